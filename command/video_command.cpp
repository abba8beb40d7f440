#include "command/video_command.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iomanip>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "command/command_line.h"
#include "command/library/scene_library.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/signals.h"
#include "command/view_command.h"
#include "lab/video/film.h"
#include "lab/view/view_page.h"
#include "lab/view/view_run.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/partial_file.h"
#include "audio/propagation/sofa_file.h"
#include "audio/run/run_player.h"
#include "scenes/format/scene_loader.h"
#include "scenes/limits/run_guard.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/recording/recorded_scene.h"
#include "scenes/values/camera_reader.h"

namespace carom::command {

namespace fs = std::filesystem;
using namespace scenes;
using namespace lab;

namespace {

constexpr int kLeastSide = 64;  // pixels
constexpr int kMostSide = 7680;
constexpr double kLongestTail = 60.0;  // s

using SizeOfPicture = std::pair<int, int>;

/// Parses "WxH"; nothing if the text is anything else, or a side is odd or out of range.
std::optional<SizeOfPicture> pictureSize(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos) return std::nullopt;
  const auto side = [](std::string_view digits) {
    int pixels = 0;
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), pixels);
    const bool isWhole = read.ec == std::errc() && read.ptr == digits.data() + digits.size();
    return isWhole && pixels >= kLeastSide && pixels <= kMostSide && pixels % 2 == 0 ? pixels : 0;
  };
  const std::string_view all = text;
  const SizeOfPicture size = {side(all.substr(0, cross)), side(all.substr(cross + 1))};
  if (size.first == 0 || size.second == 0) return std::nullopt;
  return size;
}

CLI::Validator pictureSizeRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (pictureSize(text)) return {};
    return "'" + text +
           "' is no size of a picture; expected WxH in pixels, both even, from 64 to 7680, such as "
           "1280x720";
  };
  return {check, "WIDTHxHEIGHT"};
}

std::optional<FilmFormat> formatOf(const std::string& file) {
  const std::string extension = CLI::detail::to_lower(fs::path(file).extension().string());
  if (extension == ".mp4") return FilmFormat::mp4;
  if (extension == ".webm") return FilmFormat::webm;
  return std::nullopt;
}

/// Makes a child what this process was before it began. [in the child]
void becomeOrdinary() {
  restoreSignals();
  liftMemoryCap();
}

/// Finds a program; an error says what to install.
Result<fs::path> toolOf(const std::string& asked, const std::vector<std::string>& names,
                        const std::string& package, const std::string& option) {
  const fs::path found = findProgram(asked.empty() ? names : std::vector<std::string>{asked});
  if (!found.empty()) return found;
  return Error{"video: there is no " + (asked.empty() ? names.front() : "program '" + asked + "'") +
               "; install it (Debian: apt-get install " + package + "), or name it with " + option};
}

Result<FilmTools> findTools(const std::string& browser, const std::string& encoder,
                            const std::string& pageTemplate) {
  FilmTools tools;
  tools.prepare = becomeOrdinary;
  auto ffmpeg = toolOf(encoder, {"ffmpeg"}, "ffmpeg", "--ffmpeg FILE");
  if (!ffmpeg) return ffmpeg.error();
  tools.encoder = *std::move(ffmpeg);
  auto chromium =
      toolOf(browser, {"chromium", "chromium-browser", "google-chrome-stable", "google-chrome"},
             "chromium", "--browser FILE");
  if (!chromium) return chromium.error();
  tools.browser = *std::move(chromium);
  auto page = findTemplate(pageTemplate, pageFolders());
  if (!page) return page.error();
  tools.pageTemplate = *std::move(page);
  return tools;
}

/// Returns the index of a listener by its name; an error says which there are.
Result<std::size_t> listenerOf(const std::string& name, const std::vector<Listener>& listeners) {
  const auto found = std::ranges::find(listeners, name, &Listener::name);
  if (found != listeners.end()) return static_cast<std::size_t>(found - listeners.begin());
  std::string names;
  for (const Listener& listener : listeners)
    names += (names.empty() ? "'" : ", '") + listener.name + "'";
  return Error{"--listener: there is no '" + name + "'; expected one of " + names};
}

ListenerFormat earFormat(const std::string& word) {
  if (word == "mono") return ListenerFormat::mono;
  return word == "head" ? ListenerFormat::binaural : ListenerFormat::spacedPair;
}

nlohmann::ordered_json filmJson(const FilmReport& report, const FilmSettings& settings) {
  const bool isMp4 = settings.format == FilmFormat::mp4;
  nlohmann::ordered_json object;
  object["file"] = report.file.string();
  object["frames"] = report.pictures;
  object["rate_hz"] = report.rate;
  object["duration_s"] = report.duration;
  object["width"] = settings.width;
  object["height"] = settings.height;
  object["codecs"] =
      isMp4 ? nlohmann::ordered_json{"h264", "aac"} : nlohmann::ordered_json{"vp9", "opus"};
  object["from_s"] = settings.from;
  object["speed"] = settings.speed;
  object["channels"] = report.channels;
  object["sample_rate_hz"] = report.sampleRate;
  object["peak_pa"] = report.peak;
  object["full_scale_pa"] = report.fullScale;
  object["bytes"] = report.bytes;
  return object;
}

