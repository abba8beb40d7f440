#include "scenes/run/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "audio/io/partial_file.h"
#include "scenes/limits/incomplete_names.h"
#include "scenes/limits/sound_end.h"
#include "scenes/rows/events_file.h"
#include "scenes/run/stopwatch.h"

namespace carom::scenes {

using namespace audio;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlockFrames = 4096;
constexpr std::array kAllStems = {Stem::clicks, Stem::rings, Stem::contacts};
static_assert(kAllStems.size() == kStems);

struct Files {
  IncompleteNames names;
  SoundFileWriter sound;
  std::vector<SoundFileWriter> stems;  // one for each Stem, or none
  std::optional<EventsFileWriter> events;
};

/// Returns "out.WORD.wav" for "out.wav".
fs::path withWord(const fs::path& file, const std::string& word) {
  fs::path name = file.stem();
  name += "." + word;
  name += file.extension();
  return file.parent_path() / name;
}

bool isLimited(const RenderOptions& options) {
  return options.limit.value_or(options.format == SampleFormat::pcm16 && !options.normalize);
}

/// Opens a file for each stem, as loud as the whole; they may be louder than full scale.
Status openStems(const RenderOptions& options, SoundFileSettings settings, Files& files) {
  if (options.normalize)
    return Error{options.soundFile.string() +
                 ": stems of a normalised sound have no unit of their own; expected a full scale"};
  settings.format = SampleFormat::float32;
  settings.limit = false;
  for (const Stem stem : kAllStems) {
    const fs::path name = stemName(options.soundFile, stem);
    if (options.eventsFile && isSameFile(name, *options.eventsFile))
      return Error{name.string() + ": is to hold both a stem and the events; expected two names"};
    Result<SoundFileWriter> file = SoundFileWriter::create(files.names.of(name), settings);
    if (!file) return file.error();
    files.stems.push_back(*std::move(file));
  }
  return std::monostate{};
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
  IncompleteNames names(options.keepPartial);
  Result<SoundFileWriter> sound = SoundFileWriter::create(names.of(options.soundFile), settings);
  if (!sound) return sound.error();
  Files files{std::move(names), *std::move(sound), {}, std::nullopt};
  if (scene.sound.stems)
    if (Status opened = openStems(options, settings, files); !opened) return opened.error();
  if (options.eventsFile) {
    Result<EventsFileWriter> events = EventsFileWriter::create(files.names.of(*options.eventsFile));
    if (!events) return events.error();
    files.events.emplace(*std::move(events));
  }
  return files;
}

// Gives all files their names, the sound's after its stems', or both of sound and events neither:
// all that can go wrong there comes before the first is renamed.
Status nameFiles(Files& files) {
  for (SoundFileWriter& stem : files.stems)
    if (Status finished = stem.finish(); !finished) return finished;
  if (!files.events) return files.sound.finish();
  if (Status closed = files.events->close(); !closed) return closed;
  if (Status finished = files.sound.finish(); !finished) return finished;
  return files.events->finish();
}

/// Finishes files after the last sample; those of a run that a guard ended only if they are kept.
Status finishFiles(Files& files, const RenderReport& report, const RenderOptions& options) {
  if (report.endedEarly && !options.keepPartial) return std::monostate{};
  if (Status named = nameFiles(files); !named || report.endedEarly) return named;
  return files.names.complete();
}

class FileSink : public RenderSink {
 public:
  FileSink(Files& files, const Scene& scene) : files_(files), scene_(scene) {}

  Status write(std::span<const float* const> channels, std::size_t frames) override {
    return files_.sound.write(channels, frames);
  }
  Status writeStem(Stem stem, std::span<const float* const> channels, std::size_t frames) override {
    return files_.stems[static_cast<std::size_t>(stem)].write(channels, frames);
  }
  void add(const ImpulseEvent& event, const EventSound& sound) override {
    if (files_.events) files_.events->write(event, scene_, sound);
  }

