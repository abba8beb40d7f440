#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "carom/audio/vector.h"
#include "carom/sound_settings.h"

namespace carom::plugin {

/// kg/m^3: a body with less is hardly meant so; its mass is a guess, or its unit is not the metre.
inline constexpr double kLightestSolid = 20.0;

/// The facts of a sound that SoundOutput::report puts into words.
struct SoundFacts {
  std::size_t movable = 0;                       ///< bodies that can move
  std::size_t immovable = 0;                     ///< bodies that cannot
  std::size_t silent = 0;                        ///< bodies that BodySound::silent silences
  std::size_t light = 0;                         ///< bodies with less than kLightestSolid
  std::size_t unlikeModel = 0;                   ///< bodies that do not weigh what their model does
  double massUnlikeModel = 0.0;                  ///< kg, of one of these
  double massOfModel = 0.0;                      ///< kg, of its model
  std::map<std::string, std::size_t> guessed{};  ///< materials of bodies that can move, by name
  std::map<std::string, std::size_t> given{};    ///< the same, of bodies to which one is assigned
  Vec3 listener = Vec3::Zero();                  ///< m, the first
  bool isListenerAutomatic = false;              ///< nobody has set it
  bool isHeard = false;                          ///< played, pulled or recorded, now or before
  bool isRun = false;                            ///< what happens is or was recorded as a run
  bool isClosed = false;                         ///< the sound is
  bool isHosted = false;  ///< a host tells bodies and events, of no Bullet world
  bool hasWorld = true;
  double restSpeed = 0.0;  ///< m/s, of such a world
  SoundStatistics statistics{};

  /// Counts a body that weighs so much (kg) and has that model, if the model can hardly be meant
  /// for it.
  void compareMasses(double mass, double modelMass);
};

/// Says in sentences what sounds, how loud, and why something does not. [any thread]
std::string wordsOf(const SoundFacts& facts);

}  // namespace carom::plugin
