#pragma once

#include <functional>
#include <string_view>

namespace carom {

/// Told now and then what a long computation is at ("factorisation"), and how much of the whole is
/// done, 0 to 1. It goes on while the answer is true; false cancels it, which is an Error of its
/// own. Empty: nobody wants to know. [the thread that computes]
using Progress = std::function<bool(std::string_view stage, double fraction)>;

/// The message of an Error after Progress has said false.
inline constexpr const char* kCancelled = "cancelled";

}  // namespace carom
