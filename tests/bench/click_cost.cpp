#include "tests/bench/click_cost.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <random>
#include <span>

namespace carom::bench {
namespace {

using test::ClickCase;

constexpr int kRounds = 5;
constexpr double kClicksPerSecond = 200000.0;
constexpr std::size_t kBlock = 512;
constexpr double kAhead = 0.02;  // s, by which events are scheduled ahead of the clock

/// Number of clicks: a round lasts some milliseconds, but long contacts stay few.
std::size_t countOf(const ClickCase& click) {
  return std::clamp<std::size_t>(static_cast<std::size_t>(1.0 / click.duration), 100, 10000);
}

std::vector<ImpulseEvent> makeEvents(const ClickCase& click) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  std::vector<ImpulseEvent> events(countOf(click), test::makeClickEvent(click));
  for (std::size_t i = 0; i < events.size(); ++i)
    events[i].time += (static_cast<double>(i) + place(random)) / kClicksPerSecond;
  return events;
}

double cpuTime() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

class ClickRun {
 public:
  explicit ClickRun(const ClickCase& click)
      : synth_(test::makeClickSynth(click)),
        events_(makeEvents(click)),
        from_(click.time - synth_.leadTime(click.duration) - 0.001) {
    play();  // warms up, and allocates
  }

  void time() {
    const double begin = cpuTime();
    play();
    best_ = std::min(best_, cpuTime() - begin);
  }

  double nanoseconds() const { return 1e9 * best_ / static_cast<double>(events_.size()); }

 private:
  // Plays all events, starting just before the first click.
  void play() {
    if (!synth_.seek(from_)) std::abort();
    float* const channel = block_.data();
    auto next = events_.begin();
    while (next != events_.end() || !synth_.isSilent()) {
      for (; next != events_.end() && next->time < synth_.time() + kAhead + lead(); ++next)
        synth_.schedule(*next);
      synth_.render<float>(std::span(&channel, 1), kBlock);
    }
  }

  double lead() const { return events_.front().time - from_; }

  Synth synth_;
  std::vector<ImpulseEvent> events_;
  double from_;  // s
  std::vector<float> block_ = std::vector<float>(kBlock);
  double best_ = std::numeric_limits<double>::infinity();
};

}  // namespace

std::vector<double> clickCosts(const std::vector<ClickCase>& clicks) {
  std::vector<ClickRun> runs(clicks.begin(), clicks.end());
  for (int round = 0; round < kRounds; ++round) {
    for (ClickRun& run : runs)
      run.time();
  }
  std::vector<double> costs;
  for (const ClickRun& run : runs)
    costs.push_back(run.nanoseconds());
  return costs;
}

}  // namespace carom::bench
