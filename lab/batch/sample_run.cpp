#include "lab/batch/sample_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

#include "lab/batch/batch_rows.h"
#include "lab/batch/file_hash.h"
#include <gnu/libc-version.h>
#include <sndfile.h>

#include "audio/io/byte_file.h"
#include "audio/io/partial_file.h"
#include "audio/io/wav_stream.h"
#include "audio/synthesis/click_kernels.h"
#include "carom/audio/sound_file.h"
#include "modal/json/json_reader.h"
#include "scenes/format/scene_loader.h"
#include "scenes/limits/run_guard.h"
#include "scenes/rows/events_file.h"
#include "scenes/run/bullet_scene.h"
#include "scenes/run/motion_rows.h"
#include "scenes/run/native_only.h"
#include "scenes/run/render.h"

namespace carom::lab {

using namespace scenes;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using nlohmann::ordered_json;

constexpr double kTail = 10.0;  // s, as `carom render` has it

/// A sound in memory.
struct KeptSound {
  std::vector<float> samples;  ///< Pa, interleaved
  float peak = 0.0F;           ///< Pa

  void add(std::span<const float* const> channels, std::size_t frames) {
    const std::size_t before = samples.size();
    samples.resize(before + frames * channels.size());
    for (std::size_t channel = 0; channel < channels.size(); ++channel) {
      const float* const from = channels[channel];
      float* const to = samples.data() + before + channel;
      for (std::size_t frame = 0; frame < frames; ++frame)
        to[frame * channels.size()] = from[frame];
      for (std::size_t frame = 0; frame < frames; ++frame)
        peak = std::max(peak, std::abs(from[frame]));
    }
  }
};

/// Keeps what a rendering makes in memory.
class MemorySink : public RenderSink, private MotionSink {
 public:
  MemorySink(const Scene& scene, const BatchOutputs& outputs, bool places)
      : scene_(scene), outputs_(outputs), keepsPlaces_(places) {
    sound_.samples.reserve(static_cast<std::size_t>((scene.duration + 1.0) * scene.sampleRate) *
                           channelsOf(scene));
    if (outputs_.events) events_ = EventRows::header();
    if (outputs_.contacts) contacts_ = ContactRows::header();
    if (outputs_.poses > 0.0) {
      poses_ = PoseRows::header();
      poseRows_.emplace(outputs_.poses);
    }
  }

  Status write(std::span<const float* const> channels, std::size_t frames) override {
    sound_.add(channels, frames);
    return std::monostate{};
  }
  Status writeStem(Stem stem, std::span<const float* const> channels, std::size_t frames) override {
    stems_.at(static_cast<std::size_t>(stem)).add(channels, frames);
    return std::monostate{};
  }
  void add(const ImpulseEvent& event, const EventSound& sound) override {
    if (outputs_.events) events_ += eventRows_.row(event, scene_, sound);
  }
  MotionSink* motion() override {
    return outputs_.contacts || outputs_.poses > 0.0 || keepsPlaces_ ? this : nullptr;
  }
  /// Returns the largest distance of a body that moves to the nearest listener, at the end, in m.
  double reach() const {
    double farthest = 0.0;
    for (const auto& [body, place] : places_) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Listener& listener : scene_.listeners)
        nearest = std::min(nearest, (place - listener.position).norm());
      farthest = std::max(farthest, nearest);
    }
    return farthest;
  }

  double peak() const { return static_cast<double>(sound_.peak); }  ///< Pa
  /// Returns the peak of the sound and all stems, in Pa.
  double highestPeak() const {
    float highest = sound_.peak;
    for (const KeptSound& stem : stems_)
      highest = std::max(highest, stem.peak);
    return static_cast<double>(highest);
  }
  std::vector<float>& samples() { return sound_.samples; }  ///< Pa, interleaved
  std::vector<float>& samples(Stem stem) {
    return stems_.at(static_cast<std::size_t>(stem)).samples;
  }
  // CSV files; empty if they are not asked for.
  const std::string& events() const { return events_; }
  const std::string& contacts() const { return contacts_; }
  const std::string& poses() const { return poses_; }

 private:
  void add(const ContactState& contact) override {
    if (outputs_.contacts) contacts_ += ContactRows().row(contact, scene_);
  }
  void add(const BodyPose& pose) override {
    if (poseRows_) poses_ += poseRows_->rows(pose, scene_);
    if (keepsPlaces_) places_[pose.body] = pose.pose.position;
  }

  const Scene& scene_;
  const BatchOutputs& outputs_;
  bool keepsPlaces_;
  std::map<BodyId, Vec3> places_;  // last ones
  EventRows eventRows_;
  std::optional<PoseRows> poseRows_;
  std::string events_;
  std::string contacts_;
  std::string poses_;
  KeptSound sound_;
  std::array<KeptSound, kStems> stems_;  // empty if they are not asked for
};

