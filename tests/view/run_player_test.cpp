#include "audio/run/run_player.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/report/report.h"
#include "lab/view/page_sound.h"
#include "lab/view/view_run.h"
#include <gtest/gtest.h>

#include "audio/propagation/hrtf.h"
#include "audio/run/playable_run.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/render.h"

// A run that is played from memory beside the rendering of its scene: two ways from the same events
// to samples.

namespace carom::lab {

using namespace audio;
using namespace scenes;

namespace {

using Planes = std::vector<std::vector<float>>;

const std::filesystem::path kLibrary = std::filesystem::path(CAROM_SOURCE_DIR) / "scenes/library";

Scene sceneOf(const std::string& name, double duration) {
  Result<Scene> scene = loadScene(kLibrary / (name + ".json"));
  EXPECT_TRUE(scene) << scene.error().message;
  scene->duration = std::min(scene->duration, duration);
  for (Listener& listener : scene->listeners)  // a head makes no difference here
    if (listener.format == ListenerFormat::binaural) listener.format = ListenerFormat::spacedPair;
  scene->headFiles.clear();
  return *std::move(scene);
}

/// Keeps the samples of a rendering.
class Ear : public RenderSink {
 public:
  Status write(std::span<const float* const> channels, std::size_t frames) override {
    planes.resize(channels.size());
    for (std::size_t channel = 0; channel < channels.size(); ++channel)
      planes[channel].insert(planes[channel].end(), channels[channel], channels[channel] + frames);
    return std::monostate{};
  }
  void add(const ImpulseEvent&, const EventSound&) override {}

