#include "scenes/format/sound_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "audio/io/byte_file.h"
#include "audio/propagation/reverb.h"
#include "scenes/values/aim.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace audio;
using namespace modal;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kThreshold{
    .noun = "an audible threshold", .min = 0.0, .max = 1000.0, .unit = "pascals"};
constexpr NumberRange kOrder{
    .noun = "an order of reflection", .min = 0.0, .max = 32.0, .whole = true};
constexpr NumberRange kCoefficient{.noun = "an absorption coefficient", .min = 0.0, .max = 1.0};
constexpr NumberRange kDecayTime{
    .noun = "a reverberation time", .min = 0.05, .max = 100.0, .unit = "seconds"};
constexpr NumberRange kRoomVolume{.noun = "a volume", .min = 0.1, .max = 1e6, .unit = "m^3"};
constexpr NumberRange kRoomSurface{.noun = "a surface", .min = 1.0, .max = 1e7, .unit = "m^2"};
constexpr NumberRange kSpacing{
    .noun = "a spacing", .min = 0.0, .max = 100.0, .unit = "metres", .aboveMin = true};
constexpr NumberRange kHalfAngle{
    .noun = "a half angle", .min = 0.0, .max = 180.0, .unit = "degrees"};
constexpr NumberRange kPattern{.noun = "a pattern", .min = 0.0, .max = 1.0};
constexpr NumberRange kPoseTime{
    .noun = "the time of a pose", .min = 0.0, .max = 3600.0, .unit = "seconds", .aboveMin = true};

constexpr TextRange kSurfaceName{.noun = "the name of a surface", .minLength = 1, .maxLength = 100};

std::vector<std::string_view> surfaceNames() {
  std::vector<std::string_view> names;
  for (const Surface& surface : surfaceTable())
    names.push_back(surface.name);
  return names;
}

// ---------------------------------------------------------------------------------------------

class RoomReader {
 public:
  RoomReader(const JsonNode& node, const std::vector<RoomPlane>& planes, double speedOfSound)
      : node_(node), planes_(planes), speedOfSound_(speedOfSound) {}

  void read(SynthSettings& settings);

 private:
  void readSurfaces(const JsonNode& surfaces);
  Absorption readSurface(const JsonNode& node) const;
  void addReflectors();
  void checkImages() const;
  std::optional<ReverbSettings> readReverb(const JsonNode& node) const;
  std::optional<ReverbSettings> boxReverb(const JsonNode& node) const;
  std::optional<ReverbSettings> givenReverb(const JsonNode& node) const;
  bool measure(const JsonNode& node, ReverbSettings& settings) const;

  const JsonNode& node_;
  const std::vector<RoomPlane>& planes_;
  double speedOfSound_;
  std::map<std::string, Absorption, std::less<>> surfaces_;  // by the name of a plane or a box
  Room room_;
};

void RoomReader::read(SynthSettings& settings) {
  if (!node_.expectObject("a room", {"order", "surfaces", "reverb"})) return;
  room_.order = static_cast<int>(node_.number("order", kOrder, 1.0));
  if (const auto surfaces = node_.find("surfaces")) readSurfaces(*surfaces);
  const auto reverb = node_.find("reverb");
  if (planes_.empty() && !node_.failed() && !reverb) {
    node_.fail(
        "the scene has no plane that could reflect; expected a plane or a box among the bodies");
  }
  if (!node_.failed()) addReflectors();
  if (!node_.failed()) checkImages();
  if (reverb && !node_.failed()) settings.reverb = readReverb(*reverb);
  settings.room = std::move(room_);
}

void RoomReader::readSurfaces(const JsonNode& surfaces) {
  if (!surfaces.isObject()) {
    surfaces.failAs("a set of surfaces", "an object: names of planes and boxes, and their surface");
    return;
  }
  std::vector<std::string_view> known;
  for (const RoomPlane& plane : planes_) {
    if (known.empty() || known.back() != plane.entry) known.emplace_back(plane.entry);
  }
  for (const auto& [name, node] : surfaces.members()) {
    if (node.failed()) return;
    const auto isNamed = [&name = name](const RoomPlane& plane) {
      return plane.name == name || plane.entry == name;
    };
    if (std::ranges::none_of(planes_, isNamed)) {
      node.fail("the scene has no plane or box " + inQuotes(name) + suggestion(name, known) +
                (known.empty() ? "; expected no surfaces: there are no planes"
                               : "; expected one of " + quotedList(known) +
                                     ", or a wall of a box, such as \"box1.bottom\""));
      return;
    }
    surfaces_.emplace(name, readSurface(node));
  }
}

