#include "scenes/live/scene_drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <variant>

#include <nlohmann/json.hpp>

#include "native/jello/jello_skin.h"
#include "scenes/run/solid_surface.h"

namespace carom::scenes {

using namespace audio;
using nlohmann::ordered_json;

namespace {

ordered_json jsonOf(const Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}
ordered_json jsonOf(const Quat& turn) {
  return {turn.w(), turn.x(), turn.y(), turn.z()};
}
ordered_json jsonOf(const ListenerPose& pose) {
  const Vec3& at = pose.position;
  const Quat& turn = pose.orientation;
  return {at.x(), at.y(), at.z(), turn.w(), turn.x(), turn.y(), turn.z()};
}

/// Describes what is drawn of one scene.
class Drawing {
 public:
  explicit Drawing(const KeepBlob& keep) : keep_(keep) {}

  ordered_json of(const Scene& scene, std::span<const DrawnBody> bodies) {
    run_["name"] = scene.name;
    run_["duration"] = scene.duration;
    run_["sampleRate"] = scene.sampleRate;
    run_["description"] = scene.description;
    run_["gravity"] = jsonOf(scene.gravity);
    run_["meshes"] = ordered_json::array();
    addBodies(scene, bodies);
    addLinks(scene);
    addListeners(scene);
    addRoom(scene);
    return std::move(run_);
  }

 private:
  std::size_t meshOf(const SurfaceMesh& surface) {
    NumberTable table;
    for (const Vec3& vertex : surface.vertices)
      for (const double number : vertex)
        table.add(static_cast<float>(number));
    for (const auto& triangle : surface.triangles)
      for (const std::uint32_t vertex : triangle)
        table.add(vertex);
    run_["meshes"].push_back({{"vertices", surface.vertices.size()},
                              {"triangles", surface.triangles.size()},
                              {"blob", keep_(table.bytes())}});
    return run_["meshes"].size() - 1;
  }

  /// Returns the number of a mesh that several bodies may share.
  template <class Surface>
  std::size_t sharedMesh(const void* key, const Surface& surface) {
    const auto [known, isNew] = meshes_.try_emplace(key, 0);
    if (isNew) known->second = meshOf(surface());
    return known->second;
  }

  ordered_json formOf(const SphereShape& sphere) {
    return {{"kind", "sphere"}, {"radius", sphere.radius}};
  }
  ordered_json formOf(const PlaneShape& plane) {
    return {{"kind", "plane"}, {"normal", jsonOf(plane.normal)}, {"offset", plane.offset}};
  }
  ordered_json formOf(const BlockShape& block) {
    return {{"kind", "box"}, {"half", jsonOf(block.halfExtents)}};
  }
  ordered_json formOf(const SolidShape& solid) {
    const bool isCentred = solid.centreOfMass.norm() == 0.0;
    if (const auto* box = std::get_if<BoxForm>(&solid.form); box && isCentred)
      return {{"kind", "box"}, {"half", jsonOf(box->halfExtents)}};
    if (const auto* cylinder = std::get_if<CylinderForm>(&solid.form); cylinder && isCentred)
      return {{"kind", "cylinder"},
              {"radius", cylinder->radius},
              {"height", cylinder->height},
              {"axis", 1}};
    const auto* const mesh = std::get_if<std::shared_ptr<const SolidMesh>>(&solid.form);
    // Bodies that move have another origin than those that do not.
    const void* const key = mesh == nullptr   ? static_cast<const void*>(&solid)
                            : solid.canMove() ? static_cast<const void*>(mesh->get())
                                              : static_cast<const void*>(&(*mesh)->surface);
    return {{"kind", "mesh"}, {"mesh", sharedMesh(key, [&] { return surfaceOf(solid); })}};
  }
  ordered_json formOf(const std::shared_ptr<const JelloShape>&) { return {{"kind", "jello"}}; }
  ordered_json formOf(const GivenShape& given) {
    const BodyForm& form = given.body->form;
    switch (form.kind) {
      case BodyForm::Kind::sphere:
        return {{"kind", "sphere"}, {"radius", form.size.x()}};
      case BodyForm::Kind::plane:
        return {{"kind", "plane"}, {"normal", jsonOf(form.size)}, {"offset", form.offset}};
      case BodyForm::Kind::box:
        return {{"kind", "box"}, {"half", jsonOf(form.size)}};
      case BodyForm::Kind::mesh:
        return {{"kind", "mesh"},
                {"mesh", sharedMesh(form.mesh.get(), [&] { return *form.mesh; })}};
      case BodyForm::Kind::unknown:
        break;
    }
    return {{"kind", "unknown"}};
  }

