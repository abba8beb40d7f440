// Names that the fragments of C++ in the pages take as given. docs_snippets compiles each fragment
// as the body of a function in the namespace of its page, page_NAME, or in page_any if it has none
// here.

#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "modal/analysis/shell_model.h"
#include "modal/cache/model_key.h"
#include <carom/audio/material.h>
#include <carom/audio/modal_model_file.h>
#include <carom/bullet/bullet_bridge.h>
#include <carom/bullet/world_advice.h>
#include <carom/event_sound.h>
#include <carom/modal/mesh_analysis.h>
#include <carom/modal/mesh_check.h>
#include <carom/modal/mesh_file.h>
#include <carom/modal/model_cache.h>
#include <carom/native/recording.h>
#include <carom/native/recording_format.h>
#include <carom/native/sphere_stepper.h>
#include <carom/sound.h>

namespace docs_snippets {

/// The result of a fragment, whichever it returns.
struct Returned {
  Returned() = default;
  template <class Value>
  Returned(const Value&) {}
};

int fail(const carom::Error& error);

namespace page_any {
extern btDiscreteDynamicsWorld& world;
extern btRigidBody& ball;
extern btRigidBody& crate;
extern btRigidBody& trigger;
extern btRigidBody& bar;
extern btCollisionShape& plateShape;
extern btRigidBody& camera;
extern const btVector3& eye;
extern const btVector3& target;
extern const btScalar dt;
extern carom::Result<carom::Sound>& sound;
extern const std::shared_ptr<const carom::ModalModel>& model;
extern const std::shared_ptr<const carom::SurfaceTexture>& bumps;
struct Sparks {
  void at(const carom::Vec3& place);
};
extern Sparks& sparks;
struct Device {
  void* userdata;
};
extern Device& device;
}  // namespace page_any

namespace page_bridge {
using namespace carom;
using namespace page_any;
extern const double fixedTimeStep;
}  // namespace page_bridge

namespace page_native {
using namespace carom;
}  // namespace page_native

namespace page_native_replay {
using namespace carom;
extern SphereStepper& stepper;
}  // namespace page_native_replay

namespace page_meshes {
using namespace carom;
}  // namespace page_meshes

namespace page_model_file {
using namespace carom;
extern const SurfaceMesh& mesh;
extern const Material& material;
extern const double elementSize;
}  // namespace page_model_file

namespace page_fit {
extern carom::Sound& sound;
extern btRigidBody& bodyOfBullet;
}  // namespace page_fit

namespace page_modal {
using page_fit::bodyOfBullet;
using page_fit::sound;
extern const carom::SurfaceMesh& surface;
}  // namespace page_modal

}  // namespace docs_snippets
