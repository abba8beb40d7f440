#pragma once

#include <memory>

#include "carom/carom.h"
#include "carom/radiator_choice.h"

#include "audio/panel_radiator.h"
#include "audio/result.h"
#include "audio/sound_body.h"

namespace carom {

/// Makes SoundBodies of what a C host says about its bodies: mass and shape become the radius, or
/// the added mass and the inertia. [one thread at a time]
class CBodyReader {
 public:
  explicit CBodyReader(RadiatorChoice choice) : choice_(choice) {}

  /// Solves the shape if it is the first of its kind. Errors name the field; what SoundBody does
  /// not allow is left to EventSound::setBody.
  Result<SoundBody> read(const carom_body* given);

 private:
  Status readSolid(const carom_body& given, SoundBody& body);

  RadiatorChoice choice_;
  std::shared_ptr<RadiatorCache> cache_ = std::make_shared<RadiatorCache>();
};

}  // namespace carom
