#include "lab/fit/mode_match.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>

namespace carom::lab {

namespace {

constexpr double kSpurious = -2.3;       // nats, of a measured mode without a partner: one in ten
constexpr double kSpuriousAbove = -0.7;  // nats, above all computed modes
constexpr double kBeyond = 0.02;    // of log frequency: what is so far outside counts as outside
constexpr double kUnheard = -0.08;  // nats, of a computed mode that was not heard
constexpr double kBoundOverSigma = 2.0;  // of an error: its bound over its standard deviation
constexpr double kLeastSigma = 5e-4;
constexpr double kFarthest = 3.0;  // standard deviations: what is farther is no pair
constexpr std::size_t kMostMeasured = 45;
constexpr std::size_t kAnchors = 9;   // measured modes that factors are tried with
constexpr double kConfident = 0.3;    // less does not count
constexpr double kFactorStep = 2e-3;  // of the logarithm: factors nearer to each other are one
constexpr std::size_t kRefined = 6;   // factors
constexpr int kRefinements = 4;

/// A measured mode as the search sees it.
struct MeasuredLine {
  double log = 0.0;     // of the frequency
  double sigma = 0.0;   // of that
  double weight = 0.0;  // confidence
  std::size_t index = 0;
};

/// Computed modes as the search sees them.
struct ComputedLog {
  double log = 0.0;
  double sigma = 0.0;
  double logDensity = 0.0;  // of modes per unit of log frequency
};

struct Assignment {
  double score = -std::numeric_limits<double>::infinity();
  double logFactor = 0.0;
  std::vector<std::optional<std::size_t>> partner;  // of each line
};

std::vector<MeasuredLine> linesOf(std::span<const TapMode> measured) {
  std::vector<MeasuredLine> lines;
  for (std::size_t index = 0; index < measured.size(); ++index) {
    const TapMode& mode = measured[index];
    if (mode.confidence < kConfident) continue;
    const double undamped = std::hypot(mode.frequency, mode.decayRate / (2.0 * std::numbers::pi));
    lines.push_back(
        {std::log(undamped), mode.frequencyError / mode.frequency, mode.confidence, index});
  }
  if (lines.size() > kMostMeasured) {
    std::ranges::stable_sort(lines, std::greater<>(), &MeasuredLine::weight);
    lines.resize(kMostMeasured);
    std::ranges::sort(lines, {}, &MeasuredLine::log);
  }
  return lines;
}

void setDensities(std::vector<ComputedLog>& computed) {
  for (std::size_t at = 0; at < computed.size(); ++at) {
    const std::size_t from = at > 3 ? at - 3 : 0;
    const std::size_t to = std::min(computed.size() - 1, at + 3);
    const double span = std::max(computed[to].log - computed[from].log, 1e-3);
    computed[at].logDensity =
        std::log(static_cast<double>(std::max<std::size_t>(1, to - from)) / span);
  }
}

std::vector<ComputedLog> logsOf(std::span<const ComputedLine> computed) {
  std::vector<ComputedLog> logs;
  for (const ComputedLine& line : computed)
    logs.push_back(
        {std::log(line.frequency), std::max(line.error / kBoundOverSigma, kLeastSigma), 0.0});
  setDensities(logs);
  return logs;
}

/// Moves computed modes by about their distance from each other: another body of that size.
std::vector<ComputedLog> scrambled(const std::vector<ComputedLog>& computed, std::mt19937& random) {
  std::vector<ComputedLog> other = computed;
  for (ComputedLog& line : other) {
    const double uniform = static_cast<double>(random()) / 4294967296.0;
    line.log += (2.0 * uniform - 1.0) * std::min(0.9 * std::exp(-line.logDensity), 0.5);
  }
  std::ranges::sort(other, {}, &ComputedLog::log);
  setDensities(other);
  return other;
}

/// The search for one body. [one thread]
class MatchSearch {
 public:
  MatchSearch(const std::vector<MeasuredLine>& lines, const std::vector<ComputedLog>& computed)
      : lines_(lines), computed_(computed) {}

  /// Returns the best assignment within the bounds of the factor's logarithm.
  Assignment best(double least, double most) {
    std::vector<std::pair<double, double>> tried;  // score and factor
    for (const double factor : candidates(least, most))
      tried.emplace_back(score(factor), factor);
    std::ranges::sort(tried, std::greater<>());
    if (tried.size() > kRefined) tried.resize(kRefined);
    Assignment best;
    for (const auto& entry : tried) {
      Assignment refinedOne = refined(entry.second, least, most);
      if (refinedOne.score > best.score) best = std::move(refinedOne);
    }
    return best;
  }