Absorption RoomReader::readSurface(const JsonNode& node) const {
  Absorption absorption;
  if (node.isArray()) {
    const auto bands = node.elements("absorption by octave", kBandCount, kBandCount);
    for (std::size_t band = 0; band < bands.size(); ++band)
      absorption.coefficients.at(band) = bands[band].number(kCoefficient);
    return absorption;
  }
  if (!node.isString()) {
    node.failAs("a surface", "the name of one, or 7 absorption coefficients, 125 Hz to 8 kHz");
    return absorption;
  }
  const std::string name = node.text(kSurfaceName);
  if (node.failed()) return absorption;
  if (const Surface* surface = findSurface(name)) return surface->absorption;
  const std::vector<std::string_view> known = surfaceNames();
  node.fail("unknown surface " + inQuotes(name) + suggestion(name, known) + "; expected one of " +
            quotedList(known) + ", or 7 absorption coefficients, 125 Hz to 8 kHz");
  return absorption;
}

void RoomReader::addReflectors() {
  for (const RoomPlane& plane : planes_) {
    Reflector reflector{plane.normal, plane.offset, {}};
    auto given = surfaces_.find(plane.name);
    if (given == surfaces_.end()) given = surfaces_.find(plane.entry);
    if (given != surfaces_.end()) {
      reflector.absorption = given->second;
    } else if (plane.surface != nullptr) {
      reflector.absorption = plane.surface->absorption;
    } else {
      node_.find("surfaces")
          .value_or(node_)
          .fail("what " + inQuotes(plane.name) + ", of " + inQuotes(plane.material) +
                ", absorbs is not known; expected " + inQuotes(plane.entry) +
                " in \"surfaces\", with one of " + quotedList(surfaceNames()) +
                ", or 7 absorption coefficients, 125 Hz to 8 kHz");
      return;
    }
    room_.reflectors.push_back(reflector);
  }
}

void RoomReader::checkImages() const {
  if (room_.reflectors.empty()) return;
  const Result<std::vector<Image>> images = makeImages(room_);
  if (images) return;
  const bool isHigh = room_.order > 1;
  const JsonNode place = isHigh ? node_.find("order").value_or(node_) : node_;
  place.fail(images.error().message + (isHigh ? "; expected order 0 or 1, or one box and no plane"
                                              : " (reflectors are the scene's planes, from 0)"
                                                "; expected planes that differ"));
}

std::optional<ReverbSettings> RoomReader::readReverb(const JsonNode& node) const {
  if (node.isBoolean()) return node.boolean() ? boxReverb(node) : std::nullopt;
  if (!node.isObject()) {
    node.failAs("a reverberation", R"(true, false, or an object with "t60")");
    return std::nullopt;
  }
  if (!node.expectObject("a reverberation", {"t60", "volume", "surface"})) return std::nullopt;
  const std::optional<ReverbSettings> settings = givenReverb(node);
  if (!settings || node.failed()) return std::nullopt;
  // Reverb::create checks all settings, and allocates little at the lowest sample rate.
  if (const auto checked = Reverb::create(*settings, 8000.0, 1); !checked) {
    node.fail(checked.error().message + "; expected a room within these");
    return std::nullopt;
  }
  return settings;
}

std::optional<ReverbSettings> RoomReader::boxReverb(const JsonNode& node) const {
  const Result<ReverbSettings> settings = reverbOfBox(room_, speedOfSound_);
  if (settings) return *settings;
  node.fail(settings.error().message +
            R"(; expected false, or an object with "t60", "volume" and "surface")");
  return std::nullopt;
}

std::optional<ReverbSettings> RoomReader::givenReverb(const JsonNode& node) const {
  ReverbSettings settings;
  settings.speedOfSound = speedOfSound_;
  if (!measure(node, settings)) return std::nullopt;
  const auto time = node.require("t60", kDecayTime.describe() + ", or an array of 7 such");
  if (!time) return std::nullopt;
  if (time->isArray()) {
    const auto bands = time->elements("reverberation times by octave", kBandCount, kBandCount);
    for (std::size_t band = 0; band < bands.size(); ++band)
      settings.decayTimes.at(band) = bands[band].number(kDecayTime);
  } else {
    settings.decayTimes.fill(time->number(kDecayTime));
  }
  return settings;
}