Error cannotWrite(const fs::path& file, const std::string& why) {
  return Error{file.string() + ": cannot be written: " + why};
}

/// Makes the folder that a file is to lie in. The folder above is never made anew: it goes only if
/// somebody removes the batch.
void makeFolderOf(const fs::path& file) {
  std::error_code ignored;
  fs::create_directory(file.parent_path(), ignored);
}

/// Writes a file under a temporary name by `write`, and gives it its name.
template <class Write>
Status writeFile(const fs::path& file, const Write& write) {
  makeFolderOf(file);
  audio::PartialFile partial(file);
  if (const Status written = write(partial.path()); !written)
    return cannotWrite(file, written.error().message);
  if (const std::error_code named = partial.giveName(audio::Sync::none); named)
    return cannotWrite(file, named.message());
  return std::monostate{};
}

/// The form of a sample's sounds, and what 1.0 stands for in them.
struct SoundUnit {
  SampleForm form = SampleForm::float32;
  double fullScale = kFullScalePressure;  ///< Pa
};

SoundUnit unitOf(SampleForm form, const MemorySink& sink) {
  const double peak = sink.highestPeak();
  return {form, form == SampleForm::flac && peak > 0.0 ? peak : kFullScalePressure};
}

const char* endingOf(SampleForm form) {
  return form == SampleForm::flac ? ".flac" : ".wav";
}

/// The samples of a sound, and what they are written as.
struct SoundToWrite {
  std::span<const float> samples;  ///< interleaved, 1.0 for full scale
  SampleForm form = SampleForm::float32;
  std::size_t channels = 1;
  int sampleRate = 48000;
  double fullScale = kFullScalePressure;  ///< Pa
};

Status writeFlac(const fs::path& path, const SoundToWrite& sound) {
  SF_INFO info = {};
  info.samplerate = sound.sampleRate;
  info.channels = static_cast<int>(sound.channels);
  info.format = SF_FORMAT_FLAC | SF_FORMAT_PCM_24;
  if (sf_format_check(&info) != SF_TRUE)
    return Error{"FLAC holds up to 8 channels; expected fewer listeners, or \"float32\""};
  SNDFILE* const file = sf_open(path.c_str(), SFM_WRITE, &info);
  if (file == nullptr) return Error{sf_strerror(nullptr)};
  const std::string comment = "full scale " + modal::formatNumber(sound.fullScale) + " Pa";
  sf_set_string(file, SF_STR_COMMENT, comment.c_str());
  const auto count = static_cast<sf_count_t>(sound.samples.size());
  const bool isWritten = sf_write_float(file, sound.samples.data(), count) == count;
  const int closed = sf_close(file);
  if (isWritten && closed == 0) return std::monostate{};
  return Error{"is there room on the disk?"};
}

Status writeWav(const fs::path& path, const SoundToWrite& sound) {
  Result<audio::WavStream> stream = audio::WavStream::create(
      path,
      {.sampleRate = sound.sampleRate, .channels = sound.channels, .fullScale = sound.fullScale});
  if (!stream) return stream.error();
  if (Status appended = stream->append(sound.samples); !appended) return appended;
  return stream->close();
}

/// Writes a sample's sound or a stem of it, and leaves its samples in units of the full scale.
Status writeSound(const fs::path& file, const Scene& scene, std::vector<float>& samples,
                  const SoundUnit& unit) {
  const auto divisor = static_cast<float>(unit.fullScale);
  for (float& sample : samples)
    sample /= divisor;  // as the file of `carom render` has it, bit for bit
  const SampleForm form = unit.form;
  const SoundToWrite sound{samples, form, channelsOf(scene), static_cast<int>(scene.sampleRate),
                           unit.fullScale};
  return writeFile(file, [&](const fs::path& path) {
    return form == SampleForm::flac ? writeFlac(path, sound) : writeWav(path, sound);
  });
}

