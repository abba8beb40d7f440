#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lab/view/held_scene.h"

#include "audio/run/playable_run.h"
#include "audio/run/run_player.h"
#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"

namespace carom::lab {

/// A lasting contact from its begin to its end.
struct ContactBar {
  BodyId body = 0;
  BodyId other = 0;
  double begin = 0.0;      ///< s
  double end = 0.0;        ///< s
  bool slides = false;     ///< over some of the time
  double meanForce = 0.0;  ///< N, normal
};

/// A run as a page shows it: what is drawn, and what is heard.
struct ViewRun {
  std::string id;  ///< by which a page's address may choose it: of a-z, 0-9, _ and -
  std::string label;
  std::string stepper;  ///< "native", "bullet", or "host" of a host's run
  scenes::Scene scene;
  std::string sceneText;   ///< JSON, with which a page can run the scene itself; empty: it cannot
  std::string notLive;     ///< a sentence: why not
  HeldScene held;          ///< the same for a page, where the scene names files; else empty
  audio::PlayableRun run;  ///< without the poses of bodies that do not ring
  std::vector<std::vector<ListenerPose>> poses;  ///< of each body, in order of time
  std::vector<audio::JelloPicture> pictures;
  std::vector<ContactBar> contacts;
  std::vector<audio::RunPlayer::EventMeasure> events;  ///< in the order of eventsInOrder
};

struct ViewOptions {
  /// Returns when (s) an event of the mechanics is heard; empty: at its own time.
  std::function<double(const ImpulseEvent&)> heardAt = {};
  std::function<void(double share)> progress = {};
  Progress analysis = {};  ///< of modes and recoils
  scenes::RunGuard* guard = nullptr;
};

/// The mechanics of a run, as a stepper tells it: all that any sound of it needs.
struct ViewTape {
  std::string stepper;  ///< as in ViewRun
  bool keepsOrder = false;
  double deformationStep = 0.0;  ///< s, see SceneStepper::hearDeformations
  std::vector<audio::RunPortion> portions;
};

/// Runs a scene on its stepper, and keeps what it tells. Errors: those of the stepper, and a run
/// that the guard ends.
Result<ViewTape> recordView(const scenes::Scene& scene, const ViewOptions& options = {});
/// Returns a tape with a scene's sound: of the one that was run, or of one that differs in its
/// sound only. Errors: those of soundBodies.
Result<ViewRun> viewTape(const scenes::Scene& scene, ViewTape tape,
                         const ViewOptions& options = {});
/// Does both.
Result<ViewRun> viewScene(const scenes::Scene& scene, const ViewOptions& options = {});

/// Has a scene on Bullet be heard as its host is told of it without Carom: with the impulses that
/// were applied, pulses as they fall on the samples, and radiation as that of a point.
void hearAsTold(scenes::Scene& scene);
/// Gives a run its scene's text, and what it needs of the files that it names, so that a page can
/// run the scene.
void setSceneText(ViewRun& run, const std::string& text, const std::filesystem::path& sceneFile);

/// Returns the end of the step, of so many s, in which an event is: when Bullet tells it.
double endOfStep(const ImpulseEvent& event, double step);

/// Reads a run that was recorded, of any kind: by `carom record`, or by a host. With `confined`,
/// files that its scene names have to be below its folder.
Result<ViewRun> viewRecorded(const std::filesystem::path& file, bool confined,
                             const ViewOptions& options = {});

}  // namespace carom::lab
