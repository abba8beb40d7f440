#pragma once

#include <array>
#include <vector>

#include "audio/pulse.h"
#include "audio/surface_texture.h"
#include "audio/vector.h"

namespace carom {

/// One of the two surfaces of a lasting contact, over one step of the mechanics.
struct ScannedSurface {
  const SurfaceTexture* texture = nullptr;  ///< null: smooth
  Vec3 from = Vec3::Zero();                 ///< m, frame of its body: the contact point's path
  Vec3 to = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< unit, frame of its body: the axis next to it is looked along
};

/// From the path of a contact over two bumpy surfaces to the impulses that it takes to follow them.
///
/// Where the contact point moves at v over a surface of slope s, the bumps push the bodies apart at
/// u = v s, of both surfaces together. So their relative momentum along the normal is m u, and each
/// change of it is an impulse J = m (u' - u) at its own time (Ren, Yeh, Lin 2010, "Synthesizing
/// contact sounds between textured models", IEEE VR; Game Programming Gems 8, chapter 6.3).
///
/// The load W is all that holds them together: where following the surface would take a pull, they
/// part, fall back at W / m, and meet again in an impact with the restitution of the pair. So no
/// impulse pulls harder than the load, and a contact that is too fast for its load chatters.
///
/// What is smaller than the contact itself is averaged out, as is what passes faster than the
/// nodes follow each other.
class ContactDrive {
 public:
  /// m/s: a contact that moves more slowly over both surfaces is at rest; once it sounds, it does
  /// so down to half of that.
  static constexpr double kSlowest = 1e-3;
  /// m/s: faster is no sliding but a jump in place.
  static constexpr double kFastest = 1000.0;

  struct Step {
    double duration = 0.0;     ///< s, > 0
    double load = 0.0;         ///< N, >= 0
    double mass = 0.0;         ///< kg, > 0, of the pair along the normal
    double width = 0.0;        ///< m, >= 0, of the contact
    double restitution = 0.0;  ///< 1, 0 to 1
    double sampleRate = 0.0;   ///< Hz: there is about one node to a sample, or fewer
    std::array<ScannedSurface, 2> surfaces;
  };

  /// The impulses of a step as nodes: u in steps since its begin, weight in N s, what pushes the
  /// two apart; followed by Pulse::kRulePadding zeros. None where nothing moves. Steps follow each
  /// other, without a gap.
  void advance(const Step& step, std::vector<PulseNode>& nodes);

  /// The next step is a new contact's.
  void restart() { *this = {}; }

 private:
  double slopeSpeed(const Step& step, double share) const;
  double follow(const Step& step, double pushed, double dt);

  bool sounds_ = false;
  bool parted_ = false;
  double speed_ = 0.0;  // m/s, at which they part
  double gap_ = 0.0;    // m
  std::array<int, 2> axes_{-1, -1};
};

}  // namespace carom
