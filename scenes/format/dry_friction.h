#pragma once

#include <string_view>

namespace carom::scenes {

/// Returns the coefficient of dry friction of a built-in material on itself, above 0; 0 for a name
/// that no built-in material has. docs/materials.md has the sources. [any thread]
double dryFriction(std::string_view material);

}  // namespace carom::scenes