  void addBodies(const Scene& scene, std::span<const DrawnBody> bodies) {
    run_["bodies"] = ordered_json::array();
    for (const DrawnBody& drawn : bodies) {
      const HostBody& body = *drawn.body;
      ordered_json object;
      object["id"] = body.id;
      object["name"] = body.name;
      object["material"] = body.sound.material.name;
      if (std::isfinite(body.sound.mass))
        object["mass"] = body.sound.mass;
      else
        object["mass"] = nullptr;
      object["moves"] = drawn.moves;
      object["rings"] = body.sound.modal != nullptr;
      object["textured"] = body.sound.texture != nullptr;
      object["pose"] = jsonOf(drawn.pose);
      object["form"] = std::visit([this](const auto& shape) { return formOf(shape); },
                                  scene.bodies[body.id].shape);
      run_["bodies"].push_back(std::move(object));
    }
  }

  static ordered_json endOf(BodyId body, const Vec3& anchor) {
    const bool isFixed = body == kAnchor;
    return {{"body", isFixed ? std::int64_t{-1} : std::int64_t{body}},
            {"at", jsonOf(isFixed ? anchor : Vec3(0.0, 0.0, 0.0))}};
  }
  void addLinks(const Scene& scene) {
    run_["links"] = ordered_json::array();
    for (const Rod& rod : scene.mechanics.rods)
      run_["links"].push_back(
          {{"kind", "rod"},
           {"ends", {endOf(rod.sphere, rod.anchor), endOf(rod.other, rod.anchor)}}});
    for (const Spring& spring : scene.mechanics.springs)
      run_["links"].push_back(
          {{"kind", "spring"},
           {"ends", {endOf(spring.sphere, spring.anchor), endOf(spring.other, spring.anchor)}}});
  }

  void addListeners(const Scene& scene) {
    run_["listeners"] = ordered_json::array();
    for (std::size_t index = 0; index < scene.listeners.size(); ++index) {
      const Listener& listener = scene.listeners[index];
      ordered_json object;
      object["name"] = listener.name;
      object["format"] = listener.format == ListenerFormat::mono       ? "mono"
                         : listener.format == ListenerFormat::binaural ? "head"
                                                                       : "pair";
      object["position"] = jsonOf(listener.position);
      object["orientation"] = jsonOf(listener.orientation);
      for (const ListenerPath& path : scene.paths) {
        if (path.listener != index || path.poses.empty()) continue;
        NumberTable table;
        table.add(0.0);
        table.add(listener.position);
        table.add(listener.orientation);
        for (const ListenerPose& pose : path.poses) {
          table.add(pose.time);
          table.add(pose.position);
          table.add(pose.orientation);
        }
        object["path"] = keep_(table.bytes());
        object["poses"] = path.poses.size() + 1;
      }
      run_["listeners"].push_back(std::move(object));
    }
  }
  void addRoom(const Scene& scene) {
    if (scene.sound.room.reflectors.empty()) return;
    ordered_json walls = ordered_json::array();
    for (const Reflector& wall : scene.sound.room.reflectors)
      walls.push_back({{"normal", jsonOf(wall.normal)}, {"offset", wall.offset}});
    run_["room"] = {{"walls", std::move(walls)}};
  }

