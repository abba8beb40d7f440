#include "scenes/recording/event_tape.h"

#include <memory>
#include <string>
#include <vector>

#include "lab/report/report_run.h"
#include <gtest/gtest.h>

#include "scenes/run/scene_sound.h"
#include "tests/scenes/library.h"

namespace carom::test {

using namespace lab;
using namespace scenes;

namespace {

Signal live(const Scene& scene) {
  Result<SceneSound> sound = SceneSound::create(scene);
  EXPECT_TRUE(sound) << sound.error().message;
  Signal signal(channelsOf(scene));
  std::vector<std::vector<float>> block(signal.size(), std::vector<float>(4096));
  while (const std::size_t frames = sound->render(block)) {
    for (std::size_t channel = 0; channel < signal.size(); ++channel)
      signal[channel].insert(signal[channel].end(), block[channel].begin(),
                             block[channel].begin() + static_cast<std::ptrdiff_t>(frames));
  }
  return signal;
}

Signal taped(const Scene& scene) {
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene);
  EXPECT_TRUE(stepper) << stepper.error().message;
  Result<EventTape> tape = recordTape(**stepper, scene.duration);
  EXPECT_TRUE(tape) << tape.error().message;
  Result<SoundRun> run = runSound(scene, std::make_shared<const EventTape>(*tape), {.runs = 1});
  EXPECT_TRUE(run) << run.error().message;
  return run->signal;
}

class Taped : public testing::TestWithParam<std::string> {};

Scene tapedScene(const std::string& name) {
  if (name == "few_marbles") return fewMarbles();
  if (name == "few_marbles_on_bullet") return onStepper(fewMarbles(), StepperType::bullet);
  Scene scene = libraryScene(name);
  scene.duration = 0.6;
  return scene;
}

// The scenes have clicks, lasting contacts and the sound of a jello itself.
TEST_P(Taped, SoundsTheSameBits) {
  const Scene scene = tapedScene(GetParam());
  const Signal expected = live(scene);
  EXPECT_GT(thirdOctaves(expected, scene.sampleRate).at(10).energy, 0.0);
  EXPECT_EQ(taped(scene), expected);
}

INSTANTIATE_TEST_SUITE_P(EventTape, Taped,
                         testing::Values("few_marbles", "few_marbles_on_bullet",
                                         "marble_rolls_on_wood", "jello_drop"),
                         [](const auto& name) { return name.param; });

TEST(EventTape, HasTheEventsOfTheScene) {
  const Scene scene = fewMarbles();
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene);
  ASSERT_TRUE(stepper);
  const Result<EventTape> tape = recordTape(**stepper, scene.duration);
  ASSERT_TRUE(tape);
  const Result<std::vector<ImpulseEvent>> expected = sceneEvents(scene);
  ASSERT_TRUE(expected);
  std::vector<ImpulseEvent> events = eventsOf(*tape);
  std::erase_if(events, [&](const ImpulseEvent& event) { return event.time > scene.duration; });
  ASSERT_EQ(events.size(), expected->size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].time, (*expected)[i].time);
    EXPECT_EQ(events[i].impulse, (*expected)[i].impulse);
  }
}

TEST(EventTape, OfOtherEventsKeepsTheRest) {
  EventTape tape;
  tape.portions.resize(2);
  tape.portions[0].settledTime = 0.1;
  tape.portions[0].events.resize(3);
  tape.portions[1].settledTime = 0.2;
  tape.portions[1].contacts.resize(1);
  std::vector<ImpulseEvent> events(2);
  events[0].time = 0.05;
  events[1].time = 0.15;
  const EventTape changed = withEvents(tape, events);
  EXPECT_EQ(changed.portions[0].events.size(), 1u);
  EXPECT_EQ(changed.portions[1].events.size(), 1u);
  EXPECT_EQ(changed.portions[1].contacts.size(), 1u);
}

}  // namespace
}  // namespace carom::test
