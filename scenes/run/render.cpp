#include "scenes/run/render.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "audio/io/partial_file.h"
#include "scenes/run/events_file.h"
#include "scenes/run/recorded_scene.h"
#include "scenes/run/stopwatch.h"

namespace carom::scenes {

using namespace audio;

namespace {

constexpr std::size_t kBlockFrames = 4096;

struct Files {
  SoundFileWriter sound;
  std::optional<EventsFileWriter> events;
};

bool isLimited(const RenderOptions& options) {
  return options.limit.value_or(options.format == SampleFormat::pcm16 && !options.normalize);
}

Result<Files> openFiles(const Scene& scene, const RenderOptions& options) {
  if (options.eventsFile && isSameFile(options.soundFile, *options.eventsFile)) {
    return Error{options.soundFile.string() +
                 ": is to hold both the sound and the events; expected two names"};
  }
  SoundFileSettings settings;
  settings.sampleRate = scene.sampleRate;
  settings.channels = channelsOf(scene);
  settings.format = options.format;
  settings.fullScalePressure = options.fullScale;
  settings.limit = isLimited(options);
  settings.normalize = options.normalize;
  Result<SoundFileWriter> sound = SoundFileWriter::create(options.soundFile, settings);
  if (!sound) return sound.error();
  Files files{*std::move(sound), std::nullopt};
  if (options.eventsFile) {
    Result<EventsFileWriter> events = EventsFileWriter::create(*options.eventsFile);
    if (!events) return events.error();
    files.events.emplace(*std::move(events));
  }
  return files;
}

// Gives both files their names, or neither: all that can go
// wrong comes before the first is renamed.
Status nameFiles(Files& files) {
  if (!files.events) return files.sound.finish();
  if (Status closed = files.events->close(); !closed) return closed;
  if (Status finished = files.sound.finish(); !finished) return finished;
  return files.events->finish();
}

Status renderInto(Files& files, const Scene& scene, SceneSound& sound, RenderReport& report,
                  const RenderOptions& options) {
  std::vector<std::vector<float>> channels(channelsOf(scene), std::vector<float>(kBlockFrames));
  std::vector<const float*> pointers;
  pointers.reserve(channels.size());
  for (const auto& channel : channels)
    pointers.push_back(channel.data());
  while (const std::size_t frames = sound.render(channels)) {
    if (Status written = files.sound.write(pointers, frames); !written) return written;
    for (const auto& [event, peak] : sound.settledEvents()) {
      ++report.events;
      if (!files.events) continue;
      files.events->write(event, scene,
                          {.duration = sound.synth().contactDuration(event),
                           .peak = peak,
                           .isHeard = peak > 0.0 && peak >= scene.sound.audibleThreshold});
    }
    if (options.progress) {
      options.progress(static_cast<double>(sound.framesDone()) /
                       static_cast<double>(sound.frames()));
    }
  }
  if (const std::string failure = sound.stepper().failure(); !failure.empty())
    return Error{scene.name + ": " + failure};
  return nameFiles(files);
}

void leaveOutCounted(Plan& plan, std::uint64_t count, const std::string& stage,
                     const std::string& why) {
  if (count > 0) plan.leftOut.push_back({stage, std::to_string(count) + " " + why});
}

Result<SceneSound> soundOf(const Scene& scene, const RenderOptions& options) {
  if (options.recording == nullptr) return SceneSound::create(scene, options.analysis);
  return SceneSound::create(scene,
                            replayStepper(*options.recording, firstEventTime(scene, options.span)),
                            options.span, options.analysis);
}

/// Replaces the native stepper by the recording in the plan.
void replaceStepper(Plan& plan) {
  std::ranges::replace(plan.needed, "native_stepper", "recording");
  plan.leftOut.insert(plan.leftOut.begin(), {"native_stepper", "the run has been recorded"});
}

}  // namespace

Result<RenderReport> renderScene(const Scene& scene, const RenderOptions& options) {
  const Stopwatch stopwatch;
  Result<SceneSound> sound = soundOf(scene, options);
  if (!sound) return sound.error();
  Result<Files> files = openFiles(scene, options);
  if (!files) return files.error();

  RenderReport report;
  report.file = options.soundFile;
  report.plan = makePlan(scene);
  if (options.recording != nullptr) replaceStepper(report.plan);
  if (Status done = renderInto(*files, scene, *sound, report, options); !done) {
    return done.error();
  }
  report.sampleRate = scene.sampleRate;
  report.duration = static_cast<double>(sound->frames()) / scene.sampleRate;
  report.channels = channelsOf(scene);
  report.listeners = listenerChannels(scene);
  report.images = imageCount(scene);
  report.reverb = scene.sound.reverb;
  report.peak = files->sound.peakPressure();
  report.fullScale = options.fullScale;
  if (options.normalize) report.fullScale = report.peak > 0.0 ? report.peak : kFullScalePressure;
  report.clippedSamples = files->sound.clippedSamples();
  report.limiter = isLimited(options);
  report.gainReduction = files->sound.gainReduction();
  report.synth = sound->synth().counters();
  leaveOutCounted(report.plan, report.synth.inaudible, "inaudible_clicks",
                  "clicks stay below the threshold of hearing at every listener");
  leaveOutCounted(report.plan, report.synth.inaudibleSlides, "inaudible_slides",
                  "steps of sliding or rolling stay below it");
  leaveOutCounted(report.plan, sound->stepper().jammed(), "jammed_spheres",
                  "spheres were left no room by what moves, and touch nothing any more");
  report.wallTime = stopwatch.seconds();
  return report;
}

}  // namespace carom::scenes
