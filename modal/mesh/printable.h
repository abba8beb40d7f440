#pragma once

#include <string>
#include <string_view>

namespace carom::modal {

/// Returns at most 120 characters of the text, all of them printable: names and messages from
/// outside may be long and hold anything. [any thread]
std::string printable(std::string_view text);

}  // namespace carom::modal
