#pragma once

#include <filesystem>
#include <fstream>

#include "audio/partial_file.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// Writes impulse events as CSV (RFC 4180, header row, SI units in the column names, numbers with
/// all their digits: reading them back gives the same bits). One row per event, so two per
/// collision. The file appears under its name, whole, when `finish` succeeds; until then, and if it
/// never does, what was there before stays. [one thread]
class EventsFileWriter {
 public:
  static Result<EventsFileWriter> create(const std::filesystem::path& path);

  /// `duration` of the contact, s.
  void write(const ImpulseEvent& event, const Scene& scene, double duration);
  /// Says whether all of it is on the disk: then nothing but its name can go wrong. Once.
  Status close();
  /// Gives the file its name; closes it first where that is still to be done. Once.
  Status finish();

 private:
  EventsFileWriter(audio::PartialFile file, std::ofstream stream);
  Error failure(const std::string& reason) const;

  audio::PartialFile file_;  // declared before the stream: that is closed first, then this removed
  std::ofstream stream_;
};

}  // namespace carom::scenes
