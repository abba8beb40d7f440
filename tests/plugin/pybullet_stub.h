#pragma once

#include <string>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::test {

/// A small physics server that loads plugins as PyBullet's does: the same functions, exported by
/// the library that holds it, the same calls in the same order, over a btMultiBodyDynamicsWorld
/// with PyBullet's settings. In a library of its own, which is opened as Python opens its modules,
/// with RTLD_LOCAL.
class ServerStub {
 public:
  struct Body {
    enum class Form { ball, box, floor };
    Form form = Form::ball;
    Vec3 halfEdges = Vec3::Constant(0.05);  ///< m; x is the radius of a ball
    double mass = 1.0;                      ///< kg
    Vec3 position = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
    double restitution = 0.9;
    bool isFixed = false;                ///< useFixedBase
    bool hasMaximalCoordinates = false;  ///< a rigid body, of which the server says less
    bool isOnSlider = false;             ///< the link 0 of a base without a collider, free along z
  };
  /// As p.executePluginCommand has it.
  struct Reply {
    int result = 0;
    int type = 0;
    std::string text;
  };

  ServerStub() = default;
  ServerStub(const ServerStub&) = delete;
  ServerStub& operator=(const ServerStub&) = delete;
  virtual ~ServerStub() = default;

  /// Its number: the lowest that is free.
  virtual int add(const Body& body) = 0;
  virtual void remove(int body) = 0;
  virtual void setTimeStep(double seconds, int substeps) = 0;
  virtual void step() = 0;
  /// 0, or -1 if it was not taken.
  virtual int load(const std::string& path, const std::string& postFix) = 0;
  virtual Reply execute(const std::string& text) = 0;
  virtual void unload() = 0;
  /// m/s along z after each substep, of that body.
  virtual const std::vector<double>& risingSpeeds(int body) const = 0;
};

}  // namespace carom::test
