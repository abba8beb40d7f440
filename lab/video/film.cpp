#include "lab/video/film.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <span>
#include <thread>
#include <utility>

#include "lab/video/camera_path.h"
#include "lab/video/chromium_pipe.h"
#include "lab/video/film_sound.h"
#include "lab/video/scratch_folder.h"
#include "lab/view/view_page.h"
#include <nlohmann/json.hpp>
#include <openssl/evp.h>

#include "audio/io/partial_file.h"

namespace carom::lab {

using nlohmann::json;

namespace {

constexpr double kMeterRange = 60.0;  // dB
constexpr std::chrono::milliseconds kPageBegins(20);
constexpr int kPageLooks = 3000;

/// Returns the bytes of a text in base64, with its padding; none if it is no such text.
std::vector<std::byte> bytesOf(const std::string& text) {
  std::vector<std::byte> bytes(text.size() / 4 * 3);
  const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                                   reinterpret_cast<const unsigned char*>(text.data()),
                                   static_cast<int>(text.size()));
  const auto padding = static_cast<std::size_t>(std::ranges::count(text, '='));
  bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size) - padding);
  return bytes;
}

json jsonOf(const CameraPose& pose) {
  const Vec3& at = pose.position;
  const Quat& turn = pose.orientation;
  return {at.x(), at.y(), at.z(), turn.w(), turn.x(), turn.y(), turn.z()};
}

Error aboutBrowser(const Error& error) {
  return Error{"the browser " + error.message};
}

/// Makes one film.
class FilmMaker {
 public:
  FilmMaker(ViewRun view, const FilmSettings& settings)
      : settings_(settings),
        name_(view.scene.name),
        view_(std::move(view)),
        scratch_(settings.tools.prepare) {
    time_ = {.from = settings.from,
             .speed = settings.speed,
             .rate = settings.rate,
             .pictures = pictureCount(settings, view_.scene.duration)};
  }

  Result<FilmReport> make() {
    if (scratch_.path().empty())
      return Error{"no temporary folder can be made; expected one in TMPDIR"};
    if (Status opened = openPage(); !opened) return opened.error();
    if (Status begun = beginStage(); !begun) return begun.error();
    if (Status sounds = makeSound(); !sounds) return sounds.error();
    audio::PartialFile output(settings_.output);
    if (Status filmed = film(output.path()); !filmed) return filmed.error();
    std::error_code failed;
    const std::uintmax_t bytes = std::filesystem::file_size(output.path(), failed);
    if (!failed) failed = output.giveName();
    if (failed) return Error{settings_.output.string() + ": " + failed.message()};
    return FilmReport{.file = settings_.output,
                      .bytes = bytes,
                      .pictures = time_.pictures,
                      .rate = time_.rate,
                      .duration = time_.seconds(),
                      .channels = sound_.channels,
                      .sampleRate = kFilmSampleRate,
                      .peak = sound_.peak,
                      .fullScale = sound_.fullScale};
  }

 private:
  /// Tells how far a stage is; an error if that ends the work.
  Status tell(std::string_view stage, double share) const {
    if (!settings_.progress || settings_.progress(stage, share)) return std::monostate{};
    return Error{"the film of " + name_ + " has been ended"};
  }

  Status openPage() {
    if (Status told = tell("page", 0.0); !told) return told;
    const std::filesystem::path file = scratch_.path() / "page.html";
    Result<ViewPage> page = ViewPage::create(settings_.tools.pageTemplate, name_);
    if (!page) return page.error();
    if (const Result<bool> added = page->add(view_); !added) return added.error();
    if (const auto written = page->write(file); !written) return written.error();
    auto started =
        ChromiumPipe::start(settings_.tools.browser, scratch_.path(), settings_.tools.prepare);
    if (!started) return aboutBrowser(started.error());
    browser_ = std::make_unique<ChromiumPipe>(*std::move(started));
    if (const Status opened = browser_->open(file, "film", settings_.isLight); !opened)
      return aboutBrowser(opened.error());
    return awaitPage();
  }

  /// Waits until the page is drawn. At first there is another page, or none.
  Status awaitPage() {
    for (int look = 0; look < kPageLooks; ++look) {
      const Result<json> there = browser_->run("typeof globalThis.carom === 'object'");
      if (there && there->is_boolean() && there->get<bool>()) {
        const Result<json> ready = browser_->run("carom.ready.then(() => true)");
        if (!ready) return aboutBrowser(ready.error());
        return std::monostate{};
      }
      if (Status told = tell("page", 0.0); !told) return told;
      std::this_thread::sleep_for(kPageBegins);
    }
    return Error{"the browser does not open the page"};
  }

