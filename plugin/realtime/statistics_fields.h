#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "carom/sound_settings.h"

namespace carom::plugin {

// The members of SoundStatistics as a list: sums and the C interface follow it. A new member has to
// be in it (statistics_test), and in the table of c_structs.cpp (which does not compile otherwise).

/// The way in which the statistics of two parts of one sound, one after the other, become one.
enum class Summation : std::uint8_t {
  count,   ///< added up
  latest,  ///< a value of the moment: that of the later part
  largest  ///< the larger of the two
};

/// A number of SoundStatistics.
template <class Number>
struct StatisticsField {
  Number SoundStatistics::*member;
  Summation summation = Summation::count;
};

inline constexpr std::array kStatisticsCounts = {
    StatisticsField<std::uint64_t>{&SoundStatistics::events},
    StatisticsField<std::uint64_t>{&SoundStatistics::immovable},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejected},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejectedNotFinite},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejectedUnknownBody},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejectedNoContact},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejectedTooLong},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejectedTooFar},
    StatisticsField<std::uint64_t>{&SoundStatistics::skipped},
    StatisticsField<std::uint64_t>{&SoundStatistics::silenced},
    StatisticsField<std::uint64_t>{&SoundStatistics::inaudible},
    StatisticsField<std::uint64_t>{&SoundStatistics::stolen},
    StatisticsField<std::uint64_t>{&SoundStatistics::overBudget},
    StatisticsField<std::uint64_t>{&SoundStatistics::noBus},
    StatisticsField<std::uint64_t>{&SoundStatistics::tooLong},
    StatisticsField<std::uint64_t>{&SoundStatistics::modalVoicesExhausted},
    StatisticsField<std::uint64_t>{&SoundStatistics::queueFaults},
    StatisticsField<std::uint64_t>{&SoundStatistics::rings},
    StatisticsField<std::uint64_t>{&SoundStatistics::late},
    StatisticsField<std::uint64_t>{&SoundStatistics::undersampled},
    StatisticsField<std::uint64_t>{&SoundStatistics::slides},
    StatisticsField<std::uint64_t>{&SoundStatistics::inaudibleSlides},
    StatisticsField<std::uint64_t>{&SoundStatistics::slidesLeftOut},
    StatisticsField<std::uint64_t>{&SoundStatistics::slidesInBed},
    StatisticsField<std::uint64_t>{&SoundStatistics::maskedSlides},
    StatisticsField<std::uint64_t>{&SoundStatistics::masked},
    StatisticsField<std::uint64_t>{&SoundStatistics::stalls},
    StatisticsField<std::uint64_t>{&SoundStatistics::jumps},
    StatisticsField<std::uint64_t>{&SoundStatistics::voices, Summation::latest},
    StatisticsField<std::uint64_t>{&SoundStatistics::buses, Summation::latest},
    StatisticsField<std::uint64_t>{&SoundStatistics::ringing, Summation::latest},
    StatisticsField<std::uint64_t>{&SoundStatistics::modes, Summation::latest},
    StatisticsField<std::uint64_t>{&SoundStatistics::solvedShapes},
    StatisticsField<std::uint64_t>{&SoundStatistics::shapesSolvedInStep},
    StatisticsField<std::uint64_t>{&SoundStatistics::shapesPending, Summation::latest},
    StatisticsField<std::uint64_t>{&SoundStatistics::unsolvedBodies},
    StatisticsField<std::uint64_t>{&SoundStatistics::links},
    StatisticsField<std::uint64_t>{&SoundStatistics::unsupportedContacts},
    StatisticsField<std::uint64_t>{&SoundStatistics::refusedBodies},
    StatisticsField<std::uint64_t>{&SoundStatistics::unusedAssignments, Summation::latest},
    StatisticsField<std::uint64_t>{&SoundStatistics::heard},
    StatisticsField<std::uint64_t>{&SoundStatistics::lost},
    StatisticsField<std::uint64_t>{&SoundStatistics::ringsLeftOut},
    StatisticsField<std::uint64_t>{&SoundStatistics::rejectedSlides},
    StatisticsField<std::uint64_t>{&SoundStatistics::silencedFrames},
    StatisticsField<std::uint64_t>{&SoundStatistics::posted},
    StatisticsField<std::uint64_t>{&SoundStatistics::waiting}};

inline constexpr std::array kStatisticsMeasures = {
    StatisticsField<double>{&SoundStatistics::cpuShare, Summation::latest},
    StatisticsField<double>{&SoundStatistics::worstBlock, Summation::largest},
    StatisticsField<double>{&SoundStatistics::gainReduction, Summation::largest},
    StatisticsField<double>{&SoundStatistics::peak, Summation::largest},
    StatisticsField<double>{&SoundStatistics::peakSample, Summation::largest}};

/// Adds the statistics of an earlier part of the same sound to those of a later part.
void addEarlier(SoundStatistics& sum, const SoundStatistics& earlier);

/// Number of shares that were posted and have no fate yet.
std::uint64_t waitingShares(const SoundStatistics& statistics);
/// Counts those as lost: their output has ended.
void loseWaiting(SoundStatistics& statistics);

/// Returns the sentence of SoundStatistics::warning for a peak of that many times the full scale
/// (Pa): empty up to 1, or up to 2 if there is a limiter.
std::string peakWarning(double peakSample, double fullScale, bool isLimited);

}  // namespace carom::plugin
