#pragma once

#include <string>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::test {

/// A small physics server that loads plugins as PyBullet's does: the library that holds it exports
/// the same functions, and it makes the same calls in the same order, over a
/// btMultiBodyDynamicsWorld with PyBullet's settings. The library is opened with RTLD_LOCAL, as
/// Python opens its modules.
class ServerStub {
 public:
  struct Body {
    enum class Form { ball, box, floor, cylinder, capsule, hull, ballPair };
    Form form = Form::ball;
    /// m; x is the radius of a ball, of a cylinder and of a capsule along z, whose whole length is
    /// twice z; a hull has the corners of the box; a pair of balls, as MJCF files have it for
    /// capsules from point to point, ends where such a capsule does.
    Vec3 halfEdges = Vec3::Constant(0.05);
    double mass = 1.0;  ///< kg
    Vec3 position = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
    double restitution = 0.9;
    bool isFixed = false;                ///< useFixedBase
    bool hasMaximalCoordinates = false;  ///< a rigid body, for which the server reports less
    bool isOnSlider = false;             ///< link 0, free along z, of a base without a collider
  };
  /// The answer of p.executePluginCommand.
  struct Reply {
    int result = 0;
    int type = 0;
    std::string text;
  };

  ServerStub() = default;
  ServerStub(const ServerStub&) = delete;
  ServerStub& operator=(const ServerStub&) = delete;
  virtual ~ServerStub() = default;

  /// Adds a body; returns its number, the lowest free one.
  virtual int add(const Body& body) = 0;
  virtual void remove(int body) = 0;
  /// Removes all bodies, as p.resetSimulation.
  virtual void reset() = 0;
  /// Keeps where all bodies are and how they move; returns the number of that state. Not of links.
  virtual int saveState() = 0;
  virtual void restoreState(int state) = 0;
  /// Puts a body to rest somewhere, as p.resetBasePositionAndOrientation.
  virtual void place(int body, const Vec3& position) = 0;
  /// As p.resetBaseVelocity.
  virtual void throwAt(int body, const Vec3& velocity) = 0;
  virtual Vec3 positionOf(int body) const = 0;
  virtual void setTimeStep(double seconds, int substeps) = 0;
  /// Has the end of each substep told before the solver runs, as worlds with deformable bodies do.
  virtual void tellBeforeSolver() = 0;
  /// Tells nothing of steps any more, as some servers might not.
  virtual void tellNothing() = 0;
  /// How often the state of a body was asked for.
  virtual int statesAsked() const = 0;
  virtual void step() = 0;
  /// Loads a plugin; returns 0, or -1 if it was refused.
  virtual int load(const std::string& path, const std::string& postFix) = 0;
  virtual Reply execute(const std::string& text) = 0;
  virtual void unload() = 0;
  /// Velocity of that body along z (m/s) after each substep.
  virtual const std::vector<double>& risingSpeeds(int body) const = 0;
};

}  // namespace carom::test
