// Cost and level of sound over ordinary worlds, with nothing set: WORLD.HZ.FIGURE. Five equal
// worlds take turns frame by frame: Bullet alone, with a bridge, with sound that is pulled, with a
// recording, and with the run kept in memory.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <sndfile.h>
#include <unistd.h>

#include "carom/bullet/bullet_bridge.h"
#include "carom/sound.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/figures.h"
#include "tests/bench/scale.h"
#include "tests/support/ordinary_worlds.h"

namespace carom::bench {
namespace {

constexpr double kStillSpeed = 1e-3;     // m/s, as in a Sound
constexpr double kSampleRate = 48000.0;  // Hz
constexpr double kWindow = 0.5;          // s: the worst of these is reported
constexpr double kKept = 3600.0;         // s: the whole run

/// CPU time (s) of frames: the sum of all, and that of each window.
struct Cost {
  double sum = 0.0;
  std::vector<double> windows;

  void add(double seconds, std::size_t window) {
    sum += seconds;
    windows.resize(std::max(windows.size(), window + 1));
    windows[window] += seconds;
  }
};

/// Peak of the samples of a file; 0 if there is none.
double peakOf(const std::string& path) {
  SF_INFO info{};
  SNDFILE* const file = sf_open(path.c_str(), SFM_READ, &info);
  if (file == nullptr) return 0.0;
  std::vector<float> samples(static_cast<std::size_t>(info.frames * info.channels));
  sf_readf_float(file, samples.data(), info.frames);
  sf_close(file);
  double peak = 0.0;
  for (const float sample : samples)
    peak = std::max(peak, std::abs(static_cast<double>(sample)));
  return peak;
}

/// The cost of one world's sound, and its loudness.
struct WorldFigures {
  double bulletPerSecond = 0.0;  // ms
  double bridge = 0.0;           // % of Bullet's step, as are the next six
  double all = 0.0;
  double recording = 0.0;
  double keeping = 0.0;
  double worstBridge = 0.0;  // in the worst half second
  double worstAll = 0.0;
  double peak = 0.0;     // dB of full scale, of the recording
  double limiter = 0.0;  // dB
  double events = 0.0;
  double rejected = 0.0;
  double attach = 0.0;   // ms by the clock
  double runSize = 0.0;  // kB of the run for each second
  double moved = 0.0;    // bodies whose pose is another one with sound
};

class WorldRun {
 public:
  WorldRun(const OrdinaryWorldKind& kind, double rate, double duration)
      : rate_(rate), frames_(static_cast<std::size_t>(std::lround(duration * rate))) {
    for (auto& world : worlds_)
      world = kind.make();
  }

  WorldFigures measure() {
    attach();
    for (std::size_t frame = 0; frame < frames_; ++frame) {
      const auto window = static_cast<std::size_t>(static_cast<double>(frame) / rate_ / kWindow);
      for (std::size_t turn = 0; turn < worlds_.size(); ++turn) {
        const std::size_t which = (frame + turn) % worlds_.size();
        const double begin = cpuSeconds();
        step(which);
        costs_[which].add(cpuSeconds() - begin, window);
      }
    }
    return figures();
  }

 private:
  enum Which : std::size_t { plain, bridged, sounding, recording, keeping };

  void attach() {
    Result<BulletBridge> bridge =
        BulletBridge::attach(worlds_[bridged]->world(), {.delivery = EventDelivery::prompt,
                                                         .stillSpeed = kStillSpeed,
                                                         .search = ImpactSearch::contacts});
    if (!bridge) std::abort();
    bridge_.emplace(*std::move(bridge));
    SoundSettings settings;
    settings.level = Level::automatic;  // as on a device with nothing set
    const auto begin = std::chrono::steady_clock::now();
    sound_.emplace(attached(sounding, settings));
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    attach_ = taken.count();
    if (!sound_->prepareRendering(kSampleRate)) std::abort();
    sound_->renderInterleaved(block_.data(), 64);  // starts the clock
    recorded_.emplace(attached(recording, {.record = file_}));
    kept_.emplace(attached(keeping, {}));
    if (!kept_->keepRun(kKept)) std::abort();
  }

  Sound attached(Which which, const SoundSettings& settings) {
    Result<Sound> sound = Sound::attach(worlds_[which]->world(), settings);
    if (!sound) std::abort();
    return *std::move(sound);
  }

  void step(std::size_t which) {
    worlds_[which]->step(rate_);
    if (which == bridged) bridge_->clear();
    if (which != sounding) return;
    const auto due = static_cast<std::size_t>(worlds_[sounding]->time() * kSampleRate);
    block_.resize(2 * (due - rendered_));
    sound_->renderInterleaved(block_.data(), due - rendered_);
    rendered_ = due;
  }

  double percent(Which which) const {
    return 100.0 * (costs_[which].sum / costs_[plain].sum - 1.0);
  }
  double worstPercent(Which which) const {
    double worst = 0.0;
    for (std::size_t i = 0; i < costs_[plain].windows.size(); ++i)
      worst = std::max(worst, costs_[which].windows[i] / costs_[plain].windows[i] - 1.0);
    return 100.0 * worst;
  }
  double moved() const {
    double count = 0.0;
    const auto& objects = worlds_[plain]->world().getCollisionObjectArray();
    const auto& others = worlds_[sounding]->world().getCollisionObjectArray();
    for (int i = 0; i < objects.size(); ++i)
      count += objects[i]->getWorldTransform() == others[i]->getWorldTransform() ? 0.0 : 1.0;
    return count;
  }

