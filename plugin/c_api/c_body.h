#pragma once

#include <memory>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/carom.h"
#include "carom/sound.h"

namespace carom::plugin {

/// Makes SoundBodies of the carom_body structs of a C host: mass and shape become the radius, or
/// the added mass and the inertia. [one thread at a time]
class CBodyReader {
 public:
  explicit CBodyReader(RadiatorChoice choice) : choice_(choice) {}

  /// Reads a body; solves its shape if it is the first of its kind. Errors name the field; values
  /// that SoundBody does not allow are left to EventSound::setBody.
  Result<SoundBody> read(const carom_body* input);

 private:
  Status readSolid(const carom_body& input, SoundBody& body);

  RadiatorChoice choice_;
  std::shared_ptr<RadiatorCache> cache_ =
      std::make_shared<RadiatorCache>(PanelSettings{.quick = true});
};

}  // namespace carom::plugin
