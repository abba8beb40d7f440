#include "plugin/c_api/c_structs.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace carom {

using namespace plugin;

namespace {

template <std::size_t count>
void set(double (&field)[count], std::initializer_list<double> values) {
  std::copy(values.begin(), values.end(), field);
}

TEST(CStructs, EveryFieldOfAnEventArrives) {
  carom_event given = defaultEvent();
  given.time = 1.5;
  given.body = 2;
  given.other = 3;
  set(given.impulse, {4, 5, 6});
  set(given.applied_impulse, {7, 8, 9});
  given.has_applied_impulse = 1;
  set(given.position, {10, 11, 12});
  set(given.normal, {13, 14, 15});
  given.approach_speed = 16;
  given.effective_mass = 17;
  given.radius = 18;
  given.other_radius = 19;
  set(given.body_position, {20, 21, 22});
  set(given.body_orientation, {23, 24, 25, 26});
  set(given.body_velocity, {27, 28, 29});
  set(given.body_angular_velocity, {30, 31, 32});
  const Result<ImpulseEvent> event = eventFrom(&given);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->time, 1.5);
  EXPECT_EQ(event->body, 2u);
  EXPECT_EQ(event->other, 3u);
  EXPECT_EQ(event->impulse, Vec3(4, 5, 6));
  EXPECT_EQ(event->appliedImpulse, Vec3(7, 8, 9));
  EXPECT_TRUE(event->hasAppliedImpulse);
  EXPECT_EQ(event->position, Vec3(10, 11, 12));
  EXPECT_EQ(event->normal, Vec3(13, 14, 15));
  EXPECT_EQ(event->approachSpeed, 16);
  EXPECT_EQ(event->effectiveMass, 17);
  EXPECT_EQ(event->radius, 18);
  EXPECT_EQ(event->otherRadius, 19);
  EXPECT_EQ(event->bodyPosition, Vec3(20, 21, 22));
  EXPECT_EQ(event->bodyOrientation.vec(), Vec3(23, 24, 25));
  EXPECT_EQ(event->bodyOrientation.w(), 26);
  EXPECT_EQ(event->bodyVelocity, Vec3(27, 28, 29));
  EXPECT_EQ(event->bodyAngularVelocity, Vec3(30, 31, 32));
}

TEST(CStructs, DefaultsAreThoseOfTheLibrary) {
  carom_listener ears = defaultListener();
  carom_settings given = defaultSettings();
  given.listeners = &ears;
  given.listener_count = 1;
  const Result<CSettings> settings = settingsFrom(&given);
  ASSERT_TRUE(settings);
  const SoundSettings expected;
  EXPECT_EQ(settings->sound.synth.sampleRate, expected.synth.sampleRate);
  EXPECT_EQ(settings->sound.synth.impulse, expected.synth.impulse);
  EXPECT_EQ(settings->sound.synth.medium.density, expected.synth.medium.density);
  EXPECT_EQ(settings->sound.synth.medium.speedOfSound, expected.synth.medium.speedOfSound);
  EXPECT_EQ(settings->sound.synth.audibleThreshold, expected.synth.audibleThreshold);
  EXPECT_EQ(settings->sound.synth.doppler, expected.synth.doppler);
  EXPECT_EQ(settings->sound.latency, expected.latency);
  EXPECT_EQ(settings->sound.clock, expected.clock);
  EXPECT_EQ(settings->sound.budget.cpuShare, expected.budget.cpuShare);
  EXPECT_EQ(settings->sound.budget.voices, expected.budget.voices);
  EXPECT_EQ(settings->sound.budget.buses, expected.budget.buses);
  EXPECT_EQ(settings->sound.budget.longestContact, expected.budget.longestContact);
  EXPECT_EQ(settings->sound.budget.ringingBodies, expected.budget.ringingBodies);
  EXPECT_EQ(settings->sound.budget.modes, expected.budget.modes);
  EXPECT_EQ(settings->sound.fullScale, expected.fullScale);
  EXPECT_FALSE(settings->sound.limiter);
  EXPECT_EQ(settings->world.restSpeed, WorldSoundSettings().restSpeed);
  EXPECT_EQ(settings->world.radiators, WorldSoundSettings().radiators);
  const Listener listener;
  ASSERT_EQ(settings->sound.listeners.size(), 1u);
  EXPECT_EQ(settings->sound.listeners[0].format, listener.format);
  EXPECT_EQ(settings->sound.listeners[0].position, listener.position);
  EXPECT_EQ(settings->sound.listeners[0].orientation.coeffs(), listener.orientation.coeffs());
  EXPECT_EQ(settings->sound.listeners[0].spacing, listener.spacing);
  EXPECT_EQ(settings->sound.listeners[0].halfAngle, listener.halfAngle);
  EXPECT_EQ(settings->sound.listeners[0].pattern, listener.pattern);
}