  double runSize() {
    if (!kept_->saveRun(file_)) std::abort();
    return 1e-3 * static_cast<double>(std::filesystem::file_size(file_)) / kept_->time();
  }

  WorldFigures figures() {
    const SoundStatistics heard = sound_->statistics();
    if (!recorded_->close()) std::abort();
    WorldFigures all{
        .bulletPerSecond = 1e3 * costs_[plain].sum / (static_cast<double>(frames_) / rate_),
        .bridge = percent(bridged),
        .all = percent(sounding),
        .recording = percent(recording),
        .keeping = percent(keeping),
        .worstBridge = worstPercent(bridged),
        .worstAll = worstPercent(sounding),
        .peak = 20.0 * std::log10(std::max(peakOf(file_), 1e-10)),
        .limiter = heard.gainReduction,
        .events = static_cast<double>(heard.events),
        .rejected = static_cast<double>(heard.rejected),
        .attach = attach_,
        .runSize = runSize(),
        .moved = moved()};
    std::remove(file_.c_str());
    return all;
  }

  double rate_;  // Hz, of frames
  std::size_t frames_;
  std::array<std::unique_ptr<OrdinaryWorld>, 5> worlds_;
  std::array<Cost, 5> costs_;
  std::string file_ = "/tmp/carom_worlds_bench_" + std::to_string(getpid()) + ".wav";
  std::optional<BulletBridge> bridge_;
  std::optional<Sound> sound_;
  std::optional<Sound> recorded_;
  std::optional<Sound> kept_;
  std::vector<float> block_ = std::vector<float>(128);
  std::size_t rendered_ = 0;
  double attach_ = 0.0;
};

/// A world that is measured once, when a figure of it is asked for.
class MeasuredWorld {
 public:
  MeasuredWorld(const OrdinaryWorldKind& kind, double rate, double duration)
      : kind_(kind), rate_(rate), duration_(duration) {}
  const WorldFigures& figures() {
    if (!figures_) figures_ = WorldRun(kind_, rate_, duration_).measure();
    return *figures_;
  }

 private:
  OrdinaryWorldKind kind_;
  double rate_;
  double duration_;
  std::optional<WorldFigures> figures_;
};

/// Iterations that count as done at once, as all of them give the value that was measured once.
constexpr benchmark::IterationCount kAtOnce = 1'000'000'000;

struct Shown {
  const char* name;
  const char* unit;
  double WorldFigures::*value;
  double noise;
  std::optional<double> bar = std::nullopt;
};

void addWorld(Figures& figures, const OrdinaryWorldKind& kind, double rate, const Scale& scale) {
  const auto world = std::make_shared<MeasuredWorld>(kind, rate, scale.of(5.0, 0.25));
  const double share = scale.of(30.0, 300.0);  // %: a short run is all beginning
  constexpr double kAnything = 1e9;            // figures that say what was measured
  const double bridgeBar = kind.rests ? 5.0 : kind.name == "falling_balls" ? 8.0 : 20.0;
  const std::array shown{
      Shown{"bullet_ms_per_s", "ms", &WorldFigures::bulletPerSecond, kAnything},
      Shown{"bridge_percent", "%", &WorldFigures::bridge, share, bridgeBar},
      Shown{"all_percent", "%", &WorldFigures::all, 2.0 * share, 60.0},
      Shown{"recording_percent", "%", &WorldFigures::recording, 2.0 * share},
      Shown{"kept_run_percent", "%", &WorldFigures::keeping, 2.0 * share},
      Shown{"worst_bridge_percent", "%", &WorldFigures::worstBridge, 4.0 * share},
      Shown{"worst_all_percent", "%", &WorldFigures::worstAll, 8.0 * share},
      Shown{"peak_dbfs", "dB", &WorldFigures::peak, kAnything, -1.0},
      Shown{"limiter_db", "dB", &WorldFigures::limiter, 6.0, 6.0},
      Shown{"events", "", &WorldFigures::events, kAnything},
      Shown{"rejected", "", &WorldFigures::rejected, 10.0},
      Shown{"attach_ms", "ms", &WorldFigures::attach, scale.of(50.0, 500.0), 50.0},
      Shown{"kept_run_kb_per_s", "kB", &WorldFigures::runSize, kAnything},
      Shown{"moved_bodies", "", &WorldFigures::moved, 0.0, 0.0}};
  const std::string prefix = std::string(kind.name) + "." + std::to_string(std::lround(rate)) + ".";
  for (const Shown& figure : shown) {
    Figure row{.name = prefix + figure.name,
               .unit = figure.unit,
               .subject =
                   [world, value = figure.value](benchmark::State& state) {
                     double measured = 0.0;
                     while (state.KeepRunningBatch(kAtOnce))
                       measured = world->figures().*value;
                     reportValue(state, measured);
                   },
               .sense = Sense::lowerIsBetter,
               .noise = figure.noise};
    if (figure.bar) row.bar = Bar{Bar::Of::value, *figure.bar};
    figures.add(besideItsBar(std::move(row)));
  }
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  Figures figures;
  const Scale scale = scaleOf(argc, argv);
  for (const carom::OrdinaryWorldKind& kind : carom::ordinaryWorlds())
    for (const double rate : {60.0, 240.0})
      addWorld(figures, kind, rate, scale);
  return figures.run(argc, argv);
}
