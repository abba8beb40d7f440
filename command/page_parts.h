#pragma once

#include <filesystem>
#include <vector>

#include "lab/view/view_page.h"

#include "carom/audio/result.h"

namespace carom::command {

/// Returns the folders in which the template of `carom view` may be, by the place of this program.
std::vector<std::filesystem::path> pageFolders();

/// Gives a page the default head, if it is installed; without it, the page has no binaural ears.
/// Errors: those of ViewPage::setHead.
Status addDefaultHead(lab::ViewPage& page);

}  // namespace carom::command