 private:
  std::vector<double> candidates(double least, double most) const {
    std::vector<MeasuredLine> anchors = lines_;
    std::ranges::stable_sort(anchors, std::greater<>(), [](const MeasuredLine& line) {
      return line.weight - 0.1 * line.log;  // the lower, the fewer partners to think of
    });
    anchors.resize(std::min(anchors.size(), kAnchors));
    std::vector<double> factors;
    for (const MeasuredLine& anchor : anchors) {
      for (const ComputedLog& line : computed_) {
        const double factor = anchor.log - line.log;
        if (factor >= least && factor <= most) factors.push_back(factor);
      }
    }
    std::ranges::sort(factors);
    std::vector<double> apart;
    for (const double factor : factors) {
      if (apart.empty() || factor - apart.back() > kFactorStep) apart.push_back(factor);
    }
    return apart;
  }

  double gain(const MeasuredLine& line, const ComputedLog& partner, double factor) const {
    const double variance = line.sigma * line.sigma + partner.sigma * partner.sigma;
    const double off = line.log - partner.log - factor;
    if (off * off > kFarthest * kFarthest * variance) return -1e9;
    const double logLikelihood =
        -0.5 * off * off / variance - 0.5 * std::log(2.0 * std::numbers::pi * variance);
    return line.weight * std::max(0.0, logLikelihood - partner.logDensity + 0.5);
  }

  /// The ways to the best score of the first `line` lines and the first `column` computed modes.
  struct Moves {
    double unheard;   // the last computed mode was not heard
    double spurious;  // the last line has no partner
    double paired;    // they are one
  };
  Moves moves(std::size_t line, std::size_t column, double factor) const {
    const std::size_t columns = computed_.size() + 1;
    const MeasuredLine& measured = lines_[line - 1];
    const ComputedLog& partner = computed_[column - 1];
    const bool isOutside = partner.log + factor < lines_.front().log - kBeyond ||
                           partner.log + factor > lines_.back().log + kBeyond;
    return {table_[line * columns + column - 1] + (isOutside ? 0.0 : kUnheard),
            table_[(line - 1) * columns + column] + alone(measured, factor),
            table_[(line - 1) * columns + column - 1] + gain(measured, partner, factor)};
  }

  /// Cost of a line without a partner: above all computed modes, less.
  double alone(const MeasuredLine& line, double factor) const {
    const bool isAbove = line.log > computed_.back().log + factor + kBeyond;
    return line.weight * (isAbove ? kSpuriousAbove : kSpurious);
  }

  /// Fills the table of the best scores, and returns the last.
  double score(double factor) {
    const std::size_t columns = computed_.size() + 1;
    table_.assign((lines_.size() + 1) * columns, 0.0);
    for (std::size_t line = 1; line <= lines_.size(); ++line) {
      table_[line * columns] = table_[(line - 1) * columns] + alone(lines_[line - 1], factor);
      for (std::size_t column = 1; column < columns; ++column) {
        const Moves next = moves(line, column, factor);
        table_[line * columns + column] = std::max({next.unheard, next.spurious, next.paired});
      }
    }
    return table_.back();
  }

  /// Returns the assignment that has the best score.
  Assignment trace(double factor) {
    Assignment found;
    found.score = score(factor);
    found.logFactor = factor;
    found.partner.resize(lines_.size());
    std::size_t line = lines_.size();
    std::size_t column = computed_.size();
    while (line > 0 && column > 0) {
      const Moves ways = moves(line, column, factor);
      if (ways.paired >= std::max(ways.unheard, ways.spurious)) {
        found.partner[--line] = --column;
      } else if (ways.unheard >= ways.spurious) {
        --column;
      } else {
        --line;
      }
    }
    return found;
  }

  Assignment refined(double factor, double least, double most) {
    Assignment best = trace(factor);
    for (int round = 0; round < kRefinements; ++round) {
      double weights = 0.0;
      double sum = 0.0;
      for (std::size_t line = 0; line < lines_.size(); ++line) {
        if (!best.partner[line]) continue;
        const ComputedLog& partner = computed_[*best.partner[line]];
        const double weight = lines_[line].weight / (partner.sigma * partner.sigma +
                                                     lines_[line].sigma * lines_[line].sigma);
        weights += weight;
        sum += weight * (lines_[line].log - partner.log);
      }
      if (weights == 0.0) break;
      const double next = std::clamp(sum / weights, least, most);
      Assignment better = trace(next);
      if (!(better.score > best.score + 1e-9)) break;
      best = std::move(better);
    }
    return best;
  }

