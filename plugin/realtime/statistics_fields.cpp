#include "plugin/realtime/statistics_fields.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace carom::plugin {
namespace {

template <class Number>
void addField(const StatisticsField<Number>& field, SoundStatistics& sum,
              const SoundStatistics& earlier) {
  Number& total = sum.*field.member;
  if (field.summation == Summation::count) total += earlier.*field.member;
  if (field.summation == Summation::largest) total = std::max(total, earlier.*field.member);
}

}  // namespace

void addEarlier(SoundStatistics& sum, const SoundStatistics& earlier) {
  for (const auto& field : kStatisticsCounts)
    addField(field, sum, earlier);
  for (const auto& field : kStatisticsMeasures)
    addField(field, sum, earlier);
  if (sum.unsolvedReason.empty()) sum.unsolvedReason = earlier.unsolvedReason;
  if (sum.warning.empty()) sum.warning = earlier.warning;
  if (sum.recordingError.empty()) sum.recordingError = earlier.recordingError;
}

std::uint64_t waitingShares(const SoundStatistics& statistics) {
  const SoundStatistics& s = statistics;
  return s.posted - s.silenced - s.skipped - s.immovable - s.rejected - s.queueFaults - s.events +
         waitingEvents(s);
}

void loseWaiting(SoundStatistics& statistics) {
  statistics.lost += waitingShares(statistics);
  statistics.waiting = 0;
}

std::string peakWarning(double peakSample, double fullScale, bool isLimited) {
  if (!(peakSample > (isLimited ? 2.0 : 1.0))) return {};
  std::ostringstream text;
  text.precision(3);
  text << "the loudest sample is " << 20.0 * std::log10(peakSample) << " dB above full scale, "
       << fullScale << " Pa; set SoundSettings::fullScale to "
       << std::ceil(1.1 * peakSample * fullScale) << " Pa, or Level::automatic";
  return text.str();
}

}  // namespace carom::plugin