TEST(CStructs, EverySettingArrives) {
  carom_settings given = defaultSettings();
  given.sample_rate = 44100;
  given.latency = 0.1;
  given.air_density = 1.1;
  given.speed_of_sound = 330;
  given.audible_threshold = 1e-3;
  given.cpu_share = 0.25;
  given.voices = 100;
  given.buses = 50;
  given.longest_contact = 0.02;
  given.full_scale = 8;
  given.limiter = 1;
  given.limiter_ceiling = 0.75;
  given.rest_speed = 0.01;
  given.clock = CAROM_CLOCK_SIMULATION;
  given.impulse = CAROM_IMPULSE_APPLIED;
  given.radiators = CAROM_RADIATORS_EQUIVALENT_SPHERE;
  given.doppler = 0;
  given.ringing_bodies = 5;
  given.modes = 6;
  const Result<CSettings> settings = settingsFrom(&given);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->sound.synth.sampleRate, 44100);
  EXPECT_EQ(settings->sound.latency, 0.1);
  EXPECT_EQ(settings->sound.synth.medium.density, 1.1);
  EXPECT_EQ(settings->sound.synth.medium.speedOfSound, 330);
  EXPECT_EQ(settings->sound.synth.audibleThreshold, 1e-3);
  EXPECT_EQ(settings->sound.budget.cpuShare, 0.25);
  EXPECT_EQ(settings->sound.budget.voices, 100u);
  EXPECT_EQ(settings->sound.budget.buses, 50u);
  EXPECT_EQ(settings->sound.budget.longestContact, 0.02);
  EXPECT_EQ(settings->sound.fullScale, 8);
  ASSERT_TRUE(settings->sound.limiter);
  EXPECT_EQ(settings->sound.limiter->ceiling, 0.75F);
  EXPECT_EQ(settings->world.restSpeed, 0.01);
  EXPECT_EQ(settings->sound.clock, SoundClock::simulation);
  EXPECT_EQ(settings->sound.synth.impulse, ImpulseChoice::applied);
  EXPECT_EQ(settings->world.radiators, RadiatorChoice::equivalentSphere);
  EXPECT_FALSE(settings->sound.synth.doppler);
  EXPECT_EQ(settings->sound.budget.ringingBodies, 5u);
  EXPECT_EQ(settings->sound.budget.modes, 6u);
  EXPECT_EQ(settings->sound.listeners.size(), 1u);  // the default listener
}

// The listeners of a later version are larger, and so farther apart in memory.
TEST(CStructs, ListenersAreFoundBySize) {
  struct Later {
    carom_listener known = defaultListener();
    double more = 0.0;
  };
  std::array<Later, 2> ears;
  for (Later& ear : ears)
    ear.known.size = sizeof(Later);
  ears[0].known.format = CAROM_LISTENER_COINCIDENT_PAIR;
  ears[1].known.name = "second";
  ears[1].known.format = CAROM_LISTENER_SPACED_PAIR;
  set(ears[1].known.position, {1, 2, 3});
  set(ears[1].known.orientation, {0, 1, 0, 0});
  ears[1].known.spacing = 0.17;
  ears[1].known.half_angle = 0.9;
  ears[1].known.pattern = 0.5;
  carom_settings given = defaultSettings();
  given.listeners = &ears[0].known;
  given.listener_count = ears.size();
  const Result<CSettings> settings = settingsFrom(&given);
  ASSERT_TRUE(settings);
  ASSERT_EQ(settings->sound.listeners.size(), 2u);
  EXPECT_EQ(settings->sound.listeners[0].format, ListenerFormat::coincidentPair);
  const Listener& second = settings->sound.listeners[1];
  EXPECT_EQ(second.name, "second");
  EXPECT_EQ(second.format, ListenerFormat::spacedPair);
  EXPECT_EQ(second.position, Vec3(1, 2, 3));
  EXPECT_EQ(second.orientation.y(), 1);
  EXPECT_EQ(second.spacing, 0.17);
  EXPECT_EQ(second.halfAngle, 0.9);
  EXPECT_EQ(second.pattern, 0.5);
}

