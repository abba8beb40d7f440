// Blows on meshes, twice: body and ball integrated directly, and by the contact that is coupled
// with the body's modes. Prints their differences. `--help` describes them.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <utility>
#include <vector>

#include "audio/contact/coupled_contact.h"
#include "tests/audio/meshes.h"
#include "tests/bench/table_program.h"
#include "tests/support/direct_contact.h"

namespace carom::bench {
namespace {

using namespace audio;
using namespace test;

constexpr char kHelp[] =
    R"(usage: bench_contact_direct [--short]
       ./bench contact_direct [--short]

A ball hits a plate, a bar, a shell and a bell, free and at rest, at 1 m/s; its mass is 1/100 of to
100 times the body's, its stiffness such that the contact between rigid bodies lasts a given number
of periods of the body's highest mode (up to 20 kHz, as the product keeps them).

The reference integrates the whole mesh together with the ball, under gravity, by the trapezoidal
rule; the force is spread over a patch, and what the mesh's surface gives way there more than the
wall behind it is given back, so that Hertz's law does not count twice. Beside it stands the contact
that is coupled with the modes of the same matrices, with the few that in the product stand for what
lies above those of a solid, and once more with the matrices' own up to 40 kHz in their place.

  ball     mass over the body's; * if the contact itself loses energy (restitution 0.6)
  periods  of the highest mode in the contact of rigid bodies
  touch    how often they touch; + if more follow after 12 contacts, which are left out, and with
           them the energies as they part
  soft     %, what lies above the modes over what the contact itself gives way, at its deepest
  in modes %, share of the energy of approach in the modes as they part
  own      %, the reference's difference between two steps, as `force`
  force    %, rms of the difference of the forces over time, over rms of the reference
  peak     %, of the largest force
  impulse  %
  modes    %, energy in the modes, of itself, or of 1 % of the approach where that is more
  rigid    %, energy of the bodies' relative motion as they part, of the approach
  lost     %, energy that the contact takes, of the approach
  click    dB, worst third octave of the force's slope, which is heard as the click
  ring     dB, worst third octave of the energy in the modes; both within 30 dB of the loudest
  + 40 kHz force, modes, ring once more, with the matrices' modes, where the contact loses nothing

  --short  coarse meshes and few blows
)";

constexpr double kHighest = 20e3;  // Hz
constexpr double kBeyond = 40e3;   // Hz
constexpr double kLoss = 0.6;      // restitution of the blows that lose energy
constexpr double kHorizon = 12.0;  // contacts
constexpr double kBar = 2.0;       // %
constexpr double kBarLevel = 0.3;  // dB
constexpr double kHeard = 1e-3;    // of the loudest third octave's power

struct Effort {
  std::size_t degreesOfFreedom = 3000;
  std::size_t ofBell = 6000;
  double steps = 500.0;  // in a contact, the larger ones
  std::vector<double> periods = {0.5, 1.0, 2.0, 4.0, 8.0};
};

Effort shortEffort() {
  return {.degreesOfFreedom = 400, .ofBell = 1500, .steps = 120.0, .periods = {1.0, 4.0}};
}

using Point = std::array<double, 2>;  // m: radius and height

/// Turns an outline, from the axis to the axis, around z.
SurfaceMesh revolved(const std::vector<Point>& outline, std::uint32_t sides) {
  SurfaceMesh mesh;
  mesh.vertices = {{0.0, 0.0, outline.front()[1]}, {0.0, 0.0, outline.back()[1]}};
  const auto rings = static_cast<std::uint32_t>(outline.size()) - 2;
  for (std::uint32_t ring = 1; ring <= rings; ++ring)
    for (std::uint32_t side = 0; side < sides; ++side) {
      const double angle = 2.0 * std::numbers::pi * side / sides;
      const double radius = outline[ring][0];
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                                 outline[ring][1]);
    }
  const auto at = [sides](std::uint32_t ring, std::uint32_t side) {
    return 2 + ring * sides + side % sides;
  };
  for (std::uint32_t side = 0; side < sides; ++side) {
    mesh.triangles.push_back({0, at(0, side), at(0, side + 1)});
    mesh.triangles.push_back({1, at(rings - 1, side + 1), at(rings - 1, side)});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      mesh.triangles.push_back({at(ring, side), at(ring + 1, side), at(ring + 1, side + 1)});
      mesh.triangles.push_back({at(ring, side), at(ring + 1, side + 1), at(ring, side + 1)});
    }
  }
  return mesh;
}

