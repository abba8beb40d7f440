#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/run/host_run.h"
#include "tests/audio/meshes.h"
#include "tests/audio/recoils.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/random.h"

// Bodies and settings of a host's run, on their way through a file.

namespace carom::test {
namespace {

using audio::BodyForm;
using audio::HostBody;
using audio::HostDecoder;
using audio::HostEncoder;
using audio::HostWorld;
using testing::HasSubstr;
using testing::SizeIs;

std::shared_ptr<const SurfaceTexture> someTexture() {
  Random random(3);
  std::vector<SurfaceTexture::Slope> slopes(std::size_t{32} * 16);
  for (SurfaceTexture::Slope& slope : slopes)
    slope = {static_cast<float>(random.between(-0.3, 0.4)),
             static_cast<float>(random.between(-0.2, 0.1))};
  return std::make_shared<const SurfaceTexture>(
      *SurfaceTexture::ofSlopes({32, 16}, {1e-3, 2e-3}, std::move(slopes)));
}

std::shared_ptr<const TextureCoordinates> someCoordinates() {
  const SurfaceMesh mesh = boxMesh({0.1, 0.2, 0.3});
  Random random(4);
  std::vector<TextureCoordinates::Corners> corners(mesh.triangles.size());
  for (auto& triangle : corners)
    for (Vec2& corner : triangle)
      corner = {random.between(0.0, 1.0), random.between(0.0, 1.0)};
  return std::make_shared<const TextureCoordinates>(*TextureCoordinates::of(mesh, corners));
}

/// A body with everything that a body can have.
HostBody richBody() {
  HostBody body;
  body.id = 3;
  body.name = "the \"bell\"";
  body.sound.material = *findMaterial("wood");
  body.sound.material.roughness = {2e-6, 3e-4, 0.7};
  body.sound.mass = 0.3;
  body.sound.radius = 0.07;
  body.sound.edgeRadius = 5e-4;
  body.sound.shape = std::make_shared<const RigidRadiator>(ellipsoidRadiator({0.1, 0.2, 0.3}));
  body.sound.inverseInertia << 1.0, 0.1, 0.2, 0.1, 2.0, 0.3, 0.2, 0.3, 3.0;
  body.sound.texture = someTexture();
  body.sound.textureCoordinates = someCoordinates();
  body.sound.modal = boxOf({{900.0, 20.0}, {2100.0, 50.0}});
  body.sound.modalOrigin = Vec3(0.01, 0.02, 0.03);
  body.sound.recoil = std::make_shared<const RigidRecoil>(someRecoil(0.3, 5));
  body.form = {.kind = BodyForm::Kind::mesh,
               .size = {1.0, 2.0, 3.0},
               .offset = -0.5,
               .mesh = std::make_shared<const SurfaceMesh>(boxMesh({0.1, 0.2, 0.3}))};
  return body;
}

std::vector<std::byte> encoded(HostEncoder& encoder, const HostBody& body) {
  std::vector<std::byte> bytes;
  EXPECT_TRUE(encoder.add(body, bytes));
  return bytes;
}

TEST(HostRecords, OfBodiesComeBackWithTheSameBits) {
  const HostBody body = richBody();
  HostEncoder encoder;
  const std::vector<std::byte> bytes = encoded(encoder, body);
  HostDecoder decoder;
  const auto bodies = decoder.take(bytes);
  ASSERT_TRUE(bodies) << bodies.error().message;
  ASSERT_THAT(*bodies, SizeIs(1));
  const HostBody& read = bodies->front();
  EXPECT_EQ(read.id, 3U);
  EXPECT_EQ(read.name, body.name);
  EXPECT_EQ(read.sound.material, body.sound.material);
  EXPECT_EQ(read.sound.mass, 0.3);
  EXPECT_EQ(read.sound.radius, 0.07);
  EXPECT_EQ(read.sound.edgeRadius, 5e-4);
  EXPECT_EQ(read.sound.inverseInertia, body.sound.inverseInertia);
  EXPECT_EQ(read.sound.modalOrigin, body.sound.modalOrigin);
  EXPECT_EQ(read.sound.shape->addedVolume, body.sound.shape->addedVolume);
  EXPECT_EQ(read.sound.shape->volume, body.sound.shape->volume);
  EXPECT_EQ(read.sound.recoil->poles, body.sound.recoil->poles);
  EXPECT_EQ(read.sound.recoil->residues, body.sound.recoil->residues);
  EXPECT_EQ(read.sound.modal->shapes, body.sound.modal->shapes);
  EXPECT_EQ(read.sound.modal->modes[1].frequency, 2100.0);
  EXPECT_EQ(read.form.kind, BodyForm::Kind::mesh);
  EXPECT_EQ(*read.form.mesh, *body.form.mesh);
  EXPECT_EQ(read.form.offset, -0.5);
  Random random(7);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec2 at(random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    const double width = random.between(0.0, 0.02);
    EXPECT_EQ(read.sound.texture->slope(at, width), body.sound.texture->slope(at, width));
    const Vec3 point(random.between(-0.1, 0.1), random.between(-0.2, 0.2), 0.3);
    EXPECT_EQ(read.sound.textureCoordinates->at(point).at,
              body.sound.textureCoordinates->at(point).at);
  }
  HostEncoder again;
  EXPECT_EQ(encoded(again, read), bytes);
}

TEST(HostRecords, OfRoughTexturesComeBackWithTheirScale) {
  HostBody body;
  body.sound.material = *findMaterial("steel");
  body.sound.texture =
      std::make_shared<const SurfaceTexture>(*SurfaceTexture::rough({1e-6, 2e-4, 0.8}, 11));
  HostEncoder encoder;
  HostDecoder decoder;
  const auto bodies = decoder.take(encoded(encoder, body));
  ASSERT_TRUE(bodies) << bodies.error().message;
  const SurfaceTexture& read = *bodies->front().sound.texture;
  EXPECT_EQ(read.texel(), body.sound.texture->texel());
  for (const double place : {0.0, 1e-3, 0.7})
    EXPECT_EQ(read.slope({place, 0.3}, 1e-4), body.sound.texture->slope({place, 0.3}, 1e-4));
}

TEST(HostRecords, HoldWhatBodiesShareOnce) {
  HostBody body = richBody();
  HostEncoder encoder;
  const std::vector<std::byte> first = encoded(encoder, body);
  body.id = 4;
  const std::vector<std::byte> second = encoded(encoder, body);
  EXPECT_LT(second.size(), 500U);
  HostDecoder decoder;
  const auto one = decoder.take(first);
  const auto other = decoder.take(second);
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->front().sound.modal, other->front().sound.modal);
  EXPECT_EQ(one->front().form.mesh, other->front().form.mesh);
  EXPECT_FALSE(HostDecoder().take(second));  // of models that it does not know
}

/// A world none of whose settings is the default.
HostWorld richWorld() {
  HostWorld world;
  SynthSettings& synth = world.synth;
  synth.sampleRate = 44100.0;
  synth.impulse = ImpulseChoice::applied;
  synth.medium = {1.3, 330.0, 280.0, 0.3, 9e4};
  synth.audibleThreshold = 1e-5;
  synth.dissipative = true;
  synth.modalRadiation = ModalRadiation::monopole;
  synth.ringingContact = RingingContact::pressed;
  synth.contactLoss = 0.3;
  synth.doppler = false;
  synth.airAbsorption = false;
  synth.room.reflectors = {{Vec3::UnitY(), -0.3, {{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}}}};
  synth.room.order = 0;
  synth.reverb = ReverbSettings{.volume = 50.0,
                                .surface = 90.0,
                                .decayTimes = {1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7},
                                .decayTimeAt16kHz = 0.5,
                                .includesAir = false,
                                .onset = 0.02,
                                .gain = 0.7,
                                .speedOfSound = 330.0,
                                .silence = 1e-6};
  synth.comparison = {PulseShape::gaussian, Sampling::naive, Radiation::compact};
  synth.lasting = LastingDetail::heard;
  synth.slideVoices = 7;
  synth.stems = true;
  Listener listener;
  listener.name = "left";
  listener.position = {1.0, 2.0, 3.0};
  listener.orientation = Quat(0.5, 0.5, 0.5, 0.5);
  listener.format = ListenerFormat::coincidentPair;
  listener.spacing = 0.2;
  listener.halfAngle = 0.6;
  listener.pattern = 0.4;
  world.listeners = {listener, Listener{"right"}};
  world.paths = {{{0.5, {1.0, 2.0, 4.0}, Quat::Identity()}}, {}};
  world.hasOwnHeads = true;
  world.begin = 12.5;
  world.duration = 3.25;
  world.bodies = 9;
  return world;
}

TEST(HostRecords, OfWorldsComeBackWhole) {
  const HostWorld world = richWorld();
  const auto read = audio::decodedWorld(audio::encodedWorld(world));
  ASSERT_TRUE(read) << read.error().message;
  const SynthSettings& synth = read->synth;
  EXPECT_EQ(synth.sampleRate, 44100.0);
  EXPECT_EQ(synth.impulse, ImpulseChoice::applied);
  EXPECT_EQ(synth.medium, world.synth.medium);
  EXPECT_EQ(synth.audibleThreshold, 1e-5);
  EXPECT_TRUE(synth.dissipative);
  EXPECT_EQ(synth.modalRadiation, ModalRadiation::monopole);
  EXPECT_EQ(synth.ringingContact, RingingContact::pressed);
  EXPECT_EQ(synth.contactLoss, 0.3);
  EXPECT_FALSE(synth.doppler || synth.airAbsorption);
  ASSERT_THAT(synth.room.reflectors, SizeIs(1));
  EXPECT_EQ(synth.room.order, 0);
  EXPECT_EQ(synth.room.reflectors[0].offset, -0.3);
  EXPECT_EQ(synth.room.reflectors[0].absorption.coefficients[6], 0.7);
  ASSERT_TRUE(synth.reverb);
  EXPECT_EQ(synth.reverb->volume, 50.0);
  EXPECT_EQ(synth.reverb->surface, 90.0);
  EXPECT_EQ(synth.reverb->decayTimes, world.synth.reverb->decayTimes);
  EXPECT_EQ(synth.reverb->decayTimeAt16kHz, 0.5);
  EXPECT_FALSE(synth.reverb->includesAir);
  EXPECT_EQ(synth.reverb->onset, 0.02);
  EXPECT_EQ(synth.reverb->gain, 0.7);
  EXPECT_EQ(synth.reverb->speedOfSound, 330.0);
  EXPECT_EQ(synth.reverb->silence, 1e-6);
  EXPECT_EQ(synth.comparison.pulse, PulseShape::gaussian);
  EXPECT_EQ(synth.comparison.sampling, Sampling::naive);
  EXPECT_EQ(synth.comparison.radiation, Radiation::compact);
  EXPECT_EQ(synth.lasting, LastingDetail::heard);
  EXPECT_EQ(synth.slideVoices, 7U);
  EXPECT_TRUE(synth.stems);
  ASSERT_THAT(read->listeners, SizeIs(2));
  const Listener& listener = read->listeners.front();
  EXPECT_EQ(listener.name, "left");
  EXPECT_EQ(listener.position, Vec3(1.0, 2.0, 3.0));
  EXPECT_EQ(listener.orientation.x(), 0.5);
  EXPECT_EQ(listener.format, ListenerFormat::coincidentPair);
  EXPECT_EQ(listener.spacing, 0.2);
  EXPECT_EQ(listener.halfAngle, 0.6);
  EXPECT_EQ(listener.pattern, 0.4);
  EXPECT_FALSE(read->listeners.back().pattern);
  ASSERT_THAT(read->paths.front(), SizeIs(1));
  EXPECT_EQ(read->paths.front().front().position.z(), 4.0);
  EXPECT_TRUE(read->hasOwnHeads);
  EXPECT_EQ(read->begin, 12.5);
  EXPECT_EQ(read->duration, 3.25);
  EXPECT_EQ(read->bodies, 9U);
}

TEST(HostRecords, OfLongPathsAreInPieces) {
  HostWorld world = richWorld();
  const std::vector<ListenerPose> few = world.paths.front();
  EXPECT_TRUE(audio::takeLongPaths(world).empty());
  EXPECT_THAT(world.paths.front(), SizeIs(few.size()));
  std::vector<ListenerPose> path;
  for (std::size_t step = 1; step <= audio::kMostPiecePoses + 5; ++step)
    path.push_back({1e-3 * static_cast<double>(step), few.front().position, Quat::Identity()});
  world.paths.back() = path;
  const std::vector<audio::PathPiece> pieces = audio::takeLongPaths(world);
  ASSERT_THAT(pieces, SizeIs(3));  // one of the first listener, two of the second
  EXPECT_TRUE(world.paths.front().empty() && world.paths.back().empty());
  std::vector<audio::PathPiece> read;
  for (const audio::PathPiece& piece : pieces)
    read.push_back(*audio::decodedPath(audio::encodedPath(piece)));
  ASSERT_TRUE(audio::putBack(read, world));
  EXPECT_THAT(world.paths.front(), SizeIs(few.size()));
  ASSERT_THAT(world.paths.back(), SizeIs(path.size()));
  EXPECT_EQ(world.paths.back().back().time, path.back().time);

  HostWorld other = richWorld();
  EXPECT_FALSE(audio::putBack({{2, few}}, other));   // of no listener
  EXPECT_FALSE(audio::putBack({{0, path}}, other));  // behind it comes what is earlier
  std::vector<std::byte> cut = audio::encodedPath({0, few});
  cut.pop_back();
  EXPECT_FALSE(audio::decodedPath(cut));
}

TEST(HostRecords, RefuseWhatNoHostWrites) {
  const auto refusal = [](const HostWorld& world) {
    const auto read = audio::decodedWorld(audio::encodedWorld(world));
    return read ? std::string("none") : read.error().message;
  };
  HostWorld world = richWorld();
  world.duration = std::nan("");
  EXPECT_THAT(refusal(world), HasSubstr("duration"));
  world = richWorld();
  world.synth.room.order = 33;
  EXPECT_THAT(refusal(world), HasSubstr("order above 32"));
  world = richWorld();
  world.paths.front().front().time = 0.0;
  EXPECT_THAT(refusal(world), HasSubstr("path"));
  world = richWorld();
  world.listeners.front().position.x() = std::nan("");
  EXPECT_THAT(refusal(world), HasSubstr("listener"));
  for (const double duration : {1.1e7, 1e300, std::numeric_limits<double>::infinity()}) {
    world = richWorld();
    world.duration = duration;
    EXPECT_THAT(refusal(world), HasSubstr("above 1e7 s"));
  }
  world = richWorld();
  world.listeners.resize(257);
  world.paths.resize(257);
  EXPECT_THAT(refusal(world), HasSubstr("more than 256 listeners"));

  const auto refused = [](const HostBody& body) {
    HostEncoder encoder;
    HostDecoder decoder;
    const auto read = decoder.take(encoded(encoder, body));
    return read ? std::string("none") : read.error().message;
  };
  EXPECT_EQ(refused(richBody()), "none");
  HostBody body = richBody();
  body.sound.mass = -1.0;
  EXPECT_THAT(refused(body), HasSubstr("mass must be positive"));
  body = richBody();
  body.form.mesh = nullptr;
  EXPECT_THAT(refused(body), HasSubstr("a form that there is not"));
  body = richBody();
  SurfaceMesh torn = *body.form.mesh;
  torn.triangles.front()[1] = 1000;
  body.form.mesh = std::make_shared<const SurfaceMesh>(torn);
  EXPECT_THAT(refused(body), HasSubstr("a mesh that is none"));
}

TEST(HostRecords, ThatWereCutOrChangedAreReadOrRefusedAndNothingElse) {
  HostEncoder encoder;
  const std::vector<std::byte> body = encoded(encoder, richBody());
  const std::vector<std::byte> world = audio::encodedWorld(richWorld());
  std::minstd_rand random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    for (const std::vector<std::byte>* whole : {&body, &world}) {
      std::vector<std::byte> changed = *whole;
      changed[random() % changed.size()] ^= static_cast<std::byte>(1U << (random() % 8));
      if (trial % 2 == 0) changed.resize(random() % changed.size());
      if (whole == &body)
        (void)HostDecoder().take(changed);
      else
        (void)audio::decodedWorld(changed);
    }
  }
}

}  // namespace
}  // namespace carom::test