/// A file of a sample as its row tells of it.
struct WrittenFile {
  std::string name;  ///< relative to the plan's folder
  std::uintmax_t bytes = 0;
  std::string sha256;
};

Result<WrittenFile> described(const fs::path& folder, const std::string& name) {
  const fs::path file = folder / name;
  const Result<std::string> hash = sha256OfFile(file);
  if (!hash) return cannotWrite(file, hash.error().message);
  std::error_code failed;
  const std::uintmax_t bytes = fs::file_size(file, failed);
  if (failed) return cannotWrite(file, failed.message());
  return WrittenFile{name, bytes, *hash};
}

ordered_json valuesJson(const SampleValues& values) {
  ordered_json object = ordered_json::object();
  for (const auto& [name, value] : values)
    object[name] = value;
  return object;
}

}  // namespace

/// A branch of a sample in memory, or why there is none.
struct SampleRunner::Rendered {
  json document;
  std::unique_ptr<Scene> scene;  // which the sink borrows
  std::unique_ptr<MemorySink> sink;
  RenderReport report;
  std::optional<SampleFailure> failure;
  bool overlaps = false;  // failed, as bodies overlap
};

struct SampleRunner::Accepted {
  Sample sample;
  Rendered first;           // of the first branch, with the failure if there is none
  bool isRejected = false;  // all attempts were
};

std::string machineKind() {
  return std::string(audio::fastestKernels().name) + ", glibc " + gnu_get_libc_version();
}

Status writeSampleFile(const fs::path& file, std::string_view bytes) {
  makeFolderOf(file);
  return audio::writeBytes(file, std::as_bytes(std::span(bytes)), audio::Sync::none);
}

/// Returns the values of the first attempt, from `from` on, that no rule about values rejects; the
/// attempt is beyond the last one if there is none.
Result<Sample> SampleRunner::draw(std::uint64_t index, std::size_t from) const {
  const std::size_t attempts = plan_.spec.rejections.attempts;
  for (std::size_t attempt = from; attempt < attempts; ++attempt) {
    Result<SampleValues> values = drawValues(plan_.spec, index, attempt);
    if (!values) return values.error();
    const Result<bool> rejected = isRejected(plan_.spec, *values);
    if (!rejected) return rejected.error();
    if (!*rejected) return Sample{index, attempt, *std::move(values)};
  }
  return Sample{index, attempts, {}};
}

void SampleRunner::keepHead(const Scene& scene) {
  const bool isHeard = std::ranges::any_of(scene.listeners, [](const Listener& listener) {
    return listener.format == ListenerFormat::binaural && listener.hrtf == nullptr;
  });
  if (!isHeard || heads_.contains(scene.sampleRate)) return;
  // Where it cannot be read, the rendering says so.
  if (auto head = loadHrtf({}, scene.sampleRate))
    heads_.emplace(scene.sampleRate, *std::move(head));
}

Result<SampleRunner::Rendered> SampleRunner::render(const Sample& sample,
                                                    const BatchBranch& branch) {
  Rendered rendered;
  const auto fails = [&](const char* kind, const std::string& message) {
    rendered.failure = SampleFailure{kind, branch.name, message};
  };
  const std::string& file = sceneOf(plan_.spec, sample.values);
  Result<json> document = applied(plan_.spec, sample.values, branch, plan_.scenes.at(file));
  if (!document) return document.error();
  rendered.document = *std::move(document);
  Result<Scene> scene = parseScene(rendered.document.dump(), file,
                                   {.confined = true, .folder = (plan_.home / file).parent_path()});
  if (!scene) {
    rendered.overlaps = isOverlap(scene.error());
    fails("refused", scene.error().message);
    return rendered;
  }
  rendered.scene = std::make_unique<Scene>(*std::move(scene));
  rendered.scene->sound.stems = plan_.spec.outputs.stems;
  if (plan_.spec.rejections.overlap && rendered.scene->stepper.type == StepperType::bullet &&
      validateForBullet(*rendered.scene)) {
    const auto [one, other] = overlapAtStart(*rendered.scene);
    rendered.overlaps = !one.empty();
    if (rendered.overlaps) {
      fails("refused", one + " and " + other + " overlap at the start");
      return rendered;
    }
  }
  RunGuard guard(*rendered.scene, plan_.spec.limits);
  RenderOptions options;
  options.tail = kTail;
  options.guard = &guard;
  Result<RenderReport> report = Error{};
  try {
    keepHead(*rendered.scene);
    rendered.sink = std::make_unique<MemorySink>(*rendered.scene, plan_.spec.outputs,
                                                 plan_.spec.rejections.outOfReach.has_value());
    report = renderScene(*rendered.scene, options, *rendered.sink);
  } catch (const std::bad_alloc&) {
    guard.runOut();
  }
  if (const auto& ended = guard.ended()) {
    fails("limit", ended->what);
  } else if (!report) {
    fails("failed", report.error().message);
  } else {
    rendered.report = *std::move(report);
  }
  return rendered;
}