/// A bell of 10 cm, 7 mm thick.
SurfaceMesh bellMesh() {
  return revolved({{0.0, 0.078},
                   {0.022, 0.076},
                   {0.030, 0.066},
                   {0.034, 0.045},
                   {0.041, 0.018},
                   {0.051, 0.0},
                   {0.043, 0.0},
                   {0.034, 0.018},
                   {0.027, 0.045},
                   {0.023, 0.061},
                   {0.017, 0.069},
                   {0.0, 0.071}},
                  36);
}

/// One of the blows on a body.
struct Blow {
  double ratio = 1.0;    // mass of the ball over the body's
  double periods = 1.0;  // of the highest mode
  bool isLossy = false;
};

/// The forces in the coupled contact's steps, as the reference and the solver have them.
struct Forces {
  double step = 0.0;  // s
  std::vector<double> direct;
  std::vector<double> coupled;
};

/// Errors in % or dB.
struct Errors {
  double force = 0.0;
  double peak = 0.0;
  double impulse = 0.0;
  double modes = 0.0;
  double rigid = 0.0;
  double lost = 0.0;
  double click = 0.0;
  double ring = 0.0;

  double worst() const { return std::max({force, peak, impulse, modes, rigid, lost}); }
  double worstLevel() const { return std::max(click, ring); }
};

double rmsOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values)
    sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

double differenceOf(const std::vector<double>& some, const std::vector<double>& reference) {
  std::vector<double> difference = reference;
  for (std::size_t n = 0; n < difference.size(); ++n)
    difference[n] -= some[n];
  return 100.0 * rmsOf(difference) / rmsOf(reference);
}

/// Means over even stretches of a force that is linear from sample to sample.
std::vector<double> meansOf(const DirectCourse& course, double stretch, std::size_t count) {
  std::vector<double> integral = {0.0};
  for (std::size_t n = 1; n < course.force.size(); ++n)
    integral.push_back(integral.back() +
                       0.5 * course.step * (course.force[n - 1] + course.force[n]));
  const auto until = [&](double time) {
    const double place = std::min(time / course.step, static_cast<double>(integral.size() - 1));
    const auto sample = std::min(static_cast<std::size_t>(place), integral.size() - 2);
    const double rest = place - static_cast<double>(sample);
    const double rise = course.force[sample + 1] - course.force[sample];
    return integral[sample] + course.step * rest * (course.force[sample] + 0.5 * rest * rise);
  };
  std::vector<double> means;
  for (std::size_t n = 0; n < count; ++n)
    means.push_back(
        (until(static_cast<double>(n + 1) * stretch) - until(static_cast<double>(n) * stretch)) /
        stretch);
  return means;
}

Forces forcesOf(const DirectCourse& direct, const ContactCourse& coupled) {
  Forces forces;
  forces.step = 2.0 * coupled.nodes.front().u * coupled.duration;
  const double end = direct.step * static_cast<double>(direct.force.size() - 1);
  const auto count = static_cast<std::size_t>(end / forces.step);
  forces.direct = meansOf(direct, forces.step, count);
  forces.coupled.assign(count, 0.0);
  for (const PulseNode& node : coupled.nodes) {
    const auto place = static_cast<std::size_t>(node.u * coupled.duration / forces.step);
    if (place < count) forces.coupled[place] += node.weight / forces.step;
  }
  return forces;
}

/// The response of an oscillator to a force: the force's transform at a pole (1/s), without the
/// phase.
double transformOf(const std::vector<double>& force, double step, std::complex<double> pole) {
  const std::complex<double> turn = std::exp(-pole * step);
  std::complex<double> phase = 1.0;
  std::complex<double> sum = 0.0;
  for (const double value : force) {
    sum += value * phase;
    phase *= turn;
  }
  return std::abs(sum) * step;
}

/// Powers in the third octaves from 100 Hz to 20 kHz.
using Bands = std::array<std::array<double, 2>, 24>;  // of the reference, of the solver
constexpr double kFirstBand = 100.0;                  // Hz

