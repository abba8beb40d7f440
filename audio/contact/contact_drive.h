#pragma once

#include <array>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "audio/contact/contact_noise.h"
#include "audio/model/pulse.h"
#include "carom/audio/surface_texture.h"
#include "carom/audio/texture_coordinates.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// One of the two surfaces of a lasting contact, over one step of the mechanics.
struct ScannedSurface {
  const SurfaceTexture* texture = nullptr;  ///< null: smooth
  /// Coordinates of the texture on the body. Null: it is projected along the body's axes, see
  /// SoundBody::texture.
  const TextureCoordinates* coordinates = nullptr;
  Vec3 from = Vec3::Zero();     ///< m, frame of its body: begin of the contact point's path
  Vec3 to = Vec3::Zero();       ///< m, frame of its body: end of the path
  Vec3 normal = Vec3::UnitZ();  ///< unit, frame of its body: selects the axis of projection
  double ballRadius = 0.0;  ///< m, if the body is a ball about its origin; otherwise 0 or infinite
};

/// Turns the path of a contact over two bumpy surfaces into the impulses that make the bodies
/// follow them.
///
/// Where the contact point moves at v over a surface of slope s, the bumps push the bodies apart at
/// u = v s, summed over both surfaces. So their relative momentum along the normal is m u, and each
/// change of it is an impulse J = m (u' - u) at its own time (Ren, Yeh, Lin 2010, "Synthesizing
/// contact sounds between textured models", IEEE VR; Game Programming Gems 8, chapter 6.3).
///
/// This holds as long as the bodies follow the bumps. They are held together by a load W, and
/// between them is the contact's own spring k: Hertz's at that load, and in series with it that of
/// the asperities which the contact averages out, W over 0.4 of their rms height (Persson 2007,
/// Phys. Rev. Lett. 99, 125502). A dashpot gives an impact the restitution of the pair. So bumps
/// that pass faster than the mass swings on this spring, at sqrt(k / m), are pressed in instead;
/// and no impulse pulls, so a contact that is too fast for its load leaves the surface, falls back
/// at W / m, and chatters.
///
/// The energy that bumps put into that motion is taken from the motion along the surface: in the
/// mean no more than `Step::work`. Beyond that, the bumps are flattened, smoothly.
///
/// Bumps that are smaller than the contact itself are averaged out, as are those that pass faster
/// than the nodes follow each other. And a ball does not reach into a surface that is more curved
/// than itself: each surface is smoothed until its curvature is that of the bodies.
///
/// A time-stepping solver reports a body that slides on many points now at one point and now at
/// another. So a path goes on where the last step's ended, for as long as the steps' paths begin
/// elsewhere, but for where the coordinates of a mesh have a seam; and load and mass are means over
/// the last kSettling. Resting bodies rattle, by up to the distance that they fall from rest in a
/// step: a contact that has not gone farther is still at rest.
class ContactDrive {
 public:
  /// Lowest speed of a sliding contact in m/s: one that moves more slowly over both surfaces is at
  /// rest; once it sounds, it does so down to half of that.
  static constexpr double kSlowest = 1e-3;
  /// Highest speed of a sliding contact in m/s: a faster one has jumped in place.
  static constexpr double kFastest = 1000.0;
  static constexpr double kSettling = 0.03;  ///< s, time constant of the means of load and mass

  struct Step {
    double duration = 0.0;  ///< s, > 0
    double load = 0.0;      ///< N, >= 0
    double mass = 0.0;      ///< kg, > 0, of the pair along the normal
    double radius = 0.0;    ///< m, > 0, radius of curvature: 1/R = 1/R1 + 1/R2
    double modulus = std::numeric_limits<double>::infinity();  ///< Pa, > 0, see contactModulus
    double restitution = 0.0;                                  ///< 1, 0 to 1
    double work = std::numeric_limits<double>::infinity();  ///< J, lost by the motion in the step
    double sampleRate = 0.0;  ///< Hz: there is about one node to a sample
    std::array<ScannedSurface, 2> surfaces;
  };