 private:
  Files& files_;
  const Scene& scene_;
};

/// Renders a sound into a sink, block by block.
class Rendering {
 public:
  Rendering(RenderSink& sink, const Scene& scene, SceneSound& sound, const RenderOptions& options)
      : sink_(sink),
        scene_(scene),
        sound_(sound),
        options_(options),
        end_(scene.sampleRate),
        count_(channelsOf(scene)),
        channels_(sound.synth().channelCount(), std::vector<float>(kBlockFrames)) {
    if (options.tail) tail_ = std::llround(tailOf(scene, *options.tail) * scene.sampleRate);
  }

  Status run(RenderReport& report) {
    sound_.sendEventsTo([&](const ScheduledEvent& settled) { keep(settled, report); });
    while (const std::size_t frames = sound_.render(channels_)) {
      if (Status written = write(frames); !written) return written;
      if (options_.progress)
        options_.progress(static_cast<double>(sound_.framesDone()) /
                          static_cast<double>(sound_.frames()));
    }
    if (const std::string failure = sound_.stepper().failure(); !failure.empty())
      return Error{scene_.name + ": " + failure};
    if (options_.guard != nullptr) report.endedEarly = options_.guard->ended();
    if (!report.endedEarly)
      if (Status written = addTail(); !written) return written;
    report.levelAtEnd = end_.level();
    report.duration = static_cast<double>(written_) / scene_.sampleRate;
    return std::monostate{};
  }

 private:
  static double tailOf(const Scene& scene, double wished) {
    return jelloOf(scene) == nullptr ? wished : 0.0;
  }

  void keep(const ScheduledEvent& settled, RenderReport& report) {
    const auto& [event, peak] = settled;
    ++report.events;
    sink_.add(event, {.duration = sound_.synth().contactDuration(event),
                      .peak = peak,
                      .isHeard = peak > 0.0 && peak >= scene_.sound.audibleThreshold});
  }

  /// Goes on until nothing is to come and what sounds is quiet, or to the longest end.
  Status addTail() {
    for (std::vector<float>& channel : channels_)
      channel.resize(kTailFrames);
    const std::int64_t last = sound_.frames() + tail_.value_or(0);
    while (written_ < last && !(end_.isQuiet() && sound_.synth().pendingClicks() == 0)) {
      sound_.renderTail(channels_);
      const auto frames = std::min<std::int64_t>(kTailFrames, last - written_);
      if (Status written = write(static_cast<std::size_t>(frames)); !written) return written;
    }
    return std::monostate{};
  }

  Status write(std::size_t frames) {
    if (tail_) end_.fade(channels_, frames, written_, sound_.frames() + *tail_);
    end_.add(std::span(channels_).first(count_), frames);
    written_ += static_cast<std::int64_t>(frames);
    std::vector<const float*> pointers;
    for (const std::vector<float>& channel : channels_)
      pointers.push_back(channel.data());
    const std::span<const float* const> all(pointers);
    if (Status written = sink_.write(all.first(count_), frames); !written) return written;
    for (std::size_t index = 0; (index + 1) * count_ < all.size(); ++index) {
      const auto stem = all.subspan((index + 1) * count_, count_);
      if (Status written = sink_.writeStem(kAllStems.at(index), stem, frames); !written)
        return written;
    }
    return std::monostate{};
  }

  static constexpr std::int64_t kTailFrames = 512;

  RenderSink& sink_;
  const Scene& scene_;
  SceneSound& sound_;
  const RenderOptions& options_;
  SoundEnd end_;
  std::size_t count_;                         // channels of the whole
  std::vector<std::vector<float>> channels_;  // behind them those of the stems
  std::optional<std::int64_t> tail_;          // samples after the scene's end, at most
  std::int64_t written_ = 0;                  // samples
};

void leaveOutCounted(Plan& plan, std::uint64_t count, const std::string& stage,
                     const std::string& why) {
  if (count > 0) plan.leftOut.push_back({stage, std::to_string(count) + " " + why});
}

Result<SceneSound> soundOf(const Scene& scene, const RenderOptions& options, bool shown) {
  const Progress analysis = withinLimits(options.guard, options.analysis);
  if (!options.replay) {
    Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene, options.guard);
    if (!stepper) return stepper.error();
    if (shown) (*stepper)->showAll();
    return SceneSound::create(scene, *std::move(stepper), {}, analysis);
  }
  const double begin = firstEventTime(scene, options.span);
  return SceneSound::create(scene, options.replay(begin), options.span, analysis);
}

