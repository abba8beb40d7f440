#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "carom/audio/result.h"
#include "carom/audio/sound_file.h"
#include "scenes/format/scene.h"
#include "scenes/run/jello_scene.h"

namespace carom::scenes {

/// The outputs that a run of a scene with a jello shall have.
struct JelloOptions {
  /// WAV at the scene's sample rate, with the channels of its listeners as `carom render` has them;
  /// format and scale as `sound` says.
  std::optional<std::filesystem::path> soundFile;
  SoundFileSettings sound = {};
  std::optional<std::filesystem::path> trajectoryFile;  ///< see docs/jello.md
  std::optional<std::filesystem::path> energyFile;      ///< CSV, a row for each picture (frame)
  std::function<void(double share)> progress = {};      ///< 0 to 1
  RunGuard* guard = nullptr;                            ///< if not null, ends the run at its limits
  bool keepPartial = false;  ///< a run that the guard has ended writes its files all the same
};

struct JelloReport {
  std::size_t steps = 0;
  std::size_t evaluations = 0;  ///< of all forces
  /// s, when a jello whose steps are divided first met something, see JelloStepper::follow;
  /// infinite if it has not
  double metAt = std::numeric_limits<double>::infinity();
  double stepsPerSecond = 0.0;  ///< per second of processor time
  native::JelloEnergy start;
  native::JelloEnergy end;
  Vec3 momentum = Vec3::Zero();  ///< N s, of jello and spheres, at the end
  std::size_t touches = 0;       ///< contacts of spheres with the jello that were events
  double peak = 0.0;             ///< Pa
  std::string blowUp;            ///< when and why the run blew up; empty if it did not
  std::optional<EndedEarly> endedEarly = {};  ///< set if the guard ended the run
};

/// A run of a scene with a jello. [one thread]
class JelloRun {
 public:
  /// Chooses integrator and step where the scene leaves them open.
  /// `scene` must outlive the run. Errors: a scene without a jello, a
  /// stepper other than the native one, a world that cannot be run.
  static Result<JelloRun> create(const Scene& scene, const JelloOptions& options);
  JelloRun(JelloRun&&) noexcept;
  ~JelloRun();

  const native::JelloChoice& choice() const { return choice_; }
  /// Largest stable step of the chosen integrator, in s: see jelloLimits.
  double limit() const { return limit_; }

  /// Runs the scene and writes the outputs; to be called once. A run
  /// that blows up is no error: the files hold what came before. Errors:
  /// a file that cannot be written; then none of the files appears.
  Result<JelloReport> run();

 private:
  class Tables;

  JelloRun(const Scene& scene, const JelloOptions& options);
  bool isEnded() const;
  Status hear(JelloReport& report);
  JelloReport reportOf(const JelloSceneStepper& stepper) const;

  const Scene& scene_;
  JelloOptions options_;
  std::unique_ptr<Tables> tables_;
  std::unique_ptr<JelloSceneStepper> stepper_;
  native::JelloChoice choice_;
  double limit_ = 0.0;
};

}  // namespace carom::scenes
