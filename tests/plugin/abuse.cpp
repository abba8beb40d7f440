#include "tests/plugin/abuse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <numbers>

#include <btBulletDynamicsCommon.h>
#include <unistd.h>

#include "carom/audio/material.h"
#include "carom/event_sound.h"
#include "carom/sound.h"
#include "tests/support/constants.h"
#include "tests/support/random.h"

namespace carom::test {
namespace {

constexpr std::size_t kTaps = 129;
constexpr std::size_t kHalf = kTaps / 2;
/// Samples on either side of a place over which its peak is taken.
constexpr std::size_t kAround = 512;
/// Share of the local peak that counts as a glitch: a step of a tenth of the peak has so much next
/// to half the sample rate.
constexpr double kGlitch = 0.003;
/// Inaudible pressure in Pa.
constexpr double kInaudible = 2e-5;

constexpr double kFrame = 1.0 / 60.0;  // s

double kaiser(double x) {
  // The window is I0(beta sqrt(1 - x^2)) / I0(beta), by its series; with beta = 9 the side lobes
  // are below -90 dB.
  const auto bessel = [](double z) {
    double sum = 1.0;
    double term = 1.0;
    for (int k = 1; k < 40; ++k) {
      term *= (z / (2.0 * k)) * (z / (2.0 * k));
      sum += term;
    }
    return sum;
  };
  return bessel(9.0 * std::sqrt(std::max(0.0, 1.0 - x * x))) / bessel(9.0);
}

double residentMemory() {
  std::ifstream file("/proc/self/statm");
  double pages = 0.0;
  double resident = 0.0;
  file >> pages >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

btVector3 bt(const Vec3& v) {
  return {btScalar(v.x()), btScalar(v.y()), btScalar(v.z())};
}

/// A box of 4 m with up to kMost bodies of a few shapes.
class Playground {
 public:
  static constexpr std::size_t kMost = 40;

  explicit Playground(Random& random) : random_(random) {
    world_.setGravity(btVector3(0, btScalar(-9.81), 0));
    for (const int axis : {0, 1, 2})
      for (const double side : {-1.0, 1.0}) {
        walls_.push_back(
            std::make_unique<btStaticPlaneShape>(bt(-side * Vec3::Unit(axis)), btScalar(-2)));
        add(*walls_.back(), 0.0, Vec3::Zero());
      }
    for (int size = 0; size < 3; ++size) {
      const auto half = btScalar(0.02 * (size + 1));
      shapes_.push_back(std::make_unique<btSphereShape>(half));
      shapes_.push_back(std::make_unique<btBoxShape>(btVector3(half, half, 2 * half)));
    }
    shapes_.push_back(std::make_unique<btCapsuleShape>(btScalar(0.02), btScalar(0.1)));
    while (bodies_.size() < walls_.size() + kMost)
      addBody();
  }
  ~Playground() {
    for (const auto& body : bodies_)
      world_.removeRigidBody(body.get());
  }

  btDiscreteDynamicsWorld& world() { return world_; }
  bool isFull() const { return bodies_.size() >= walls_.size() + kMost; }

  template <class Function>
  void forEachShape(Function function) const {
    for (const auto& wall : walls_)
      function(*wall);
    for (const auto& shape : shapes_)
      function(*shape);
  }
  void addBody() {
    btCollisionShape& shape =
        *shapes_[static_cast<std::size_t>(random_.below(static_cast<int>(shapes_.size())))];
    add(shape, random_.logBetween(0.05, 2.0), 1.7 * random_.inCube());
  }
  btRigidBody& anyBody() {
    const auto movable = static_cast<int>(bodies_.size() - walls_.size());
    return *bodies_[walls_.size() + static_cast<std::size_t>(random_.below(movable))];
  }
  void remove(const btRigidBody& body) {
    const auto at =
        std::ranges::find_if(bodies_, [&](const auto& owned) { return owned.get() == &body; });
    world_.removeRigidBody(at->get());
    bodies_.erase(at);
  }
  void kick(btRigidBody& body) {
    body.activate(true);
    body.setLinearVelocity(bt(5.0 * random_.inCube()));
  }

 private:
  void add(btCollisionShape& shape, double mass, const Vec3& place) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0.0) shape.calculateLocalInertia(btScalar(mass), inertia);
    bodies_.push_back(std::make_unique<btRigidBody>(btScalar(mass), nullptr, &shape, inertia));
    btRigidBody& body = *bodies_.back();
    body.setRestitution(btScalar(0.8));
    body.setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), bt(place)));
    world_.addRigidBody(&body);
  }

  Random& random_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::vector<std::unique_ptr<btStaticPlaneShape>> walls_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