/// Replaces the stepper by the recording in the plan.
void replaceStepper(Plan& plan) {
  const auto stage = std::ranges::find_if(plan.needed, [](const std::string& needed) {
    return needed == "native_stepper" || needed == "bullet_world";
  });
  if (stage == plan.needed.end()) return;
  plan.leftOut.insert(plan.leftOut.begin(), {*stage, "the run has been recorded"});
  *stage = "recording";
}

}  // namespace

const char* nameOf(Stem stem) {
  constexpr std::array kNames = {"clicks", "rings", "contacts"};
  return kNames.at(static_cast<std::size_t>(stem));
}

fs::path stemName(const fs::path& file, Stem stem) {
  return withWord(file, nameOf(stem));
}

Result<RenderReport> renderScene(const Scene& scene, const RenderOptions& options,
                                 RenderSink& sink) {
  const Stopwatch stopwatch;
  Result<SceneSound> sound = soundOf(scene, options, sink.motion() != nullptr);
  if (!sound) return sound.error();
  sound->sendMotionTo(sink.motion());
  if (options.guard != nullptr) sound->watch(*options.guard);

  RenderReport report;
  report.plan = makePlan(scene);
  if (options.replay) replaceStepper(report.plan);
  if (Status done = Rendering(sink, scene, *sound, options).run(report); !done) return done.error();
  report.sampleRate = scene.sampleRate;
  report.channels = channelsOf(scene);
  report.listeners = listenerChannels(scene);
  report.images = imageCount(scene);
  report.reverb = scene.sound.reverb;
  report.notes = sound->notes();
  report.synth = sound->synth().counters();
  report.energy = sound->synth().contactEnergy(sound->synth().time());
  leaveOutCounted(report.plan, report.synth.inaudible, "inaudible_clicks",
                  "clicks stay below the threshold of hearing at every listener");
  leaveOutCounted(report.plan, report.synth.inaudibleSlides, "inaudible_slides",
                  "steps of sliding or rolling stay below it");
  leaveOutCounted(report.plan, sound->stepper().jammed(), "jammed_spheres",
                  "spheres were left no room by what moves, and touch nothing any more");
  report.wallTime = stopwatch.seconds();
  return report;
}

Result<RenderReport> renderScene(const Scene& scene, const RenderOptions& options) {
  const Stopwatch stopwatch;
  Result<Files> files = openFiles(scene, options);
  if (!files) return files.error();
  FileSink sink(*files, scene);
  Result<RenderReport> report = renderScene(scene, options, sink);
  if (!report) return report;
  if (Status finished = finishFiles(*files, *report, options); !finished) return finished.error();
  report->file = options.soundFile;
  if (report->endedEarly)
    report->file = options.keepPartial ? files->names.of(options.soundFile) : "";
  if (scene.sound.stems && !report->file.empty())
    for (const Stem stem : kAllStems) {
      const fs::path name = stemName(options.soundFile, stem);
      report->stems.push_back(report->endedEarly ? files->names.of(name) : name);
    }
  report->peak = files->sound.peakPressure();
  report->fullScale = options.fullScale;
  if (options.normalize) report->fullScale = report->peak > 0.0 ? report->peak : kFullScalePressure;
  report->clippedSamples = files->sound.clippedSamples();
  report->limiter = isLimited(options);
  report->gainReduction = files->sound.gainReduction();
  report->wallTime = stopwatch.seconds();
  return report;
}

}  // namespace carom::scenes
