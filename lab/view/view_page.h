#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "lab/view/view_run.h"

#include "audio/propagation/hrtf.h"
#include "carom/audio/result.h"

namespace carom::lab {

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

/// A page in the making: a template, and the runs that are added to it. What several runs share is
/// in it once. [one thread]
class ViewPage {
 public:
  /// Reads a template. Refuses a file that is none.
  static Result<ViewPage> create(const std::filesystem::path& pageTemplate,
                                 const std::string& title);
  ViewPage(ViewPage&&) noexcept;
  ViewPage& operator=(ViewPage&&) noexcept;
  ~ViewPage();

  /// Sets the head of binaural ears, without which there are none. Refuses what cannot be packed.
  Status setHead(const HrtfMeasurements& head);

  /// Adds a run, unless the page has more than `most` bytes with it: returns whether it was added.
  /// Refuses a model that cannot be encoded.
  Result<bool> add(const ViewRun& run,
                   std::uintmax_t most = std::numeric_limits<std::uintmax_t>::max());
  std::size_t runs() const;
  std::uintmax_t bytes() const;

  /// Writes the page, which appears whole or not at all. Requires a run. Errors: the disk.
  Result<ViewReport> write(const std::filesystem::path& file) const;

 private:
  class Maker;
  explicit ViewPage(std::unique_ptr<Maker> maker);
  std::unique_ptr<Maker> maker_;
};

}  // namespace carom::lab