SoundSettings abusedSettings(bool slides) {
  SoundSettings settings;
  settings.budget.voices = 256;
  settings.budget.buses = 128;
  settings.budget.slidingContacts = slides ? 8 : 0;
  return settings;
}

/// Pulls samples in blocks of any size and examines them.
template <class Pulled>
class PullingEar {
 public:
  PullingEar(Pulled& sound, Random& random) : sound_(sound), random_(random) {}

  void hear(double seconds) {
    owed_ += seconds * sound_.sampleRate();
    while (owed_ >= 1.0) {
      const std::size_t frames = std::min(static_cast<std::size_t>(owed_),
                                          static_cast<std::size_t>(1 + random_.below(1500)));
      std::array<float*, 2> channels{};
      for (std::size_t channel = 0; channel < 2; ++channel) {
        samples_[channel].resize(frames);
        channels[channel] = samples_[channel].data();
      }
      sound_.render(channels, frames);
      for (std::size_t channel = 0; channel < 2; ++channel) {
        detectors_[channel].push(samples_[channel]);
        for (const float sample : samples_[channel])
          peak_ = std::max(peak_, std::abs(static_cast<double>(sample)));
      }
      owed_ -= static_cast<double>(frames);
      heard_ += static_cast<double>(frames) / sound_.sampleRate();
    }
  }
  void restart() {
    for (GlitchDetector& detector : detectors_)
      detector.restart();
  }
  void reportTo(AbuseReport& report) const {
    for (const GlitchDetector& detector : detectors_) {
      report.glitches += detector.glitches();
      report.notFinite += detector.notFinite();
      report.worst = std::max(report.worst, detector.worst());
    }
    report.peak = std::max(report.peak, peak_);
    report.seconds += heard_;
  }

 private:
  Pulled& sound_;
  Random& random_;
  std::array<GlitchDetector, 2> detectors_;
  std::array<std::vector<float>, 2> samples_;
  double owed_ = 0.0;
  double heard_ = 0.0;
  double peak_ = 0.0;
};

void require(const Status& status) {
  if (status) return;
  std::fprintf(stderr, "%s\n", status.error().message.c_str());
  std::abort();
}

class Abuse {
 public:
  explicit Abuse(const AbuseSettings& settings) : settings_(settings), random_(settings.seed) {
    for (BodyId id = 0; id < kEventBodies; ++id)
      require(events_.setBody(id, ball(id)));
    world_.forEachShape([this](const btCollisionShape& shape) {
      require(sound_.assign(shape, {.material = "rubber"}));
    });
    require(sound_.prepareRendering(48000.0));
    require(events_.prepareRendering(48000.0));
  }

  AbuseReport run() {
    const auto frames = static_cast<int>(settings_.seconds / kFrame);
    for (int frame = 0; frame < frames; ++frame) {
      step();
      annoy();
      if (frame == frames / 3) report_.memoryBegin = memoryInUse();
    }
    report_.memoryEnd = memoryInUse();
    worldEar_.reportTo(report_);
    eventEar_.reportTo(report_);
    report_.ofWorld = sound_.statistics();
    report_.ofEvents = events_.statistics();
    return report_;
  }

 private:
  static constexpr BodyId kEventBodies = 30;

  /// Resident memory in MB, always at the same sample rate, as buses hold more samples at other
  /// rates.
  double memoryInUse() {
    require(sound_.prepareRendering(48000.0));
    require(events_.prepareRendering(48000.0));
    worldEar_.restart();
    eventEar_.restart();
    return residentMemory();
  }

  static SoundBody ball(BodyId id) {
    const double radius = 0.01 * std::pow(1.06, id);
    const Material rubber = *findMaterial("rubber");
    return {.material = rubber,
            .mass = 4.0 / 3.0 * std::numbers::pi * rubber.density * std::pow(radius, 3),
            .radius = radius};
  }

