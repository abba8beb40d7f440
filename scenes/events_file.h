#pragma once

#include <filesystem>
#include <fstream>

#include "audio/impulse_event.h"
#include "audio/result.h"
#include "scenes/scene.h"

namespace carom {

/// Writes impulse events as CSV (RFC 4180, header row, SI units in the column names, numbers with
/// all their digits: reading them back gives the same bits). One row per event, so two per
/// collision. The file appears under its name, whole, when `finish` succeeds.
class EventsFileWriter {
 public:
  static Result<EventsFileWriter> create(const std::filesystem::path& path);
  EventsFileWriter(EventsFileWriter&&) noexcept = default;
  EventsFileWriter& operator=(EventsFileWriter&&) = delete;
  ~EventsFileWriter();

  /// `duration` of the contact, s.
  void write(const ImpulseEvent& event, const Scene& scene, double duration);
  Status finish();

 private:
  EventsFileWriter(std::filesystem::path path, std::filesystem::path partial, std::ofstream stream);

  std::filesystem::path path_;
  std::filesystem::path partial_;
  std::ofstream stream_;
};

}  // namespace carom