  Planes planes;
};

Planes rendered(const Scene& scene) {
  Ear ear;
  const auto report = renderScene(scene, {}, ear);
  EXPECT_TRUE(report) << report.error().message;
  return std::move(ear.planes);
}

ViewRun viewOf(const Scene& scene) {
  Result<ViewRun> view = viewScene(scene);
  EXPECT_TRUE(view) << view.error().message;
  return *std::move(view);
}

RunPlayer playerOf(const PlayableRun& run, double rate = 48000.0) {
  Result<RunPlayer> player = RunPlayer::create(run, rate);
  EXPECT_TRUE(player) << player.error().message;
  return *std::move(player);
}

/// Renders in blocks of uneven sizes.
Planes played(RunPlayer& player, std::size_t frames) {
  Planes planes(player.channels(), std::vector<float>(frames));
  for (std::size_t done = 0, block = 1; done < frames; block = block * 3 % 2000 + 1) {
    const std::size_t part = std::min(block, frames - done);
    std::vector<float*> channels;
    for (std::vector<float>& plane : planes)
      channels.push_back(plane.data() + done);
    player.render(channels, part);
    done += part;
  }
  return planes;
}

double peakOf(const Planes& planes, std::size_t from = 0) {
  float peak = 0.0F;
  for (const std::vector<float>& plane : planes)
    for (std::size_t at = from; at < plane.size(); ++at)
      peak = std::max(peak, std::abs(plane[at]));
  return peak;
}

/// Returns the largest difference over the largest sample, in dB; `planes` begins at the sample
/// `from` of the others.
double difference(const Planes& planes, const Planes& others, std::size_t from = 0,
                  std::size_t skipped = 0) {
  double most = 0.0;
  for (std::size_t channel = 0; channel < planes.size(); ++channel)
    for (std::size_t at = skipped; at < planes[channel].size(); ++at)
      most =
          std::max<double>(most, std::abs(planes[channel][at] - others.at(channel).at(from + at)));
  return 20.0 * std::log10(most / peakOf(others) + 1e-30);
}

struct Case {
  const char* scene;
  double duration;  // s
};

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.scene;
}

class PlayedRuns : public testing::TestWithParam<Case> {};

TEST_P(PlayedRuns, SoundAsTheirScenes) {
  const Scene scene = sceneOf(GetParam().scene, GetParam().duration);
  const Planes whole = rendered(scene);
  const ViewRun view = viewOf(scene);
  const Result<std::vector<std::byte>> bytes = encodedRun(view.run);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const Result<PlayableRun> decoded = decodedRun(*bytes);
  ASSERT_TRUE(decoded) << decoded.error().message;
  RunPlayer player = playerOf(*decoded, scene.sampleRate);
  std::size_t first = 0;
  for (std::size_t listener = 0; listener < scene.listeners.size(); ++listener) {
    player.follow(listener);
    ASSERT_TRUE(player.seek({}));
    const Planes planes = played(player, whole.front().size());
    const Planes others(whole.begin() + static_cast<std::ptrdiff_t>(first),
                        whole.begin() + static_cast<std::ptrdiff_t>(first + planes.size()));
    EXPECT_LT(difference(planes, others), -120.0) << scene.listeners[listener].name;
    EXPECT_EQ(player.late(), 0u);
    first += planes.size();
  }
  EXPECT_EQ(first, whole.size());
}

TEST_P(PlayedRuns, SoundSoToAnEar) {
  Scene scene = sceneOf(GetParam().scene, GetParam().duration);
  scene.listeners = {{"ear", {0.3, 0.4, 0.9}}};
  scene.paths.clear();
  const Planes whole = rendered(scene);
  const ViewRun view = viewOf(sceneOf(GetParam().scene, GetParam().duration));
  RunPlayer player = playerOf(view.run, scene.sampleRate);
  ASSERT_TRUE(player.placeEar({0.0, scene.listeners[0].position, Quat::Identity()}));
  ASSERT_TRUE(player.seek({}));
  EXPECT_LT(difference(played(player, whole.front().size()), whole), -120.0);
}

INSTANTIATE_TEST_SUITE_P(Library, PlayedRuns,
                         testing::Values(Case{"two_balls", 1.0}, Case{"newtons_cradle", 1.0},
                                         Case{"marbles_in_a_room", 1.5},
                                         Case{"glass_and_plate", 1.0}, Case{"fly_by", 2.0},
                                         Case{"pen_scrapes_brick", 0.7},
                                         Case{"dropped_wrench", 1.5}, Case{"jello_drop", 0.6},
                                         Case{"coin_spin", 0.5}),
                         [](const auto& one) { return std::string(one.param.scene); });

TEST(PageSounds, AreAsLoud) {
  // A slide that is rounded has other samples of the same level; the level would change with a
  // number that was rounded too far.
  for (const auto& [name, duration] :
       {Case{"coin_spin", 1.0}, Case{"pen_scrapes_brick", 0.7}, Case{"wood_blocks", 1.5}}) {
    const ViewRun view = viewOf(sceneOf(name, duration));
    RunPlayer exact = playerOf(view.run);
    RunPlayer ofPage = playerOf(pageSound(view.run));
    const auto frames = static_cast<std::size_t>(48000.0 * duration);
    const auto powerOf = [](const Planes& planes) {
      double power = 0.0;
      for (const std::vector<float>& plane : planes)
        for (const float sample : plane)
          power += static_cast<double>(sample) * static_cast<double>(sample);
      return power;
    };
    const double ratio = powerOf(played(ofPage, frames)) / powerOf(played(exact, frames));
    EXPECT_LT(std::abs(10.0 * std::log10(ratio)), 1.0) << name;
  }
}

TEST(PageSounds, RingAsLongAsTheyDo) {
  // A ball that lies on a plate damps it, by its force and its place, both of which a page rounds.
  const ViewRun view = viewOf(sceneOf("glass_and_plate", 1.5));
  RunPlayer exact = playerOf(view.run);
  RunPlayer ofPage = playerOf(pageSound(view.run));
  for (const Vec3& place : {Vec3(0.3, 0.4, 0.9), Vec3(-1.5, 0.8, -0.7)}) {
    for (RunPlayer* const player : {&exact, &ofPage}) {
      ASSERT_TRUE(player->placeEar({0.0, place, Quat::Identity()}));
      ASSERT_TRUE(player->seek({}));
    }
    EXPECT_LT(difference(played(ofPage, 72000), played(exact, 72000)), -120.0);
  }
}

class PlayedMarbles : public testing::Test {
 protected:
  const Scene scene_ = sceneOf("marbles_in_a_box", 1.0);
  const ViewRun view_ = viewOf(scene_);
  const std::size_t frames_ = 48000;
};

TEST_F(PlayedMarbles, BeginAnywhere) {
  RunPlayer player = playerOf(view_.run);
  player.follow(0);
  ASSERT_TRUE(player.seek({}));
  const Planes whole = played(player, frames_);
  ASSERT_TRUE(player.seek({.time = 0.5, .prelude = 0.3}));
  EXPECT_NEAR(player.time(), 0.5, 1e-9);
  EXPECT_LT(difference(played(player, frames_ / 2), whole, frames_ / 2), -120.0);
  // Without a prelude what was heard before is cut, and what comes is not.
  ASSERT_TRUE(player.seek({.time = 0.5}));
  EXPECT_LT(difference(played(player, frames_ / 2), whole, frames_ / 2, 2400), -100.0);
}

TEST_F(PlayedMarbles, AreSilentWhereNothingIsHeard) {
  RunPlayer player = playerOf(view_.run);
  for (const HostBody& body : view_.run.bodies.front().bodies)
    player.setAudible(body.id, false);
  ASSERT_TRUE(player.seek({}));
  EXPECT_EQ(peakOf(played(player, frames_)), 0.0);
}

TEST_F(PlayedMarbles, AreTheSumOfTheirBodies) {
  RunPlayer player = playerOf(view_.run);
  const auto half = [&](std::size_t rest) {
    for (const HostBody& body : view_.run.bodies.front().bodies)
      player.setAudible(body.id, body.id % 2 == rest);
    EXPECT_TRUE(player.seek({}));
    return played(player, frames_);
  };
  Planes even = half(0);
  const Planes odd = half(1);
  for (std::size_t at = 0; at < frames_; ++at)
    even[0][at] += odd[0][at];
  for (const HostBody& body : view_.run.bodies.front().bodies)
    player.setAudible(body.id, true);
  ASSERT_TRUE(player.seek({}));
  EXPECT_LT(difference(even, played(player, frames_)), -70.0);  // filters are shared by order
}

TEST_F(PlayedMarbles, GiveTheSoundOfOneCollision) {
  const std::vector<EventPlace> order = eventsInOrder(view_.run);
  const auto loudest = std::ranges::max_element(view_.events, {}, &RunPlayer::EventMeasure::peak);
  const auto row = static_cast<std::size_t>(loudest - view_.events.begin());
  const ImpulseEvent& event = view_.run.portions[order[row].portion].events[order[row].event];
  RunPlayer player = playerOf(view_.run);
  player.setOnly(row);
  ASSERT_TRUE(player.seek({.time = event.time - 0.01}));
  const Planes planes = played(player, frames_ / 10);
  EXPECT_LE(peakOf(planes), 2.0 * loudest->peak);  // of both shares
  EXPECT_GT(peakOf(planes), 0.3 * loudest->peak);
  // It comes after the way through the air, and everything else is silent.
  const double delay =
      (event.position - scene_.listeners.front().position).norm() / scene_.medium.speedOfSound;
  const auto at = static_cast<std::size_t>(
      std::ranges::max_element(planes[0], {}, [](float x) { return std::abs(x); }) -
      planes[0].begin());
  EXPECT_NEAR(static_cast<double>(at) / 48000.0 - 0.01, delay, 5e-4);
  player.setOnly(view_.events.size());
  EXPECT_FALSE(player.seek({}));
}

TEST_F(PlayedMarbles, ClickAsLongInSlowMotion) {
  // At a hundredth of the speed the first click has the same samples, its neighbours come later.
  RunPlayer player = playerOf(view_.run);
  const ImpulseEvent* first = nullptr;
  for (const RunPortion& portion : view_.run.portions)
    for (const ImpulseEvent& event : portion.events)
      if (first == nullptr || event.time < first->time) first = &event;
  ASSERT_NE(first, nullptr);
  player.setOnly(0);
  ASSERT_TRUE(player.seek({.time = first->time}));
  const Planes fast = played(player, 2400);
  player.setOnly(std::nullopt);
  ASSERT_TRUE(player.seek({.time = first->time, .speed = 0.001}));
  const Planes slow = played(player, 2400);
  EXPECT_NEAR(player.time(), first->time + 0.001 * 0.05, 1e-8);
  ASSERT_TRUE(player.seek({.time = first->time, .speed = 1.0}));
  EXPECT_GT(peakOf(fast), 0.0);
  EXPECT_LT(std::abs(peakOf(slow) / peakOf(fast) - 2.0), 2.0);  // the other share's click joins it
}

TEST_F(PlayedMarbles, FollowTheEar) {
  RunPlayer player = playerOf(view_.run);
  const Vec3 middle = scene_.listeners.front().position;
  ASSERT_TRUE(player.placeEar({0.0, middle, Quat::Identity()}));
  ASSERT_TRUE(player.seek({}));
  const double near = peakOf(played(player, frames_));
  ASSERT_TRUE(player.placeEar({0.0, middle + Vec3(0.0, 50.0, 0.0), Quat::Identity()}));
  ASSERT_TRUE(player.seek({}));
  EXPECT_LT(peakOf(played(player, frames_)), 0.2 * near);
  // Walking away makes it quieter while it plays.
  ASSERT_TRUE(player.placeEar({0.0, middle, Quat::Identity()}));
  ASSERT_TRUE(player.seek({}));
  played(player, 4800);
  ASSERT_TRUE(player.moveEar({0.0, middle + Vec3(0.0, 500.0, 0.0), Quat::Identity()}));
  played(player, 24000);
  EXPECT_LT(peakOf(played(player, 19200)), 0.05 * near);
  EXPECT_FALSE(player.moveEar({0.0, Vec3(NAN, 0.0, 0.0), Quat::Identity()}));
}

TEST_F(PlayedMarbles, RefuseWhatCannotBePlayed) {
  RunPlayer player = playerOf(view_.run);
  EXPECT_FALSE(player.seek({.time = NAN}));
  EXPECT_FALSE(player.seek({.speed = 0.0}));
  EXPECT_FALSE(player.seek({.speed = 1e9}));
  EXPECT_FALSE(player.seek({.prelude = -1.0}));
  player.follow(100);
  EXPECT_FALSE(player.seek({}));
  player.follow(std::nullopt);
  player.setFormat(ListenerFormat::binaural);
  EXPECT_FALSE(player.seek({}));  // there is no head
  player.setFormat(ListenerFormat::mono);
  ASSERT_TRUE(player.seek({.time = 1e6}));  // after the end there is silence
  EXPECT_EQ(peakOf(played(player, 4800)), 0.0);
}

TEST(PlayedJello, BeginsAnywhere) {
  const ViewRun view = viewOf(sceneOf("jello_drop", 1.5));
  RunPlayer player = playerOf(view.run);
  player.follow(0);
  ASSERT_TRUE(player.seek({}));
  const Planes whole = played(player, 72000);
  for (const double prelude : {0.0, 0.1}) {
    ASSERT_TRUE(player.seek({.time = 1.0, .prelude = prelude}));
    EXPECT_LT(difference(played(player, 24000), whole, 48000), -120.0);
  }
}

TEST(PlayedSlides, AreNotLate) {
  const ViewRun view = viewOf(sceneOf("coin_spin", 1.0));
  RunPlayer player = playerOf(view.run);
  Result<HrtfSet> head = HrtfSet::load({}, 48000.0);
  if (!head) GTEST_SKIP() << head.error().message;
  player.setHead(std::make_shared<const HrtfSet>(*std::move(head)));
  player.setFormat(ListenerFormat::binaural);
  for (const double time : {0.0, 0.3, 0.7}) {
    ASSERT_TRUE(player.seek({.time = time}));
    EXPECT_GT(peakOf(played(player, 4800)), 0.0);
    EXPECT_EQ(player.late(), 0u) << time;
  }
}

TEST(PlayedKinds, AddUpToTheWhole) {
  const ViewRun view = viewOf(sceneOf("glass_and_plate", 0.6));
  RunPlayer player = playerOf(view.run);
  const auto heard = [&](const std::array<bool, kStems>& stems) {
    player.setStems(stems);
    EXPECT_TRUE(player.seek({}));
    return played(player, 28800);
  };
  const Planes whole = heard({true, true, true});
  Planes sum = heard({true, false, true});
  const Planes rings = heard({false, true, false});
  EXPECT_GT(peakOf(rings), 0.0);
  for (std::size_t at = 0; at < sum[0].size(); ++at)
    sum[0][at] += rings[0][at];
  EXPECT_LT(difference(sum, whole), -120.0);
}

TEST(EncodedRuns, ThatAreDamagedAreRefusedOrPlayed) {
  const ViewRun view = viewOf(sceneOf("glass_and_plate", 0.3));
  const std::vector<std::byte> bytes = *encodedRun(view.run);
  EXPECT_EQ(*encodedRun(*decodedRun(bytes)), bytes);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{3}, std::size_t{100}, bytes.size() / 2, bytes.size() - 1})
    EXPECT_FALSE(decodedRun(std::span(bytes).first(size))) << size;
  std::size_t refused = 0;
  for (std::size_t at = 0; at < bytes.size(); at += bytes.size() / 100 + 1) {
    std::vector<std::byte> damaged = bytes;
    damaged[at] ^= std::byte{0xFF};
    Result<PlayableRun> run = decodedRun(damaged);
    refused += run ? 0U : 1U;
    if (!run) continue;
    Result<RunPlayer> player = RunPlayer::create(*std::move(run), 48000.0);
    if (player) played(*player, 4800);
  }
  EXPECT_GT(refused, 0u);
}

