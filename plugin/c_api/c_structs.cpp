#include "plugin/c_api/c_structs.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "audio/model/immortal.h"
#include "carom/audio/sound_body.h"
#include "plugin/c_api/c_handles.h"
#include "plugin/realtime/statistics_fields.h"

namespace carom::plugin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Most vertices, and most triangles. A larger number is a mistake; a tenth of it takes minutes to
/// solve.
constexpr std::size_t kMostOfAMesh = 10'000'000;

/// A number of SoundStatistics and the field of carom_statistics that shows it.
template <class Number>
struct ShownStatistic {
  Number SoundStatistics::*from;
  Number carom_statistics::*to;
};

constexpr std::array kShownCounts = {
    ShownStatistic<std::uint64_t>{&SoundStatistics::events, &carom_statistics::events},
    ShownStatistic<std::uint64_t>{&SoundStatistics::immovable, &carom_statistics::immovable},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejected, &carom_statistics::rejected},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejectedNotFinite,
                                  &carom_statistics::rejected_not_finite},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejectedUnknownBody,
                                  &carom_statistics::rejected_unknown_body},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejectedNoContact,
                                  &carom_statistics::rejected_no_contact},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejectedTooLong,
                                  &carom_statistics::rejected_too_long},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejectedTooFar,
                                  &carom_statistics::rejected_too_far},
    ShownStatistic<std::uint64_t>{&SoundStatistics::refusedBodies,
                                  &carom_statistics::refused_bodies},
    ShownStatistic<std::uint64_t>{&SoundStatistics::unusedAssignments,
                                  &carom_statistics::unused_assignments},
    ShownStatistic<std::uint64_t>{&SoundStatistics::skipped, &carom_statistics::skipped},
    ShownStatistic<std::uint64_t>{&SoundStatistics::silenced, &carom_statistics::silenced},
    ShownStatistic<std::uint64_t>{&SoundStatistics::inaudible, &carom_statistics::inaudible},
    ShownStatistic<std::uint64_t>{&SoundStatistics::stolen, &carom_statistics::stolen},
    ShownStatistic<std::uint64_t>{&SoundStatistics::overBudget, &carom_statistics::over_budget},
    ShownStatistic<std::uint64_t>{&SoundStatistics::noBus, &carom_statistics::no_bus},
    ShownStatistic<std::uint64_t>{&SoundStatistics::tooLong, &carom_statistics::too_long},
    ShownStatistic<std::uint64_t>{&SoundStatistics::modalVoicesExhausted,
                                  &carom_statistics::modal_voices_exhausted},
    ShownStatistic<std::uint64_t>{&SoundStatistics::queueFaults, &carom_statistics::queue_faults},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rings, &carom_statistics::rings},
    ShownStatistic<std::uint64_t>{&SoundStatistics::late, &carom_statistics::late},
    ShownStatistic<std::uint64_t>{&SoundStatistics::slides, &carom_statistics::slides},
    ShownStatistic<std::uint64_t>{&SoundStatistics::undersampled, &carom_statistics::undersampled},
    ShownStatistic<std::uint64_t>{&SoundStatistics::inaudibleSlides,
                                  &carom_statistics::inaudible_slides},
    ShownStatistic<std::uint64_t>{&SoundStatistics::slidesLeftOut,
                                  &carom_statistics::slides_left_out},
    ShownStatistic<std::uint64_t>{&SoundStatistics::slidesInBed, &carom_statistics::slides_in_bed},
    ShownStatistic<std::uint64_t>{&SoundStatistics::maskedSlides, &carom_statistics::masked_slides},
    ShownStatistic<std::uint64_t>{&SoundStatistics::masked, &carom_statistics::masked},
    ShownStatistic<std::uint64_t>{&SoundStatistics::stalls, &carom_statistics::stalls},
    ShownStatistic<std::uint64_t>{&SoundStatistics::jumps, &carom_statistics::jumps},
    ShownStatistic<std::uint64_t>{&SoundStatistics::voices, &carom_statistics::voices},
    ShownStatistic<std::uint64_t>{&SoundStatistics::buses, &carom_statistics::buses},
    ShownStatistic<std::uint64_t>{&SoundStatistics::ringing, &carom_statistics::ringing},
    ShownStatistic<std::uint64_t>{&SoundStatistics::modes, &carom_statistics::modes},
    ShownStatistic<std::uint64_t>{&SoundStatistics::solvedShapes, &carom_statistics::solved_shapes},
    ShownStatistic<std::uint64_t>{&SoundStatistics::shapesSolvedInStep,
                                  &carom_statistics::shapes_solved_late},
    ShownStatistic<std::uint64_t>{&SoundStatistics::shapesPending,
                                  &carom_statistics::shapes_pending},
    ShownStatistic<std::uint64_t>{&SoundStatistics::unsolvedBodies,
                                  &carom_statistics::unsolved_bodies},
    ShownStatistic<std::uint64_t>{&SoundStatistics::links, &carom_statistics::links},
    ShownStatistic<std::uint64_t>{&SoundStatistics::unsupportedContacts,
                                  &carom_statistics::unsupported_contacts},
    ShownStatistic<std::uint64_t>{&SoundStatistics::heard, &carom_statistics::heard},
    ShownStatistic<std::uint64_t>{&SoundStatistics::lost, &carom_statistics::lost},
    ShownStatistic<std::uint64_t>{&SoundStatistics::ringsLeftOut,
                                  &carom_statistics::rings_left_out},
    ShownStatistic<std::uint64_t>{&SoundStatistics::rejectedSlides,
                                  &carom_statistics::rejected_slides},
    ShownStatistic<std::uint64_t>{&SoundStatistics::silencedFrames,
                                  &carom_statistics::silenced_frames},
    ShownStatistic<std::uint64_t>{&SoundStatistics::posted, &carom_statistics::posted},
    ShownStatistic<std::uint64_t>{&SoundStatistics::waiting, &carom_statistics::waiting}};

