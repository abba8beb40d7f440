#pragma once

#include <array>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "audio/pulse.h"
#include "carom/audio/surface_texture.h"
#include "carom/audio/texture_coordinates.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// One of the two surfaces of a lasting contact, over one step of the mechanics.
struct ScannedSurface {
  const SurfaceTexture* texture = nullptr;  ///< null: smooth
  /// How the texture lies on the body. Null: along the axes of the body, see SoundBody::texture.
  const TextureCoordinates* coordinates = nullptr;
  Vec3 from = Vec3::Zero();  ///< m, frame of its body: the contact point's path
  Vec3 to = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< unit, frame of its body: the axis next to it is looked along
  double ballRadius = 0.0;      ///< m, of a ball about the origin; 0: it is none
};

/// From the path of a contact over two bumpy surfaces to the impulses that it takes to follow them.
///
/// Where the contact point moves at v over a surface of slope s, the bumps push the bodies apart at
/// u = v s, of both surfaces together. So their relative momentum along the normal is m u, and each
/// change of it is an impulse J = m (u' - u) at its own time (Ren, Yeh, Lin 2010, "Synthesizing
/// contact sounds between textured models", IEEE VR; Game Programming Gems 8, chapter 6.3).
///
/// That is, as long as they follow. What holds them together is a load W, and between them is the
/// contact's own spring k: Hertz's at that load, and in series with it that of the asperities which
/// the contact averages out, W over 0.4 of their rms height (Persson 2007, Phys. Rev. Lett. 99,
/// 125502). A dashpot gives an impact the restitution of the pair. So bumps that pass faster than
/// the mass swings on it, at sqrt(k / m), are pressed in instead; and no impulse pulls, so a
/// contact that is too fast for its load leaves the surface, falls back at W / m, and chatters.
///
/// What bumps put into that motion, they take from the one along the surface: in the mean no more
/// than `Step::work`. Beyond, the bumps are flattened, smoothly.
///
/// What is smaller than the contact itself is averaged out, as is what passes faster than the
/// nodes follow each other. And a ball does not reach into what is more curved than itself: a
/// surface is seen as coarsely as it takes for its curvature to be that of the bodies.
///
/// Mechanics in steps says of a body that slides on many points now this of them and now that. So a
/// path goes on where the last step's ended, as long as this one's begins elsewhere, but for where
/// the coordinates of a mesh have a seam; and load and mass are means over the last kSettling. What
/// rests rattles, by up to what it falls in a step from rest: a contact that has not gone as far
/// rests still.
class ContactDrive {
 public:
  /// m/s: a contact that moves more slowly over both surfaces is at rest; once it sounds, it does
  /// so down to half of that.
  static constexpr double kSlowest = 1e-3;
  /// m/s: faster is no sliding but a jump in place.
  static constexpr double kFastest = 1000.0;
  static constexpr double kSettling = 0.03;  ///< s

  struct Step {
    double duration = 0.0;  ///< s, > 0
    double load = 0.0;      ///< N, >= 0
    double mass = 0.0;      ///< kg, > 0, of the pair along the normal
    double radius = 0.0;    ///< m, > 0, of curvature: 1/R = 1/R1 + 1/R2
    double modulus = std::numeric_limits<double>::infinity();  ///< Pa, > 0, see contactModulus
    double restitution = 0.0;                                  ///< 1, 0 to 1
    double work = std::numeric_limits<double>::infinity();  ///< J, what the motion has lost in it
    double sampleRate = 0.0;  ///< Hz: there is about one node to a sample
    std::array<ScannedSurface, 2> surfaces;
  };

  /// The impulses of a step as nodes: u in steps since its begin, weight in N s, what pushes the
  /// two apart. None where nothing moves. Steps follow each other, without a gap.
  void advance(const Step& step, std::vector<PulseNode>& nodes);

  /// The next step is a new contact's.
  void restart() { *this = {}; }

 private:
  /// Of one of the surfaces.
  struct Scan {
    int axis = -1;                // looked along
    Vec2 at = Vec2::Zero();       // m, on the texture
    Vec2 along = Vec2::Zero();    // m, on the texture, in the step
    Vec2 climbed = Vec2::Zero();  // m, on the body, in the step, as slopes are
    Vec2 moved = Vec2::Zero();    // m, on the body, since it began to move
    double stretch = 1.0;         // see TextureCoordinates::Patch
    Vec3 end = Vec3::Zero();      // m, of the path, frame of the body
    Vec2 led = Vec2::Zero();      // m, on the texture: where that is
    SurfaceTexture::Look look;
    const SurfaceTexture* texture = nullptr;  // null: nothing to see in this step
  };
  /// The contact's spring and dashpot, for nodes of dt.
  struct Spring {
    double stiffness = 0.0;   // N/m; 0: not known yet
    double damping = 0.0;     // N s/m
    double implicit = 0.5;    // 1, of the end of a node in its mean
    double dt = 0.0;          // s
    double perForce = 0.0;    // m/s for N
    double fall = 0.0;        // m/s
    double grip = 0.0;        // 1/m: of the dashpot, by how deep they are pressed
    double resistance = 0.0;  // N s/m, of both over a node
    double yielding = 1.0;    // 1, of the force, as the bodies give way to it within the node
  };
  void settle(const Step& step);
  void aim(const Step& step, const ScannedSurface& surface, Scan& scan) const;
  static void project(const ScannedSurface& surface, Scan& scan);
  static void unwrap(const ScannedSurface& surface, Scan& scan);
  bool hasLeft(const Step& step);
  double slopeSpeed(double duration, double share) const;
  void scan(const Step& step, std::size_t count);
  void tighten(const Step& step, double dt);
  double swing(double pushed);
  void flatten(const Step& step, double taken);

  bool sounds_ = false;
  double load_ = 0.0;   // N
  double mass_ = 0.0;   // kg; 0: not known yet
  double width_ = 0.0;  // m, of the contact
  double speed_ = 0.0;  // m/s, at which the bodies part
  Spring spring_;
  double pressed_ = 0.0;   // m, into each other; negative: a gap
  double given_ = 0.0;     // W, that the motion loses, of late
  double taken_ = 0.0;     // W, that the bumps take of it, of late
  double flatness_ = 1.0;  // 1, of the bumps now
  double flatter_ = 1.0;   // 1, of the bumps at the end of the step
  std::array<Scan, 2> scans_;
  std::vector<double> pushed_;  // m/s, of the step in hand, by node
};

}  // namespace carom::audio