  const KeepBlob& keep_;
  ordered_json run_ = ordered_json::object();
  std::map<const void*, std::size_t> meshes_;
};

ListenerPose poseOf(const SceneBody& body) {
  ListenerPose pose;
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
    pose.position = sphere->position;
    pose.orientation = sphere->orientation;
  } else if (const auto* block = std::get_if<BlockShape>(&body.shape)) {
    pose.position = block->centre;
    pose.orientation = block->orientation;
  } else if (const auto* solid = std::get_if<SolidShape>(&body.shape)) {
    pose.position = solid->position;
    pose.orientation = solid->orientation;
  }
  return pose;
}

}  // namespace

DrawnBody drawnBody(const Scene& scene, const HostBody& body) {
  const SceneBody& entry = scene.bodies[body.id];
  const auto* const solid = std::get_if<SolidShape>(&entry.shape);
  return {&body, isSphere(entry) || (solid != nullptr && solid->canMove()), poseOf(entry)};
}

ordered_json sceneDrawing(const Scene& scene, std::span<const DrawnBody> bodies,
                          const KeepBlob& keep) {
  return Drawing(keep).of(scene, bodies);
}

void addEventRow(const ImpulseEvent& event, const RunPlayer::EventMeasure& measure,
                 ImpulseChoice choice, NumberTable& table) {
  const bool isApplied = choice == ImpulseChoice::applied && event.hasAppliedImpulse;
  const Vec3& impulse = isApplied ? event.appliedImpulse : event.impulse;
  for (const double number :
       {event.time, static_cast<double>(event.body), static_cast<double>(event.other),
        impulse.norm(), event.approachSpeed, measure.duration, measure.peak})
    table.add(number);
  table.add(event.position);
  table.add(impulse);
  table.add(0.0);
}

void addPoseRow(BodyId body, const ListenerPose& pose, NumberTable& table) {
  const Vec3& at = pose.position;
  const Quat& turn = pose.orientation;
  for (const double number : {pose.time, static_cast<double>(body), at.x(), at.y(), at.z(),
                              turn.w(), turn.x(), turn.y(), turn.z()})
    table.add(static_cast<float>(number));
}

JelloOutline::JelloOutline(const JelloShape& jello) {
  const native::JelloSkin skin(jello.lattice.count);
  for (const auto& square : skin.squares())
    for (const std::size_t point : square)
      points_.emplace(point, 0);
  std::uint32_t count = 0;
  for (auto& [point, number] : points_)
    number = count++;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& square : skin.squares()) {
    for (std::size_t side = 0; side < square.size(); ++side)
      edges.insert(
          std::minmax({points_.at(square[side]), points_.at(square[(side + 1) % square.size()])}));
    for (const std::size_t corner : std::array<std::size_t, 6>{0, 1, 2, 0, 2, 3})
      triangles_.push_back(points_.at(square[corner]));
  }
  edges_.assign(edges.begin(), edges.end());
}

ordered_json JelloOutline::drawing(const Scene& scene, std::span<const JelloPicture> pictures,
                                   const KeepBlob& keep) const {
  NumberTable table;
  for (const auto& [from, to] : edges_) {
    table.add(from);
    table.add(to);
  }
  for (const std::uint32_t point : triangles_)
    table.add(point);
  for (const JelloPicture& picture : pictures)
    table.add(picture.time);
  for (const JelloPicture& picture : pictures)
    addPoints(picture, table);
  const auto isJello = [](const SceneBody& body) {
    return std::holds_alternative<std::shared_ptr<const JelloShape>>(body.shape);
  };
  return {{"body", std::ranges::find_if(scene.bodies, isJello) - scene.bodies.begin()},
          {"points", points_.size()},
          {"edges", edges_.size()},
          {"triangles", triangles_.size() / 3},
          {"pictures", pictures.size()},
          {"blob", keep(table.bytes())}};
}

void JelloOutline::addPoints(const JelloPicture& picture, NumberTable& table) const {
  for (const auto& [point, number] : points_)
    for (std::size_t axis = 0; axis < 3; ++axis)
      table.add(picture.points.at(3 * point + axis));
}

}  // namespace carom::scenes