constexpr std::array kShownMeasures = {
    ShownStatistic<double>{&SoundStatistics::cpuShare, &carom_statistics::cpu_share},
    ShownStatistic<double>{&SoundStatistics::worstBlock, &carom_statistics::worst_block},
    ShownStatistic<double>{&SoundStatistics::gainReduction, &carom_statistics::gain_reduction},
    ShownStatistic<double>{&SoundStatistics::peak, &carom_statistics::peak},
    ShownStatistic<double>{&SoundStatistics::peakSample, &carom_statistics::peak_sample}};

/// True if every number of the list is shown.
template <class Fields, class Shown>
constexpr bool showsAll(const Fields& fields, const Shown& shown) {
  return std::ranges::all_of(fields, [&](const auto& field) {
    return std::ranges::any_of(shown, [&](const auto& one) { return one.from == field.member; });
  });
}
static_assert(showsAll(kStatisticsCounts, kShownCounts),
              "a count of SoundStatistics has no field in carom_statistics");
static_assert(showsAll(kStatisticsMeasures, kShownMeasures),
              "a measure of SoundStatistics has no field in carom_statistics");

/// Returns the roughness of a built-in material, which lives for ever; NULL for another one.
const carom_roughness* builtInRoughness(const std::string& name) {
  static const std::vector<carom_roughness>& all = audio::immortal([] {
    std::vector<carom_roughness> table;
    for (const Material& material : builtInMaterials())
      table.push_back(toC(material.roughness));
    return table;
  });
  const auto materials = builtInMaterials();
  const auto found = std::ranges::find(materials, name, &Material::name);
  return found == materials.end() ? nullptr
                                  : &all[static_cast<std::size_t>(found - materials.begin())];
}

Result<Roughness> roughnessOf(const carom_material& input) {
  if (input.roughness != nullptr) return roughnessFrom(input.roughness);
  const Material* const known = input.name != nullptr ? findMaterial(input.name) : nullptr;
  return known != nullptr ? known->roughness : Roughness{};
}

Status checkBodySound(const carom_body_sound& input) {
  const auto allowed = [](const void* part) { return part == nullptr ? 2 : 1; };
  return checkChoices({{"carom_body_sound.no_modes", input.no_modes, allowed(input.modes)},
                       {"carom_body_sound.no_texture", input.no_texture, allowed(input.texture)},
                       {"carom_body_sound.no_texture_coordinates", input.no_texture_coordinates,
                        allowed(input.texture_coordinates)},
                       {"carom_body_sound.silent", input.silent, 3}});
}

/// Sets a part of a BodySound: to what the handle shares, or to none.
template <class Handle, class Part>
void setPart(const Handle* handle, std::int32_t none, Part& part) {
  if (handle != nullptr || none != 0) part = sharedFrom(handle);
}

}  // namespace

carom_body defaultBody() {
  const SoundBody body;
  auto made = zeroed<carom_body>();
  made.mass = body.mass;
  made.edge_radius = body.edgeRadius;
  return made;
}

carom_body_sound defaultBodySound() {
  return zeroed<carom_body_sound>();
}

carom_event defaultEvent() {
  auto made = zeroed<carom_event>();
  made.normal[0] = 1.0;
  made.radius = kInfinity;
  made.other_radius = kInfinity;
  made.body_orientation[3] = 1.0;
  made.other_orientation[3] = 1.0;
  return made;
}

