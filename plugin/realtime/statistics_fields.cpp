#include "plugin/realtime/statistics_fields.h"

#include <algorithm>

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
}

}  // namespace carom::plugin
