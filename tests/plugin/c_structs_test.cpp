#include "plugin/c_api/c_structs.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "plugin/c_api/c_handles.h"
#include "plugin/c_api/c_settings.h"

namespace carom {

using namespace plugin;

namespace {

template <std::size_t count>
void set(double (&field)[count], std::initializer_list<double> values) {
  std::copy(values.begin(), values.end(), field);
}

TEST(CStructs, EveryFieldOfAnEventArrives) {
  carom_event input = defaultEvent();
  input.time = 1.5;
  input.body = 2;
  input.other = 3;
  set(input.impulse, {4, 5, 6});
  set(input.applied_impulse, {7, 8, 9});
  input.has_applied_impulse = 1;
  set(input.position, {10, 11, 12});
  set(input.normal, {13, 14, 15});
  input.approach_speed = 16;
  input.effective_mass = 17;
  input.radius = 18;
  input.other_radius = 19;
  set(input.body_position, {20, 21, 22});
  set(input.body_orientation, {23, 24, 25, 26});
  set(input.body_velocity, {27, 28, 29});
  set(input.body_angular_velocity, {30, 31, 32});
  input.has_other_pose = 1;
  set(input.other_position, {33, 34, 35});
  set(input.other_orientation, {36, 37, 38, 39});
  const Result<ImpulseEvent> event = eventFrom(&input);
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
  EXPECT_TRUE(event->hasOtherPose);
  EXPECT_EQ(event->otherPosition, Vec3(33, 34, 35));
  EXPECT_EQ(event->otherOrientation.vec(), Vec3(36, 37, 38));
  EXPECT_EQ(event->otherOrientation.w(), 39);
}

TEST(CStructs, EveryFieldOfAContactArrives) {
  carom_contact input = defaultContact();
  input.time = 1.5;
  input.duration = 2.5;
  input.phase = CAROM_CONTACT_END;
  input.body = 3;
  input.other = 4;
  set(input.normal, {5, 6, 7});
  set(input.position, {8, 9, 10});
  input.normal_load = 11;
  set(input.applied_impulse, {12, 13, 14});
  input.radius = 15;
  input.other_radius = 16;
  set(input.slip_velocity, {17, 18, 19});
  set(input.rolling_velocity, {20, 21, 22});
  set(input.body_position, {23, 24, 25});
  set(input.body_orientation, {26, 27, 28, 29});
  set(input.body_velocity, {30, 31, 32});
  set(input.other_position, {33, 34, 35});
  set(input.other_orientation, {36, 37, 38, 39});
  set(input.other_velocity, {40, 41, 42});
  set(input.path_start, {43, 44, 45});
  set(input.path_end, {46, 47, 48});
  set(input.other_path_start, {49, 50, 51});
  set(input.other_path_end, {52, 53, 54});
  const Result<ContactState> contact = contactFrom(&input);
  ASSERT_TRUE(contact);
  EXPECT_EQ(contact->time, 1.5);
  EXPECT_EQ(contact->duration, 2.5);
  EXPECT_EQ(contact->phase, ContactPhase::end);
  EXPECT_EQ(contact->body, 3u);
  EXPECT_EQ(contact->other, 4u);
  EXPECT_EQ(contact->normal, Vec3(5, 6, 7));
  EXPECT_EQ(contact->position, Vec3(8, 9, 10));
  EXPECT_EQ(contact->normalLoad, 11);
  EXPECT_EQ(contact->appliedImpulse, Vec3(12, 13, 14));
  EXPECT_EQ(contact->radius, 15);
  EXPECT_EQ(contact->otherRadius, 16);
  EXPECT_EQ(contact->slipVelocity, Vec3(17, 18, 19));
  EXPECT_EQ(contact->rollingVelocity, Vec3(20, 21, 22));
  EXPECT_EQ(contact->bodyPosition, Vec3(23, 24, 25));
  EXPECT_EQ(contact->bodyOrientation.vec(), Vec3(26, 27, 28));
  EXPECT_EQ(contact->bodyOrientation.w(), 29);
  EXPECT_EQ(contact->bodyVelocity, Vec3(30, 31, 32));
  EXPECT_EQ(contact->otherPosition, Vec3(33, 34, 35));
  EXPECT_EQ(contact->otherOrientation.vec(), Vec3(36, 37, 38));
  EXPECT_EQ(contact->otherOrientation.w(), 39);
  EXPECT_EQ(contact->otherVelocity, Vec3(40, 41, 42));
  EXPECT_EQ(contact->pathStart, Vec3(43, 44, 45));
  EXPECT_EQ(contact->pathEnd, Vec3(46, 47, 48));
  EXPECT_EQ(contact->otherPathStart, Vec3(49, 50, 51));
  EXPECT_EQ(contact->otherPathEnd, Vec3(52, 53, 54));
}

TEST(CStructs, DefaultContactIsThatOfTheLibrary) {
  const carom_contact input = defaultContact();
  const Result<ContactState> contact = contactFrom(&input);
  ASSERT_TRUE(contact);
  const ContactState expected;
  EXPECT_EQ(contact->phase, expected.phase);
  EXPECT_EQ(contact->normal, expected.normal);
  EXPECT_EQ(contact->radius, expected.radius);
  EXPECT_EQ(contact->otherRadius, expected.otherRadius);
  EXPECT_EQ(contact->bodyOrientation.coeffs(), expected.bodyOrientation.coeffs());
  EXPECT_EQ(contact->otherOrientation.coeffs(), expected.otherOrientation.coeffs());
}

TEST(CStructs, EveryFieldOfARoomArrives) {
  std::array<carom_reflector, 2> walls = {defaultReflector(), defaultReflector()};
  set(walls[0].normal, {0, 1, 0});
  walls[0].offset = 2;
  set(walls[0].absorption, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  walls[1].surface = "concrete";
  carom_room input = defaultRoom();
  EXPECT_EQ(input.order, Room{}.order);
  input.reflectors = walls.data();
  input.reflector_count = walls.size();
  input.order = 3;
  const Result<Room> room = roomFrom(&input);
  ASSERT_TRUE(room);
  EXPECT_EQ(room->order, 3);
  ASSERT_EQ(room->reflectors.size(), 2u);
  EXPECT_EQ(room->reflectors[0].normal, Vec3(0, 1, 0));
  EXPECT_EQ(room->reflectors[0].offset, 2);
  EXPECT_EQ(room->reflectors[0].absorption.coefficients,
            (std::array{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}));
  EXPECT_EQ(room->reflectors[1].normal, Reflector{}.normal);
  EXPECT_EQ(room->reflectors[1].absorption.coefficients,
            findSurface("concrete")->absorption.coefficients);
}

TEST(CStructs, EveryFieldOfAReverberationArrivesAndComesBack) {
  const ReverbSettings untouched;
  carom_reverb input = defaultReverb();
  EXPECT_EQ(input.gain, untouched.gain);
  EXPECT_EQ(input.silence, untouched.silence);
  EXPECT_EQ(input.speed_of_sound, untouched.speedOfSound);
  input.volume = 1;
  input.surface = 2;
  set(input.decay_times, {3, 4, 5, 6, 7, 8, 9});
  input.onset = 10;
  input.gain = 11;
  input.speed_of_sound = 12;
  input.silence = 13;
  input.decay_time_16khz = 14;
  input.includes_air = 0;
  const Result<ReverbSettings> reverb = reverbFrom(&input);
  ASSERT_TRUE(reverb);
  EXPECT_EQ(reverb->volume, 1);
  EXPECT_EQ(reverb->surface, 2);
  EXPECT_EQ(reverb->decayTimes, (DecayTimes{3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(reverb->onset, 10);
  EXPECT_EQ(reverb->gain, 11);
  EXPECT_EQ(reverb->speedOfSound, 12);
  EXPECT_EQ(reverb->silence, 13);
  EXPECT_EQ(reverb->decayTimeAt16kHz, 14);
  EXPECT_FALSE(reverb->includesAir);
  const carom_reverb back = toC(*reverb);
  EXPECT_EQ(back.size, input.size);
  EXPECT_EQ(back.volume, 1);
  EXPECT_EQ(back.surface, 2);
  EXPECT_TRUE(std::equal(back.decay_times, back.decay_times + CAROM_BAND_COUNT, input.decay_times));
  EXPECT_EQ(back.onset, 10);
  EXPECT_EQ(back.gain, 11);
  EXPECT_EQ(back.speed_of_sound, 12);
  EXPECT_EQ(back.silence, 13);
  EXPECT_EQ(back.decay_time_16khz, 14);
  EXPECT_EQ(back.includes_air, 0);
}

TEST(CStructs, EveryFieldOfASurfaceComesBack) {
  const Surface& surface = *findSurface("concrete");
  const carom_surface told = toC(surface);
  EXPECT_EQ(told.size, sizeof told);
  EXPECT_EQ(told.name, surface.name);
  EXPECT_EQ(told.source, surface.source);
  EXPECT_TRUE(std::equal(told.absorption, told.absorption + CAROM_BAND_COUNT,
                         surface.absorption.coefficients.begin()));
}

TEST(CStructs, EveryPartOfABodySoundArrives) {
  carom_body_sound input = defaultBodySound();
  Result<BodySound> sound = bodySoundFrom(&input);
  ASSERT_TRUE(sound);
  EXPECT_FALSE(sound->material || sound->modes || sound->texture || sound->textureCoordinates ||
               sound->silent);
  const carom_modes modes = {std::make_shared<const ModalModel>()};
  Result<SurfaceTexture> rough = SurfaceTexture::rough({1e-6, 1e-4, 0.8}, 1);
  ASSERT_TRUE(rough);
  const carom_texture texture = {std::make_shared<const SurfaceTexture>(*std::move(rough))};
  const SurfaceMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  Result<TextureCoordinates> placed =
      TextureCoordinates::of(triangle, {{Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)}});
  ASSERT_TRUE(placed);
  const carom_texture_coordinates coordinates = {
      std::make_shared<const TextureCoordinates>(*std::move(placed))};
  input.material = "glass";
  input.modes = &modes;
  input.texture = &texture;
  input.texture_coordinates = &coordinates;
  input.silent = CAROM_YES;
  sound = bodySoundFrom(&input);
  ASSERT_TRUE(sound);
  EXPECT_EQ(*sound->material->material(), *findMaterial("glass"));
  EXPECT_EQ(sound->modes, modes.model);
  EXPECT_EQ(sound->texture, texture.texture);
  EXPECT_EQ(sound->textureCoordinates, coordinates.coordinates);
  EXPECT_EQ(sound->silent, true);
}

TEST(CStructs, EveryPartOfABodySoundCanBeNone) {
  carom_material own = toC(*findMaterial("glass"));
  own.density = 1234;
  carom_body_sound input = defaultBodySound();
  input.own_material = &own;
  input.no_modes = 1;
  input.no_texture = 1;
  input.no_texture_coordinates = 1;
  input.silent = CAROM_NO;
  const Result<BodySound> sound = bodySoundFrom(&input);
  ASSERT_TRUE(sound);
  EXPECT_EQ(sound->material->material()->density, 1234);
  EXPECT_TRUE(sound->modes && *sound->modes == nullptr);
  EXPECT_TRUE(sound->texture && *sound->texture == nullptr);
  EXPECT_TRUE(sound->textureCoordinates && *sound->textureCoordinates == nullptr);
  EXPECT_EQ(sound->silent, false);
}

TEST(CStructs, EveryFieldOfANormalMapArrives) {
  carom_normal_map input = defaultNormalMap();
  ASSERT_TRUE(normalMapFrom(&input));
  EXPECT_EQ(*normalMapFrom(&input), NormalMapSettings{});
  EXPECT_EQ(*normalMapFrom(nullptr), NormalMapSettings{});
  set(input.picture_size, {1.5, 2.5});
  input.strength = 3;
  input.green_is_down = 1;
  const Result<NormalMapSettings> map = normalMapFrom(&input);
  ASSERT_TRUE(map);
  EXPECT_EQ(*map, (NormalMapSettings{.size = {1.5, 2.5}, .greenIsDown = true, .strength = 3}));
}

TEST(CStructs, EveryFieldOfAMeshArrives) {
  const std::array<double, 9> vertices = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  const std::array<std::uint32_t, 3> triangles = {2, 0, 1};
  const Result<SurfaceMesh> mesh =
      meshFrom({sizeof(carom_mesh), vertices.data(), 3, triangles.data(), 1});
  ASSERT_TRUE(mesh);
  EXPECT_EQ(*mesh, (SurfaceMesh{{{0, 1, 2}, {3, 4, 5}, {6, 7, 8}}, {{2, 0, 1}}}));
}

TEST(CStructs, DefaultsAreThoseOfTheLibrary) {
  carom_listener ears = defaultListener();
  carom_settings input = defaultSettings();
  input.listeners = &ears;
  input.listener_count = 1;
  const Result<CSettings> settings = settingsFrom(&input);
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
  EXPECT_EQ(settings->sound.budget.slidingContacts, expected.budget.slidingContacts);
  EXPECT_EQ(settings->sound.synth.comparison.pulse, expected.synth.comparison.pulse);
  EXPECT_EQ(settings->sound.synth.comparison.sampling, expected.synth.comparison.sampling);
  EXPECT_EQ(settings->sound.synth.comparison.radiation, expected.synth.comparison.radiation);
  EXPECT_EQ(settings->sound.synth.modalRadiation, expected.synth.modalRadiation);
  EXPECT_EQ(settings->sound.synth.dissipative, expected.synth.dissipative);
  EXPECT_EQ(settings->sound.synth.contactLoss, expected.synth.contactLoss);
  EXPECT_EQ(settings->sound.synth.lasting, expected.synth.lasting);
  EXPECT_EQ(settings->sound.synth.slideVoices, expected.synth.slideVoices);
  EXPECT_TRUE(settings->sound.synth.room.reflectors.empty());
  EXPECT_FALSE(settings->sound.synth.reverb);
  EXPECT_EQ(settings->sound.fullScale, expected.fullScale);
  EXPECT_EQ(settings->sound.level, expected.level);
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
  carom_settings input = defaultSettings();
  input.sample_rate = 44100;
  input.latency = 0.1;
  input.air_density = 1.1;
  input.speed_of_sound = 330;
  input.audible_threshold = 1e-3;
  input.cpu_share = 0.25;
  input.voices = 100;
  input.buses = 50;
  input.longest_contact = 0.02;
  input.full_scale = 8;
  input.limiter = 1;
  input.limiter_ceiling = 0.75;
  input.rest_speed = 0.01;
  input.clock = CAROM_CLOCK_SIMULATION;
  input.impulse = CAROM_IMPULSE_APPLIED;
  input.radiators = CAROM_RADIATORS_EQUIVALENT_SPHERE;
  input.doppler = 0;
  input.ringing_bodies = 5;
  input.modes = 6;
  input.sliding_contacts = 7;
  input.limiter_look_ahead = 0.004;
  input.limiter_release = 0.08;
  input.contact_loss = 0.3;
  input.lasting = CAROM_LASTING_EXACT;
  input.slide_voices = 3;
  input.metres_per_unit = 0.01;
  input.pulse = CAROM_PULSE_COURSE_GAUSSIAN;
  input.sampling = CAROM_SAMPLING_NAIVE;
  input.radiation = CAROM_RADIATION_COMPACT;
  input.modal_radiation = CAROM_MODAL_RADIATION_CONSTANT;
  input.ringing_contact = CAROM_RINGING_COUPLED;
  input.dissipative = 1;
  input.level = CAROM_LEVEL_AUTOMATIC;
  input.air_temperature = 280;
  input.air_humidity = 0.75;
  input.air_pressure = 9e4;
  input.air_absorption = 0;
  const carom_reflector floor = defaultReflector();
  carom_room room = defaultRoom();
  room.reflectors = &floor;
  room.reflector_count = 1;
  carom_reverb reverb = defaultReverb();
  reverb.volume = 70;
  input.room = &room;
  input.reverb = &reverb;
  const Result<CSettings> settings = settingsFrom(&input);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->sound.synth.sampleRate, 44100);
  EXPECT_EQ(settings->sound.latency, 0.1);
  EXPECT_EQ(settings->sound.synth.medium.density, 1.1);
  EXPECT_EQ(settings->sound.synth.medium.speedOfSound, 330);
  EXPECT_EQ(settings->sound.synth.medium.temperature, 280);
  EXPECT_EQ(settings->sound.synth.medium.humidity, 0.75);
  EXPECT_EQ(settings->sound.synth.medium.pressure, 9e4);
  EXPECT_FALSE(settings->sound.synth.airAbsorption);
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
  EXPECT_EQ(settings->sound.budget.slidingContacts, 7u);
  EXPECT_EQ(settings->sound.limiter->lookAhead, 0.004);
  EXPECT_EQ(settings->sound.limiter->release, 0.08);
  EXPECT_EQ(settings->sound.synth.contactLoss, 0.3);
  EXPECT_EQ(settings->sound.synth.lasting, LastingDetail::exact);
  EXPECT_EQ(settings->sound.synth.slideVoices, 3u);
  EXPECT_EQ(settings->world.metresPerUnit, 0.01);
  EXPECT_EQ(settings->sound.synth.comparison.pulse, PulseShape::courseGaussian);
  EXPECT_EQ(settings->sound.synth.comparison.sampling, Sampling::naive);
  EXPECT_EQ(settings->sound.synth.comparison.radiation, Radiation::compact);
  EXPECT_EQ(settings->sound.synth.modalRadiation, ModalRadiation::constant);
  EXPECT_TRUE(settings->sound.synth.dissipative);
  EXPECT_EQ(settings->sound.level, Level::automatic);
  EXPECT_EQ(settings->sound.synth.room.reflectors.size(), 1u);
  ASSERT_TRUE(settings->sound.synth.reverb);
  EXPECT_EQ(settings->sound.synth.reverb->volume, 70);
  EXPECT_TRUE(settings->sound.listeners.empty());  // the automatic one
}

// Each name in C is the value of the same name in C++.
TEST(CStructs, ChoicesAreThoseOfTheLibrary) {
  const auto is = [](int in_c, auto value) { return in_c == static_cast<int>(value); };
  EXPECT_TRUE(is(CAROM_CLOCK_REAL_TIME, SoundClock::realTime));
  EXPECT_TRUE(is(CAROM_CLOCK_SIMULATION, SoundClock::simulation));
  EXPECT_TRUE(is(CAROM_LEVEL_STANDARD, Level::standard));
  EXPECT_TRUE(is(CAROM_LEVEL_FIXED, Level::fixed));
  EXPECT_TRUE(is(CAROM_LEVEL_AUTOMATIC, Level::automatic));
  EXPECT_TRUE(is(CAROM_LASTING_EXACT, LastingDetail::exact));
  EXPECT_TRUE(is(CAROM_LASTING_HEARD, LastingDetail::heard));
  EXPECT_TRUE(is(CAROM_IMPULSE_PHYSICAL, ImpulseChoice::physical));
  EXPECT_TRUE(is(CAROM_IMPULSE_APPLIED, ImpulseChoice::applied));
  EXPECT_TRUE(is(CAROM_RADIATORS_SOLVED, RadiatorChoice::solved));
  EXPECT_TRUE(is(CAROM_RADIATORS_EQUIVALENT_SPHERE, RadiatorChoice::equivalentSphere));
  EXPECT_TRUE(is(CAROM_PULSE_HERTZ, PulseShape::hertz));
  EXPECT_TRUE(is(CAROM_PULSE_HALF_SINE, PulseShape::halfSine));
  EXPECT_TRUE(is(CAROM_PULSE_GAUSSIAN, PulseShape::gaussian));
  EXPECT_TRUE(is(CAROM_PULSE_MITCHELL_NETRAVALI, PulseShape::mitchellNetravali));
  EXPECT_TRUE(is(CAROM_PULSE_COURSE_GAUSSIAN, PulseShape::courseGaussian));
  EXPECT_TRUE(is(CAROM_SAMPLING_BAND_LIMITED, Sampling::bandLimited));
  EXPECT_TRUE(is(CAROM_SAMPLING_NAIVE, Sampling::naive));
  EXPECT_TRUE(is(CAROM_RADIATION_EXACT, Radiation::exact));
  EXPECT_TRUE(is(CAROM_RADIATION_COMPACT, Radiation::compact));
  EXPECT_TRUE(is(CAROM_MODAL_RADIATION_DIRECTIONAL, ModalRadiation::directional));
  EXPECT_TRUE(is(CAROM_MODAL_RADIATION_MONOPOLE, ModalRadiation::monopole));
  EXPECT_TRUE(is(CAROM_MODAL_RADIATION_CONSTANT, ModalRadiation::constant));
  EXPECT_TRUE(is(CAROM_LISTENER_MONO, ListenerFormat::mono));
  EXPECT_TRUE(is(CAROM_LISTENER_SPACED_PAIR, ListenerFormat::spacedPair));
  EXPECT_TRUE(is(CAROM_LISTENER_COINCIDENT_PAIR, ListenerFormat::coincidentPair));
  EXPECT_TRUE(is(CAROM_LISTENER_BINAURAL, ListenerFormat::binaural));
  EXPECT_TRUE(is(CAROM_CONTACT_BEGIN, ContactPhase::begin));
  EXPECT_TRUE(is(CAROM_CONTACT_DURING, ContactPhase::during));
  EXPECT_TRUE(is(CAROM_CONTACT_END, ContactPhase::end));
  EXPECT_EQ(std::size_t{CAROM_BAND_COUNT}, kBandCount);
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
  carom_settings input = defaultSettings();
  input.listeners = &ears[0].known;
  input.listener_count = ears.size();
  const Result<CSettings> settings = settingsFrom(&input);
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
  SoundStatistics input;
  input.slides = 28;
  input.inaudibleSlides = 29;
  input.undersampled = 32;
  input.peak = 33;
  input.peakSample = 34;
  input.slidesLeftOut = 30;
  input.slidesInBed = 33;
  input.maskedSlides = 34;
  input.masked = 35;
  input.silenced = 31;
  input.events = 1;
  input.immovable = 2;
  input.rejected = 3;
  input.inaudible = 4;
  input.stolen = 5;
  input.overBudget = 6;
  input.noBus = 7;
  input.tooLong = 8;
  input.skipped = 9;
  input.queueFaults = 10;
  input.late = 11;
  input.stalls = 12;
  input.jumps = 13;
  input.voices = 14;
  input.buses = 15;
  input.cpuShare = 16;
  input.worstBlock = 17;
  input.gainReduction = 18;
  input.solvedShapes = 19;
  input.shapesSolvedInStep = 20;
  input.unsolvedBodies = 21;
  input.links = 22;
  input.unsupportedContacts = 23;
  input.rings = 24;
  input.modalVoicesExhausted = 25;
  input.ringing = 26;
  input.modes = 27;
  input.rejectedNotFinite = 33;
  input.rejectedUnknownBody = 34;
  input.rejectedNoContact = 35;
  input.rejectedTooLong = 36;
  input.rejectedTooFar = 37;
  input.refusedBodies = 38;
  input.unusedAssignments = 39;
  input.shapesPending = 40;
  input.heard = 41;
  input.lost = 42;
  input.ringsLeftOut = 43;
  input.rejectedSlides = 44;
  input.silencedFrames = 45;
  input.posted = 46;
  input.waiting = 47;
  const carom_statistics told = toC(input);
  EXPECT_EQ(told.events, 1u);
  EXPECT_EQ(told.heard, 41u);
  EXPECT_EQ(told.lost, 42u);
  EXPECT_EQ(told.rings_left_out, 43u);
  EXPECT_EQ(told.rejected_slides, 44u);
  EXPECT_EQ(told.silenced_frames, 45u);
  EXPECT_EQ(told.posted, 46u);
  EXPECT_EQ(told.waiting, 47u);
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
  EXPECT_EQ(told.slides, 28u);
  EXPECT_EQ(told.inaudible_slides, 29u);
  EXPECT_EQ(told.undersampled, 32u);
  EXPECT_EQ(told.peak, 33);
  EXPECT_EQ(told.peak_sample, 34);
  EXPECT_EQ(told.slides_left_out, 30u);
  EXPECT_EQ(told.slides_in_bed, 33u);
  EXPECT_EQ(told.masked_slides, 34u);
  EXPECT_EQ(told.masked, 35u);
  EXPECT_EQ(told.silenced, 31u);
  EXPECT_EQ(told.rejected_not_finite, 33u);
  EXPECT_EQ(told.rejected_unknown_body, 34u);
  EXPECT_EQ(told.rejected_no_contact, 35u);
  EXPECT_EQ(told.rejected_too_long, 36u);
  EXPECT_EQ(told.rejected_too_far, 37u);
  EXPECT_EQ(told.refused_bodies, 38u);
  EXPECT_EQ(told.unused_assignments, 39u);
  EXPECT_EQ(told.shapes_pending, 40u);
}

TEST(CStructs, EveryNumberOfAMaterialArrivesAndComesBack) {
  carom_material input = {};
  input.size = sizeof input;
  input.name = "bronze";
  input.density = 1;
  input.youngs_modulus = 2;
  input.poissons_ratio = 3;
  input.restitution = 4;
  input.damping_alpha = 5;
  input.damping_beta = 6;
  input.loss_factor = 0.5;
  input.loss_exponent = -1.5;
  input.thermal_expansion = 7e-6;
  input.thermal_conductivity = 8;
  input.heat_capacity = 9;
  const Result<Material> material = materialFrom(&input);
  ASSERT_TRUE(material);
  EXPECT_EQ(*material, (Material{.name = "bronze",
                                 .density = 1,
                                 .youngsModulus = 2,
                                 .poissonsRatio = 3,
                                 .restitution = 4,
                                 .dampingAlpha = 5,
                                 .dampingBeta = 6,
                                 .roughness = findMaterial("bronze")->roughness,
                                 .lossFactor = 0.5,
                                 .lossExponent = -1.5,
                                 .thermal = {7e-6, 8, 9}}));
  const carom_material told = toC(*material);
  EXPECT_STREQ(told.name, "bronze");
  EXPECT_EQ(told.density, 1);
  EXPECT_EQ(told.youngs_modulus, 2);
  EXPECT_EQ(told.poissons_ratio, 3);
  EXPECT_EQ(told.restitution, 4);
  EXPECT_EQ(told.damping_alpha, 5);
  EXPECT_EQ(told.damping_beta, 6);
  EXPECT_EQ(told.loss_factor, 0.5);
  EXPECT_EQ(told.loss_exponent, -1.5);
  EXPECT_EQ(told.thermal_expansion, 7e-6);
  EXPECT_EQ(told.thermal_conductivity, 8);
  EXPECT_EQ(told.heat_capacity, 9);
  ASSERT_NE(told.roughness, nullptr);
  EXPECT_EQ(told.roughness->rms_height, findMaterial("bronze")->roughness.rmsHeight);
  EXPECT_EQ(told.roughness->correlation_length,
            findMaterial("bronze")->roughness.correlationLength);
  EXPECT_EQ(told.roughness->hurst, findMaterial("bronze")->roughness.hurst);
}

TEST(CStructs, RoughnessOfAMaterialIsItsOwnIfThereIsOne) {
  carom_roughness bumps = defaultRoughness();
  EXPECT_EQ(*roughnessFrom(&bumps), Roughness{});
  bumps.rms_height = 7;
  bumps.correlation_length = 8;
  bumps.hurst = 9;
  carom_material input = toC(*findMaterial("bronze"));
  input.roughness = &bumps;
  const Result<Material> material = materialFrom(&input);
  ASSERT_TRUE(material);
  EXPECT_EQ(material->roughness, (Roughness{.rmsHeight = 7, .correlationLength = 8, .hurst = 9}));
}

// The sizes were computed by a compiler from the header of that version; existing programs contain
// them.
TEST(CStructs, OfTheFirstVersionHaveTheSizesThatProgramsWereCompiledWith) {
  if (sizeof(void*) != 8) GTEST_SKIP() << "counted for 64 bits";
  EXPECT_EQ(kSizes<carom_settings>.front(), 144u);
  EXPECT_EQ(kSizes<carom_material>.front(), 48u);
  EXPECT_EQ(kSizes<carom_statistics>.front(), 192u);
  EXPECT_EQ(kSizes<carom_listener>.front(), 104u);
  EXPECT_EQ(kSizes<carom_body>.front(), 184u);
  EXPECT_EQ(kSizes<carom_event>.front(), 264u);
}

}  // namespace
}  // namespace carom