carom_contact defaultContact() {
  auto made = zeroed<carom_contact>();
  made.normal[0] = 1.0;
  made.radius = kInfinity;
  made.other_radius = kInfinity;
  made.body_orientation[3] = 1.0;
  made.other_orientation[3] = 1.0;
  made.phase = CAROM_CONTACT_DURING;
  return made;
}

carom_roughness toC(const Roughness& roughness) {
  return {.size = sizeof(carom_roughness),
          .rms_height = roughness.rmsHeight,
          .correlation_length = roughness.correlationLength,
          .hurst = roughness.hurst};
}

carom_roughness defaultRoughness() {
  return toC(Roughness{});
}

carom_normal_map defaultNormalMap() {
  const NormalMapSettings settings;
  auto made = zeroed<carom_normal_map>();
  made.picture_size[0] = settings.size.x();
  made.picture_size[1] = settings.size.y();
  made.strength = settings.strength;
  return made;
}

Result<ImpulseEvent> eventFrom(const carom_event* input) {
  const Result<carom_event> read = readStruct(input, defaultEvent(), "carom_event");
  if (!read) return read.error();
  const Status checked =
      checkChoices({{"carom_event.has_applied_impulse", read->has_applied_impulse, 2},
                    {"carom_event.has_other_pose", read->has_other_pose, 2}});
  if (!checked) return checked.error();
  return ImpulseEvent{.time = read->time,
                      .body = read->body,
                      .other = read->other,
                      .impulse = vectorFrom(read->impulse),
                      .appliedImpulse = vectorFrom(read->applied_impulse),
                      .hasAppliedImpulse = read->has_applied_impulse != 0,
                      .hasOtherPose = read->has_other_pose != 0,
                      .position = vectorFrom(read->position),
                      .normal = vectorFrom(read->normal),
                      .approachSpeed = read->approach_speed,
                      .effectiveMass = read->effective_mass,
                      .radius = read->radius,
                      .otherRadius = read->other_radius,
                      .bodyPosition = vectorFrom(read->body_position),
                      .bodyOrientation = quaternionFrom(read->body_orientation),
                      .bodyVelocity = vectorFrom(read->body_velocity),
                      .bodyAngularVelocity = vectorFrom(read->body_angular_velocity),
                      .otherPosition = vectorFrom(read->other_position),
                      .otherOrientation = quaternionFrom(read->other_orientation)};
}

Result<ContactState> contactFrom(const carom_contact* input) {
  const Result<carom_contact> read = readStruct(input, defaultContact(), "carom_contact");
  if (!read) return read.error();
  const Status checked = checkChoices(
      {{"carom_contact.phase", read->phase, 3}, {"carom_contact.reserved", read->reserved, 1}});
  if (!checked) return checked.error();
  return ContactState{.time = read->time,
                      .duration = read->duration,
                      .phase = static_cast<ContactPhase>(read->phase),
                      .body = read->body,
                      .other = read->other,
                      .normal = vectorFrom(read->normal),
                      .position = vectorFrom(read->position),
                      .normalLoad = read->normal_load,
                      .appliedImpulse = vectorFrom(read->applied_impulse),
                      .radius = read->radius,
                      .otherRadius = read->other_radius,
                      .slipVelocity = vectorFrom(read->slip_velocity),
                      .rollingVelocity = vectorFrom(read->rolling_velocity),
                      .bodyPosition = vectorFrom(read->body_position),
                      .bodyOrientation = quaternionFrom(read->body_orientation),
                      .bodyVelocity = vectorFrom(read->body_velocity),
                      .otherPosition = vectorFrom(read->other_position),
                      .otherOrientation = quaternionFrom(read->other_orientation),
                      .otherVelocity = vectorFrom(read->other_velocity),
                      .pathStart = vectorFrom(read->path_start),
                      .pathEnd = vectorFrom(read->path_end),
                      .otherPathStart = vectorFrom(read->other_path_start),
                      .otherPathEnd = vectorFrom(read->other_path_end)};
}

Result<Roughness> roughnessFrom(const carom_roughness* input) {
  const Result<carom_roughness> read = readStruct(input, defaultRoughness(), "carom_roughness");
  if (!read) return read.error();
  return Roughness{.rmsHeight = read->rms_height,
                   .correlationLength = read->correlation_length,
                   .hurst = read->hurst};
}

Result<Material> materialFrom(const carom_material* input) {
  const Result<carom_material> read = readStruct(input, zeroed<carom_material>(), "carom_material");
  if (!read) return read.error();
  const Result<Roughness> roughness = roughnessOf(*read);
  if (!roughness) return roughness.error();
  return Material{.name = read->name != nullptr ? read->name : "",
                  .density = read->density,
                  .youngsModulus = read->youngs_modulus,
                  .poissonsRatio = read->poissons_ratio,
                  .restitution = read->restitution,
                  .dampingAlpha = read->damping_alpha,
                  .dampingBeta = read->damping_beta,
                  .roughness = *roughness,
                  .lossFactor = read->loss_factor,
                  .lossExponent = read->loss_exponent,
                  .thermal = {.expansion = read->thermal_expansion,
                              .conductivity = read->thermal_conductivity,
                              .heatCapacity = read->heat_capacity}};
}

