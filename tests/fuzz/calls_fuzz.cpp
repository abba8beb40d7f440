#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "carom/audio/material.h"
#include "carom/event_sound.h"
#include "tests/audio/ringing_box.h"
#include "tests/fuzz/fuzz_host.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

constexpr std::size_t kBodies = 5;
constexpr std::size_t kMostCalls = 200;

/// A host that calls in any order, with numbers that are mostly sound.
class Host {
 public:
  Host(EventSound& sound, FuzzNumbers& numbers) : sound_(sound), numbers_(numbers) {}

  void run() {
    callInAnyOrder(numbers_, kMostCalls, [this] { callOne(); });
  }

 private:
  void callOne() {
    switch (numbers_.below(16)) {
      case 0:
        setBody();
        break;
      case 1:
        sound_.removeBody(body());
        break;
      case 2:
        (void)sound_.setListener(numbers_.wild(numbers_.inCube(3.0)), orientation());
        (void)sound_.moveBody(
            body(), {numbers_.wild(time_), numbers_.wild(numbers_.inCube(3.0)), Quat::Identity()});
        break;
      case 3:
        sound_.pause();
        break;
      case 4:
        (void)sound_.setTimeScale(numbers_.wild(numbers_.logBetween(0.1, 4.0)));
        break;
      case 5:
        (void)sound_.setGain(numbers_.wild(numbers_.between(0.0, 2.0)));
        break;
      case 6:
        updateContact();
        break;
      case 7:
        time_ = numbers_.wild(time_);
        sound_.advanceTo(time_);
        if (!(std::abs(time_) < 1e6)) time_ = 0.0;
        break;
      case 8:
      case 9:
      case 10:
        time_ += numbers_.logBetween(1e-4, 0.05);
        sound_.advanceTo(time_);
        break;
      default:
        post();
    }
  }
  BodyId body() { return static_cast<BodyId>(numbers_.below(kBodies + 1)); }
  Quat orientation() {
    const Vec3 axis = numbers_.wild(numbers_.inCube(1.0));
    return {numbers_.wild(numbers_.between(-1.0, 1.0)), axis.x(), axis.y(), axis.z()};
  }
  void setBody() {
    constexpr std::array kMaterials = {"steel", "glass", "wood", "rubber"};
    SoundBody set;
    set.material = *findMaterial(kMaterials[numbers_.below(kMaterials.size())]);
    set.mass = numbers_.wild(numbers_.logBetween(1e-3, 100.0));
    set.radius = numbers_.wild(numbers_.logBetween(1e-3, 1.0));
    if (numbers_.chance(64)) set.modal = test::boxOf({{700.0, 3.0, 1e-3}});
    (void)sound_.setBody(body(), set);
  }
  void post() {
    ImpulseEvent event;
    event.time = numbers_.wild(time_ + numbers_.between(-0.01, 0.05));
    event.body = body();
    event.other = body();
    event.normal = numbers_.wild(Vec3(numbers_.inCube(1.0) + Vec3(0.0, 1e-3, 0.0)).normalized());
    event.approachSpeed = numbers_.wild(numbers_.logBetween(1e-3, 100.0));
    event.effectiveMass = numbers_.wild(numbers_.logBetween(1e-4, 10.0));
    event.impulse = numbers_.wild(Vec3(event.effectiveMass * event.approachSpeed * event.normal));
    event.radius = numbers_.wild(numbers_.logBetween(1e-3, 1.0));
    event.otherRadius = numbers_.wild(numbers_.logBetween(1e-3, 1.0));
    event.position = event.bodyPosition = numbers_.wild(numbers_.inCube(3.0));
    event.bodyVelocity = numbers_.wild(numbers_.inCube(10.0));
    if (numbers_.chance(64)) event.bodyOrientation = orientation();
    sound_.post(event);
  }
  void updateContact() {
    ContactState contact;
    contact.time = numbers_.wild(time_);
    contact.duration = numbers_.wild(numbers_.logBetween(1e-4, 0.02));
    contact.phase = static_cast<ContactPhase>(numbers_.below(3));
    contact.body = body();
    contact.other = body();
    contact.normal = Vec3::UnitY();
    contact.position = numbers_.wild(numbers_.inCube(2.0));
    contact.normalLoad = numbers_.wild(numbers_.logBetween(1e-3, 1e3));
    contact.slipVelocity = numbers_.wild(Vec3(numbers_.between(-3.0, 3.0), 0.0, 0.0));
    contact.pathEnd = contact.otherPathEnd =
        numbers_.wild(Vec3(contact.duration * contact.slipVelocity));
    sound_.updateContact(contact);
  }

  EventSound& sound_;
  FuzzNumbers& numbers_;
  double time_ = 0.0;  // s
};

/// Settings that are no usual ones, or none that a sound takes; those from 8 on change nothing.
void vary(SoundSettings& settings, unsigned which) {
  switch (which) {
    case 0:
      settings.level = Level::automatic;
      return;
    case 1:
      settings.limiter.emplace();
      settings.fullScale = 0.01;
      return;
    case 2:
      settings.clock = SoundClock::simulation;
      return;
    case 3:
      settings.listeners.assign(2, SoundSettings::defaultListener());
      for (Listener& listener : settings.listeners)
        listener.format = ListenerFormat::mono;
      return;
    case 4:
      settings.latency = std::nan("");
      return;
    case 5:
      settings.fullScale = 1e-320;
      return;
    case 6:
      settings.budget.voices = 0;
      return;
    case 7:
      settings.budget.longestContact = 2.0;
      return;
    default:
      return;
  }
}

void call(FuzzNumbers& numbers, unsigned variation) {
  SoundSettings settings = smallSettings(numbers);
  vary(settings, variation);
  auto sound = EventSound::create(settings);
  require(sound || !sound.error().message.empty());
  require(static_cast<bool>(sound) == (variation < 4 || variation > 7));
  if (!sound) return;
  const bool isPulled = numbers.chance(200);
  if (isPulled) require(static_cast<bool>(sound->prepareRendering(kRate)));
  Host host(*sound, numbers);
  if (isPulled && numbers.chance(128)) {
    const Puller puller([&](std::span<float* const> channels, std::size_t frames) {
      sound->render(channels, frames);
    });
    host.run();
  } else {
    host.run();
  }
  closeWithFates(*sound);
}

}  // namespace
}  // namespace carom::fuzz

/// Calls a sound of events in the order and with the numbers that the bytes stand for, beside a
/// thread that pulls samples: no sample may be anything but finite, and each share that was posted
/// must have one fate.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  carom::fuzz::keepTables();
  carom::fuzz::FuzzNumbers numbers({data, size});
  // The last byte, on which few calls depend, says how the settings differ from usual ones.
  carom::fuzz::call(numbers, size == 0 ? 0xFFU : (0xFFU - data[size - 1]) / 8U);
  return 0;
}
