#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/recording/run_file.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// The size of a run that recordRun has written.
struct RunReport {
  std::uintmax_t bytes = 0;
  std::uint64_t events = 0;
  std::uint64_t contacts = 0;  ///< states of lasting contacts
  std::uint64_t poses = 0;
  std::uint64_t pictures = 0;  ///< of the jello
};

/// The scene of a run, and where to write it.
struct RunToRecord {
  const Scene* scene = nullptr;  ///< must outlive the recording
  std::string_view text;         ///< of the scene's file
  std::string_view name;         ///< of the scene's file
  std::filesystem::path file;
};

/// Runs a scene on its stepper from its start to its end, and writes what the stepper tells into a
/// file, as it goes. Errors: those of makeStepper and of the disk, the stepper's failure, and a run
/// that the guard, if any, ends. [one thread]
Result<RunReport> recordRun(const RunToRecord& run,
                            const std::function<void(double share)>& progress, RunGuard* guard);

/// A run file with its scene.
struct RecordedRun {
  Scene scene;
  std::shared_ptr<RunReader> reader;  ///< before its first portion
};

/// Opens a run. Refuses whatever RunReader refuses, and a run that does not belong to the scene in
/// it. With `confined`, files that the scene names have to be below the run's folder.
Result<RecordedRun> openRun(const std::filesystem::path& file, bool confined = false);

/// Returns a stepper that plays a run back; it is read once. The bits of a sound that is made of it
/// are those that its own stepper had given. [one thread]
std::unique_ptr<SceneStepper> runStepper(std::shared_ptr<RunReader> reader);

}  // namespace carom::scenes