/// Sets volume, surface and onset of the reverberation: as given, or those of the box.
bool RoomReader::measure(const JsonNode& node, ReverbSettings& settings) const {
  const bool hasVolume = node.find("volume").has_value();
  if (hasVolume != node.find("surface").has_value()) {
    node.fail(std::string("the reverberation has a ") +
              (hasVolume ? "volume and no surface" : "surface and no volume") +
              "; expected both, or neither in a box");
    return false;
  }
  if (hasVolume) {
    settings.volume = node.number("volume", kRoomVolume);
    settings.surface = node.number("surface", kRoomSurface);
  } else {
    const Result<RoomMeasures> box = measureBox(room_);
    if (!box) {
      node.fail(box.error().message + R"(; expected "volume" and "surface", or a box)");
      return false;
    }
    settings.volume = box->volume;
    settings.surface = box->surface;
  }
  const int order = room_.reflectors.empty() ? 0 : room_.order;
  if (!node.failed()) {
    settings.onset =
        std::min(1.0, onsetAfter(order, settings.volume, settings.surface, speedOfSound_));
  }
  return !node.failed();
}

// ---------------------------------------------------------------------------------------------

ListenerFormat readFormat(const JsonNode& entry) {
  const auto format = entry.find("format");
  if (!format) return ListenerFormat::mono;
  constexpr std::array<ListenerFormat, 4> kFormats = {
      ListenerFormat::mono, ListenerFormat::spacedPair, ListenerFormat::coincidentPair,
      ListenerFormat::binaural};
  return kFormats.at(format->choice("a format of listener",
                                    {"mono", "spaced_pair", "coincident_pair", "binaural"}));
}

/// Refuses a field that the listener's format does not use, since it would change nothing.
void refuseUnused(const JsonNode& entry, std::string_view key, bool isUsed,
                  std::string_view accepted) {
  const auto node = entry.find(key);
  if (!node || isUsed) return;
  node->fail("a listener of this format has no use for it; expected none, or " +
             std::string(accepted));
}

void readMicrophones(const JsonNode& entry, Listener& listener) {
  const ListenerFormat format = listener.format;
  const bool isPair =
      format == ListenerFormat::spacedPair || format == ListenerFormat::coincidentPair;
  refuseUnused(entry, "spacing", format == ListenerFormat::spacedPair,
               "\"format\": \"spaced_pair\"");
  refuseUnused(entry, "half_angle", isPair, "\"format\": \"spaced_pair\" or \"coincident_pair\"");
  refuseUnused(entry, "pattern", format != ListenerFormat::binaural, "another format");
  refuseUnused(entry, "sofa", format == ListenerFormat::binaural, "\"format\": \"binaural\"");
  listener.spacing = entry.number("spacing", kSpacing, listener.spacing);
  const double degree = std::numbers::pi / 180.0;
  if (const auto angle = entry.find("half_angle"))
    listener.halfAngle = angle->number(kHalfAngle) * degree;
  if (const auto pattern = entry.find("pattern")) listener.pattern = pattern->number(kPattern);
}

std::filesystem::path readSofa(const JsonNode& node, const SceneFolder& folder) {
  std::filesystem::path file = folder.fileOf(node);
  if (node.failed()) return {};
  if (!audio::isRegularFile(file))
    node.fail("there is no file " + inQuotes(file.string()) +
              "; expected a SOFA file, its name relative to the scene's folder");
  return file;
}

/// Checks a step of a path as PoseTrack would, with an error that names its place in the file.
void checkStep(const JsonNode& node, const ListenerPose& last, const ListenerPose& pose) {
  if (node.failed()) return;
  if (!(pose.time > last.time)) {
    node.find("time")->fail(formatNumber(pose.time) + " s is not after the pose before, at " +
                            formatNumber(last.time) + " s; expected times that ascend");
    return;
  }
  const double speed = (pose.position - last.position).norm() / (pose.time - last.time);
  if (speed > PoseTrack::kMaxSpeed) {
    node.fail("it moves at " + formatNumber(std::round(speed)) +
              " m/s from the pose before; expected at most " + formatNumber(PoseTrack::kMaxSpeed) +
              " m/s");
  }
}

std::vector<ListenerPose> readPath(const JsonNode& path, const Listener& listener, Aim aim) {
  std::vector<ListenerPose> poses;
  ListenerPose last{0.0, listener.position, listener.orientation};
  for (const JsonNode& node : path.elements("a path", 1, kMaxPoses)) {
    if (!node.expectObject("a pose", {"time", "position", "looks_at", "forward", "up"})) break;
    ListenerPose pose;
    pose.time = node.number("time", kPoseTime);
    pose.position = node.vector("position", kPlace);
    readAim(node, aim);
    pose.orientation = orientationOf(aim, pose.position, node);
    checkStep(node, last, pose);
    if (node.failed()) break;
    poses.push_back(pose);
    last = pose;
  }
  return poses;
}

}  // namespace

