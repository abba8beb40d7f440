#pragma once

#include <map>
#include <string>
#include <string_view>

#include "carom/audio/contact_state.h"
#include "scenes/format/scene.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// Makes the rows of lasting contacts as CSV, one for each step of each contact: SI units in the
/// column names, world frame. [one thread]
class ContactRows {
 public:
  static std::string_view header();  ///< with its line end
  std::string row(const ContactState& contact, const Scene& scene) const;
};

/// Makes the rows of poses as CSV at a fixed rate from time 0 on: between the poses that a stepper
/// tells, places lie on the straight line and orientations on the shortest turn. [one thread]
class PoseRows {
 public:
  explicit PoseRows(double rate) : rate_(rate) {}  ///< rate in Hz, > 0

  static std::string_view header();  ///< with its line end
  /// Takes the next pose of a body, and returns the rows that are known by it; none, or some.
  std::string rows(const BodyPose& pose, const Scene& scene);

 private:
  struct Followed {
    ListenerPose last;
    std::int64_t next = 0;  // row, at next / rate s
  };
  double rate_;
  std::map<BodyId, Followed> bodies_;
};

}  // namespace carom::scenes
