#pragma once

#include "modal/json/json_reader.h"

namespace carom::scenes {

/// The ranges of quantities that occur in several parts of a scene file.
inline constexpr modal::NumberRange kPlace{
    .noun = "a coordinate", .min = -1e6, .max = 1e6, .unit = "metres"};
inline constexpr modal::NumberRange kVelocity{
    .noun = "a component of velocity", .min = -1e4, .max = 1e4, .unit = "m/s"};
inline constexpr modal::NumberRange kRadius{
    .noun = "a radius", .min = 1e-6, .max = 1e4, .unit = "metres"};
inline constexpr modal::NumberRange kMass{
    .noun = "a mass", .min = 1e-21, .max = 1e18, .unit = "kilograms"};
inline constexpr modal::NumberRange kStiffness{
    .noun = "a stiffness", .min = 0.0, .max = 1e12, .unit = "N/m"};
inline constexpr modal::NumberRange kDamping{
    .noun = "a damping", .min = 0.0, .max = 1e9, .unit = "N s/m"};
inline constexpr modal::TextRange kName{.noun = "a name", .minLength = 1, .maxLength = 100};
inline constexpr modal::TextRange kFileName{
    .noun = "the name of a file", .minLength = 1, .maxLength = 1000};

}  // namespace carom::scenes