  /// Gives the page's picture its size, and finds the way of the camera.
  Status beginStage() {
    const json order = {
        {"width", settings_.width},
        {"height", settings_.height},
        {"listener", settings_.listener ? static_cast<int>(*settings_.listener) : -1}};
    const Result<json> view = browser_->run("carom.film.begin(" + order.dump() + ")");
    if (!view) return aboutBrowser(view.error());
    std::vector<scenes::CameraKey> keys = settings_.camera;
    if (keys.empty()) {
      const auto pose = view->at("pose").get<std::vector<double>>();
      scenes::CameraKey& key = keys.emplace_back();
      key.position = {pose.at(0), pose.at(1), pose.at(2)};
      key.orientation = Quat(pose.at(3), pose.at(4), pose.at(5), pose.at(6)).normalized();
      key.fieldOfView = view->at("fov").get<double>();
    }
    camera_.emplace(std::move(keys));
    return std::monostate{};
  }

  Status makeSound() {
    FilmSoundSettings settings;
    settings.listener = settings_.listener;
    settings.ear = settings_.ear;
    settings.fullScale = settings_.fullScale;
    settings.progress = [this](double share) { return static_cast<bool>(tell("sound", share)); };
    if (settings_.head) {
      Result<HrtfSet> head = HrtfSet::create(*settings_.head, kFilmSampleRate);
      if (!head) return head.error();
      settings.head = std::make_shared<const HrtfSet>(*std::move(head));
    }
    Result<FilmSound> sound = renderFilmSound(std::move(view_.run), *camera_, time_, settings);
    if (!sound) return Error{name_ + ": " + sound.error().message};
    sound_ = *std::move(sound);
    std::ofstream file(soundFile(), std::ios::binary);
    const auto bytes = std::as_bytes(std::span(sound_.samples));
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    file.close();
    if (!file) return Error{soundFile().string() + " cannot be written; is the disk full?"};
    return std::monostate{};
  }
  std::filesystem::path soundFile() const { return scratch_.path() / "sound.f32"; }

  /// Returns the script that draws a picture.
  std::string scriptOf(std::size_t picture) const {
    const double time = time_.at(picture);
    const CameraPose pose = camera_->at(time);
    json shown = {{"pose", jsonOf(pose)},
                  {"fov", pose.fieldOfView},
                  {"speed", time_.speed},
                  {"watch", static_cast<double>(picture) / time_.rate},
                  {"captions", settings_.hasCaptions}};
    if (settings_.hasMeter) {
      const double top = 20.0 * std::log10(sound_.fullScale / 20e-6);
      shown["meter"] = {{"top", top}, {"range", kMeterRange}};
      for (const MeterLevel& level : sound_.levels.at(picture))
        shown["levels"].push_back({{"now", level.now}, {"peak", level.peak}});
    }
    return "carom.film.frame(" + json(time).dump() + "," + shown.dump() + ")";
  }

  /// Has all pictures drawn and encoded: while one is encoded the next is drawn.
  Status film(const std::filesystem::path& file) {
    auto encoder = FilmEncoder::start({.program = settings_.tools.encoder,
                                       .output = file,
                                       .sound = soundFile(),
                                       .messages = scratch_.path() / "encoder.txt",
                                       .format = settings_.format,
                                       .rate = time_.rate,
                                       .sampleRate = kFilmSampleRate,
                                       .channels = sound_.channels,
                                       .isLossless = settings_.isLossless},
                                      settings_.tools.prepare);
    if (!encoder) return Error{"ffmpeg " + encoder.error().message};
    Result<std::uint64_t> asked = browser_->ask(scriptOf(0));
    for (std::size_t picture = 0; picture < time_.pictures; ++picture) {
      if (!asked) return aboutBrowser(asked.error());
      const Result<json> drawn = browser_->answer(*asked);
      if (!drawn) return aboutBrowser(drawn.error());
      if (picture + 1 < time_.pictures) asked = browser_->ask(scriptOf(picture + 1));
      const std::vector<std::byte> bytes =
          bytesOf(drawn->is_string() ? drawn->get<std::string>() : std::string());
      if (bytes.empty()) return Error{"the browser has drawn no picture"};
      if (Status added = encoder->add(bytes); !added)
        return Error{"ffmpeg " + added.error().message};
      const double share = static_cast<double>(picture + 1) / static_cast<double>(time_.pictures);
      if (Status told = tell("pictures", share); !told) return told;
    }
    browser_.reset();
    if (Status finished = encoder->finish(); !finished)
      return Error{"ffmpeg " + finished.error().message};
    return std::monostate{};
  }

  const FilmSettings& settings_;
  std::string name_;
  FilmTime time_;
  ViewRun view_;
  ScratchFolder scratch_;  // goes after all that has files in it
  std::unique_ptr<ChromiumPipe> browser_;
  std::optional<CameraPath> camera_;
  FilmSound sound_;
};

}  // namespace

std::size_t pictureCount(const FilmSettings& settings, double runDuration) {
  const double stretch = std::min(settings.to, runDuration) - settings.from;
  const double seconds = std::max(0.0, stretch) / settings.speed + settings.tail;
  return static_cast<std::size_t>(std::max(1.0, std::round(seconds * settings.rate)));
}

Result<FilmReport> makeFilm(ViewRun view, const FilmSettings& settings) {
  return FilmMaker(std::move(view), settings).make();
}

}  // namespace carom::lab