  void step() {
    world_.world().stepSimulation(btScalar(kFrame * scale_), 10, btScalar(1.0 / 240.0));
    ++report_.steps;
    for (int i = random_.below(6); i > 0; --i)
      post(events_.time() + random_.between(0.0, kFrame));
    events_.advanceTo(events_.time() + kFrame);
    hear(kFrame);
  }
  void hear(double seconds) {
    worldEar_.hear(seconds);
    eventEar_.hear(seconds);
  }
  void post(double time) {
    const auto id = static_cast<BodyId>(random_.below(kEventBodies));
    const SoundBody body = ball(id);
    ImpulseEvent event;
    event.time = time;
    event.body = id;
    event.other = (id + 1) % kEventBodies;
    event.normal = random_.direction();
    event.approachSpeed = random_.logBetween(0.01, 2.0);
    event.effectiveMass = 0.5 * body.mass;
    event.impulse = event.effectiveMass * event.approachSpeed * event.normal;
    event.radius = event.otherRadius = body.radius;
    event.bodyPosition = event.position = 3.0 * random_.inCube();
    if (random_.chance(1e-3)) event.bodyPosition.x() = kNaN;
    events_.post(event);
  }

  void annoy() {
    if (random_.chance(0.3)) world_.kick(world_.anyBody());
    if (random_.chance(0.1)) exchangeBodies();
    if (random_.chance(1.0 / 300.0)) stall();
    if (random_.chance(1.0 / 400.0)) burst();
    if (random_.chance(1.0 / 500.0)) breakNumbers();
    if (random_.chance(1.0 / 1200.0)) changeRate();
    if (random_.chance(1.0 / 700.0)) pause();
    if (random_.chance(1.0 / 700.0)) slowDown();
    moveListener();
  }
  void exchangeBodies() {
    if (world_.isFull() || random_.chance(0.5)) {
      world_.remove(world_.anyBody());
      ++report_.removed;
    }
    while (!world_.isFull()) {
      world_.addBody();
      ++report_.added;
    }
  }
  void stall() {
    hear(random_.between(0.02, 1.5));
    ++report_.stalls;
  }
  void burst() {
    for (int i = 0; i < 100000; ++i)
      post(events_.time() + random_.between(-0.01, kFrame));
    ++report_.bursts;
  }
  void breakNumbers() {
    btRigidBody& body = world_.anyBody();
    btTransform broken = body.getWorldTransform();
    broken.setOrigin(btVector3(btScalar(kNaN), 0, 0));
    body.setCenterOfMassTransform(broken);
    if (random_.chance(0.5)) body.setLinearVelocity(btVector3(0, btScalar(kNaN), 0));
    step();
    world_.remove(body);
    world_.addBody();
    ++report_.notNumbers;
  }
  void changeRate() {
    constexpr std::array kRates = {44100.0, 48000.0, 96000.0, 32000.0};
    const double rate = kRates[static_cast<std::size_t>(random_.below(4))];
    require(sound_.prepareRendering(rate));
    require(events_.prepareRendering(rate));
    worldEar_.restart();
    eventEar_.restart();
    ++report_.rateChanges;
  }
  void pause() {
    sound_.pause();
    events_.pause();
    hear(random_.between(0.0, 2.0));
    ++report_.pauses;
  }
  void slowDown() {
    scale_ = scale_ == 1.0 ? random_.logBetween(0.1, 2.0) : 1.0;
    require(sound_.setTimeScale(scale_));
    ++report_.slowMotions;
  }
  void moveListener() {
    Vec3 place = place_ + 0.01 * random_.inCube();
    if (random_.chance(0.02)) place = 1.9 * random_.inCube();
    if (random_.chance(0.05)) {
      const btVector3 inside = world_.anyBody().getWorldTransform().getOrigin();
      place = {double(inside.x()), double(inside.y()), double(inside.z())};
      ++report_.insideBodies;
    }
    if (!sound_.setListener(place, random_.orientation())) return;
    (void)events_.setListener(random_.chance(0.01) ? Vec3(kNaN, 0, 0) : place);
    place_ = place;
  }

