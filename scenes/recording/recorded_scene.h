#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "carom/audio/result.h"
#include "carom/native/recording.h"
#include "scenes/format/scene.h"
#include "scenes/run/render.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// A recorded run with its scene: a file of `carom record`. The scene's text is stored in the
/// recording, so that no other file is needed but the heads that the scene names.
struct RecordedScene {
  Scene scene;
  Recording recording;
  std::uintmax_t bytes = 0;  ///< size of the file
};

/// Refuses a scene that cannot be recorded, as far as its stepper goes; the message is the second
/// half of a sentence. [any thread]
Status validateForRecording(const Scene& scene);

/// Runs the scene from its start to its end. `text` is that of the scene's file, `name` the file's
/// name. Refuses scenes on Bullet, and those that the native stepper refuses; a run that the guard,
/// if any, ends is an error, too. [one thread]
Result<Recording> recordScene(const Scene& scene, std::string_view text, std::string_view name,
                              const std::function<void(double share)>& progress = {},
                              RunGuard* guard = nullptr);

/// Writes a file, which appears whole or not at all, and returns its size in bytes.
Result<std::uintmax_t> saveRecording(const Recording& recording, const std::filesystem::path& file);

/// Reads a recording. Refuses whatever `decoded` refuses, and a run that does not belong to the
/// scene in it: one with other bodies, or of another length. Never throws for bad input.
Result<RecordedScene> loadRecordedScene(const std::filesystem::path& file, bool confined = false);

/// True if the file begins as a recording does.
bool isRecording(const std::filesystem::path& file);

/// Returns a stepper that replays a recorded run of the scene from `begin` (s) on. The recording
/// must outlive it.
std::unique_ptr<SceneStepper> replayStepper(const Recording& recording, const Scene& scene,
                                            double begin);
/// Returns what makes these; recording and scene must outlive it.
Replay replayOf(const Recording& recording, const Scene& scene);

}  // namespace carom::scenes