  const std::vector<MeasuredLine>& lines_;
  const std::vector<ComputedLog>& computed_;
  std::vector<double> table_;
};

/// Sets the figures of a match from its assignment.
void setFigures(ModeMatch& match, const Assignment& best, const std::vector<MeasuredLine>& lines,
                const std::vector<ComputedLog>& computed) {
  match.factor = std::exp(best.logFactor);
  match.score = best.score;
  const double top = computed.back().log + best.logFactor + kBeyond;
  double inReach = 0.0;
  double explained = 0.0;
  double squares = 0.0;
  for (std::size_t line = 0; line < lines.size(); ++line) {
    if (lines[line].log < top) inReach += lines[line].weight;
    if (!best.partner[line]) continue;
    match.computed[lines[line].index] = best.partner[line];
    const double off = lines[line].log - computed[*best.partner[line]].log - best.logFactor;
    explained += lines[line].weight;
    squares += lines[line].weight * off * off;
    ++match.matched;
  }
  match.explained = inReach > 0.0 ? explained / inReach : 0.0;
  match.residual = explained > 0.0 ? std::sqrt(squares / explained) : 0.0;
  match.factorError =
      match.residual / std::sqrt(std::max(1.0, static_cast<double>(match.matched) - 1.0));
}

void compareWithChance(ModeMatch& match, const std::vector<MeasuredLine>& lines,
                       const std::vector<ComputedLog>& computed,
                       const ModeMatchSettings& settings) {
  std::mt19937 random(settings.seed);
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t run = 0; run < settings.scrambles; ++run) {
    const std::vector<ComputedLog> other = scrambled(computed, random);
    const double score = MatchSearch(lines, other)
                             .best(std::log(settings.leastFactor), std::log(settings.mostFactor))
                             .score;
    sum += score;
    squares += score * score;
  }
  const auto count = static_cast<double>(settings.scrambles);
  match.chanceScore = sum / count;
  const double deviation =
      std::sqrt(std::max(1e-6, squares / count - match.chanceScore * match.chanceScore));
  match.chanceDistance = (match.score - match.chanceScore) / std::max(deviation, 0.5);
}

std::string percent(double share) {
  std::ostringstream text;
  text << std::setprecision(3) << 100.0 * share << " %";
  return text.str();
}

std::string whyRefused(const ModeMatch& match, const ModeMatchSettings& settings) {
  std::ostringstream why;
  if (match.matched < settings.leastMatched) {
    why << "only " << match.matched << " modes of the tap have a partner among the computed ones; "
        << "expected at least " << settings.leastMatched;
  } else if (match.explained < settings.leastExplained) {
    why << "the mesh explains only " << percent(match.explained)
        << " of the modes that the tap surely has; expected at least "
        << percent(settings.leastExplained);
  } else if (settings.scrambles > 0 && match.chanceDistance < settings.leastDistance) {
    why << "a body of another shape would fit the tap about as well: the match stands only "
        << std::setprecision(3) << match.chanceDistance
        << " standard deviations above chance; expected at least " << settings.leastDistance;
  }
  return why.str();
}

}  // namespace

ModeMatch matchModes(std::span<const TapMode> measured, std::span<const ComputedLine> computed,
                     const ModeMatchSettings& settings) {
  ModeMatch match;
  match.computed.resize(measured.size());
  const std::vector<MeasuredLine> lines = linesOf(measured);
  if (lines.empty() || computed.empty()) {
    match.reason = lines.empty() ? "no mode of the tap is clear enough to be matched"
                                 : "no mode of the mesh can be heard";
    return match;
  }
  const std::vector<ComputedLog> logs = logsOf(computed);
  const Assignment best =
      MatchSearch(lines, logs).best(std::log(settings.leastFactor), std::log(settings.mostFactor));
  if (best.partner.empty()) {
    match.reason = "no material makes a mode of the mesh one of the tap";
    return match;
  }
  setFigures(match, best, lines, logs);
  if (settings.scrambles > 0) compareWithChance(match, lines, logs, settings);
  match.reason = whyRefused(match, settings);
  match.accepted = match.reason.empty();
  return match;
}

}  // namespace carom::lab
