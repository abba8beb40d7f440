#include "audio/propagation/receiver.h"

#include <cmath>

namespace carom::audio {
namespace {

constexpr double kCardioid = 0.5;

/// `side` is -1 for the left and +1 for the right microphone.
Receiver halfOfPair(const Listener& listener, double side) {
  Receiver receiver;
  if (listener.format == ListenerFormat::spacedPair)
    receiver.offset = Vec3(side * 0.5 * listener.spacing, 0.0, 0.0);
  receiver.axis = Vec3(side * std::sin(listener.halfAngle), 0.0, -std::cos(listener.halfAngle));
  receiver.pattern = patternOf(listener);
  return receiver;
}

}  // namespace

double patternOf(const Listener& listener) {
  switch (listener.format) {
    case ListenerFormat::coincidentPair:
      return listener.pattern.value_or(kCardioid);
    case ListenerFormat::mono:
    case ListenerFormat::spacedPair:
      return listener.pattern.value_or(0.0);
    case ListenerFormat::binaural:
      break;
  }
  return 0.0;
}

Receivers receiversOf(const Listener& listener) {
  Receivers receivers;
  receivers.count = channelCount(listener);
  switch (listener.format) {
    case ListenerFormat::mono:
      receivers.items[0].pattern = patternOf(listener);
      break;
    case ListenerFormat::spacedPair:
    case ListenerFormat::coincidentPair:
      receivers.items = {halfOfPair(listener, -1.0), halfOfPair(listener, 1.0)};
      break;
    case ListenerFormat::binaural:
      break;
  }
  return receivers;
}

double gain(const Receiver& receiver, const Quat& orientation, const Vec3& towardsSource) {
  if (receiver.pattern == 0.0) return 1.0;
  const double distance = towardsSource.norm();
  const double cosine =
      distance > 0.0 ? (orientation * receiver.axis).dot(towardsSource) / distance : 0.0;
  return (1.0 - receiver.pattern) + receiver.pattern * cosine;
}

}  // namespace carom::audio
