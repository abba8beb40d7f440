#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "carom/native/recording_format.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/run/render.h"
#include "tests/scenes/library.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_folder.h"

namespace carom::test {

using namespace scenes;

namespace {

namespace fs = std::filesystem;
using SphereRun = carom::Recording;

constexpr std::string_view kMarbles = R"({
  "duration": 3,
  "seed": 5,
  "bodies": [
    {"type": "box", "name": "box", "min": [-0.06, 0, -0.06], "max": [0.06, 1, 0.06],
     "material": "wood"},
    {"type": "spheres", "name": "marbles", "count": 12, "radius": [0.006, 0.009],
     "material": ["glass", "steel"], "min": [-0.05, 0.02, -0.05], "max": [0.05, 0.12, 0.05],
     "speed": [0, 1]}
  ],
  "listeners": [{"name": "left", "position": [-0.1, 0.4, 0.3]},
                {"name": "right", "position": [0.1, 0.4, 0.3]}]
})";

Scene marbles() {
  return orAbort(parseScene(kMarbles, "marbles.json"));
}

SphereRun runOf(const Scene& scene, std::string_view text = kMarbles) {
  Result<SphereRun> run = recordScene(scene, text, "marbles.json");
  EXPECT_TRUE(run) << run.error().message;
  return run ? *std::move(run) : SphereRun{};
}

class Replay : public testing::Test {
 protected:
  RenderReport rendered(const Scene& scene, const std::string& name, const SphereRun* run = nullptr,
                        const SoundSpan& span = {}) const {
    RenderOptions options;
    options.soundFile = folder_ / (name + ".wav");
    options.eventsFile = folder_ / (name + ".csv");
    if (run != nullptr) options.replay = replayOf(*run, scene);
    options.span = span;
    const Result<RenderReport> report = renderScene(scene, options);
    EXPECT_TRUE(report) << report.error().message;
    return report ? *report : RenderReport{};
  }
  std::string bytes(const std::string& name) const { return contents(folder_ / name); }
  std::string saved(const SphereRun& run) const {
    const Result<std::uintmax_t> size = saveRecording(run, folder_ / "run.carom");
    EXPECT_TRUE(size) << size.error().message;
    return (folder_ / "run.carom").string();
  }

  const TemporaryFolder folder_;
};

TEST_F(Replay, HasTheSoundAndTheEventsOfTheRunByteForByte) {
  for (const std::string_view name : kLibrary) {
    const Scene scene = onStepper(libraryScene(name), StepperType::native);
    const SphereRun run = runOf(scene, contents(libraryFile(name)));
    const RenderReport stepped = rendered(scene, "stepped");
    const RenderReport replayed = rendered(scene, "replayed", &run);
    EXPECT_TRUE(bytes("stepped.wav") == bytes("replayed.wav")) << name;
    EXPECT_TRUE(bytes("stepped.csv") == bytes("replayed.csv")) << name;
    EXPECT_EQ(stepped.events, replayed.events);
    EXPECT_EQ(stepped.peak, replayed.peak);
  }
}

TEST_F(Replay, NamesTheRecordingInThePlanInsteadOfTheStepper) {
  const Scene scene = marbles();
  const SphereRun run = runOf(scene);
  const Plan plan = rendered(scene, "replayed", &run).plan;
  EXPECT_EQ(plan.needed.front(), "recording");
  EXPECT_EQ(plan.leftOut.front().stage, "native_stepper");
}

TEST_F(Replay, OfAPartHasTheSamplesThatTheWholeHasThere) {
  const Scene scene = marbles();
  const SphereRun run = runOf(scene);
  rendered(scene, "whole", &run);
  const auto whole = readRecording(folder_ / "whole.wav");
  for (const SoundSpan span : {SoundSpan{0.0, 0.7}, {0.25, 0.5}, {1.3, 3.0}, {2.2, 2.2004}}) {
    const RenderReport report = rendered(scene, "part", &run, span);
    const auto part = readRecording(folder_ / "part.wav");
    EXPECT_NEAR(report.duration, span.to - span.from, 1e-4);
    const auto first = static_cast<std::size_t>(std::llround(span.from * 48000.0)) * 2;
    ASSERT_LE(first + part.samples.size(), whole.samples.size());
    EXPECT_TRUE(std::equal(part.samples.begin(), part.samples.end(),
                           whole.samples.begin() + static_cast<std::ptrdiff_t>(first)))
        << span.from;
    EXPECT_EQ(report.synth.late, 0U);
    EXPECT_EQ(report.events, run.eventsBetween(span.from, span.to).size());
  }
}