  /// Computes the impulses of a step as nodes: u in steps since its begin, weight in N s, positive
  /// where the bodies are pushed apart. No nodes if nothing moves. Steps follow each other, without
  /// a gap.
  void advance(const Step& step, std::vector<PulseNode>& nodes);

  /// Follows the contact over a step as `advance` does, at a small part of its cost, without its
  /// impulses. Returns false if nothing moves. Steps of both may alternate.
  bool follow(const Step& step);
  /// Computes the nodes of the step that was followed last, as `advance` would have.
  void giveNodes(const Step& step, std::vector<PulseNode>& nodes);
  /// Returns the contact as it is in the step that was advanced or followed last, which lasted
  /// `duration` (s).
  BumpyContact contact(double duration) const;

  /// Forgets the contact: the next step begins a new one.
  void restart() { *this = {}; }

 private:
  /// The state of the lookup on one of the surfaces.
  struct Scan {
    int axis = -1;                // axis of projection; 3: by coordinates; -1: not known yet
    Vec2 at = Vec2::Zero();       // m, on the texture: the present place
    Vec2 before = Vec2::Zero();   // m, on the texture: the place at the begin of the step
    Vec2 along = Vec2::Zero();    // m, on the texture: displacement in the step
    Vec2 climbed = Vec2::Zero();  // m, on the body: the same along the axes of the slopes
    Vec2 moved = Vec2::Zero();    // m, on the body: displacement since it began to move
    double stretch = 1.0;         // see TextureCoordinates::Patch
    Vec3 end = Vec3::Zero();      // m, frame of the body: end of the path
    Vec2 led = Vec2::Zero();      // m, on the texture: the place of `end` by the coordinates
    SurfaceTexture::Look look;
    const SurfaceTexture* texture = nullptr;  // null: no bumps in this step
  };
  /// The contact's spring and dashpot, for nodes that are dt apart.
  struct Spring {
    double stiffness = 0.0;   // N/m; 0: not known yet
    double damping = 0.0;     // N s/m
    double implicit = 0.5;    // 1, weight of a node's end in the mean over it
    double dt = 0.0;          // s
    double perForce = 0.0;    // m/s per N: change of speed over a node
    double fall = 0.0;        // m/s: change of speed over a node by the load
    double grip = 0.0;        // 1/m: share of the dashpot that acts, by depth of penetration
    double resistance = 0.0;  // N s/m, of spring and dashpot over a node
    double yielding = 1.0;    // 1, factor on the force, as the bodies give way within the node
  };
  bool begin(const Step& step);
  void push(const Step& step, std::vector<PulseNode>& nodes);
  void settle(const Step& step);
  void aim(const Step& step, const ScannedSurface& surface, Scan& scan) const;
  static void project(const ScannedSurface& surface, Scan& scan);
  static void unwrap(const ScannedSurface& surface, Scan& scan);
  bool hasLeft(const Step& step);
  void scan(const Step& step, std::size_t count);
  void addPush(const Scan& scan, double duration);
  void tighten(const Step& step, double dt);
  double swing(double pushed);
  void flatten(const Step& step, double taken);

  bool sounds_ = false;
  bool swings_ = false;  // the step before had nodes
  double load_ = 0.0;    // N
  double mass_ = 0.0;    // kg; 0: not known yet
  double width_ = 0.0;   // m, of the contact
  double speed_ = 0.0;   // m/s, at which the bodies separate
  Spring spring_;
  double pressed_ = 0.0;   // m, penetration; negative: a gap
  double given_ = 0.0;     // W, recent mean of what the motion loses
  double taken_ = 0.0;     // W, recent mean of what the bumps take of it
  double flatness_ = 1.0;  // 1, factor on the bumps now
  double flatter_ = 1.0;   // 1, factor on the bumps at the end of the step
  std::array<Scan, 2> scans_;
  std::vector<double> pushed_;  // m/s, by which the bumps push, at each node of the current step
};

}  // namespace carom::audio
