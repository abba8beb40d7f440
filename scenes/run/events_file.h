#pragma once

#include <filesystem>
#include <fstream>

#include "audio/io/partial_file.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// Writes impulse events as CSV (RFC 4180, header row, SI units in the column names, numbers with
/// all their digits: reading them back gives the same bits). One row per event, so two per
/// collision. The file appears under its name, whole, when `finish` succeeds; until then, and if it
/// never does, a file that had the name before stays. [one thread]
class EventsFileWriter {
 public:
  static Result<EventsFileWriter> create(const std::filesystem::path& path);

  /// Writes a row; `duration` is that of the contact, s.
  void write(const ImpulseEvent& event, const Scene& scene, double duration);
  /// Closes the file. Success means that all of it is on the disk, and only the renaming can still
  /// fail. To be called once at most.
  Status close();
  /// Gives the file its name, and closes it first if that is still to be done. To be called once.
  Status finish();

 private:
  EventsFileWriter(audio::PartialFile file, std::ofstream stream);
  Error failure(const std::string& reason) const;

  audio::PartialFile file_;  // before the stream, which is closed first; then this is removed
  std::ofstream stream_;
};

}  // namespace carom::scenes