  AbuseSettings settings_;
  Random random_;
  AbuseReport report_;
  Playground world_{random_};
  Sound sound_ = std::move(*Sound::attach(world_.world(), abusedSettings(settings_.slides)));
  EventSound events_ = std::move(*EventSound::create(abusedSettings(settings_.slides)));
  PullingEar<Sound> worldEar_{sound_, random_};
  PullingEar<EventSound> eventEar_{events_, random_};
  Vec3 place_ = Vec3::Zero();
  double scale_ = 1.0;
};

}  // namespace

GlitchDetector::GlitchDetector() : taps_(kTaps), window_(2 * kAround + kTaps) {
  // The taps pass what lies above 0.47 of the sample rate: a low-pass of the width 0.03, shifted by
  // half the rate.
  constexpr double kWidth = 0.03;
  for (std::size_t tap = 0; tap < kTaps; ++tap) {
    const double n = static_cast<double>(tap) - static_cast<double>(kHalf);
    const double sinc =
        n == 0.0 ? 2.0 * kWidth
                 : std::sin(2.0 * std::numbers::pi * kWidth * n) / (std::numbers::pi * n);
    const double sign = (tap + kHalf) % 2 == 0 ? 1.0 : -1.0;
    taps_[tap] = sign * sinc * kaiser(n / (static_cast<double>(kHalf) + 1.0));
  }
  restart();
}

void GlitchDetector::restart() {
  std::ranges::fill(window_, 0.0);
  next_ = 0;
  seen_ = 0;
  quietUntil_ = 0;
}

void GlitchDetector::push(std::span<const float> samples) {
  for (const float sample : samples) {
    notFinite_ += std::isfinite(sample) ? 0U : 1U;
    window_[next_] = std::isfinite(sample) ? static_cast<double>(sample) : 0.0;
    next_ = (next_ + 1) % window_.size();
    ++seen_;
    // The first window has no samples before its begin, so that it is not examined.
    if (seen_ > window_.size()) examine();
  }
}

/// Examines the place in the middle of the window.
void GlitchDetector::examine() {
  double high = 0.0;
  for (std::size_t tap = 0; tap < kTaps; ++tap)
    high += taps_[tap] * window_[(next_ + kAround + tap) % window_.size()];
  if (std::abs(high) < kGlitch * kInaudible) return;
  double peak = 0.0;
  for (const double sample : window_)
    peak = std::max(peak, std::abs(sample));
  const double share = std::abs(high) / std::max(peak, kInaudible);
  worst_ = std::max(worst_, share);
  if (share < kGlitch || seen_ < quietUntil_) return;
  ++glitches_;
  quietUntil_ = seen_ + kAround;
}

AbuseReport abuse(const AbuseSettings& settings) {
  return Abuse(settings).run();
}

std::string AbuseReport::text() const {
  std::string all;
  const auto line = [&all](const char* name, double value, const char* unit) {
    char text[128];
    std::snprintf(text, sizeof text, "%-42s %14.6g %s\n", name, value, unit);
    all += text;
  };
  const auto count = [&line](const char* name, std::uint64_t value) {
    line(name, static_cast<double>(value), "");
  };
  line("sound", seconds, "s");
  count("samples that are no number", notFinite);
  count("glitches", glitches);
  line("next to half the sample rate, at most", worst, "of the peak around");
  line("peak", peak, "Pa");
  line("memory after a third", memoryBegin, "MB");
  line("memory at the end", memoryEnd, "MB");
  count("frames", steps);
  count("stalls", stalls);
  count("bursts of 100,000 events", bursts);
  count("bodies added", added);
  count("bodies removed", removed);
  count("transforms that are no number", notNumbers);
  count("listeners within bodies", insideBodies);
  count("changes of the sample rate", rateChanges);
  count("pauses", pauses);
  count("changes of the time scale", slowMotions);
  for (const SoundStatistics* s : {&ofWorld, &ofEvents}) {
    all += s == &ofWorld ? "\nof the world\n" : "\nof the events\n";
    count("  events", s->events);
    count("  rejected", s->rejected);
    count("  skipped", s->skipped);
    count("  inaudible", s->inaudible);
    count("  stolen", s->stolen);
    count("  over budget", s->overBudget);
    count("  without a bus", s->noBus);
    count("  too long", s->tooLong);
    count("  queue faults", s->queueFaults);
    count("  late", s->late);
    count("  stalls", s->stalls);
    count("  jumps", s->jumps);
  }
  return all;
}

}  // namespace carom::test
