#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "audio/io/partial_file.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// The sound of one event.
struct EventSound {
  double duration = 0.0;  ///< s, of the contact
  double peak = 0.0;      ///< Pa, upper bound at the loudest listener; 0: there is none
  bool isHeard = false;   ///< not left out as inaudible
};

/// Makes the rows of impulse events as CSV (RFC 4180, header row, SI units in the column names,
/// numbers with all their digits: reading them back gives the same bits). One row per event, so two
/// per collision, which have its number: collisions count from 1 in the order of the rows.
/// [one thread]
class EventRows {
 public:
  static std::string_view header();  ///< with its line end
  /// Returns the row of the next event, with its line end. Events come in order of time.
  std::string row(const ImpulseEvent& event, const Scene& scene, const EventSound& sound);

 private:
  /// The first share of a collision whose other share has not come yet.
  struct OpenCollision {
    ImpulseEvent share;
    std::uint64_t number;
  };
  std::uint64_t collisionOf(const ImpulseEvent& event);

  std::vector<OpenCollision> open_;  // of the time of the last event
  std::uint64_t collisions_ = 0;
};

/// Writes EventRows into a file. The file appears under its name, whole, when `finish` succeeds;
/// until then, and if it never does, a file that had the name before stays. [one thread]
class EventsFileWriter {
 public:
  static Result<EventsFileWriter> create(const std::filesystem::path& path);

  /// Writes a row. Events come in order of time.
  void write(const ImpulseEvent& event, const Scene& scene, const EventSound& sound);
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
  EventRows rows_;
};

}  // namespace carom::scenes
