#pragma once

#include <string>
#include <string_view>

namespace carom::modal {

/// At most 120 characters, all of them printable: names and messages from outside may be long and
/// hold anything. [any thread]
std::string printable(std::string_view text);

}  // namespace carom::modal
