#include "tests/bench/accuracy_table.h"

#include <cmath>
#include <cstdio>

namespace carom::bench {
namespace {

std::string barOf(const AccuracyRow& row) {
  std::string text = "0 missed, 0 spurious, ";
  char part[64];
  if (std::isfinite(row.barRms)) {
    std::snprintf(part, sizeof part, "%g us rms, ", row.barRms);
    text += part;
  }
  std::snprintf(part, sizeof part, "%g us max", row.barMax);
  text += part;
  if (std::isfinite(row.barImpulse)) {
    std::snprintf(part, sizeof part, ", %g %%", 100.0 * row.barImpulse);
    text += part;
  }
  return text;
}

}  // namespace

void AccuracyRow::addMatch(double microseconds, double impulse, const std::string& run) {
  ++matched;
  squares += microseconds * microseconds;
  if (!(microseconds <= timeError)) {
    timeError = microseconds;
    worst = run;
  }
  if (!(impulse <= impulseError)) impulseError = impulse;
}

double AccuracyRow::rms() const {
  return matched > 0 ? std::sqrt(squares / matched) : 0.0;
}

bool AccuracyRow::holds() const {
  return matched > 0 && missed == 0 && spurious == 0 && rms() <= barRms && timeError <= barMax &&
         impulseError <= barImpulse;
}

void printHeader() {
  std::printf(
      "| case | step, s | runs | impacts | matched | missed | spurious | time error, us: rms | max "
      "| "
      "impulse error, %%: max | bar | |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

void printRow(const AccuracyRow& row) {
  std::printf("| %s | 1/%.0f | %d | %d | ", row.name.c_str(), 1.0 / row.step, row.runs,
              row.impacts);
  if (row.unsupported && row.matched == 0) {
    std::printf("| | | | | | %s | not supported |\n", barOf(row).c_str());
  } else {
    std::printf("%d | %d | %d | %.2g | %.2g | %.2g | %s | %s |\n", row.matched, row.missed,
                row.spurious, row.rms(), row.timeError, 100.0 * row.impulseError,
                barOf(row).c_str(), row.holds() ? "holds" : "missed");
  }
  std::fflush(stdout);
}

void printRestRow(const std::string& name, double step, int events, double speed, bool supported) {
  std::printf("| %s (in Bullet up to %.1g m/s) | 1/%.0f | 1 | 0 | 0 | 0 | ", name.c_str(), speed,
              1.0 / step);
  if (supported) {
    std::printf("%d | | | | 0 events | %s |\n", events, events == 0 ? "holds" : "missed");
  } else {
    std::printf("| | | | 0 events | not supported |\n");
  }
  std::fflush(stdout);
}

void printBalanceRow(const std::string& name, double step, int runs, int collisions,
                     double imbalance, double bar, bool supported) {
  std::printf("| %s | 1/%.0f | %d | %d | | | | | | ", name.c_str(), 1.0 / step, runs, collisions);
  if (supported) {
    std::printf("%.2g | %g %% | %s |\n", 100.0 * imbalance, 100.0 * bar,
                imbalance <= bar ? "holds" : "missed");
  } else {
    std::printf("| %g %% | not supported |\n", 100.0 * bar);
  }
  std::fflush(stdout);
}

void printWorst(const AccuracyRow& row) {
  std::fprintf(stderr,
               "%s, 1/%.0f: worst %s; missed or spurious: %s; needless pushes %d; path %.1g m\n",
               row.name.c_str(), 1.0 / row.step, row.worst.c_str(),
               row.firstMiss.empty() ? "none" : row.firstMiss.c_str(), row.needless, row.pathError);
}

}  // namespace carom::bench