double worstBand(const Bands& bands) {
  double loudest = 0.0;
  for (const auto& band : bands)
    loudest = std::max(loudest, band[0]);
  double worst = 0.0;
  for (const auto& [direct, coupled] : bands)
    if (direct > kHeard * loudest)
      worst = std::max(worst, std::abs(10.0 * std::log10(coupled / direct)));
  return worst;
}

double clickError(const Forces& forces) {
  constexpr int kPoints = 6;  // in a band
  Bands bands{};
  for (std::size_t band = 0; band < bands.size(); ++band)
    for (int point = 0; point < kPoints; ++point) {
      const double place = static_cast<double>(band) + (point + 0.5) / kPoints - 0.5;
      const double frequency = kFirstBand * std::pow(2.0, place / 3.0);
      const std::complex<double> pole(0.0, 2.0 * std::numbers::pi * frequency);
      const double direct = transformOf(forces.direct, forces.step, pole);
      const double coupled = transformOf(forces.coupled, forces.step, pole);
      bands[band][0] += direct * direct * frequency * frequency;
      bands[band][1] += coupled * coupled * frequency * frequency;
    }
  return worstBand(bands);
}

double ringError(const Forces& forces, const std::vector<ContactMode>& modes) {
  Bands bands{};
  for (const ContactMode& mode : modes) {
    const double frequency = mode.frequency / (2.0 * std::numbers::pi);
    const double band = std::round(3.0 * std::log2(frequency / kFirstBand));
    if (band < 0.0) continue;
    auto& both = bands[std::min(static_cast<std::size_t>(band), bands.size() - 1)];
    const std::complex<double> pole(-mode.decay, mode.frequency);
    both[0] += std::pow(mode.shape * transformOf(forces.direct, forces.step, pole), 2);
    both[1] += std::pow(mode.shape * transformOf(forces.coupled, forces.step, pole), 2);
  }
  return worstBand(bands);
}

double relative(double value, double reference, double scale) {
  return 100.0 * std::abs(value - reference) / scale;
}

/// True if the reference ends before the contact does.
bool isCut(const DirectCourse& direct, const ContactCourse& coupled) {
  return direct.step * static_cast<double>(direct.force.size() - 1) < coupled.duration;
}

Errors errorsOf(const DirectCourse& direct, const ContactCourse& coupled,
                const std::vector<ContactMode>& modes) {
  const Forces forces = forcesOf(direct, coupled);
  const double peak = *std::ranges::max_element(forces.direct);
  double impulse = 0.0;
  double wanted = 0.0;
  for (std::size_t n = 0; n < forces.direct.size(); ++n) {
    impulse += forces.coupled[n];
    wanted += forces.direct[n];
  }
  Errors errors{.force = differenceOf(forces.coupled, forces.direct),
                .peak = relative(*std::ranges::max_element(forces.coupled), peak, peak),
                .impulse = relative(impulse, wanted, wanted),
                .click = clickError(forces),
                .ring = ringError(forces, modes)};
  if (isCut(direct, coupled)) return errors;
  const ContactLedger& energy = coupled.energy;
  errors.modes = relative(energy.modes + energy.beyond, direct.modes,
                          std::max(direct.modes, 0.01 * energy.approach));
  errors.rigid = relative(energy.rigid, direct.rigid, energy.approach);
  errors.lost = relative(energy.lost, direct.lost, energy.approach);
  return errors;
}

/// Counts rows that hold the bars.
struct Tally {
  std::size_t rows = 0;
  std::size_t within = 0;
  std::size_t withinLevel = 0;
  Errors worst;

  void add(const Errors& errors) {
    ++rows;
    if (errors.worst() <= kBar) ++within;
    if (errors.worstLevel() <= kBarLevel) ++withinLevel;
    worst.force = std::max(worst.force, errors.force);
    worst.peak = std::max(worst.peak, errors.peak);
    worst.impulse = std::max(worst.impulse, errors.impulse);
    worst.modes = std::max(worst.modes, errors.modes);
    worst.rigid = std::max(worst.rigid, errors.rigid);
    worst.lost = std::max(worst.lost, errors.lost);
    worst.click = std::max(worst.click, errors.click);
    worst.ring = std::max(worst.ring, errors.ring);
  }
  void print(const char* name) const {
    std::printf(
        "%-32s %3zu blows, %3zu within %g %%, %3zu within %g dB; worst: force %.2g, peak %.2g, "
        "impulse %.2g, modes %.2g, rigid %.2g, lost %.2g %%, click %.2g, ring %.2g dB\n",
        name, rows, within, kBar, withinLevel, kBarLevel, worst.force, worst.peak, worst.impulse,
        worst.modes, worst.rigid, worst.lost, worst.click, worst.ring);
  }
};