Result<Material> materialNamed(const char* name) {
  if (name == nullptr)
    return Error{"the name of a material is NULL; expected that of a built-in one"};
  return MaterialChoice(name).material();
}

Result<BodySound> bodySoundFrom(const carom_body_sound* input) {
  const Result<carom_body_sound> read = readStruct(input, defaultBodySound(), "carom_body_sound");
  if (!read) return read.error();
  if (const Status checked = checkBodySound(*read); !checked) return checked.error();
  BodySound sound;
  if (read->own_material != nullptr) {
    Result<Material> material = materialFrom(read->own_material);
    if (!material) return material.error();
    sound.material = *std::move(material);
  } else if (read->material != nullptr) {
    sound.material = read->material;
  }
  setPart(read->modes, read->no_modes, sound.modes);
  setPart(read->texture, read->no_texture, sound.texture);
  setPart(read->texture_coordinates, read->no_texture_coordinates, sound.textureCoordinates);
  if (read->silent != CAROM_UNSET) sound.silent = read->silent == CAROM_YES;
  return sound;
}

Result<NormalMapSettings> normalMapFrom(const carom_normal_map* input) {
  if (input == nullptr) return NormalMapSettings{};
  const Result<carom_normal_map> read = readStruct(input, defaultNormalMap(), "carom_normal_map");
  if (!read) return read.error();
  const Status checked = checkChoices({{"carom_normal_map.green_is_down", read->green_is_down, 2},
                                       {"carom_normal_map.reserved", read->reserved, 1}});
  if (!checked) return checked.error();
  return NormalMapSettings{.size = {read->picture_size[0], read->picture_size[1]},
                           .greenIsDown = read->green_is_down != 0,
                           .strength = read->strength};
}

Result<SurfaceMesh> meshFrom(const carom_mesh& input) {
  if (input.vertices == nullptr) return Error{"vertices is NULL for a mesh"};
  if (input.triangles == nullptr) return Error{"triangles is NULL for a mesh"};
  for (const auto& [name, count] : {std::pair("vertex_count", input.vertex_count),
                                    std::pair("triangle_count", input.triangle_count)})
    if (count > kMostOfAMesh)
      return Error{std::string(name) + " is " + std::to_string(count) + "; expected at most " +
                   std::to_string(kMostOfAMesh)};
  SurfaceMesh mesh;
  mesh.vertices.reserve(input.vertex_count);
  for (std::size_t vertex = 0; vertex < input.vertex_count; ++vertex) {
    const double* const at = input.vertices + 3 * vertex;
    mesh.vertices.emplace_back(at[0], at[1], at[2]);
  }
  mesh.triangles.reserve(input.triangle_count);
  for (std::size_t triangle = 0; triangle < input.triangle_count; ++triangle) {
    const std::uint32_t* const corners = input.triangles + 3 * triangle;
    mesh.triangles.push_back({corners[0], corners[1], corners[2]});
  }
  return mesh;
}

carom_material toC(const Material& material) {
  return {.size = sizeof(carom_material),
          .name = material.name.c_str(),
          .density = material.density,
          .youngs_modulus = material.youngsModulus,
          .poissons_ratio = material.poissonsRatio,
          .restitution = material.restitution,
          .damping_alpha = material.dampingAlpha,
          .damping_beta = material.dampingBeta,
          .roughness = builtInRoughness(material.name),
          .loss_factor = material.lossFactor,
          .loss_exponent = material.lossExponent,
          .thermal_expansion = material.thermal.expansion,
          .thermal_conductivity = material.thermal.conductivity,
          .heat_capacity = material.thermal.heatCapacity};
}

carom_collision toC(const SoundCollision& collision) {
  auto shown = zeroed<carom_collision>();
  shown.time = collision.time;
  shown.body = collision.body;
  shown.other = collision.other;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    shown.position[axis] = collision.position[axis];
    shown.normal[axis] = collision.normal[axis];
  }
  shown.impulse = collision.impulse;
  shown.approach_speed = collision.approachSpeed;
  shown.peak = collision.peak;
  shown.listener_count = collision.heard.size();
  return shown;
}

carom_statistics toC(const SoundStatistics& statistics) {
  auto shown = zeroed<carom_statistics>();
  for (const auto& count : kShownCounts)
    shown.*count.to = statistics.*count.from;
  for (const auto& measure : kShownMeasures)
    shown.*measure.to = statistics.*measure.from;
  return shown;
}

}  // namespace carom::plugin