TEST(PlayedAgain, ARoomHasTheSameBits) {
  const Scene scene = sceneOf("marbles_in_a_room", 0.7);
  RunPlayer player = playerOf(viewOf(scene).run);
  std::vector<Planes> takes;
  for (std::size_t take = 0; take < 3; ++take) {
    ASSERT_TRUE(player.seek({.time = 0.3, .prelude = 0.2}));
    takes.push_back(played(player, 9600));
  }
  EXPECT_GT(peakOf(takes[0]), 0.0);
  EXPECT_EQ(takes[0], takes[1]);
  EXPECT_EQ(takes[0], takes[2]);
}

TEST(ShownVariants, SoundAsTheReportHasMeasuredThem) {
  const Scene scene = sceneOf("two_balls", 1.0);
  std::map<std::string, ViewRun> shown;
  ReportOptions options;
  options.runs = 1;
  options.show = [&shown](const ViewRun& view) -> Result<bool> {
    shown.emplace(view.id, view);
    return true;
  };
  const Result<SceneReport> report = reportScene(scene, options);
  ASSERT_TRUE(report) << report.error().message;
  ASSERT_EQ(report->shown.size(), report->variants.size());
  ASSERT_EQ(shown.size(), report->variants.size());
  ASSERT_GT(shown.size(), 20u);
  for (const VariantReport& variant : report->variants) {
    const ViewRun& view = shown.at(variant.choice.id);
    EXPECT_EQ(view.label, variant.choice.label);
    RunPlayer player = playerOf(view.run, scene.sampleRate);
    player.follow(0);
    ASSERT_TRUE(player.seek({}));
    const Planes planes = played(player, variant.signal.front().size());
    EXPECT_LT(difference(planes, variant.signal), -120.0) << variant.choice.id;
  }
}

}  // namespace
}  // namespace carom::lab
