#include "lab/view/view_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <variant>

#include "lab/report/page_text.h"
#include "lab/view/packed_text.h"
#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "audio/io/partial_file.h"
#include "audio/run/head_code.h"
#include "native/jello/jello_skin.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/solid_surface.h"

namespace carom::lab {

using namespace scenes;
using namespace audio;
using nlohmann::ordered_json;

namespace {

constexpr const char* kTemplateName = "carom_view.html";
constexpr std::string_view kMark = "<!-- carom: runs -->";
constexpr std::string_view kEngine = "id=\"carom-engine\"";
constexpr int kFormat = 1;
/// Samples of a head's responses: what HrtfSet keeps of KEMAR's at their rate, and room.
constexpr std::size_t kHeadSamples = 256;

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

/// Numbers in the order in which a page reads them.
class Table {
 public:
  template <class Number>
  void add(Number number) {
    const auto bytes = std::as_bytes(std::span(&number, 1));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void add(const Vec3& vector) {
    for (const double number : vector)
      add(number);
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// Returns the numbers of a table as bytes that pack well: of each column in turn all lowest bytes,
/// then the next, each number as its difference in bits from the one above.
template <class Number>
std::vector<std::byte> inPlanes(std::span<const std::byte> rows, std::size_t columns) {
  const std::size_t row = columns * sizeof(Number);
  std::vector<std::byte> planes;
  planes.reserve(rows.size());
  for (std::size_t at = 0; at < row; ++at)
    for (std::size_t from = at; from < rows.size(); from += row)
      planes.push_back(from < row ? rows[from] : rows[from] ^ rows[from - row]);
  return planes;
}

/// Makes the manifest and the blobs of a page.
class PageMaker {
 public:
  Status add(const ViewPage& page) {
    manifest_["format"] = kFormat;
    manifest_["version"] = CAROM_VERSION;
    manifest_["title"] = page.title;
    if (page.head) manifest_["head"] = blob(encodedHead(*page.head, kHeadSamples));
    for (const ViewRun& run : page.runs)
      if (Status added = add(run); !added) return added;
    return fault_.empty() ? Status(std::monostate{}) : Status(Error{fault_});
  }

  std::string text() const {
    std::string text = "<script type=\"application/json\" id=\"carom-page\">";
    text += jsonInScript(manifest_) + "</script>\n";
    for (std::size_t index = 0; index < blobs_.size(); ++index)
      text += "<script type=\"application/octet-stream\" id=\"carom-blob-" + std::to_string(index) +
              "\">" + blobs_[index] + "</script>\n";
    return text;
  }

 private:
  /// Keeps bytes, and returns the number of their blob.
  std::size_t blob(std::span<const std::byte> bytes) {
    Result<std::string> packed = packedText(bytes);
    if (!packed) fault_ = packed.error().message;
    blobs_.push_back(packed ? *std::move(packed) : std::string());
    return blobs_.size() - 1;
  }

  Status add(const ViewRun& view) {
    const Result<std::vector<std::byte>> sound = encodedRun(view.run);
    if (!sound) return Error{view.scene.name + ": " + sound.error().message};
    meshes_.clear();
    run_ = ordered_json::object();
    run_["label"] = view.label;
    run_["name"] = view.scene.name;
    run_["stepper"] = view.stepper;
    run_["duration"] = view.scene.duration;
    run_["sampleRate"] = view.scene.sampleRate;
    run_["description"] = view.scene.description;
    run_["gravity"] = jsonOf(view.scene.gravity);
    run_["sound"] = blob(*sound);
    run_["meshes"] = ordered_json::array();
    addBodies(view);
    addLinks(view.scene);
    addJello(view);
    addListeners(view.scene);
    addRoom(view.scene);
    addEvents(view);
    addPoses(view);
    addContacts(view);
    manifest_["runs"].push_back(std::move(run_));
    return std::monostate{};
  }

  // --- What is drawn ---

  std::size_t meshOf(const SurfaceMesh& surface) {
    Table table;
    for (const Vec3& vertex : surface.vertices)
      for (const double number : vertex)
        table.add(static_cast<float>(number));
    for (const auto& triangle : surface.triangles)
      for (const std::uint32_t vertex : triangle)
        table.add(vertex);
    run_["meshes"].push_back({{"vertices", surface.vertices.size()},
                              {"triangles", surface.triangles.size()},
                              {"blob", blob(table.bytes())}});
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

  static ListenerPose poseOf(const SceneBody& body) {
    ListenerPose pose;
    if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
      pose.position = sphere->position;
    } else if (const auto* block = std::get_if<BlockShape>(&body.shape)) {
      pose.position = block->centre;
      pose.orientation = block->orientation;
    } else if (const auto* solid = std::get_if<SolidShape>(&body.shape)) {
      pose.position = solid->position;
      pose.orientation = solid->orientation;
    }
    return pose;
  }

  void addBodies(const ViewRun& view) {
    run_["bodies"] = ordered_json::array();
    for (const HostBody& body : view.run.bodies.front().bodies) {
      const SceneBody& entry = view.scene.bodies[body.id];
      const std::vector<ListenerPose>& poses = view.poses[body.id];
      ordered_json object;
      object["id"] = body.id;
      object["name"] = body.name;
      object["material"] = body.sound.material.name;
      if (std::isfinite(body.sound.mass))
        object["mass"] = body.sound.mass;
      else
        object["mass"] = nullptr;
      object["moves"] = poses.size() > 1;
      object["rings"] = body.sound.modal != nullptr;
      object["textured"] = body.sound.texture != nullptr;
      object["pose"] = jsonOf(poses.empty() ? poseOf(entry) : poses.front());
      object["form"] = std::visit([this](const auto& shape) { return formOf(shape); }, entry.shape);
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

  /// Adds what is drawn of a jello: its outermost points, their squares, and all pictures.
  void addJello(const ViewRun& view) {
    const JelloShape* const jello = jelloOf(view.scene);
    if (jello == nullptr || view.pictures.empty()) return;
    const native::JelloSkin skin(jello->lattice.count);
    std::map<std::size_t, std::uint32_t> points;  // of the lattice, by their numbers here
    for (const auto& square : skin.squares())
      for (const std::size_t point : square)
        points.emplace(point, 0);
    std::uint32_t count = 0;
    for (auto& [point, number] : points)
      number = count++;
    Table table;
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> edges;
    for (const auto& square : skin.squares())
      for (std::size_t side = 0; side < square.size(); ++side)
        edges[std::minmax(points.at(square[side]), points.at(square[(side + 1) % 4]))] = true;
    for (const auto& [edge, isThere] : edges) {
      table.add(edge.first);
      table.add(edge.second);
    }
    for (const auto& square : skin.squares())
      for (const std::size_t corner : std::array<std::size_t, 6>{0, 1, 2, 0, 2, 3})
        table.add(points.at(square[corner]));
    for (const JelloPicture& picture : view.pictures)
      table.add(picture.time);
    for (const JelloPicture& picture : view.pictures)
      for (const auto& [point, number] : points)
        for (std::size_t axis = 0; axis < 3; ++axis)
          table.add(picture.points.at(3 * point + axis));
    const auto isJello = [](const SceneBody& body) {
      return std::holds_alternative<std::shared_ptr<const JelloShape>>(body.shape);
    };
    const auto body = std::ranges::find_if(view.scene.bodies, isJello);
    run_["jello"] = {{"body", body - view.scene.bodies.begin()},
                     {"points", points.size()},
                     {"edges", edges.size()},
                     {"triangles", 2 * skin.squares().size()},
                     {"pictures", view.pictures.size()},
                     {"blob", blob(table.bytes())}};
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
        Table table;
        table.add(0.0);
        table.add(listener.position);
        addTurn(table, listener.orientation);
        for (const ListenerPose& pose : path.poses) {
          table.add(pose.time);
          table.add(pose.position);
          addTurn(table, pose.orientation);
        }
        object["path"] = blob(table.bytes());
        object["poses"] = path.poses.size() + 1;
      }
      run_["listeners"].push_back(std::move(object));
    }
  }
  static void addTurn(Table& table, const Quat& turn) {
    for (const double number : {turn.w(), turn.x(), turn.y(), turn.z()})
      table.add(number);
  }

  void addRoom(const Scene& scene) {
    if (scene.sound.room.reflectors.empty()) return;
    ordered_json walls = ordered_json::array();
    for (const Reflector& wall : scene.sound.room.reflectors)
      walls.push_back({{"normal", jsonOf(wall.normal)}, {"offset", wall.offset}});
    run_["room"] = {{"walls", std::move(walls)}};
  }

  // --- What happens ---

  template <class Number>
  void addTable(const char* name, std::size_t columns, const Table& table) {
    run_[name] = {{"rows", table.bytes().size() / (columns * sizeof(Number))},
                  {"blob", blob(inPlanes<Number>(table.bytes(), columns))}};
  }

  void addEvents(const ViewRun& view) {
    Table table;
    const std::vector<EventPlace> order = eventsInOrder(view.run);
    for (std::size_t row = 0; row < order.size(); ++row) {
      const ImpulseEvent& event = view.run.portions[order[row].portion].events[order[row].event];
      const Vec3& impulse =
          view.run.world.synth.impulse == ImpulseChoice::applied && event.hasAppliedImpulse
              ? event.appliedImpulse
              : event.impulse;
      const auto& measure = view.events.at(row);
      table.add(event.time);
      table.add(static_cast<double>(event.body));
      table.add(static_cast<double>(event.other));
      table.add(impulse.norm());
      table.add(event.approachSpeed);
      table.add(measure.duration);
      table.add(measure.peak);
      table.add(event.position);
      table.add(impulse);
      table.add(0.0);
    }
    addTable<double>("events", 14, table);
  }

  void addPoses(const ViewRun& view) {
    Table table;
    for (std::size_t body = 0; body < view.poses.size(); ++body) {
      if (view.poses[body].size() < 2) continue;  // it stays where the manifest has it
      for (const ListenerPose& pose : view.poses[body]) {
        const Quat& turn = pose.orientation;
        for (const double number :
             {pose.time, static_cast<double>(body), pose.position.x(), pose.position.y(),
              pose.position.z(), turn.w(), turn.x(), turn.y(), turn.z()})
          table.add(static_cast<float>(number));
      }
    }
    addTable<float>("poses", 9, table);
  }

  void addContacts(const ViewRun& view) {
    Table table;
    for (const ContactBar& bar : view.contacts)
      for (const double number : {static_cast<double>(bar.body), static_cast<double>(bar.other),
                                  bar.begin, bar.end, bar.slides ? 1.0 : 0.0, bar.meanForce})
        table.add(number);
    addTable<double>("contacts", 6, table);
  }

  ordered_json manifest_;
  ordered_json run_;
  std::map<const void*, std::size_t> meshes_;
  std::vector<std::string> blobs_;
  std::string fault_;
};

}  // namespace

Result<std::filesystem::path> findTemplate(const std::filesystem::path& asked,
                                           const std::vector<std::filesystem::path>& folders) {
  std::error_code ignored;
  if (!asked.empty()) {
    if (std::filesystem::is_regular_file(asked, ignored)) return asked;
    return Error{asked.string() + ": there is no such page template"};
  }
  for (const std::filesystem::path& folder : folders)
    if (std::filesystem::is_regular_file(folder / kTemplateName, ignored))
      return folder / kTemplateName;
  return Error{
      "the page's parts are not built: 'cmake --preset web && cmake --build --preset web' makes "
      "carom_view.html (docs/view.md says what to install for it)"};
}

Result<ViewReport> writeViewPage(const ViewPage& page, const std::filesystem::path& pageTemplate,
                                 const std::filesystem::path& file) {
  const Result<std::vector<std::byte>> read = readBytes(pageTemplate);
  if (!read) return Error{pageTemplate.string() + ": " + read.error().message};
  std::string text(reinterpret_cast<const char*>(read->data()), read->size());
  if (text.find(kMark) == std::string::npos)
    return Error{pageTemplate.string() + ": this is no template of Carom's page"};
  PageMaker maker;
  if (const Status added = maker.add(page); !added) return added.error();
  fillPage(text, kMark, maker.text());
  ViewReport report;
  report.file = file;
  report.bytes = text.size();
  report.isLive = text.find(kEngine) != std::string::npos;
  if (const Status written = writeBytes(file, std::as_bytes(std::span(text))); !written)
    return Error{file.string() + ": " + written.error().message};
  return report;
}

}  // namespace carom::lab