void readSound(const JsonNode& node, Scene& scene) {
  SynthSettings& settings = scene.sound;
  if (!node.expectObject(
          "a description of the sound",
          {"pulse", "dissipative", "sampling", "radiation", "modal_radiation", "ringing", "recoil",
           "doppler", "air_absorption", "audible_threshold", "impulse"})) {
    return;
  }
  const auto pulse = node.find("pulse");
  if (pulse) {
    constexpr std::array<PulseShape, 5> kShapes = {
        PulseShape::hertz, PulseShape::halfSine, PulseShape::gaussian,
        PulseShape::mitchellNetravali, PulseShape::courseGaussian};
    settings.comparison.pulse = kShapes.at(pulse->choice(
        "a pulse", {"hertz", "half_sine", "gaussian", "mitchell_netravali", "course_gaussian"}));
  }
  settings.dissipative = node.boolean("dissipative", settings.dissipative);
  if (settings.dissipative && settings.comparison.pulse != PulseShape::hertz) {
    pulse->fail(R"(a dissipative contact has a pulse of its own; expected "hertz", or none)");
  }
  if (const auto sampling = node.find("sampling")) {
    const bool naive = sampling->choice("a way of sampling", {"band_limited", "naive"}) == 1;
    settings.comparison.sampling = naive ? Sampling::naive : Sampling::bandLimited;
  }
  if (const auto radiation = node.find("radiation")) {
    const bool compact = radiation->choice("a model of radiation", {"exact", "compact"}) == 1;
    settings.comparison.radiation = compact ? Radiation::compact : Radiation::exact;
  }
  if (const auto radiation = node.find("modal_radiation")) {
    constexpr std::array<ModalRadiation, 3> kModels = {
        ModalRadiation::directional, ModalRadiation::monopole, ModalRadiation::constant};
    settings.modalRadiation =
        kModels.at(radiation->choice("how modes radiate", {"directional", "monopole", "constant"}));
  }
  if (const auto ringing = node.find("ringing")) {
    const bool coupled =
        ringing->choice("how impacts make bodies ring", {"pressed", "coupled"}) == 1;
    settings.ringingContact = coupled ? RingingContact::coupled : RingingContact::pressed;
  }
  if (const auto recoil = node.find("recoil")) {
    const bool ofShape = recoil->choice("a model of recoil", {"sphere", "shape"}) == 1;
    scene.recoil = ofShape ? RecoilModel::shape : RecoilModel::sphere;
  }
  settings.doppler = node.boolean("doppler", settings.doppler);
  settings.airAbsorption = node.boolean("air_absorption", settings.airAbsorption);
  settings.audibleThreshold =
      node.number("audible_threshold", kThreshold, settings.audibleThreshold);
  if (const auto impulse = node.find("impulse")) {
    const bool applied = impulse->choice("a choice of impulse", {"physical", "applied"}) == 1;
    settings.impulse = applied ? ImpulseChoice::applied : ImpulseChoice::physical;
  }
}

void readRoom(const JsonNode& node, const std::vector<RoomPlane>& planes, double speedOfSound,
              SynthSettings& settings) {
  RoomReader(node, planes, speedOfSound).read(settings);
}

bool expectListener(const JsonNode& entry) {
  return entry.expectObject("a listener",
                            {"name", "position", "format", "looks_at", "forward", "up", "spacing",
                             "half_angle", "pattern", "sofa", "path"});
}

ListenerEntry readListener(const JsonNode& entry, const SceneFolder& folder) {
  ListenerEntry read;
  Listener& listener = read.listener;
  listener.position = entry.vector("position", kPlace);
  listener.format = readFormat(entry);
  readMicrophones(entry, listener);
  Aim aim;
  readAim(entry, aim);
  listener.orientation = orientationOf(aim, listener.position, entry);
  if (entry.failed()) return read;
  // All other fields have been checked: the only fault left
  // is that both channels would be the same.
  if (const Status valid = validate(listener); !valid) {
    entry.fail(
        "both channels of this coincident pair would be the same; expected a \"pattern\" "
        "above 0 (0.5 is a cardioid) and a \"half_angle\" above 0");
    return read;
  }
  if (const auto sofa = entry.find("sofa")) read.sofa = readSofa(*sofa, folder);
  if (const auto path = entry.find("path")) read.poses = readPath(*path, listener, aim);
  return read;
}

}  // namespace carom::scenes
