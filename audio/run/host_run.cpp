#include "audio/run/host_run.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "audio/io/field_code.h"
#include "carom/audio/modal_model_file.h"

namespace carom::audio {

/// A SurfaceTexture taken apart.
struct TextureRecord {
  std::uint64_t width = 0;
  std::uint64_t height = 0;
  Vec2 texel = Vec2::Ones();
  std::vector<SurfaceTexture::Slope> slopes;
  double scale = 1.0;
  double steepness = 1.0;
  Vec2 axis = Vec2::UnitX();

  TextureRecord() = default;
  explicit TextureRecord(const SurfaceTexture& texture)
      : width(texture.size().width),
        height(texture.size().height),
        texel(texture.texels_->texel),
        slopes(texture.texels_->levels.front().slopes),
        scale(texture.scale_),
        steepness(texture.steepness_),
        axis(texture.axis_) {}

  /// Returns the texture, with the same bits. Refuses what no texture has.
  Result<SurfaceTexture> texture() && {
    constexpr double kLargest = 1e12;
    const auto isFactor = [](double value) { return value >= 0.0 && value < kLargest; };
    if (!isFactor(scale) || !(scale > 0.0) || !isFactor(steepness) ||
        !(std::abs(axis.norm() - 1.0) < 1e-6))
      return Error{"surface texture: its scale, steepness or axis is out of range"};
    const SurfaceTexture::Size size{static_cast<std::size_t>(width),
                                    static_cast<std::size_t>(height)};
    if (const Status valid = SurfaceTexture::check(size, texel, slopes); !valid)
      return valid.error();
    // Their mean was subtracted once: subtracted again it would change their last digits.
    const auto isSteep = [](const SurfaceTexture::Slope& slope) {
      return slope.cwiseAbs().maxCoeff() > 2.0F * SurfaceTexture::kSteepest;
    };
    if (std::ranges::any_of(slopes, isSteep))
      return Error{"surface texture: a slope is steeper than any texture has"};
    SurfaceTexture made = SurfaceTexture::ofCentred(size, texel, std::move(slopes));
    made.scale_ = scale;
    made.steepness_ = steepness;
    made.axis_ = axis;
    return made;
  }
};

namespace {

/// The kind of a record.
enum class RecordKind : std::uint8_t {
  radiator,
  recoil,
  modal,
  texture,
  coordinates,
  mesh,
  body,
};

/// A body, with the numbers of what it shares with others in their place; 0 for none.
struct BodyRecord {
  HostBody body;
  bool hasModalOrigin = false;
  Vec3 modalOrigin = Vec3::Zero();
  std::array<std::uint32_t, 6> shared{};  // by RecordKind
};

void codeMaterial(auto& archive, auto& material) {
  archive.text(material.name);
  for (auto* value :
       {&material.density, &material.youngsModulus, &material.poissonsRatio, &material.restitution,
        &material.dampingAlpha, &material.dampingBeta, &material.roughness.rmsHeight,
        &material.roughness.correlationLength, &material.roughness.hurst})
    archive.number(*value);
}

void codeRecord(auto& archive, auto& record) {
  auto& [id, name, sound, form] = record.body;
  archive.number(id);
  archive.text(name);
  codeMaterial(archive, sound.material);
  archive.number(sound.mass);
  archive.number(sound.radius);
  archive.number(sound.edgeRadius);
  codeMatrix(archive, sound.inverseInertia);
  archive.flag(record.hasModalOrigin);
  codeMatrix(archive, record.modalOrigin);
  archive.choice(form.kind, BodyForm::Kind::mesh);
  codeMatrix(archive, form.size);
  archive.number(form.offset);
  for (auto& number : record.shared)
    archive.number(number);
}

void codeRadiator(auto& archive, auto& radiator) {
  archive.number(radiator.volume);
  codeMatrix(archive, radiator.centroid);
  codeMatrix(archive, radiator.addedVolume);
}

void codeRecoil(auto& archive, auto& recoil) {
  archive.number(recoil.radius);
  archive.count(recoil.poles, 2 * sizeof(double));
  for (auto& pole : recoil.poles)
    codeComplex(archive, pole);
  archive.count(recoil.terms, 2 * sizeof(std::uint16_t));
  for (auto& term : recoil.terms) {
    archive.number(term.motion);
    archive.number(term.harmonic);
  }
  archive.count(recoil.residues, 2 * sizeof(float));
  for (auto& residue : recoil.residues)
    codeComplex(archive, residue);
}

void codeTexture(auto& archive, auto& texture) {
  archive.number(texture.width);
  archive.number(texture.height);
  codeMatrix(archive, texture.texel);
  archive.number(texture.scale);
  archive.number(texture.steepness);
  codeMatrix(archive, texture.axis);
  archive.count(texture.slopes, 2 * sizeof(float));
  for (auto& slope : texture.slopes)
    codeMatrix(archive, slope);
}

void codeCorners(auto& archive, auto& corners) {
  archive.count(corners, 6 * sizeof(double));
  for (auto& triangle : corners)
    for (auto& corner : triangle)
      codeMatrix(archive, corner);
}

void codeReverb(auto& archive, auto& reverb) {
  archive.number(reverb.volume);
  archive.number(reverb.surface);
  for (auto& time : reverb.decayTimes)
    archive.number(time);
  archive.number(reverb.decayTimeAt16kHz);
  archive.flag(reverb.includesAir);
  for (auto* value : {&reverb.onset, &reverb.gain, &reverb.speedOfSound, &reverb.silence})
    archive.number(*value);
}

void codeRoom(auto& archive, auto& room, auto& order) {
  archive.number(order);
  archive.count(room.reflectors, (4 + kBandCount) * sizeof(double));
  for (auto& reflector : room.reflectors) {
    codeMatrix(archive, reflector.normal);
    archive.number(reflector.offset);
    for (auto& coefficient : reflector.absorption.coefficients)
      archive.number(coefficient);
  }
}

/// SynthSettings but for the optional parts, whose flags and numbers are in a form that can be
/// coded.
struct SynthRecord {
  SynthSettings synth;
  std::uint32_t order = 0;
  std::uint64_t slideVoices = 0;
  bool hasReverb = false;
  ReverbSettings reverb;
};

void codeSynth(auto& archive, auto& record) {
  auto& synth = record.synth;
  archive.number(synth.sampleRate);
  archive.choice(synth.impulse, ImpulseChoice::applied);
  for (auto* value : {&synth.medium.density, &synth.medium.speedOfSound, &synth.medium.temperature,
                      &synth.medium.humidity, &synth.medium.pressure, &synth.audibleThreshold})
    archive.number(*value);
  archive.flag(synth.dissipative);
  archive.choice(synth.modalRadiation, ModalRadiation::constant);
  archive.choice(synth.ringingContact, RingingContact::coupled);
  archive.number(synth.contactLoss);
  archive.flag(synth.doppler);
  archive.flag(synth.airAbsorption);
  codeRoom(archive, synth.room, record.order);
  archive.flag(record.hasReverb);
  codeReverb(archive, record.reverb);
  archive.choice(synth.comparison.pulse, PulseShape::courseGaussian);
  archive.choice(synth.comparison.sampling, Sampling::naive);
  archive.choice(synth.comparison.radiation, Radiation::compact);
  archive.choice(synth.lasting, LastingDetail::heard);
  archive.number(record.slideVoices);
  archive.flag(synth.stems);
}

/// A listener whose optional part is in a form that can be coded.
struct ListenerRecord {
  Listener listener;
  bool hasPattern = false;
  double pattern = 0.0;
  std::vector<ListenerPose> path;
};

void codePose(auto& archive, auto& pose) {
  archive.number(pose.time);
  codeMatrix(archive, pose.position);
  codeMatrix(archive, pose.orientation.coeffs());
}

void codeListener(auto& archive, auto& record) {
  auto& listener = record.listener;
  archive.text(listener.name);
  codeMatrix(archive, listener.position);
  codeMatrix(archive, listener.orientation.coeffs());
  archive.choice(listener.format, ListenerFormat::binaural);
  archive.number(listener.spacing);
  archive.number(listener.halfAngle);
  archive.flag(record.hasPattern);
  archive.number(record.pattern);
  archive.count(record.path, 8 * sizeof(double));
  for (auto& pose : record.path)
    codePose(archive, pose);
}

void codePiece(auto& archive, auto& piece) {
  archive.number(piece.listener);
  archive.count(piece.poses, 8 * sizeof(double));
  for (auto& pose : piece.poses)
    codePose(archive, pose);
}

struct WorldRecord {
  SynthRecord synth;
  std::vector<ListenerRecord> listeners;
  bool hasOwnHeads = false;
  double begin = 0.0;
  double duration = 0.0;
  std::uint32_t bodies = 0;
};

void codeWorld(auto& archive, auto& world) {
  codeSynth(archive, world.synth);
  archive.count(world.listeners, 12 * sizeof(double));
  for (auto& listener : world.listeners)
    codeListener(archive, listener);
  archive.flag(world.hasOwnHeads);
  archive.number(world.begin);
  archive.number(world.duration);
  archive.number(world.bodies);
}

/// Returns a record's bytes: its kind, and what `code` writes.
template <class Code>
std::vector<std::byte> recordOf(RecordKind kind, const Code& code) {
  std::vector<std::byte> bytes;
  FieldWriter writer(bytes);
  writer.choice(kind, RecordKind::body);
  code(writer);
  return bytes;
}

/// Reads all of a record's bytes but the first.
template <class Code>
Status readRecord(std::span<const std::byte> bytes, const Code& code) {
  FieldReader reader(bytes, 1);
  code(reader);
  reader.end();
  if (!reader.fault().empty()) return Error{reader.fault()};
  return std::monostate{};
}

bool isMesh(const SurfaceMesh& mesh) {
  const auto isIn = [&](std::uint32_t vertex) { return vertex < mesh.vertices.size(); };
  for (const Vec3& vertex : mesh.vertices)
    if (!vertex.allFinite()) return false;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (!isIn(vertex)) return false;
  return true;
}

bool isForm(const BodyForm& form) {
  if (!form.size.allFinite() || !std::isfinite(form.offset)) return false;
  return (form.kind == BodyForm::Kind::mesh) == (form.mesh != nullptr);
}

/// True for a path with ascending times above 0 and poses that can be.
bool isPath(const std::vector<ListenerPose>& path) {
  double before = 0.0;
  for (const ListenerPose& pose : path) {
    if (!isPose(pose) || !(pose.time > before)) return false;
    before = pose.time;
  }
  return true;
}

}  // namespace

/// Returns the number that an object has; 0 if it has none yet. Another may have come to the
/// address of one that is gone; what nobody owns, as it is static, stays.
std::uint32_t HostEncoder::numberOf(const std::shared_ptr<const void>& object) const {
  const auto found = known_.find(object.get());
  if (found == known_.end()) return 0;
  const Known& known = found->second;
  const bool isGone = known.isOwned ? known.object.expired() : object.use_count() > 0;
  return isGone ? 0 : known.number;
}

template <class Object, class Encode>
std::uint32_t HostEncoder::place(const std::shared_ptr<const Object>& object,
                                 const Encode& encode) {
  if (object == nullptr) return 0;
  if (const std::uint32_t number = numberOf(object)) return number;
  known_[object.get()] = {object, object.use_count() > 0, ++count_};
  records_.push_back(encode(*object));
  return count_;
}

Status HostEncoder::add(const HostBody& body, std::vector<std::byte>& bytes) {
  const SoundBody& sound = body.sound;
  records_.clear();
  BodyRecord record{.body = body};
  record.hasModalOrigin = sound.modalOrigin.has_value();
  record.modalOrigin = sound.modalOrigin.value_or(Vec3::Zero());
  const auto number = [&record](RecordKind kind) -> std::uint32_t& {
    return record.shared.at(static_cast<std::size_t>(kind));
  };
  number(RecordKind::radiator) = place(sound.shape, [](const RigidRadiator& radiator) {
    return recordOf(RecordKind::radiator, [&](auto& writer) { codeRadiator(writer, radiator); });
  });
  number(RecordKind::recoil) = place(sound.recoil, [](const RigidRecoil& recoil) {
    return recordOf(RecordKind::recoil, [&](auto& writer) { codeRecoil(writer, recoil); });
  });
  number(RecordKind::texture) = place(sound.texture, [](const SurfaceTexture& texture) {
    const TextureRecord parts(texture);
    return recordOf(RecordKind::texture, [&](auto& writer) { codeTexture(writer, parts); });
  });
  number(RecordKind::coordinates) =
      place(sound.textureCoordinates, [](const TextureCoordinates& coordinates) {
        return recordOf(RecordKind::coordinates, [&](auto& writer) {
          codeSurface(writer, coordinates.mesh());
          codeCorners(writer, coordinates.corners());
        });
      });
  number(RecordKind::mesh) = place(body.form.mesh, [](const SurfaceMesh& mesh) {
    return recordOf(RecordKind::mesh, [&](auto& writer) { codeSurface(writer, mesh); });
  });
  number(RecordKind::modal) = numberOf(sound.modal);
  if (sound.modal != nullptr && number(RecordKind::modal) == 0) {
    const Result<std::vector<std::byte>> model = encodedModalModel(*sound.modal);
    if (!model) return model.error();
    number(RecordKind::modal) = place(sound.modal, [&model](const ModalModel&) {
      std::vector<std::byte> whole = recordOf(RecordKind::modal, [](auto&) {});
      whole.insert(whole.end(), model->begin(), model->end());
      return whole;
    });
  }
  records_.push_back(
      recordOf(RecordKind::body, [&](auto& writer) { codeRecord(writer, std::as_const(record)); }));
  FieldWriter sizes(bytes);
  for (const std::vector<std::byte>& each : records_) {
    sizes.number(static_cast<std::uint32_t>(each.size()));
    bytes.insert(bytes.end(), each.begin(), each.end());
  }
  return std::monostate{};
}

namespace {

template <class Object, class Code>
Result<std::shared_ptr<const Object>> readShared(std::span<const std::byte> bytes,
                                                 const Code& code) {
  auto object = std::make_shared<Object>();
  const Status read = readRecord(bytes, [&](FieldReader& reader) { code(reader, *object); });
  if (!read) return read.error();
  return std::shared_ptr<const Object>(std::move(object));
}

Result<std::shared_ptr<const RigidRadiator>> radiatorOf(std::span<const std::byte> bytes) {
  auto radiator = readShared<RigidRadiator>(
      bytes, [](FieldReader& reader, RigidRadiator& to) { codeRadiator(reader, to); });
  if (radiator && !(std::isfinite((*radiator)->volume) && (*radiator)->centroid.allFinite() &&
                    (*radiator)->addedVolume.allFinite()))
    return Error{"has a radiator with numbers that are not finite"};
  return radiator;
}

Result<std::shared_ptr<const RigidRecoil>> hostRecoil(std::span<const std::byte> bytes) {
  auto recoil = readShared<RigidRecoil>(
      bytes, [](FieldReader& reader, RigidRecoil& to) { codeRecoil(reader, to); });
  if (recoil)
    if (const Status valid = validate(**recoil); !valid)
      return Error{"has a recoil that is none: " + valid.error().message};
  return recoil;
}

Result<std::shared_ptr<const ModalModel>> modalOf(std::span<const std::byte> bytes) {
  Result<ModalModel> model = decodedModalModel(bytes, "a model");
  if (!model) return Error{"has a model that is none: " + model.error().message};
  return std::make_shared<const ModalModel>(*std::move(model));
}

Result<std::shared_ptr<const SurfaceTexture>> textureOf(std::span<const std::byte> bytes) {
  TextureRecord parts;
  const Status read = readRecord(bytes, [&](FieldReader& reader) { codeTexture(reader, parts); });
  if (!read) return read.error();
  Result<SurfaceTexture> texture = std::move(parts).texture();
  if (!texture) return Error{"has a texture that is none: " + texture.error().message};
  return std::make_shared<const SurfaceTexture>(*std::move(texture));
}

Result<std::shared_ptr<const TextureCoordinates>> coordinatesOf(std::span<const std::byte> bytes) {
  SurfaceMesh mesh;
  std::vector<TextureCoordinates::Corners> corners;
  const Status read = readRecord(bytes, [&](FieldReader& reader) {
    codeSurface(reader, mesh);
    codeCorners(reader, corners);
  });
  if (!read) return read.error();
  if (!isMesh(mesh)) return Error{"has a mesh that is none"};
  Result<TextureCoordinates> made = TextureCoordinates::of(std::move(mesh), std::move(corners));
  if (!made) return Error{"has texture coordinates that are none: " + made.error().message};
  return std::make_shared<const TextureCoordinates>(*std::move(made));
}

Result<std::shared_ptr<const SurfaceMesh>> meshOf(std::span<const std::byte> bytes) {
  auto mesh = readShared<SurfaceMesh>(
      bytes, [](FieldReader& reader, SurfaceMesh& to) { codeSurface(reader, to); });
  if (mesh && !isMesh(**mesh)) return Error{"has a mesh that is none"};
  return mesh;
}

}  // namespace

template <class Object>
bool HostDecoder::find(std::uint32_t number, std::shared_ptr<const Object>& object) const {
  if (number == 0) return true;
  if (number > shared_.size()) return false;
  const auto* const known = std::get_if<std::shared_ptr<const Object>>(&shared_[number - 1]);
  if (known != nullptr) object = *known;
  return known != nullptr;
}

Result<std::optional<HostBody>> HostDecoder::bodyOf(std::span<const std::byte> bytes) const {
  BodyRecord record;
  const Status read = readRecord(bytes, [&](FieldReader& reader) { codeRecord(reader, record); });
  if (!read) return read.error();
  HostBody& body = record.body;
  const auto number = [&record](RecordKind kind) {
    return record.shared.at(static_cast<std::size_t>(kind));
  };
  if (!find(number(RecordKind::radiator), body.sound.shape) ||
      !find(number(RecordKind::recoil), body.sound.recoil) ||
      !find(number(RecordKind::modal), body.sound.modal) ||
      !find(number(RecordKind::texture), body.sound.texture) ||
      !find(number(RecordKind::coordinates), body.sound.textureCoordinates) ||
      !find(number(RecordKind::mesh), body.form.mesh))
    return Error{"has a body of something that is not there"};
  if (record.hasModalOrigin) body.sound.modalOrigin = record.modalOrigin;
  if (const Status valid = validate(body.sound); !valid)
    return Error{"has a body that cannot sound: " + valid.error().message};
  if (!isForm(body.form)) return Error{"has a body of a form that there is not"};
  return std::optional(std::move(body));
}

Result<std::vector<HostBody>> HostDecoder::take(std::span<const std::byte> bytes) {
  std::vector<HostBody> bodies;
  while (!bytes.empty()) {
    std::uint32_t size = 0;
    FieldReader(bytes, 0).number(size);
    if (bytes.size() < sizeof size || size > bytes.size() - sizeof size)
      return Error{"has a record that is longer than what is left"};
    Result<std::optional<HostBody>> body = takeRecord(bytes.subspan(sizeof size, size));
    if (!body) return body.error();
    if (*body) bodies.push_back(**std::move(body));
    bytes = bytes.subspan(sizeof size + size);
  }
  return bodies;
}

Result<std::optional<HostBody>> HostDecoder::takeRecord(std::span<const std::byte> bytes) {
  if (bytes.empty()) return Error{"is empty"};
  const auto content = bytes.subspan(1);
  const auto keepOne = [this](auto object) -> Result<std::optional<HostBody>> {
    if (!object) return object.error();
    shared_.emplace_back(*std::move(object));
    return std::optional<HostBody>();
  };
  switch (static_cast<RecordKind>(bytes.front())) {
    case RecordKind::radiator:
      return keepOne(radiatorOf(content));
    case RecordKind::recoil:
      return keepOne(hostRecoil(content));
    case RecordKind::modal:
      return keepOne(modalOf(content));
    case RecordKind::texture:
      return keepOne(textureOf(content));
    case RecordKind::coordinates:
      return keepOne(coordinatesOf(content));
    case RecordKind::mesh:
      return keepOne(meshOf(content));
    case RecordKind::body:
      return bodyOf(content);
  }
  return Error{"has a record of a kind that there is not"};
}

std::vector<std::byte> encodedPath(const PathPiece& piece) {
  std::vector<std::byte> bytes;
  FieldWriter writer(bytes);
  codePiece(writer, piece);
  return bytes;
}

Result<PathPiece> decodedPath(std::span<const std::byte> bytes) {
  PathPiece piece;
  FieldReader reader(bytes, 0);
  codePiece(reader, piece);
  reader.end();
  if (!reader.fault().empty()) return Error{reader.fault()};
  return piece;
}

std::vector<PathPiece> takeLongPaths(HostWorld& world) {
  std::vector<PathPiece> pieces;
  std::size_t poses = 0;
  for (const std::vector<ListenerPose>& path : world.paths)
    poses += path.size();
  if (poses <= kMostPiecePoses) return pieces;
  for (std::uint32_t listener = 0; listener < world.paths.size(); ++listener) {
    const std::vector<ListenerPose> path = std::exchange(world.paths[listener], {});
    for (std::size_t first = 0; first < path.size(); first += kMostPiecePoses) {
      const auto from = path.begin() + static_cast<std::ptrdiff_t>(first);
      const std::size_t count = std::min(kMostPiecePoses, path.size() - first);
      pieces.push_back({listener, {from, from + static_cast<std::ptrdiff_t>(count)}});
    }
  }
  return pieces;
}

Status putBack(const std::vector<PathPiece>& pieces, HostWorld& world) {
  std::vector<std::vector<ListenerPose>> paths(world.paths.size());
  for (const PathPiece& piece : pieces) {
    if (piece.listener >= paths.size()) return Error{"has a path of a listener that there is not"};
    std::vector<ListenerPose>& path = paths[piece.listener];
    path.insert(path.end(), piece.poses.begin(), piece.poses.end());
  }
  for (std::size_t listener = 0; listener < paths.size(); ++listener) {
    std::vector<ListenerPose>& path = world.paths[listener];
    path.insert(path.begin(), paths[listener].begin(), paths[listener].end());
    if (!isPath(path)) return Error{"has a path of a listener that is none"};
  }
  return std::monostate{};
}

std::vector<std::byte> encodedWorld(const HostWorld& world) {
  WorldRecord record;
  record.synth.synth = world.synth;
  record.synth.order = static_cast<std::uint32_t>(world.synth.room.order);
  record.synth.slideVoices = world.synth.slideVoices;
  record.synth.hasReverb = world.synth.reverb.has_value();
  record.synth.reverb = world.synth.reverb.value_or(ReverbSettings());
  for (std::size_t index = 0; index < world.listeners.size(); ++index) {
    const Listener& listener = world.listeners[index];
    record.listeners.push_back({listener, listener.pattern.has_value(),
                                listener.pattern.value_or(0.0), world.paths.at(index)});
  }
  record.hasOwnHeads = world.hasOwnHeads;
  record.begin = world.begin;
  record.duration = world.duration;
  record.bodies = world.bodies;
  std::vector<std::byte> bytes;
  FieldWriter writer(bytes);
  codeWorld(writer, std::as_const(record));
  return bytes;
}

Result<HostWorld> decodedWorld(std::span<const std::byte> bytes) {
  constexpr std::uint32_t kHighestOrder = 32;
  constexpr std::size_t kMostListeners = 256;
  constexpr double kLongestRun = 1e7;    // s
  constexpr double kLatestBegin = 1e12;  // s
  WorldRecord record;
  FieldReader reader(bytes, 0);
  codeWorld(reader, record);
  reader.end();
  if (!reader.fault().empty()) return Error{reader.fault()};
  if (record.synth.order > kHighestOrder) return Error{"has a room of an order above 32"};
  if (!(record.duration > 0.0 && record.duration <= kLongestRun) ||
      !(std::abs(record.begin) <= kLatestBegin))
    return Error{"has a duration that is none, or above 1e7 s"};
  if (record.listeners.size() > kMostListeners) return Error{"has more than 256 listeners"};
  HostWorld world;
  world.synth = std::move(record.synth.synth);
  world.synth.room.order = static_cast<int>(record.synth.order);
  world.synth.slideVoices = static_cast<std::size_t>(record.synth.slideVoices);
  if (record.synth.hasReverb) world.synth.reverb = record.synth.reverb;
  for (ListenerRecord& listener : record.listeners) {
    if (listener.hasPattern) listener.listener.pattern = listener.pattern;
    if (const Status valid = validate(listener.listener); !valid)
      return Error{"has a listener that is none: " + valid.error().message};
    if (!isPath(listener.path)) return Error{"has a path of a listener that is none"};
    world.listeners.push_back(std::move(listener.listener));
    world.paths.push_back(std::move(listener.path));
  }
  if (world.listeners.empty()) return Error{"has no listener"};
  world.hasOwnHeads = record.hasOwnHeads;
  world.begin = record.begin;
  world.duration = record.duration;
  world.bodies = record.bodies;
  return world;
}

}  // namespace carom::audio
