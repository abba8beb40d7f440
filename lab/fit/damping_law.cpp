#include "lab/fit/damping_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Dense>
#include <nlohmann/json.hpp>

namespace carom::lab {

namespace {

constexpr double kReferenceFrequency = 1000.0;  // Hz
constexpr double kHuber = 0.25;                 // of a logarithm: beyond, deviations count linearly
constexpr int kRounds = 12;
constexpr double kMostExponent = 2.0;
constexpr double kMostLossFactor = 1.0;
constexpr std::size_t kLeastForExponent = 3;
constexpr double kClearlyBetter = 0.9;  // of the residual: or else the loss factor is taken

double angular(double frequency) {
  return 2.0 * std::numbers::pi * frequency;
}

double deviation(const DampingLaw& law, const MeasuredDecay& decay) {
  return std::log(std::max(law.decayRate(decay.frequency), 1e-12) / decay.decayRate);
}

double huberWeight(double off) {
  return std::abs(off) <= kHuber ? 1.0 : kHuber / std::abs(off);
}

double residualOf(const DampingLaw& law, std::span<const MeasuredDecay> decays) {
  double squares = 0.0;
  double weights = 0.0;
  for (const MeasuredDecay& decay : decays) {
    const double off = deviation(law, decay);
    const double weight = decay.weight * huberWeight(off);
    squares += weight * off * off;
    weights += weight;
  }
  return weights > 0.0 ? std::sqrt(squares / weights) : 0.0;
}

/// Minimises the squares of matrix x - 1 with two unknowns that are at least 0.
Eigen::Vector2d nonNegative(const Eigen::MatrixX2d& matrix, const Eigen::VectorXd& right) {
  const Eigen::Vector2d scale = matrix.colwise().norm().cwiseMax(1e-300).transpose();
  const Eigen::MatrixX2d scaled = matrix * scale.cwiseInverse().asDiagonal();
  Eigen::Vector2d best = scaled.colPivHouseholderQr().solve(right);
  if (best.minCoeff() < 0.0) {
    const Eigen::Vector2d single = (scaled.transpose() * right).cwiseMax(0.0);
    const double first = (scaled.col(0) * single(0) - right).squaredNorm();
    const double second = (scaled.col(1) * single(1) - right).squaredNorm();
    best = first <= second ? Eigen::Vector2d(single(0), 0.0) : Eigen::Vector2d(0.0, single(1));
  }
  return best.cwiseQuotient(scale);
}

DampingLaw rayleighOf(std::span<const MeasuredDecay> decays) {
  DampingLaw law;
  const auto count = static_cast<Eigen::Index>(decays.size());
  Eigen::VectorXd weights(count);
  for (Eigen::Index at = 0; at < count; ++at)
    weights(at) = decays[static_cast<std::size_t>(at)].weight;
  const Eigen::VectorXd given = weights;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixX2d matrix(count, 2);
    Eigen::VectorXd right(count);
    for (Eigen::Index at = 0; at < count; ++at) {
      const MeasuredDecay& decay = decays[static_cast<std::size_t>(at)];
      const double root = std::sqrt(weights(at));
      const double w = angular(decay.frequency);
      matrix(at, 0) = root * 0.5 / decay.decayRate;
      matrix(at, 1) = root * 0.5 * w * w / decay.decayRate;
      right(at) = root;
    }
    const Eigen::Vector2d solved = nonNegative(matrix, right);
    law.alpha = solved(0);
    law.beta = solved(1);
    for (Eigen::Index at = 0; at < count; ++at) {
      const MeasuredDecay& decay = decays[static_cast<std::size_t>(at)];
      const double off = law.decayRate(decay.frequency) / decay.decayRate - 1.0;
      weights(at) = given(at) * huberWeight(off);
    }
  }
  return law;
}

DampingLaw lossFactorOf(std::span<const MeasuredDecay> decays) {
  DampingLaw law;
  std::vector<double> robust(decays.size(), 1.0);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t at = 0; at < decays.size(); ++at) {
      const double x = std::log(decays[at].frequency / kReferenceFrequency);
      const double y = std::log(2.0 * decays[at].decayRate / angular(decays[at].frequency));
      const double weight = decays[at].weight * robust[at];
      const Eigen::Vector2d row(1.0, x);
      normal += weight * row * row.transpose();
      right += weight * y * row;
    }
    const double spread = normal(1, 1) / normal(0, 0) - std::pow(normal(0, 1) / normal(0, 0), 2);
    double exponent = 0.0;
    if (decays.size() >= kLeastForExponent && spread > 1e-3)
      exponent = std::clamp(normal.ldlt().solve(right)(1), -kMostExponent, kMostExponent);
    const double log = (right(0) - exponent * normal(0, 1)) / normal(0, 0);
    law.lossFactor = std::min(std::exp(log), kMostLossFactor);
    law.lossExponent = exponent;
    for (std::size_t at = 0; at < decays.size(); ++at)
      robust[at] = huberWeight(deviation(law, decays[at]));
  }
  return law;
}

}  // namespace

double DampingLaw::decayRate(double frequency) const {
  Material material;
  setDamping(material, *this);
  return dampingRate(material, frequency);
}

DampingFit fitDamping(std::span<const MeasuredDecay> decays) {
  DampingFit fit;
  fit.modes = decays.size();
  if (decays.empty()) return fit;
  const DampingLaw rayleigh = rayleighOf(decays);
  const DampingLaw loss = lossFactorOf(decays);
  fit.rayleighResidual = residualOf(rayleigh, decays);
  fit.lossFactorResidual = residualOf(loss, decays);
  fit.isRayleigh = fit.rayleighResidual <= kClearlyBetter * fit.lossFactorResidual;
  fit.law = fit.isRayleigh ? rayleigh : loss;
  return fit;
}

void setDamping(Material& material, const DampingLaw& law) {
  material.dampingAlpha = law.alpha;
  material.dampingBeta = law.beta;
  material.lossFactor = law.lossFactor;
  material.lossExponent = law.lossExponent;
}

void addDamping(nlohmann::ordered_json& material, const DampingLaw& law) {
  material["damping_alpha"] = law.alpha;
  material["damping_beta"] = law.beta;
  material["loss_factor"] = law.lossFactor;
  material["loss_exponent"] = law.lossExponent;
}

}  // namespace carom::lab
