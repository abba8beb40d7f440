#include "lab/fit/body_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Dense>

namespace carom::lab {

namespace {

constexpr double kPoissonStep = 0.08;
constexpr double kLeastPoisson = 0.02;
constexpr double kMostPoisson = 0.47;
constexpr int kPoissonTrials = 4;  // on each side of the start
constexpr double kPoissonTrial = 0.05;
constexpr double kWallStep = 0.08;    // of the wall
constexpr double kThinTrial = -0.22;  // of the wall, as is the next
constexpr double kThickTrial = 0.28;
constexpr int kWallTrials = 35;         // on each side of the start
constexpr double kMostWall = 0.35;      // of the wall
constexpr double kLeastSpread = 8e-4;   // of frequencies: what meshes and bodies differ by anyway
constexpr double kSignificant = 8.0;    // F(1, n) at 1 % for some ten modes
constexpr double kRobust = 2.5;         // standard deviations: pairs farther off count less
constexpr double kRematchRange = 0.06;  // of log factor
constexpr int kRounds = 3;
constexpr int kRestarts = 3;           // from the body found
constexpr double kSettledWall = 0.01;  // of the wall: a change of less needs no other start

/// How the logarithms of all frequencies of a body change with what is free.
struct Sensitivities {
  std::vector<double> poisson;  // per unit
  std::vector<double> wall;     // per m; empty: not free
};

/// The unknowns of one least-squares problem.
struct BodyParameters {
  double logFactor = 0.0;
  double poisson = 0.0;  // from the start
  double wall = 0.0;     // m, from the start
};

struct LeastSquares {
  BodyParameters parameters;
  BodyParameters errors;
  double chiSquared = 0.0;  // with the variances assumed
  double residual = 0.0;    // rms, weighted
  std::size_t pairs = 0;
};

/// A measured frequency beside the computed one of the start.
struct FrequencyPair {
  double off = 0.0;  // log measured over computed
  double variance = 0.0;
  double weight = 0.0;  // confidence
  double poisson = 0.0;
  double wall = 0.0;
};

double undampedLog(const TapMode& mode) {
  return std::log(std::hypot(mode.frequency, mode.decayRate / (2.0 * std::numbers::pi)));
}

std::vector<FrequencyPair> pairsOf(const std::vector<TapMode>& measured, const ModeMatch& match,
                                   const std::vector<ComputedLine>& lines,
                                   const Sensitivities& sensitivities) {
  std::vector<FrequencyPair> pairs;
  for (std::size_t mode = 0; mode < measured.size(); ++mode) {
    if (!match.computed[mode]) continue;
    const std::size_t line = *match.computed[mode];
    FrequencyPair pair;
    pair.off = undampedLog(measured[mode]) - std::log(lines[line].frequency);
    const double relative = measured[mode].frequencyError / measured[mode].frequency;
    pair.variance =
        relative * relative + std::pow(0.4 * lines[line].error, 2) + kLeastSpread * kLeastSpread;
    pair.weight = measured[mode].confidence;
    pair.poisson = sensitivities.poisson[line];
    if (!sensitivities.wall.empty()) pair.wall = sensitivities.wall[line];
    pairs.push_back(pair);
  }
  return pairs;
}

/// The unknowns beside the common factor.
struct Freedom {
  bool poisson = false;
  bool wall = false;
  double poissonExpected = 0.0;  // from the start
  double poissonSpread = 0.1;
};

/// Solves for the parameters that are free, by least squares reweighted where pairs are far off.
LeastSquares solved(const std::vector<FrequencyPair>& pairs, const Freedom& freedom) {
  const auto count = static_cast<Eigen::Index>(pairs.size());
  Eigen::MatrixXd matrix(count + 1, 3);
  Eigen::VectorXd right(count + 1);
  Eigen::VectorXd off = Eigen::VectorXd::Zero(count);
  Eigen::Vector3d found = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  const double noPoisson = freedom.poisson ? 1.0 : 0.0;
  const double noWall = freedom.wall ? 1.0 : 0.0;
  for (int round = 0; round < 6; ++round) {
    for (Eigen::Index at = 0; at < count; ++at) {
      const FrequencyPair& pair = pairs[static_cast<std::size_t>(at)];
      const double far = std::abs(off(at)) / std::sqrt(pair.variance);
      const double robust = far <= kRobust ? 1.0 : kRobust / far;
      const double root = std::sqrt(robust * pair.weight / pair.variance);
      matrix.row(at) << root, noPoisson * root * pair.poisson, noWall * root * pair.wall;
      right(at) = root * pair.off;
    }
    matrix.row(count) << 0.0, 1.0 / freedom.poissonSpread, 0.0;
    right(count) = noPoisson * freedom.poissonExpected / freedom.poissonSpread;
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition(matrix);
    found = decomposition.solve(right);
    const Eigen::MatrixXd inverse = decomposition.pseudoInverse();
    covariance = inverse * inverse.transpose();
    for (Eigen::Index at = 0; at < count; ++at) {
      const FrequencyPair& pair = pairs[static_cast<std::size_t>(at)];
      off(at) = pair.off - found(0) - found(1) * pair.poisson - found(2) * pair.wall;
    }
  }
  LeastSquares result;
  result.pairs = pairs.size();
  result.parameters = {found(0), found(1), found(2)};
  double weights = 0.0;
  double squares = 0.0;
  for (Eigen::Index at = 0; at < count; ++at) {
    const FrequencyPair& pair = pairs[static_cast<std::size_t>(at)];
    const double scaled = std::min(off(at) * off(at) / pair.variance,
                                   kRobust * std::abs(off(at)) / std::sqrt(pair.variance));
    result.chiSquared += pair.weight * scaled;
    squares += pair.weight * off(at) * off(at);
    weights += pair.weight;
  }
  result.residual = weights > 0.0 ? std::sqrt(squares / weights) : 0.0;
  const double unknowns = 1.0 + noPoisson + noWall;
  const double spread =
      std::max(1.0, result.chiSquared / std::max(1.0, static_cast<double>(count) - unknowns));
  const Eigen::Vector3d errors = (spread * covariance.diagonal()).cwiseSqrt();
  result.errors = {errors(0), errors(1), errors(2)};
  return result;
}

/// True if one more unknown explains more than chance would.
bool isSignificant(const LeastSquares& less, const LeastSquares& more, int unknowns) {
  const double freedom = static_cast<double>(more.pairs) - unknowns;
  if (freedom < 2.0) return false;
  const double spread = std::max(1.0, more.chiSquared / freedom);
  return (less.chiSquared - more.chiSquared) / spread > kSignificant;
}

ModeMatchSettings withoutChance(ModeMatchSettings settings) {
  settings.scrambles = 0;
  return settings;
}

/// Returns the settings of a match whose factor is about known.
ModeMatchSettings around(double factor, const ModeMatchSettings& settings) {
  ModeMatchSettings near = withoutChance(settings);
  near.leastFactor = factor * std::exp(-kRematchRange);
  near.mostFactor = factor * std::exp(kRematchRange);
  return near;
}

/// Matches with lines in any order; the indices are those of `lines`.
ModeMatch matchUnordered(const std::vector<TapMode>& measured, std::vector<ComputedLine> lines,
                         const ModeMatchSettings& settings) {
  std::vector<std::size_t> order(lines.size());
  for (std::size_t line = 0; line < order.size(); ++line)
    order[line] = line;
  std::ranges::stable_sort(order, {}, [&](std::size_t line) { return lines[line].frequency; });
  std::ranges::stable_sort(lines, {}, &ComputedLine::frequency);
  ModeMatch match = matchModes(measured, lines, settings);
  for (std::optional<std::size_t>& line : match.computed) {
    if (line) line = order[*line];
  }
  return match;
}

/// A body that was analysed, and how the tap matches it.
struct Matched {
  BodyVariant variant;
  ModalModel model;
  ModeMatch match;
};

Result<Matched> matched(const std::vector<TapMode>& measured, const BodyVariants& variants,
                        const BodyVariant& variant, const ModeMatchSettings& settings) {
  Result<ModalModel> model = variants.analysed(variant);
  if (!model) return model.error();
  ModeMatch match = matchModes(measured, linesOfModel(*model), settings);
  return Matched{variant, *std::move(model), std::move(match)};
}

/// Returns the change of the wall (m) with which the tap matches best: between bodies that are
/// analysed, frequencies go with a square of the wall.
Result<double> bestWall(const std::vector<TapMode>& measured, const BodyVariants& variants,
                        const BodyFitSettings& settings) {
  const Result<ModalModel> start = variants.analysed(settings.start);
  if (!start) return start.error();
  const std::array<double, 2> walls = {kThinTrial * settings.wallThickness,
                                       kThickTrial * settings.wallThickness};
  std::array<std::vector<double>, 2> shifts;
  for (std::size_t trial = 0; trial < walls.size(); ++trial) {
    BodyVariant variant = settings.start;
    variant.wall += walls[trial];
    const Result<ModalModel> model = variants.analysed(variant);
    if (!model) return model.error();
    shifts[trial] = frequencyShifts(*start, *model);
  }
  const std::vector<ComputedLine> lines = linesOfModel(*start);
  double best = 0.0;
  double bestScore = -1e300;
  for (int step = -kWallTrials; step <= kWallTrials; ++step) {
    const double wall = kMostWall * settings.wallThickness * step / kWallTrials;
    std::vector<ComputedLine> changed = lines;
    for (std::size_t line = 0; line < lines.size(); ++line)
      changed[line].frequency *=
          std::exp(shifts[0][line] * wall * (wall - walls[1]) / (walls[0] * (walls[0] - walls[1])) +
                   shifts[1][line] * wall * (wall - walls[0]) / (walls[1] * (walls[1] - walls[0])));
    const double score = matchUnordered(measured, changed, withoutChance(settings.match)).score;
    if (score <= bestScore) continue;
    bestScore = score;
    best = wall;
  }
  return best;
}

/// Analyses the start, or with `freeThickness` the body with the wall that matches best.
Result<Matched> bestStart(const std::vector<TapMode>& measured, const BodyVariants& variants,
                          const BodyFitSettings& settings) {
  BodyVariant variant = settings.start;
  if (settings.freeThickness) {
    const Result<double> wall = bestWall(measured, variants, settings);
    if (!wall) return wall.error();
    variant.wall += *wall;
  }
  return matched(measured, variants, variant, withoutChance(settings.match));
}

Result<Sensitivities> sensitivitiesOf(const BodyVariants& variants, const Matched& start,
                                      const BodyFitSettings& settings) {
  Sensitivities sensitivities;
  BodyVariant changed = start.variant;
  const double step = start.variant.poissonsRatio > 0.3 ? -kPoissonStep : kPoissonStep;
  changed.poissonsRatio += step;
  const Result<ModalModel> poisson = variants.analysed(changed);
  if (!poisson) return poisson.error();
  sensitivities.poisson = frequencyShifts(start.model, *poisson);
  for (double& shift : sensitivities.poisson)
    shift /= step;
  if (!settings.freeThickness) return sensitivities;
  changed = start.variant;
  const double thicker = kWallStep * settings.wallThickness;
  changed.wall += thicker;
  const Result<ModalModel> wall = variants.analysed(changed);
  if (!wall) return wall.error();
  sensitivities.wall = frequencyShifts(start.model, *wall);
  for (double& shift : sensitivities.wall)
    shift /= thicker;
  return sensitivities;
}

/// Returns the lines of a body whose parameters have changed; they need not ascend any more.
std::vector<ComputedLine> moved(std::vector<ComputedLine> lines, const Sensitivities& sensitivities,
                                const BodyParameters& by) {
  for (std::size_t line = 0; line < lines.size(); ++line) {
    double log = by.poisson * sensitivities.poisson[line];
    if (!sensitivities.wall.empty()) log += by.wall * sensitivities.wall[line];
    lines[line].frequency *= std::exp(log);
  }
  return lines;
}

BodyParameters limited(BodyParameters parameters, const BodyFitSettings& settings,
                       const BodyVariant& start) {
  parameters.poisson = std::clamp(parameters.poisson, kLeastPoisson - start.poissonsRatio,
                                  kMostPoisson - start.poissonsRatio);
  const double most = kMostWall * settings.wallThickness;
  const double before = start.wall - settings.start.wall;
  parameters.wall = std::clamp(parameters.wall, -most - before, most - before);
  return parameters;
}

/// Returns the change of Poisson's ratio with which the tap matches best, by the score less what
/// the change costs.
double bestPoisson(const std::vector<TapMode>& measured, const std::vector<ComputedLine>& lines,
                   const Sensitivities& sensitivities, const BodyFitSettings& settings) {
  double best = 0.0;
  double bestScore = -1e300;
  for (int trial = -kPoissonTrials; trial <= kPoissonTrials; ++trial) {
    const double change = kPoissonTrial * trial;
    const double ratio = settings.start.poissonsRatio + change;
    if (ratio < kLeastPoisson || ratio > kMostPoisson) continue;
    const double cost = 0.5 * std::pow(change / settings.poissonSpread, 2.0);
    const double score = matchUnordered(measured, moved(lines, sensitivities, {0.0, change, 0.0}),
                                        withoutChance(settings.match))
                             .score;
    if (score - cost <= bestScore) continue;
    bestScore = score - cost;
    best = change;
  }
  return best;
}

/// Improves match and parameters in turns, from the fit's body. A Poisson's ratio that has been
/// fitted once stays free.
LeastSquares refinedFit(BodyFit& fit, ModeMatch match, const std::vector<TapMode>& measured,
                        const std::vector<ComputedLine>& lines, const Sensitivities& sensitivities,
                        const BodyFitSettings& settings) {
  const bool wasPoissonFitted = fit.isPoissonFitted;
  const Freedom kept{.poisson = false,
                     .wall = settings.freeThickness,
                     .poissonExpected = settings.start.poissonsRatio - fit.variant.poissonsRatio,
                     .poissonSpread = settings.poissonSpread};
  Freedom free = kept;
  free.poisson = true;
  LeastSquares best;
  for (int round = 0; round < kRounds; ++round) {
    const auto pairs = pairsOf(measured, match, lines, sensitivities);
    const LeastSquares less = solved(pairs, kept);
    best = solved(pairs, free);
    fit.isPoissonFitted =
        wasPoissonFitted || isSignificant(less, best, settings.freeThickness ? 3 : 2);
    if (!fit.isPoissonFitted) best = less;
    best.parameters = limited(best.parameters, settings, fit.variant);
    match = matchUnordered(measured, moved(lines, sensitivities, best.parameters),
                           around(std::exp(best.parameters.logFactor), settings.match));
  }
  return best;
}

/// Moves the body of the fit to where the parameters say.
void setFit(BodyFit& fit, const LeastSquares& found, const BodyFitSettings& settings) {
  fit.variant.poissonsRatio += found.parameters.poisson;
  fit.variant.wall += found.parameters.wall;
  fit.factor = std::exp(found.parameters.logFactor);
  fit.factorError = found.errors.logFactor;
  fit.poissonError = fit.isPoissonFitted ? found.errors.poisson : 0.0;
  fit.wallError = settings.freeThickness ? found.errors.wall : 0.0;
  fit.residual = found.residual;
}

}  // namespace

Result<BodyFit> fitBody(const std::vector<TapMode>& measured, const BodyVariants& variants,
                        const BodyFitSettings& settings) {
  Result<Matched> start = bestStart(measured, variants, settings);
  if (!start) return start.error();
  BodyFit fit;
  fit.match = start->match;
  fit.variant = start->variant;
  fit.factor = start->match.factor;
  if (start->match.matched == 0) return fit;
  Result<Sensitivities> sensitivities = sensitivitiesOf(variants, *start, settings);
  if (!sensitivities) return sensitivities.error();
  const std::vector<ComputedLine> lines = linesOfModel(start->model);
  const double change = bestPoisson(measured, lines, *sensitivities, settings);
  fit.match =
      matchUnordered(measured, moved(lines, *sensitivities, {0.0, change, 0.0}), settings.match);
  fit.factor = fit.match.factor;
  if (!fit.match.accepted) return fit;
  setFit(fit, refinedFit(fit, fit.match, measured, lines, *sensitivities, settings), settings);
  double shift = fit.variant.wall - start->variant.wall;
  // A wall changes frequencies by more than in proportion: the body found is a better start.
  for (int restart = 0; restart < kRestarts; ++restart) {
    if (std::abs(shift) <= kSettledWall * settings.wallThickness) break;
    start = matched(measured, variants, fit.variant, around(fit.factor, settings.match));
    if (!start) return start.error();
    if (start->match.matched < settings.match.leastMatched) break;
    sensitivities = sensitivitiesOf(variants, *start, settings);
    if (!sensitivities) return sensitivities.error();
    setFit(fit,
           refinedFit(fit, start->match, measured, linesOfModel(start->model), *sensitivities,
                      settings),
           settings);
    shift = fit.variant.wall - start->variant.wall;
  }
  return fit;
}

}  // namespace carom::lab
