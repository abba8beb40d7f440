#pragma once

#include "carom/audio/material.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// An error if temperature, humidity or pressure are out of the ranges of Medium. [any thread]
Status validateAir(const Medium& medium);

}  // namespace carom::audio
