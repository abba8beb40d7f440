#include "scenes/run/scene_modes.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "audio/model/sphere_mesh.h"
#include "carom/modal/mesh_analysis.h"
#include "scenes/format/model_file.h"
#include "scenes/run/solid_surface.h"

namespace carom::scenes {

using namespace audio;

namespace {

constexpr std::size_t kSpherePoints = 600;

/// Returns a polyhedron with the volume of the sphere, its vertices evenly spread along a spiral.
SurfaceMesh sphereSurface(double radius) {
  std::vector<Vec3> directions;
  constexpr double kGoldenAngle = 2.399963229728653;  // rad
  for (std::size_t i = 0; i < kSpherePoints; ++i) {
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / kSpherePoints;
    const double turn = kGoldenAngle * static_cast<double>(i);
    const double across = std::sqrt(1.0 - z * z);
    directions.emplace_back(across * std::cos(turn), across * std::sin(turn), z);
  }
  const std::optional<SphereMesh> sphere = SphereMesh::create(directions);
  assert(sphere);
  SurfaceMesh surface{sphere->points(), {}};
  for (std::size_t index = 0; index < sphere->triangles(); ++index) {
    const auto& corner = sphere->corners(index);
    surface.triangles.push_back({static_cast<std::uint32_t>(corner[0]),
                                 static_cast<std::uint32_t>(corner[1]),
                                 static_cast<std::uint32_t>(corner[2])});
  }
  const double volume = signedVolume(surface);
  if (volume < 0.0)
    for (auto& triangle : surface.triangles)
      std::swap(triangle[1], triangle[2]);
  const double grow = radius * std::cbrt(4.0 / 3.0 * std::numbers::pi / std::abs(volume));
  for (Vec3& vertex : surface.vertices)
    vertex *= grow;
  return surface;
}

/// Returns the surface of a body in m, body frame.
SurfaceMesh surfaceOf(const SceneBody& body) {
  if (const auto* solid = std::get_if<SolidShape>(&body.shape)) return surfaceOf(*solid);
  return sphereSurface(std::get<SphereShape>(body.shape).radius);
}

/// Returns the material that a body rings by: of the density that its mass has, if it is given and
/// the body is solid, spread evenly over the volume of its surface.
Material ringingMaterial(const SceneBody& body, const SurfaceMesh& surface) {
  constexpr double kRounding = 1e-6;
  double mass = std::numeric_limits<double>::infinity();
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) mass = sphere->mass;
  if (const auto* solid = std::get_if<SolidShape>(&body.shape)) mass = solid->mass;
  Material material = body.material;
  const double density = mass / signedVolume(surface);
  const bool isGiven = body.ringing->analysis.body == BodyModel::solid && std::isfinite(density) &&
                       density > 0.0 && std::abs(density / material.density - 1.0) > kRounding;
  if (isGiven) material.density = density;
  return material;
}

/// Returns the body's origin in a model from a file, which is in the frame of the body's form.
Vec3 originInFile(const SceneBody& body) {
  const auto* solid = std::get_if<SolidShape>(&body.shape);
  return solid != nullptr ? solid->centreOfMass : Vec3::Zero();
}

class ModesOfBodies {
 public:
  Result<BodyModes> make(const SceneBody& body, const Progress& progress) {
    BodyModes modes;
    if (!body.ringing) return modes;
    const Ringing& ringing = *body.ringing;
    const auto model = ringing.model.empty() ? computed(body, progress) : read(ringing, progress);
    if (!model) return model.error();
    if (!(*model)->modes.empty()) modes.model = *model;
    if (!ringing.model.empty()) modes.origin = originInFile(body);
    return modes;
  }

  using Model = std::shared_ptr<const ModalModel>;

  /// Returns the model with its lowest `most` modes at most; null if none are left.
  Model lowest(const Model& model, std::size_t most) {
    if (model->modes.size() <= most) return model;
    Model& cut = cut_[model];
    if (most == 0 || cut != nullptr) return cut;
    ModalModel fewer = *model;
    fewer.modes.resize(most);
    fewer.shapes.resize(most * 3 * fewer.surface.vertices.size());
    cut = std::make_shared<const ModalModel>(std::move(fewer));
    return cut;
  }

 private:
  struct Computed {
    SurfaceMesh surface;
    Material material;
    MeshAnalysisSettings analysis;
    Model model;
  };

  Result<Model> read(const Ringing& ringing, const Progress& progress) {
    Model& model = files_[ringing.model];
    if (model != nullptr) return model;
    Result<ModalModel> loaded = loadModel(ringing.model);
    if (!loaded) return loaded.error();
    if (const Status heard = addRadiation(*loaded, {}, &cache_, progress); !heard)
      return Error{ringing.model.path.string() + ": " + heard.error().message};
    model = std::make_shared<const ModalModel>(*std::move(loaded));
    return model;
  }

  Result<Model> computed(const SceneBody& body, const Progress& progress) {
    SurfaceMesh surface = surfaceOf(body);
    const Material material = ringingMaterial(body, surface);
    const MeshAnalysisSettings& analysis = body.ringing->analysis;
    const auto known = std::ranges::find_if(computed_, [&](const Computed& one) {
      return one.surface == surface && one.material == material && one.analysis == analysis;
    });
    if (known != computed_.end()) return known->model;
    Result<MeshAnalysis> made = analyseMesh(surface, material, analysis, &cache_, progress);
    if (!made) return Error{"modes: " + made.error().message};
    made->model.name = body.name;
    const Model model = std::make_shared<const ModalModel>(std::move(made->model));
    computed_.push_back({std::move(surface), material, analysis, model});
    return model;
  }

  ModelCache cache_;
  std::map<ModelFile, Model> files_;
  std::vector<Computed> computed_;
  std::map<Model, Model> cut_;
};

}  // namespace

std::vector<ModesToCompute> modesToCompute(const Scene& scene) {
  std::vector<ModesToCompute> all;
  for (const SceneBody& body : scene.bodies) {
    if (!body.ringing || !body.ringing->model.empty()) continue;
    ModesToCompute one{.body = &body, .surface = surfaceOf(body)};
    const bool known = std::ranges::any_of(all, [&](const ModesToCompute& other) {
      return other.surface == one.surface &&
             ringingMaterial(*other.body, other.surface) == ringingMaterial(body, one.surface) &&
             other.body->ringing->analysis == body.ringing->analysis;
    });
    if (!known) all.push_back(std::move(one));
  }
  return all;
}

Result<std::vector<BodyModes>> sceneModes(const Scene& scene, const Progress& progress) {
  ModesOfBodies modes;
  std::vector<BodyModes> all;
  for (const SceneBody& body : scene.bodies) {
    Result<BodyModes> made = modes.make(body, progress);
    if (!made) return Error{body.name + ": " + made.error().message};
    if (scene.mostModes && made->model != nullptr)
      made->model = modes.lowest(made->model, *scene.mostModes);
    all.push_back(*std::move(made));
  }
  return all;
}

}  // namespace carom::scenes