struct Summary {
  Tally below;  // less than two periods
  Tally above;
  Tally belowWithMore;
  Tally aboveWithMore;
  double own = 0.0;  // %, worst difference of two steps
};

/// Models of solids know that modes are missing, so that what those give way is estimated; those of
/// shells do not.
enum class Kind { solid, shell };

class Body {
 public:
  Body(const char* name, PatchedBody body, Kind kind, const Effort& effort)
      : body_(std::move(body)),
        patch_(modesOf(body_, kHighest)),
        more_(modesOf(body_, kBeyond).modes),
        contactModes_(patch_.modes),
        effort_(effort) {
    if (kind == Kind::solid) addModesBeyond(contactModes_, 0, patch_.modes.size());
    double estimated = 0.0;  // m/N
    for (std::size_t i = patch_.modes.size(); i < contactModes_.size(); ++i)
      estimated += std::pow(contactModes_[i].shape / contactModes_[i].frequency, 2);
    mass_ = body_.mass.sum() / 3.0;
    for (const ContactMode& mode : patch_.modes)
      fastest_ = std::max(fastest_, mode.frequency);
    std::printf(
        "\n%s: %td degrees of freedom, %zu modes up to %.0f Hz, %.3g kg; the mesh's dent %.2g "
        "nm/N, "
        "what lies above the modes %.2g nm/N, estimated %.2g\n%7s %7s %5s %5s %8s %6s |%7s %6s %7s "
        "%6s %6s %6s "
        "%6s %6s |%8s %6s %6s\n",
        name, body_.push.size(), patch_.modes.size(), fastest_ / (2.0 * std::numbers::pi), mass_,
        1e9 * body_.dent, 1e9 * patch_.beyond, 1e9 * estimated, "ball", "periods", "touch", "soft",
        "in modes", "own", "force", "peak", "impulse", "modes", "rigid", "lost", "click", "ring",
        "+ 40 kHz", "modes", "ring");
  }

  void hit(const Blow& blow, Summary& summary) {
    DirectBlow direct{.mass = blow.ratio * mass_};
    CoupledImpact impact{.mass = 1.0 / (patch_.mobility + 1.0 / direct.mass),
                         .speed = direct.speed,
                         .modes = contactModes_,
                         .beyond = contactModes_.size() - patch_.modes.size()};
    const double duration = blow.periods * 2.0 * std::numbers::pi / fastest_;
    impact.stiffness = 1.25 * impact.mass * std::pow(2.9432 / duration, 2.5);
    impact.impulse = impact.mass * (1.0 + (blow.isLossy ? kLoss : 1.0));
    const ContactCourse course = contact_.solve(impact);
    direct.stiffness = impact.stiffness;
    direct.damping = course.damping;
    const double until = std::min(1.1 * course.duration + 0.5 * duration, kHorizon * duration);
    const double step = duration / effort_.steps;
    const DirectCourse coarse = integrate(body_, patch_, direct, step, until);
    const DirectCourse fine = integrate(body_, patch_, direct, 0.5 * step, until);
    const auto count = static_cast<std::size_t>(until / duration * 64.0) - 1;
    const double own = differenceOf(meansOf(coarse, duration / 64.0, count),
                                    meansOf(fine, duration / 64.0, count));
    const Errors errors = errorsOf(fine, course, patch_.modes);
    const double force = *std::ranges::max_element(fine.force);
    std::printf("%6g%s %7g %4zu%s %5.1f %8.2f %6.3f |%7.2f %6.2f %7.2f ", blow.ratio,
                blow.isLossy ? "*" : " ", blow.periods, fine.touches,
                isCut(fine, course) ? "+" : " ", 100.0 * patch_.beyond * force / fine.deepest,
                100.0 * fine.modes / course.energy.approach, own, errors.force, errors.peak,
                errors.impulse);
    if (isCut(fine, course))
      std::printf("%6s %6s %6s ", "-", "-", "-");
    else
      std::printf("%6.2f %6.2f %6.2f ", errors.modes, errors.rigid, errors.lost);
    std::printf("%6.2f %6.2f |", errors.click, errors.ring);
    (blow.periods < 2.0 ? summary.below : summary.above).add(errors);
    if (blow.isLossy) {
      std::printf("\n");
    } else {
      const ContactCourse withMore = solveWithMore(impact);
      const Errors more = errorsOf(fine, withMore, patch_.modes);
      if (isCut(fine, withMore))
        std::printf("%8.2f %6s %6.2f\n", more.force, "-", more.ring);
      else
        std::printf("%8.2f %6.2f %6.2f\n", more.force, more.modes, more.ring);
      (blow.periods < 2.0 ? summary.belowWithMore : summary.aboveWithMore).add(more);
    }
    std::fflush(stdout);
    summary.own = std::max(summary.own, own);
  }

