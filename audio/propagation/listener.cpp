#include "carom/audio/listener.h"

#include <cmath>

#include "audio/propagation/receiver.h"

namespace carom {

using namespace audio;

namespace {

constexpr double kUnitTolerance = 1e-6;
constexpr double kMaxSpacing = 100.0;  // m

bool isWithin(double value, double least, double most) {
  return value >= least && value <= most;  // false for NaN
}

std::string rangeError(const std::string& field, double value, const std::string& accepted) {
  return field + " is " + std::to_string(value) + "; it takes " + accepted;
}

bool isPair(const Listener& listener) {
  return listener.format == ListenerFormat::spacedPair ||
         listener.format == ListenerFormat::coincidentPair;
}

Status validatePair(const Listener& listener) {
  if (!isWithin(listener.halfAngle, 0.0, std::numbers::pi))
    return Error{rangeError("halfAngle", listener.halfAngle, "0 to pi rad")};
  if (listener.format == ListenerFormat::spacedPair) {
    if (!isWithin(listener.spacing, 0.0, kMaxSpacing) || listener.spacing == 0.0)
      return Error{rangeError("spacing", listener.spacing, "more than 0 and up to 100 m")};
  } else if (patternOf(listener) == 0.0 || listener.halfAngle == 0.0) {
    return Error{
        "pattern: both channels of this coincident pair would be the same; it takes a pattern "
        "above 0 (0.5 is a cardioid) and a halfAngle above 0"};
  }
  return std::monostate{};
}

}  // namespace

std::size_t channelCount(const Listener& listener) {
  return listener.format == ListenerFormat::mono ? 1 : 2;
}

Status validate(const Listener& listener) {
  if (!listener.position.allFinite()) return Error{"position is not finite; it takes metres"};
  const double length = listener.orientation.norm();
  if (!isWithin(length, 1.0 - kUnitTolerance, 1.0 + kUnitTolerance))
    return Error{rangeError("orientation's length", length, "a quaternion of length 1")};
  if (listener.format < ListenerFormat::mono || listener.format > ListenerFormat::binaural)
    return Error{"format is none of mono, spacedPair, coincidentPair and binaural"};
  if (!isWithin(patternOf(listener), 0.0, 1.0))
    return Error{
        rangeError("pattern", patternOf(listener), "0 (omnidirectional) to 1 (figure of eight)")};
  return isPair(listener) ? validatePair(listener) : std::monostate{};
}

bool isPose(const ListenerPose& pose) {
  return std::isfinite(pose.time) && pose.position.allFinite() &&
         std::abs(pose.orientation.norm() - 1.0) <= kUnitTolerance;
}

}  // namespace carom
