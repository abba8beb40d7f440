#pragma once

#include <cmath>
#include <span>

#include "audio/contact_state.h"
#include "bullet_bridge/bullet_bridge.h"

namespace carom {

// What the programs ask of a bridge beyond the smallest version of it, and what stands in where a
// version lacks it. Templates, so that both compile.

template <class Bridge>
void clearBridge(Bridge& bridge) {
  if constexpr (requires { bridge.clear(); }) {
    bridge.clear();
  } else {
    bridge.clearEvents();
  }
}

template <class Bridge>
constexpr bool kHasContacts = requires(const Bridge& bridge) {
  bridge.contacts();
};

template <class Bridge>
std::span<const ContactState> contactsOf(const Bridge& bridge) {
  if constexpr (kHasContacts<Bridge>) {
    return bridge.contacts();
  } else {
    return {};
  }
}

/// s: no event before it is still to come. Without a word from the bridge on it, events come with
/// their substep.
template <class Bridge>
double settledTimeOf(const Bridge& bridge) {
  if constexpr (requires { bridge.settledTime(); }) {
    return bridge.settledTime();
  } else {
    return bridge.time();
  }
}

/// How many substeps after an impact it has been delivered in any case.
inline int stepsUntilDelivered(double step) {
  constexpr double kLongest = 0.02;  // s; or three substeps, if they are longer
  return 5 + static_cast<int>(std::ceil(kLongest / step));
}

/// Settings that deliver at once, if there is a choice.
template <class Settings>
Settings promptly(Settings settings) {
  if constexpr (requires { settings.delivery; }) {
    settings.delivery = decltype(settings.delivery)::prompt;
  }
  return settings;
}

template <class Bridge>
bool sawUnsupported(const Bridge& bridge) {
  if constexpr (requires { bridge.counters().unsupported; }) {
    return bridge.counters().unsupported > 0;
  } else {
    return false;
  }
}

}  // namespace carom
