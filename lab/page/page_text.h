#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace carom::lab {

/// Returns an object as JSON in which no '<' stands, so that it cannot end the script element
/// around it.
std::string jsonInScript(const nlohmann::ordered_json& object);

/// Puts `text` in the place of the first `mark` of a page, if there is one.
void fillPage(std::string& page, std::string_view mark, std::string_view text);

}  // namespace carom::lab