/// Draws a sample until its first branch is neither refused for overlaps nor silent, where the
/// batch asks for that.
Result<SampleRunner::Accepted> SampleRunner::accept(std::uint64_t index) {
  const BatchRejections& rules = plan_.spec.rejections;
  std::string why = "\"expression\"";
  std::size_t from = 0;
  while (true) {
    Result<Sample> sample = draw(index, from);
    if (!sample) return sample.error();
    if (sample->attempt >= rules.attempts) {
      Accepted none{*std::move(sample), {}, true};
      none.first.failure = SampleFailure{
          "rejected", "",
          "each of " + std::to_string(rules.attempts) + " attempts was rejected, the last by " +
              why + "; expected ranges in which more can be, or more \"attempts\""};
      return none;
    }
    if (goesOn_) goesOn_();
    Result<Rendered> first = render(*sample, plan_.spec.branches.front());
    if (!first) return first.error();
    const bool overlaps = rules.overlap && first->overlaps;
    const bool isSilent = !first->failure && rules.silent && !(first->sink->peak() > *rules.silent);
    const bool isFar =
        !first->failure && rules.outOfReach && first->sink->reach() > *rules.outOfReach;
    if (!overlaps && !isSilent && !isFar)
      return Accepted{*std::move(sample), *std::move(first), false};
    why = overlaps ? "\"overlap\"" : isSilent ? "\"silent\"" : "\"out_of_reach\"";
    from = sample->attempt + 1;
  }
}

/// Writes the files of a branch, and returns its row.
Result<ordered_json> SampleRunner::write(const Sample& sample, const BatchBranch& branch,
                                         Rendered& rendered) const {
  const auto nameOf = [&](const char* ending) {
    return sampleFile(sample.index, branch.name, ending);
  };
  const RenderReport& report = rendered.report;
  MemorySink& sink = *rendered.sink;
  const SoundUnit unit = unitOf(plan_.spec.outputs.form, sink);
  ordered_json row = {{"index", sample.index}};
  const auto addSound = [&](const RowFile& keys, const std::string& part,
                            std::vector<float>& samples) -> Status {
    const std::string name = nameOf((part + endingOf(unit.form)).c_str());
    if (Status written = writeSound(plan_.folder / name, *rendered.scene, samples, unit); !written)
      return written;
    const Result<WrittenFile> file = described(plan_.folder, name);
    if (!file) return file.error();
    row[keys.name] = file->name;
    row[keys.bytes] = file->bytes;
    row[keys.hash] = file->sha256;
    return std::monostate{};
  };
  if (!branch.name.empty()) row["branch"] = branch.name;
  row["split"] = splitOf(plan_.spec, sample.index, sample.values);
  if (Status added = addSound(kRowFiles.front(), "", sink.samples()); !added) return added.error();
  const std::array tables = {&sink.events(), &sink.contacts(), &sink.poses()};
  constexpr std::array kEndings = {".events.csv", ".contacts.csv", ".poses.csv"};
  for (std::size_t at = 0; at < tables.size(); ++at) {
    const std::string& table = *tables[at];
    if (table.empty()) continue;
    const std::string name = nameOf(kEndings[at]);
    if (Status written = writeSampleFile(plan_.folder / name, table); !written)
      return written.error();
    const RowFile& keys = kRowFiles.at(at + 1);  // the first is the sound
    row[keys.name] = name;
    row[keys.bytes] = table.size();
    row[keys.hash] = sha256(table);
  }
  for (std::size_t at = 0; plan_.spec.outputs.stems && at < kStems; ++at) {
    const auto stem = static_cast<Stem>(at);
    const std::string part = "." + std::string(scenes::nameOf(stem));
    if (Status added = addSound(kRowFiles.at(kStemFiles + at), part, sink.samples(stem)); !added)
      return added.error();
  }
  row["parameters"] = valuesJson(sample.values);
  row["attempt"] = sample.attempt;
  row["duration_s"] = report.duration;
  row["sample_rate_hz"] = report.sampleRate;
  row["channels"] = report.channels;
  row["peak_pa"] = sink.peak();
  row["full_scale_pa"] = unit.fullScale;
  row["events"] = report.events;
  row["version"] = CAROM_VERSION;
  row["cpu_features"] = machineKind();
  ordered_json record = row;
  record["seed"] = plan_.spec.seed;
  record["plan_hash"] = plan_.hash;
  record["scene"] = rendered.document;
  if (Status written = writeSampleFile(plan_.folder / nameOf(".json"), record.dump(1) + "\n");
      !written)
    return written.error();
  row["wall_s"] = report.wallTime;
  return row;
}