 private:
  /// The impact with all modes of the matrices up to 40 kHz.
  ContactCourse solveWithMore(CoupledImpact impact) {
    impact.modes = more_;
    impact.beyond = 0;
    return contact_.solve(impact);
  }

  PatchedBody body_;
  PatchModes patch_;
  std::vector<ContactMode> more_;          // up to 40 kHz
  std::vector<ContactMode> contactModes_;  // as the product has them
  const Effort& effort_;
  double mass_ = 0.0;     // kg
  double fastest_ = 0.0;  // rad/s
  CoupledContact contact_;
};

void strike(const char* name, PatchedBody matrices, Kind kind, const Effort& effort,
            Summary& summary) {
  Body body(name, std::move(matrices), kind, effort);
  for (const double ratio : {0.01, 1.0, 100.0}) {
    for (const double periods : effort.periods)
      body.hit({.ratio = ratio, .periods = periods}, summary);
    body.hit({.ratio = ratio, .periods = 4.0, .isLossy = true}, summary);
  }
}

/// A material that does not brake rigid motion.
Material lossOf(const char* name) {
  Material material = *findMaterial(name);
  material.dampingAlpha = 0.0;
  return material;
}

int run(const Scale& scale) {
  const Effort effort = scale.of(Effort(), shortEffort());
  Summary summary;
  strike("plate, steel, 180 x 140 x 6 mm",
         patchedSolid(boxMesh({0.09, 0.07, 0.003}), lossOf("steel"), effort.degreesOfFreedom,
                      {.centre = {0.031, 0.022, 0.003}, .radius = 0.008, .wall = 0.006}),
         Kind::solid, effort, summary);
  strike("bar, steel, 240 x 20 x 10 mm",
         patchedSolid(boxMesh({0.12, 0.01, 0.005}), lossOf("steel"), effort.degreesOfFreedom,
                      {.centre = {0.1, 0.0, 0.005}, .radius = 0.007, .wall = 0.01}),
         Kind::solid, effort, summary);
  const Vec3 top(0.0, 0.0, 0.13);
  strike("shell, aluminium, 400 x 320 x 260 mm, of springs",
         patchedShell(ellipsoidMesh({0.2, 0.16, 0.13}, scale.of(3, 2)), lossOf("aluminium"),
                      {.centre = top, .radius = scale.of(0.1, 0.16), .wall = 0.003}),
         Kind::shell, effort, summary);
  strike("bell, bronze, 102 mm wide, 78 mm high",
         patchedSolid(bellMesh(), lossOf("bronze"), effort.ofBell,
                      {.centre = {0.0455, 0.0, 0.0099},
                       .inward = Vec3(-0.874, 0.0, -0.486).normalized(),
                       .radius = 0.007,
                       .wall = 0.007}),
         Kind::solid, effort, summary);
  std::printf("\n");
  summary.above.print("two periods and more");
  summary.below.print("less than two periods");
  summary.aboveWithMore.print("two and more, to 40 kHz");
  summary.belowWithMore.print("less than two, to 40 kHz");
  std::printf("the reference's own difference between two steps: %.2g %% at most\n", summary.own);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_contact_direct", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