TEST(CStructs, EveryNumberOfStatisticsArrives) {
  SoundStatistics given;
  given.events = 1;
  given.immovable = 2;
  given.rejected = 3;
  given.inaudible = 4;
  given.stolen = 5;
  given.overBudget = 6;
  given.noBus = 7;
  given.tooLong = 8;
  given.skipped = 9;
  given.queueFaults = 10;
  given.late = 11;
  given.stalls = 12;
  given.jumps = 13;
  given.voices = 14;
  given.buses = 15;
  given.cpuShare = 16;
  given.worstBlock = 17;
  given.gainReduction = 18;
  given.solvedShapes = 19;
  given.shapesSolvedInStep = 20;
  given.unsolvedBodies = 21;
  given.links = 22;
  given.unsupportedContacts = 23;
  given.rings = 24;
  given.modalVoicesExhausted = 25;
  given.ringing = 26;
  given.modes = 27;
  const carom_statistics told = toC(given);
  EXPECT_EQ(told.events, 1u);
  EXPECT_EQ(told.immovable, 2u);
  EXPECT_EQ(told.rejected, 3u);
  EXPECT_EQ(told.inaudible, 4u);
  EXPECT_EQ(told.stolen, 5u);
  EXPECT_EQ(told.over_budget, 6u);
  EXPECT_EQ(told.no_bus, 7u);
  EXPECT_EQ(told.too_long, 8u);
  EXPECT_EQ(told.skipped, 9u);
  EXPECT_EQ(told.queue_faults, 10u);
  EXPECT_EQ(told.late, 11u);
  EXPECT_EQ(told.stalls, 12u);
  EXPECT_EQ(told.jumps, 13u);
  EXPECT_EQ(told.voices, 14u);
  EXPECT_EQ(told.buses, 15u);
  EXPECT_EQ(told.cpu_share, 16);
  EXPECT_EQ(told.worst_block, 17);
  EXPECT_EQ(told.gain_reduction, 18);
  EXPECT_EQ(told.solved_shapes, 19u);
  EXPECT_EQ(told.shapes_solved_late, 20u);
  EXPECT_EQ(told.unsolved_bodies, 21u);
  EXPECT_EQ(told.links, 22u);
  EXPECT_EQ(told.unsupported_contacts, 23u);
  EXPECT_EQ(told.rings, 24u);
  EXPECT_EQ(told.modal_voices_exhausted, 25u);
  EXPECT_EQ(told.ringing, 26u);
  EXPECT_EQ(told.modes, 27u);
}

TEST(CStructs, EveryNumberOfAMaterialArrivesAndComesBack) {
  carom_material given = {};
  given.size = sizeof given;
  given.name = "bronze";
  given.density = 1;
  given.youngs_modulus = 2;
  given.poissons_ratio = 3;
  given.restitution = 4;
  given.damping_alpha = 5;
  given.damping_beta = 6;
  const Result<Material> material = materialFrom(&given);
  ASSERT_TRUE(material);
  EXPECT_EQ(*material, (Material{.name = "bronze",
                                 .density = 1,
                                 .youngsModulus = 2,
                                 .poissonsRatio = 3,
                                 .restitution = 4,
                                 .dampingAlpha = 5,
                                 .dampingBeta = 6,
                                 .roughness = findMaterial("bronze")->roughness}));
  const carom_material told = toC(*material);
  EXPECT_STREQ(told.name, "bronze");
  EXPECT_EQ(told.density, 1);
  EXPECT_EQ(told.youngs_modulus, 2);
  EXPECT_EQ(told.poissons_ratio, 3);
  EXPECT_EQ(told.restitution, 4);
  EXPECT_EQ(told.damping_alpha, 5);
  EXPECT_EQ(told.damping_beta, 6);
}

// The sizes were computed by a compiler from the header of that version; existing programs contain
// them.
TEST(CStructs, OfTheFirstVersionHaveTheSizesThatProgramsWereCompiledWith) {
  if (sizeof(void*) != 8) GTEST_SKIP() << "counted for 64 bits";
  EXPECT_EQ(kSizes<carom_settings>.first, 144u);
  EXPECT_EQ(kSizes<carom_material>.first, 48u);
  EXPECT_EQ(kSizes<carom_statistics>.first, 192u);
  EXPECT_EQ(kSizes<carom_listener>.first, 104u);
  EXPECT_EQ(kSizes<carom_body>.first, 184u);
  EXPECT_EQ(kSizes<carom_event>.first, 264u);
}

}  // namespace
}  // namespace carom
