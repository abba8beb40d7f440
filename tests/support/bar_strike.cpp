#include "tests/support/bar_strike.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include <Eigen/Dense>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/synth.h"
#include "modal/analysis/solid_model.h"
#include "modal/radiation/mode_radiation.h"
#include "tests/modal/ringing_models.h"
#include "tests/support/constants.h"

namespace carom::test {

using namespace audio;
using namespace modal;

namespace {

using Complex = std::complex<double>;
constexpr double kStart = 0.01;    // s on the synth's clock, of first touch
constexpr double kFitFrom = 3e-3;  // s after first touch
constexpr double kSameMode = 3.0;  // Hz; closer modes are one
// Few enough panels that panelRadiator does not cluster them: clustering costs 7 % of the added
// mass.
constexpr int kRigidSlices = 8;
constexpr int kRigidSides = 20;
constexpr std::size_t kAhead = 200;  // samples: nearer surface points, pre-ringing of filters
constexpr int kBandFrequencies = 40;

template <class T>
T valueOf(Result<T> result) {
  if (!result) std::abort();
  return *std::move(result);
}

// Sound in Pa from `ahead` samples before the first touch is heard, which falls on a sample.
std::vector<double> heard(const StruckBar& bar, const SoundBody& body, const Vec3& listener,
                          std::size_t ahead, std::size_t frames) {
  SynthSettings settings;
  settings.ringingContact = RingingContact::pressed;  // by a force that is given
  settings.audibleThreshold = 0.0;
  const double delay = listener.norm() / settings.medium.speedOfSound;
  Synth synth = valueOf(Synth::create(settings, {{.name = "seat", .position = listener}}));
  if (!synth.setBody(1, {.material = bar.strike.ball}) || !synth.setBody(2, body)) std::abort();
  ImpulseEvent event = bar.strike.event();
  event.time = std::ceil((kStart + delay) * kRate) / kRate - delay;
  synth.schedule(event);
  const auto before = static_cast<std::size_t>(std::lround((event.time + delay) * kRate)) - ahead;
  std::vector<double> samples(before + frames);
  double* const channel = samples.data();
  synth.render<double>({&channel, 1}, samples.size());
  samples.erase(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(before));
  return samples;
}

// A bar whose polygonal section has the area of the circle.
SurfaceMesh barSurface(const FreeBar& bar, int slices, int sides) {
  const double corner = bar.radius * std::sqrt(kPi / (0.5 * sides * std::sin(2.0 * kPi / sides)));
  return barMesh({0.5 * bar.length, corner, corner}, slices, sides);
}

// Poles of the model in rad/s, -decay + i w: one for all modes of nearly the same frequency.
std::vector<Complex> polesOf(const ModalModel& model) {
  std::vector<Complex> poles;
  for (const Mode& mode : model.modes) {
    const double omega = 2.0 * kPi * mode.frequency;
    if (mode.frequency > 0.4167 * kRate) break;
    if (!poles.empty() && omega - poles.back().imag() < 2.0 * kPi * kSameMode) continue;
    poles.emplace_back(-mode.decayRate, std::sqrt(omega * omega - mode.decayRate * mode.decayRate));
  }
  return poles;
}

}  // namespace

StruckBar struckBar(const FreeBar& bar, const BallStrike& ball, double hit,
                    const BarDetail& detail) {
  const SurfaceMesh mesh = barSurface(bar, detail.slices, detail.sides);
  StruckBar struck;
  struck.bar = bar;
  SolidSettings settings;
  settings.grid.degreesOfFreedom = detail.degreesOfFreedom;
  settings.maxModes = detail.modes;
  ModalModel model = valueOf(solidModalModel(mesh, bar.material, settings));
  static_cast<void>(valueOf(
      computeRadiation(model, {.panels = mesh.triangles.size(), .maxOrder = kHighestMultipole})));
  struck.model = std::make_shared<const ModalModel>(std::move(model));
  struck.shape = valueOf(panelRadiator(barSurface(bar, kRigidSlices, kRigidSides)))
                     .about(struck.model->centreOfMass);
  struck.strike = ball;
  struck.strike.body = bar.material;
  struck.strike.bodyMass = 1.0 / (1.0 / bar.mass() + hit * hit / bar.turnInertia());
  struck.strike.bodyCurvature = 0.5 / bar.radius;
  struck.strike.inward = -Vec3::UnitY();
  struck.strike.at = {hit, bar.radius, 0.0};
  return struck;
}

std::vector<double> ringOf(const StruckBar& bar, const Vec3& listener, std::size_t frames) {
  return heard(bar, {.material = bar.bar.material, .modal = bar.model}, listener, 0, frames);
}

std::vector<double> clickOf(const StruckBar& bar, const Vec3& listener, std::size_t frames) {
  return heard(bar,
               {.material = bar.bar.material,
                .mass = bar.model->mass,
                .shape = std::make_shared<const RigidRadiator>(bar.shape),
                .inverseInertia = bar.model->inertia.inverse()},
               listener, kAhead, frames);
}

std::vector<Partial> partialsOf(const StruckBar& bar, const std::vector<double>& samples) {
  const std::vector<Complex> poles = polesOf(*bar.model);
  const auto first = static_cast<Eigen::Index>(std::ceil(kFitFrom * kRate));
  const Eigen::Index rows = std::ssize(samples) - first;
  Eigen::MatrixXd basis(rows, 2 * std::ssize(poles));
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index pole = 0; pole < std::ssize(poles); ++pole) {
      const Complex value = std::exp(poles[static_cast<std::size_t>(pole)] *
                                     (static_cast<double>(first + row) / kRate));
      basis(row, 2 * pole) = value.real();
      basis(row, 2 * pole + 1) = -value.imag();
    }
  }
  const Eigen::Map<const Eigen::VectorXd> heard(&samples[static_cast<std::size_t>(first)], rows);
  const Eigen::VectorXd found = (basis.transpose() * basis).ldlt().solve(basis.transpose() * heard);
  std::vector<Partial> partials;
  for (std::size_t pole = 0; pole < poles.size(); ++pole) {
    const auto at = static_cast<Eigen::Index>(2 * pole);
    partials.push_back({std::abs(poles[pole]) / (2.0 * kPi), std::hypot(found[at], found[at + 1])});
  }
  return partials;
}