std::string filmText(const FilmReport& report, const FilmSettings& settings) {
  std::ostringstream text;
  text << report.file.string() << ": " << report.duration << " s, " << report.pictures
       << " pictures of " << settings.width << "x" << settings.height << " at " << report.rate
       << " Hz, " << report.bytes / 1000 << " kB\n"
       << "sound     " << report.channels << (report.channels == 1 ? " channel" : " channels")
       << " at " << report.sampleRate << " Hz\n"
       << std::setprecision(4) << "peak      " << report.peak << " Pa; 1.0 in the sound is "
       << report.fullScale << " Pa\n";
  return text.str();
}

}  // namespace

VideoCommand::VideoCommand(CLI::App& app)
    : command_(app.add_subcommand("video",
                                  "Make a film of a scene, or of a recorded run, with its sound\n"
                                  "Needs Chromium and ffmpeg (docs/video.md).")) {
  command_
      ->add_option("FILE", input_,
                   "scene, by its file or its name in the library, or a file "
                   "of 'carom record' and of hosts")
      ->required()
      ->type_name("SCENE|FILE.carom")
      ->transform(sceneName());
  command_
      ->add_option("-o,--output", output_,
                   "film to write: FILE.mp4 (H.264, AAC) or FILE.webm (VP9, Opus)")
      ->required()
      ->type_name("FILE.mp4")
      ->check(fileName());
  addPicture();
  addSound();
  addPrograms();
  addConfine(*command_, confine_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  addLimits(*command_, run_);
  command_->footer(
      "Examples:\n"
      "  carom video marbles_in_a_box -o marbles.mp4 --captions --meter\n"
      "  carom video billiard_break -o break.webm --size 960x540 --speed 0.1 "
      "--to 0.5\n"
      "  carom video run.carom -o run.mp4 --camera way.json --ear head");
}

/// Adds the options of the pictures, and of the stretch that they show.
void VideoCommand::addPicture() {
  command_->add_option("--size", size_, "width and height in pixels, both even")
      ->check(pictureSizeRange())
      ->capture_default_str();
  command_->add_option("--rate", rate_, "pictures in a second")
      ->check(wholeNumberRange(1, 240, "Hz"))
      ->capture_default_str();
  command_->add_option("--from", from_, "begin here; default: 0")
      ->check(numberRange(0.0, 1e9, "seconds"));
  command_->add_option("--to", to_, "end here; default: the end")
      ->check(numberRange(1e-6, 1e9, "seconds"));
  command_->add_option("--speed", speed_, "of the run's time: 0.1 shows it ten times as long")
      ->check(numberRange(audio::RunPlayer::kSlowest, audio::RunPlayer::kFastest, ""))
      ->capture_default_str();
  command_->add_option("--tail", tail_, "the last picture stays so long, and the sound goes on")
      ->check(numberRange(0.0, kLongestTail, "seconds"))
      ->capture_default_str();
  command_
      ->add_option("--camera", camera_,
                   "file with key frames, as a scene's \"camera\" has them; default: the "
                   "scene's, or else the first view of its page")
      ->type_name("FILE.json");
  command_->add_flag("--captions", captions_,
                     "draw the title, the time, and who has just met whom");
  command_->add_flag("--meter", meter_, "draw the level of the sound");
  command_->add_option("--theme", theme_, "colours")
      ->check(oneOf({"dark", "light"}))
      ->capture_default_str();
}

void VideoCommand::addSound() {
  command_
      ->add_option("--listener", listener_,
                   "what a listener of the scene hears; default: what the camera hears")
      ->type_name("NAME");
  command_
      ->add_option("--ear", ear_, "of the camera: one microphone, two, or a head for headphones")
      ->check(oneOf({"mono", "pair", "head"}))
      ->capture_default_str();
  command_
      ->add_option("--full-scale", fullScale_,
                   "what 1.0 in the sound stands for; louder sound is "
                   "limited; default: so that the peak is at -3 dB")
      ->check(fullScaleRange());
}

/// Adds the options of the mechanics and of the programs that a film takes.
void VideoCommand::addPrograms() {
  command_->add_option("--stepper", stepper_, "mechanics of a scene; default: its own choice")
      ->check(oneOf({"native", "bullet"}));
  command_->add_option("--step", step_, "Bullet's step; default: the scene's own")
      ->check(numberRange(kShortestStep, kLongestStep, "seconds"));
  command_->add_flag("--lossless", lossless_,
                     "lose nothing more of the pictures; mp4 only, several times as large");
  command_->add_option("--browser", browser_, "Chromium; default: the one in PATH")
      ->type_name("PROGRAM");
  command_->add_option("--ffmpeg", encoder_, "ffmpeg; default: the one in PATH")
      ->type_name("PROGRAM");
  command_
      ->add_option("--template", template_,
                   "page without runs, as for 'carom view'; default: the one that was built or "
                   "installed with this program")
      ->type_name("FILE.html");
}

bool VideoCommand::parsed() const {
  return command_->parsed();
}

/// Refuses an output that cannot be written.
Status VideoCommand::checkOutput() const {
  const auto format = formatOf(output_);
  if (!format)
    return Error{"'" + output_ + "' is not the name of a film; expected FILE.mp4 or FILE.webm"};
  if (const Status writable = audio::checkWritable(output_); !writable)
    return Error{output_ + " " + writable.error().message};
  if (lossless_ && *format != FilmFormat::mp4)
    return Error{output_ + " is a WebM; expected FILE.mp4 with --lossless"};
  return std::monostate{};
}

/// Returns the scene with the options of the command line.
Result<Scene> VideoCommand::chosenScene() const {
  Result<Scene> scene = loadScene(input_, {.confined = confine_});
  if (!scene) return scene;
  if (stepper_ == "native") scene->stepper.type = StepperType::native;
  if (stepper_ == "bullet") scene->stepper.type = StepperType::bullet;
  if (step_ > 0.0) scene->stepper.step = step_;
  return scene;
}

/// Returns the settings for a run, but for programs and progress.
Result<FilmSettings> VideoCommand::settingsFor(const Scene& scene) const {
  FilmSettings settings;
  settings.output = output_;
  settings.format = formatOf(output_).value();
  std::tie(settings.width, settings.height) = pictureSize(size_).value();
  settings.rate = rate_;
  settings.from = from_;
  if (to_ > 0.0) settings.to = to_;
  settings.speed = speed_;
  settings.tail = tail_;
  if (const double end = std::min(settings.to, scene.duration); !(from_ < end))
    return Error{"--from: the film would begin where it ends; expected less than " +
                 CLI::detail::to_string(end) + " s"};
  settings.camera = scene.camera;
  if (!camera_.empty()) {
    Result<std::vector<CameraKey>> keys = loadCamera(camera_, scene.gravity);
    if (!keys) return Error{"--camera: " + keys.error().message};
    settings.camera = *std::move(keys);
  }
  settings.ear = earFormat(ear_);
  if (!listener_.empty()) {
    const Result<std::size_t> listener = listenerOf(listener_, scene.listeners);
    if (!listener) return listener.error();
    settings.listener = *listener;
    settings.ear = scene.listeners[*listener].format;
  }
  settings.fullScale = fullScalePressure(fullScale_);
  settings.hasCaptions = captions_;
  settings.hasMeter = meter_;
  settings.isLight = theme_ == "light";
  settings.isLossless = lossless_;
  return settings;
}

int VideoCommand::run() const {
  if (const Status valid = refuseStandardOutput(
          output_, "--output", "the name says the format; expected FILE.mp4 or FILE.webm");
      !valid)
    return fail(kBadInput, valid.error().message);
  if (const Status valid = checkOutput(); !valid)
    return fail(kBadInput, "--output: " + valid.error().message);
  const auto tools = findTools(browser_, encoder_, template_);
  if (!tools) return fail(kFailed, tools.error().message);
  if (const Status kept = checkKept({{"--output", output_}}, {input_, camera_, template_}); !kept)
    return fail(kBadInput, kept.error().message);
  const RunLimits limits = run_.limits();
  capMemory(limits.memory);
  ResourceWatch watch(limits);
  const bool isRun = isRunFile(input_) || isRecording(input_);
  const Result<Scene> scene = isRun ? Scene() : chosenScene();
  if (!scene) return fail(kBadInput, scene.error().message);
  if (const Status kept = checkKept({{"--output", output_}}, scene->files); !kept)
    return fail(kBadInput, kept.error().message);
  MadeView made = isRun ? readView(input_, confine_, limits) : runView(input_, *scene, limits);
  if (const auto* none = std::get_if<NoView>(&made)) return none->code;
  auto& view = std::get<ViewRun>(made);
  view.label = fs::path(input_).stem().string();
  Result<FilmSettings> settings = settingsFor(view.scene);
  if (!settings) return fail(kBadInput, settings.error().message);
  settings->tools = *tools;
  if (settings->ear == ListenerFormat::binaural) {
    auto head = audio::readSofaFile(audio::defaultSofaFile());
    if (!head) return fail(kFailed, head.error().message);
    settings->head = *std::move(head);
  }
  return film(std::move(view), *std::move(settings), watch);
}

int VideoCommand::film(ViewRun view, FilmSettings settings, ResourceWatch& watch) const {
  ProgressBar bar("filming " + view.scene.name);
  std::string limit;
  settings.progress = [&](std::string_view stage, double share) {
    bar.show(share, std::string(stage));
    limit = watch.exceeded();
    return limit.empty();
  };
  const Result<FilmReport> report = makeFilm(std::move(view), settings);
  bar.clear();
  if (!limit.empty()) return endedEarly(input_, watch, limit);
  if (!report) return fail(kFailed, report.error().message);
  return answer(json_ ? jsonText(filmJson(*report, settings)) : filmText(*report, settings));
}

}  // namespace carom::command
