#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/hertz.h"
#include "audio/model/pulse.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

namespace carom::test {

using namespace audio;

namespace {

const Listener kSeat{"seat", {0.0, 0.0, 1.0}};

/// The ring of a force that the modes do not change.
SynthSettings pressed() {
  SynthSettings settings;
  settings.ringingContact = RingingContact::pressed;
  return settings;
}

/// Returns a synth in which the floor rings and the ball is silent, since its click is left out.
Synth floorRings(const BallDrop& drop, const std::vector<Tone>& tones,
                 const SynthSettings& settings = pressed(), const Listener& listener = kSeat) {
  Synth synth = *Synth::create(settings, {listener});
  SoundBody floor = drop.floor();
  floor.modal = boxOf(tones);
  EXPECT_TRUE(synth.setBody(kBall, {.material = drop.material}));
  EXPECT_TRUE(synth.setBody(kFloor, floor));
  return synth;
}

/// Pressure of monopoles by brute force: each oscillator is integrated with the contact's force
/// (Runge-Kutta, 64 steps per sample and more), and its acceleration is heard r / c later.
std::vector<double> integrated(const std::vector<Tone>& tones, const ImpulseEvent& event,
                               double duration, double distance, std::size_t frames) {
  constexpr int kSteps = 256;
  const Pulse& pulse = Pulse::of(PulseShape::hertz);
  const double h = 1.0 / (kRate * kSteps);
  std::vector<double> heard(frames, 0.0);
  for (const Tone& tone : tones) {
    const double omega = 2.0 * std::numbers::pi * tone.frequency;
    const double gain = 1.20 * tone.volume / (4.0 * std::numbers::pi * distance);
    const auto acceleration = [&](double t, double q, double v) {
      const double u = (t - event.time - distance / 343.0) / duration;
      const double force = 5.0 * event.impulse.z() * pulse.force(u) / duration;
      return force - 2.0 * tone.decayRate * v - omega * omega * q;
    };
    double q = 0.0;
    double v = 0.0;
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const double start = static_cast<double>(frame) / kRate;
      heard[frame] += gain * acceleration(start, q, v);
      for (int step = 0; step < kSteps; ++step) {
        const double t = start + step * h;
        const double a1 = acceleration(t, q, v);
        const double a2 = acceleration(t + h / 2, q + h / 2 * v, v + h / 2 * a1);
        const double a3 = acceleration(t + h / 2, q + h / 2 * (v + h / 2 * a1), v + h / 2 * a2);
        const double a4 = acceleration(t + h, q + h * (v + h / 2 * a2), v + h * a3);
        q += h * v + h * h / 6 * (a1 + a2 + a3);
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      }
    }
  }
  return heard;
}

double rootMeanSquare(const std::vector<double>& samples, std::size_t from, std::size_t to) {
  double sum = 0.0;
  for (std::size_t i = from; i < to; ++i)
    sum += samples[i] * samples[i];
  return std::sqrt(sum / static_cast<double>(to - from));
}

struct RingCase {
  double frequency;
  double time;
};

class RingOfOneMode : public testing::TestWithParam<RingCase> {};

// The ring is compared in attack and tail, for periods that are long and short against the contact
// of 39 us.
TEST_P(RingOfOneMode, IsThatOfTheOscillatorThatTheContactDrives) {
  const std::vector<Tone> tones = {{GetParam().frequency, 30.0, 1e-3}};
  const BallDrop drop = dropOnBox(GetParam().time);
  Synth synth = floorRings(drop, tones);
  const ImpulseEvent event = floorShare(drop);
  synth.schedule(event);
  const std::vector<double> heard = renderMono(synth, 4800);
  const std::vector<double> wanted =
      integrated(tones, event, synth.contactDuration(event), 1.0, heard.size());
  std::vector<double> error(heard.size());
  for (std::size_t i = 0; i < heard.size(); ++i)
    error[i] = heard[i] - wanted[i];
  const auto begin = static_cast<std::size_t>((event.time + 1.0 / 343.0) * kRate);
  // Once the contact and its smearing by the band limit are over, the rings are equal.
  EXPECT_LT(rootMeanSquare(error, begin + 30, heard.size()),
            1e-5 * rootMeanSquare(wanted, begin + 30, heard.size()));
  // Before the contact there is silence but for what a filter without delay rings ahead: 16
  // samples, and half of the kernel that spreads an instant.
  EXPECT_LT(rootMeanSquare(heard, 0, begin - 26), 1e-12);
}
INSTANTIATE_TEST_SUITE_P(FromLowToHigh, RingOfOneMode,
                         testing::Values(RingCase{60.0, 0.01}, RingCase{1000.0, 0.01},
                                         RingCase{1000.0, 0.0100037}, RingCase{7000.0, 0.0100151},
                                         RingCase{19000.0, 0.010009}, RingCase{12000.0, 0.01}));

// A contact that lasts many periods excites next to nothing, and the pulse itself makes no thump,
// either.
TEST(SynthRing, AContactMuchLongerThanThePeriodLeavesTheModeStill) {
  BallDrop drop = dropOnBox(0.01);
  drop.material = *findMaterial("rubber");
  drop.radius = 0.008;
  const std::vector<Tone> high = {{18000.0, 30.0, 1e-3}};
  SynthSettings settings;
  settings.audibleThreshold = 0.0;
  Synth synth = floorRings(drop, high, settings);
  const ImpulseEvent event = floorShare(drop);
  ASSERT_GT(synth.contactDuration(event), 20.0 / 18000.0);
  synth.schedule(event);
  const double peak = peakOf(renderMono(synth, 4800));
  // Peak of the ring that an impulse of no duration would excite.
  const double sharp = 1.20 * 1e-3 / (4.0 * std::numbers::pi) * 5.0 * std::abs(event.impulse.z()) *
                       2.0 * std::numbers::pi * 18000.0;
  EXPECT_LT(peak, 2e-3 * sharp);
}

TEST(SynthRing, BitsDoNotDependOnTheBlocks) {
  const std::vector<Tone> tones = {{440.0, 5.0, 1e-3}, {3000.0, 30.0, 1e-3}, {9000.0, 99.0, 1e-3}};
  const auto render = [&](std::vector<std::size_t> blocks) {
    Synth synth = floorRings(dropOnBox(0.01), tones);
    for (const double time : {0.01, 0.0131, 0.0132, 0.05})
      synth.schedule(floorShare(dropOnBox(time)));
    std::vector<double> all;
    for (std::size_t block = 0; all.size() < 9600; ++block) {
      const std::vector<double> part =
          renderMono(synth, std::min(blocks[block % blocks.size()], 9600 - all.size()));
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  };
  const std::vector<double> whole = render({9600});
  EXPECT_GT(peakOf(whole), 1e-3);
  for (const std::vector<std::size_t>& blocks :
       {std::vector<std::size_t>{1}, {64}, {7, 300, 1, 63}, {256, 255}})
    EXPECT_EQ(render(blocks), whole);
}

TEST(SynthRing, BitsDoNotDependOnTheOrderOfTheEvents) {
  const std::vector<Tone> tones = {{440.0, 5.0, 1e-3}, {3000.0, 30.0, 1e-3}};
  const auto render = [&](const std::vector<double>& speeds) {
    Synth synth = floorRings(dropOnBox(0.01), tones);
    for (const double speed : speeds) {
      BallDrop drop = dropOnBox(0.01);
      drop.speed = speed;
      synth.schedule(floorShare(drop));
    }
    return renderMono(synth, 4800);
  };
  EXPECT_EQ(render({1.0, 0.3, 1.7, 0.3001}), render({0.3001, 1.7, 1.0, 0.3}));
}

TEST(SynthRing, HitsAddUp) {
  const std::vector<Tone> tones = {{440.0, 5.0, 1e-3}, {3000.0, 30.0, 1e-3}};
  const auto render = [&](const std::vector<double>& times) {
    Synth synth = floorRings(dropOnBox(0.01), tones);
    for (const double time : times)
      synth.schedule(floorShare(dropOnBox(time)));
    return renderMono(synth, 9600);
  };
  const std::vector<double> both = render({0.01, 0.0717});
  const std::vector<double> first = render({0.01});
  const std::vector<double> second = render({0.0717});
  for (std::size_t i = 0; i < both.size(); ++i)
    ASSERT_NEAR(both[i], first[i] + second[i], 1e-12 * peakOf(both)) << i;
}

TEST(SynthRing, FallsSilentAndCountsWhatItDid) {
  Synth synth = floorRings(dropOnBox(0.01), {{440.0, 50.0, 1e-3}, {3000.0, 90.0, 1e-3}});
  synth.schedule(floorShare(dropOnBox(0.01)));
  EXPECT_FALSE(synth.isSilent());
  static_cast<void>(renderMono(synth, 48000));
  EXPECT_TRUE(synth.isSilent());
  EXPECT_EQ(peakOf(renderMono(synth, 100)), 0.0);
  EXPECT_EQ(synth.counters().events, 1u);
  EXPECT_EQ(synth.counters().rings, 1u);
  EXPECT_EQ(synth.counters().immovable, 0u);
}

TEST(SynthRing, RenderingAllocatesNothing) {
  Synth synth = floorRings(dropOnBox(0.01), {{440.0, 50.0, 1e-3}, {3000.0, 90.0, 1e-3}});
  for (const double time : {0.01, 0.02, 0.03})
    synth.schedule(floorShare(dropOnBox(time)));
  std::vector<double> samples(48000);
  double* const channel = samples.data();
  const NoAllocScope scope;
  synth.render<double>({&channel, 1}, samples.size());
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(SynthRing, IsHeardInTheMiddleOfTheBodyAsFromItsSurface) {
  const auto peakAt = [](const Vec3& place) {
    Synth synth = floorRings(dropOnBox(0.01), {{440.0, 50.0, 1e-3}}, {}, {"inside", place});
    synth.schedule(floorShare(dropOnBox(0.01)));
    return peakOf(renderMono(synth, 4800));
  };
  const double surface = 0.01 * std::sqrt(3.0);
  EXPECT_NEAR(peakAt(Vec3::Zero()), peakAt({0.0, 0.0, surface}), 1e-2 * peakAt(Vec3::Zero()));
}

/// The ball rests on the box from `begin` to `end` (s), with a load (N).
void rest(Synth& synth, double begin, double end, double load) {
  ContactState contact;
  contact.body = kBall;
  contact.other = kFloor;
  contact.normal = Vec3::UnitZ();
  contact.normalLoad = load;
  contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
  contact.duration = 1e-3;
  for (double time = begin; time < end; time += contact.duration) {
    contact.time = time;
    contact.phase = time == begin ? ContactPhase::begin : ContactPhase::during;
    synth.updateContact(contact);
  }
  contact.time = end;
  contact.phase = ContactPhase::end;
  contact.normalLoad = 0.0;
  synth.updateContact(contact);
}

/// Decay rate (1/s) between two times, from the energies in the 10 ms after each.
double decayBetween(const std::vector<double>& samples, double from, double to) {
  const auto at = [](double time) { return static_cast<std::size_t>(time * kRate); };
  return std::log(rootMeanSquare(samples, at(from), at(from + 0.01)) /
                  rootMeanSquare(samples, at(to), at(to + 0.01))) /
         (to - from);
}

// A dashpot c at the contact takes the power c v^2; with v = 5 q' (the shape is 5 along z) and
// c = eta k / w, the energy q'^2 / 2 + ... of the mode decays by 25 c, its amplitude by half that.
TEST(SynthRing, DecaysFasterWhileItIsTouched) {
  const double frequency = 1000.0;
  const double own = 3.0;
  SynthSettings settings;
  settings.contactLoss = 0.05;
  Synth synth = floorRings(dropOnBox(0.01), {{frequency, own, 1.0}}, settings);
  synth.schedule(floorShare(dropOnBox(0.01)));
  const double load = 1e-4;
  rest(synth, 0.2, 0.4, load);
  const std::vector<double> heard = renderMono(synth, 36000);

  // The stiffness follows by its definition from the law F(d) of two spheres, here the edges of 1
  // mm each.
  const Material& steel = *findMaterial("steel");
  const double effective =
      steel.youngsModulus / (2.0 * (1.0 - steel.poissonsRatio * steel.poissonsRatio));
  const double depth = std::pow(load / (4.0 / 3.0 * std::sqrt(0.5e-3) * effective), 2.0 / 3.0);
  const double stiffness = 1.5 * load / depth;
  const double dashpot = settings.contactLoss * stiffness / (2.0 * std::numbers::pi * frequency);
  const double added = 25.0 * dashpot / 2.0;
  ASSERT_GT(added, 5.0);
  ASSERT_LT(added, 100.0);
  EXPECT_NEAR(decayBetween(heard, 0.05, 0.18), own, 0.05);
  EXPECT_NEAR(decayBetween(heard, 0.22, 0.37), own + added, 0.02 * (own + added));
  EXPECT_NEAR(decayBetween(heard, 0.43, 0.7), own, 0.05);
}

// A mode q and a mass x on one another through a spring k (1 + i eta): the decay rate is the
// imaginary part of the root w of
//     w0^2 - w^2 + phi^2 K(w) = 0,   K(w) = -m w^2 kappa / (kappa - m w^2),   kappa = k (1 + i eta)
// near w0, found by Newton's method.
TEST(SynthRing, WhatIsLightSwingsAlongAndTakesLess) {
  const double loss = 0.05;
  const auto addedBy = [loss](double mass) {
    SynthSettings settings;
    settings.contactLoss = loss;
    Synth synth = floorRings(dropOnBox(0.01), {{1000.0, 3.0, 1.0}}, settings);
    constexpr BodyId kLid = 7;
    EXPECT_TRUE(
        synth.setBody(kLid, {.material = *findMaterial("steel"), .mass = mass, .radius = 1e-3}));
    synth.schedule(floorShare(dropOnBox(0.01)));
    ContactState contact;
    contact.body = kLid;
    contact.other = kFloor;
    contact.normal = Vec3::UnitZ();
    contact.normalLoad = 1e-4;
    contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
    contact.time = 0.1;
    contact.duration = 1e-3;
    synth.updateContact(contact);
    return decayBetween(renderMono(synth, 24000), 0.15, 0.4) - 3.0;
  };
  const double own = 2.0 * std::numbers::pi * 1000.0;
  const double held = addedBy(std::numeric_limits<double>::infinity());
  const double stiffness = held * 2.0 * own / (25.0 * loss);
  ASSERT_GT(held, 5.0);
  for (const double mass : {3e-4, 6e-4}) {
    const std::complex<double> kappa(stiffness, loss * stiffness);
    const auto residue = [&](std::complex<double> w) {
      const std::complex<double> inertia = mass * w * w;
      return own * own - w * w - 25.0 * inertia * kappa / (kappa - inertia);
    };
    std::complex<double> w = own;
    for (int step = 0; step < 20; ++step) {
      const std::complex<double> slope = (residue(w + 1e-3) - residue(w - 1e-3)) / 2e-3;
      w -= residue(w) / slope;
    }
    const double expected = std::abs(w.imag());
    ASSERT_LT(expected, 0.1 * held);
    EXPECT_NEAR(addedBy(mass), expected, 0.1 * expected + 0.005) << mass;
  }
}

TEST(SynthRing, ATouchThatDampsNothingChangesNoBits) {
  const auto render = [](bool touched) {
    SynthSettings settings;
    settings.contactLoss = 0.0;
    Synth synth = floorRings(dropOnBox(0.01), {{500.0, 5.0, 1.0}}, settings);
    synth.schedule(floorShare(dropOnBox(0.01)));
    if (touched) rest(synth, 0.02, 0.05, 10.0);
    return renderMono(synth, 9600);
  };
  EXPECT_EQ(render(true), render(false));
}

// The ear is 0.1 s away: what touches the body from 0.3 s on is heard from 0.4 s on.
TEST(SynthRing, ADampingIsHeardAsLateAsTheRing) {
  SynthSettings settings;
  settings.contactLoss = 0.05;
  Synth synth = floorRings(dropOnBox(0.01), {{1000.0, 3.0, 1.0}}, settings,
                           {"far", {0.0, 0.0, 0.1 * settings.medium.speedOfSound}});
  synth.schedule(floorShare(dropOnBox(0.01)));
  rest(synth, 0.3, 1.0, 1e-4);
  const std::vector<double> heard = renderMono(synth, 36000);
  EXPECT_NEAR(decayBetween(heard, 0.2, 0.38), 3.0, 0.05);
  EXPECT_GT(decayBetween(heard, 0.41, 0.6), 8.0);
}

// Two contacts damp the body, and the later one is nearer to the ear by 0.1 s: the change that is
// under way from the earlier one does not end the damping that the later one has begun.
TEST(SynthRing, TheLastOfTwoDampingsStays) {
  SynthSettings settings;
  settings.contactLoss = 0.05;
  Synth synth = floorRings(dropOnBox(0.01), {{1000.0, 3.0, 1.0}}, settings);
  constexpr BodyId kLid = 7;
  ASSERT_TRUE(synth.setBody(kLid, dropOnBox(0.0).ball()));
  synth.schedule(floorShare(dropOnBox(0.01)));
  ContactState contact;
  contact.other = kFloor;
  contact.normal = Vec3::UnitZ();
  contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
  contact.duration = 1e-3;
  contact.body = kBall;
  contact.time = 0.1;
  contact.normalLoad = 1e-12;
  contact.position = {0.0, 0.0, -0.1 * settings.medium.speedOfSound};
  synth.updateContact(contact);
  contact.body = kLid;
  contact.time = 0.11;
  contact.normalLoad = 1e-4;
  contact.position.setZero();
  synth.updateContact(contact);
  EXPECT_GT(decayBetween(renderMono(synth, 24000), 0.25, 0.4), 8.0);
}

TEST(SynthRing, WhatRestedOnItIsRemovedAndItRingsFreely) {
  const auto decayAfter = [](bool isRemoved) {
    SynthSettings settings;
    settings.contactLoss = 0.05;
    Synth synth = floorRings(dropOnBox(0.1), {{1000.0, 3.0, 1.0}}, settings);
    constexpr BodyId kLid = 7;
    EXPECT_TRUE(synth.setBody(kLid, dropOnBox(0.0).ball()));
    ContactState contact;
    contact.body = kLid;
    contact.other = kFloor;
    contact.normal = Vec3::UnitZ();
    contact.normalLoad = 1e-4;
    contact.otherPathStart = contact.otherPathEnd = Vec3(0.0, 0.0, 0.01);
    contact.time = 0.02;
    contact.duration = 1e-3;
    synth.updateContact(contact);
    if (isRemoved) synth.removeBody(kLid);
    synth.schedule(floorShare(dropOnBox(0.1)));
    return decayBetween(renderMono(synth, 24000), 0.12, 0.3);
  };
  EXPECT_GT(decayAfter(false), 8.0);
  EXPECT_NEAR(decayAfter(true), 3.0, 0.05);
}

// The same contacts come again, as in a replay, or lie on a body that has another model by now.
TEST(SynthRing, IsDampedAgainAfterASeekAndWithAnotherModel) {
  SynthSettings settings;
  settings.contactLoss = 0.05;
  Synth synth = floorRings(dropOnBox(0.1), {{1000.0, 3.0, 1.0}}, settings);
  const auto decay = [&synth] {
    synth.schedule(floorShare(dropOnBox(0.1)));
    return decayBetween(renderMono(synth, 24000), 0.12, 0.3);
  };
  rest(synth, 0.02, 0.5, 1e-4);
  const double first = decay();
  EXPECT_GT(first, 8.0);
  ASSERT_TRUE(synth.seek(0.0));
  rest(synth, 0.02, 0.5, 1e-4);
  EXPECT_NEAR(decay(), first, 1e-6 * first);
  ASSERT_TRUE(synth.seek(0.0));
  rest(synth, 0.02, 0.05, 1e-4);
  SoundBody floor = dropOnBox(0.0).floor();
  floor.modal = boxOf({{1000.0, 3.0, 1.0}});
  ASSERT_TRUE(synth.setBody(kFloor, floor));
  rest(synth, 0.05, 0.5, 1e-4);
  EXPECT_NEAR(decay(), first, 1e-6 * first);
}

// A body that is struck while something lies on it is damped from the start.
TEST(SynthRing, WhatIsStruckWhileItIsTouchedIsDampedToo) {
  SynthSettings settings;
  settings.contactLoss = 0.05;
  Synth synth = floorRings(dropOnBox(0.1), {{1000.0, 3.0, 1.0}}, settings);
  rest(synth, 0.02, 10.0, 1e-4);
  synth.schedule(floorShare(dropOnBox(0.1)));
  EXPECT_GT(decayBetween(renderMono(synth, 24000), 0.12, 0.3), 8.0);
}

}  // namespace
}  // namespace carom::test