Result<SampleRunner::Outcome> SampleRunner::run(std::uint64_t index) {
  Outcome outcome;
  Result<Accepted> accepted = accept(index);
  if (!accepted) {
    outcome.failures.push_back({"refused", "", accepted.error().message});
    return outcome;
  }
  const Sample& sample = accepted->sample;
  for (std::size_t at = 0; at < plan_.spec.branches.size(); ++at) {
    const BatchBranch& branch = plan_.spec.branches[at];
    if (goesOn_) goesOn_();
    Result<Rendered> rendered = at == 0 ? std::move(accepted->first) : render(sample, branch);
    if (!rendered) {
      outcome.failures.push_back({"refused", branch.name, rendered.error().message});
    } else if (rendered->failure) {
      outcome.failures.push_back(*rendered->failure);
      if (accepted->isRejected) break;
    } else {
      Result<ordered_json> row = write(sample, branch, *rendered);
      if (!row) return row.error();
      outcome.rows.push_back(*std::move(row));
    }
  }
  return outcome;
}

Result<SampleRunner::Outcome> SampleRunner::repeat(std::uint64_t index, const std::string& branch,
                                                   const fs::path& soundFile) {
  const auto& branches = plan_.spec.branches;
  const auto wanted = std::ranges::find(branches, branch, &BatchBranch::name);
  if (wanted == branches.end())
    return Error{"there is no branch \"" + branch + "\" in the batch; expected one of its own"};
  Outcome outcome;
  Result<Accepted> accepted = accept(index);
  if (!accepted) {
    outcome.failures.push_back({"refused", branch, accepted.error().message});
    return outcome;
  }
  const bool isFirst = wanted == branches.begin() || accepted->isRejected;
  Result<Rendered> rendered =
      isFirst ? std::move(accepted->first) : render(accepted->sample, *wanted);
  if (!rendered) {
    outcome.failures.push_back({"refused", branch, rendered.error().message});
    return outcome;
  }
  if (rendered->failure) {
    outcome.failures.push_back(*rendered->failure);
    return outcome;
  }
  const SoundUnit unit = unitOf(plan_.spec.outputs.form, *rendered->sink);
  if (Status written = writeSound(soundFile, *rendered->scene, rendered->sink->samples(), unit);
      !written)
    return written.error();
  const Result<std::string> hash = sha256OfFile(soundFile);
  if (!hash) return cannotWrite(soundFile, hash.error().message);
  outcome.rows.push_back({{"index", index},
                          {"branch", branch},
                          {"file", soundFile.string()},
                          {"sha256", *hash},
                          {"parameters", valuesJson(accepted->sample.values)},
                          {"attempt", accepted->sample.attempt},
                          {"peak_pa", rendered->sink->peak()}});
  return outcome;
}

}  // namespace carom::lab