Partial partialOf(const StruckBar& bar, const BendingMode& mode, const Vec3& listener,
                  double endLoss) {
  const Material& material = bar.bar.material;
  const double omega = mode.omega();
  const double decay = 0.5 * (material.dampingAlpha + material.dampingBeta * omega * omega);
  const Complex pole(-decay, std::sqrt(omega * omega - decay * decay));
  const Complex impulse = HertzContact(bar.strike).transform(-pole);
  const Complex heard = lineOfDipoles(
      bar.bar, [&](double x) { return mode.deflection(x); }, omega, listener, endLoss);
  return {omega / (2.0 * kPi), std::abs(pole * pole / pole.imag() *
                                        mode.deflection(bar.strike.at.x()) * impulse * heard)};
}

double bandEnergy(const std::vector<double>& samples, double low, double high) {
  const double step = (high - low) / kBandFrequencies;
  double energy = 0.0;
  for (int index = 0; index < kBandFrequencies; ++index) {
    const double omega = 2.0 * kPi * (low + (index + 0.5) * step);
    Complex sum = 0.0;
    for (std::size_t frame = 0; frame < samples.size(); ++frame)
      sum += samples[frame] * std::polar(1.0 / kRate, -omega * static_cast<double>(frame) / kRate);
    energy += step * std::norm(sum);
  }
  return energy;
}

double bandEnergy(const StruckBar& bar, const Vec3& listener, double endLoss, double low,
                  double high) {
  const HertzContact contact(bar.strike);
  const double hit = bar.strike.at.x();
  const auto perForce = [&](double x) {
    return 1.0 / bar.bar.mass() + hit * x / bar.bar.turnInertia();
  };
  const double step = (high - low) / kBandFrequencies;
  double energy = 0.0;
  for (int index = 0; index < kBandFrequencies; ++index) {
    const double omega = 2.0 * kPi * (low + (index + 0.5) * step);
    energy += step * std::norm(contact.transform(Complex(0.0, -omega)) *
                               lineOfDipoles(bar.bar, perForce, omega, listener, endLoss));
  }
  return energy;
}

}  // namespace carom::test
