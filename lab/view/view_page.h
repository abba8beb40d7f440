#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lab/view/view_run.h"

#include "audio/propagation/hrtf.h"
#include "carom/audio/result.h"

namespace carom::lab {

/// The content of a page.
struct ViewPage {
  std::string title;
  std::vector<ViewRun> runs;                  ///< at least one
  std::optional<HrtfMeasurements> head = {};  ///< of binaural ears
};

/// A page that has been written.
struct ViewReport {
  std::filesystem::path file;
  std::uintmax_t bytes = 0;
  bool isLive = false;  ///< the engine is in it, so there is sound
};

/// Returns where the page's template is, which `cmake --preset web` makes: at `asked` if that is
/// not empty, or else in one of the folders, relative to that of the program. An error says what to
/// build.
Result<std::filesystem::path> findTemplate(const std::filesystem::path& asked,
                                           const std::vector<std::filesystem::path>& folders);

/// Writes the page: the template with the runs in it. It appears whole or not at all. Errors: a
/// template that is none, a model that cannot be encoded, the disk.
Result<ViewReport> writeViewPage(const ViewPage& page, const std::filesystem::path& pageTemplate,
                                 const std::filesystem::path& file);

}  // namespace carom::lab