TEST_F(Replay, ForOtherListenersIsTheSceneWithThoseListeners) {
  Scene scene = marbles();
  const SphereRun run = runOf(scene);
  scene.listeners.resize(1);
  scene.listeners[0].position = {0.3, 0.2, -0.4};
  rendered(scene, "stepped");
  rendered(scene, "replayed", &run);
  EXPECT_TRUE(bytes("stepped.wav") == bytes("replayed.wav"));
}

TEST_F(Replay, NeedsNothingButTheFile) {
  const Scene scene = marbles();
  const SphereRun run = runOf(scene);
  const Result<RecordedScene> loaded = loadRecordedScene(saved(run));
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->recording.trajectoryHash(), run.trajectoryHash());
  EXPECT_EQ(loaded->bytes, fs::file_size(folder_ / "run.carom"));
  rendered(scene, "stepped");
  rendered(loaded->scene, "replayed", &loaded->recording);
  EXPECT_TRUE(bytes("stepped.wav") == bytes("replayed.wav"));
}

TEST_F(Replay, OfASceneForBulletRunsNatively) {
  std::string text(kMarbles);
  text.insert(1, R"("stepper": {"type": "bullet"},)");
  const Scene bullet = orAbort(parseScene(text, "marbles.json"));
  const Result<SphereRun> refused = recordScene(bullet, text, "marbles.json");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("runs on Bullet"), std::string::npos);
  EXPECT_NE(refused.error().message.find("--stepper native"), std::string::npos);
  const SphereRun run = runOf(onStepper(bullet, StepperType::native), text);
  const Result<RecordedScene> loaded = loadRecordedScene(saved(run));
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->scene.stepper.type, StepperType::native);
}

TEST_F(Replay, RefusesTheRunOfAnotherScene) {
  std::string longer(kMarbles);
  longer.replace(longer.find("\"duration\": 3"), 13, "\"duration\": 4");
  std::string fewer(kMarbles);
  fewer.replace(fewer.find("\"count\": 12"), 11, "\"count\": 11");
  std::string other(kMarbles);
  other.replace(other.find("\"seed\": 5"), 9, "\"seed\": 6");
  for (const std::string& text : {longer, fewer, other}) {
    SphereRun run = runOf(marbles());
    run.setPayload(std::string("marbles.json") + '\0' + text);
    const std::string file = saved(run);
    const Result<RecordedScene> loaded = loadRecordedScene(file);
    ASSERT_FALSE(loaded);
    EXPECT_TRUE(loaded.error().message.starts_with(file + ": ")) << loaded.error().message;
    EXPECT_NE(loaded.error().message.find("not of the scene"), std::string::npos);
  }
}

TEST_F(Replay, RefusesAPayloadThatIsNoScene) {
  for (const std::string& payload :
       {std::string(), std::string("no scene"), std::string("x.json\0{]", 9)}) {
    SphereRun run = runOf(marbles());
    run.setPayload(payload);
    const std::string file = saved(run);
    const Result<RecordedScene> loaded = loadRecordedScene(file);
    ASSERT_FALSE(loaded);
    EXPECT_TRUE(loaded.error().message.starts_with(file + ": ")) << loaded.error().message;
  }
}

TEST_F(Replay, RefusesAFileThatIsCutOff) {
  const std::string file = saved(runOf(marbles()));
  const std::string whole = contents(file);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{7}, std::size_t{100}, whole.size() / 2, whole.size() - 1}) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << whole.substr(0, size);
    const Result<RecordedScene> loaded = loadRecordedScene(file);
    ASSERT_FALSE(loaded) << size;
    EXPECT_TRUE(loaded.error().message.starts_with(file + ": ")) << loaded.error().message;
  }
}

TEST_F(Replay, LeavesNothingWhereNothingCanBeWritten) {
  const SphereRun run = runOf(marbles());
  EXPECT_FALSE(saveRecording(run, folder_ / "no" / "run.carom"));
  fs::create_directory(folder_ / "folder");
  EXPECT_FALSE(saveRecording(run, folder_ / "folder"));
  EXPECT_EQ(folder_.entries(), 1U);
}

}  // namespace
}  // namespace carom::test
