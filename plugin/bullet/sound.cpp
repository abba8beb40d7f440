#include "carom/sound.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bodies/proxy_id.h"
#include "carom/bullet/bullet_bridge.h"
#include "carom/event_sound.h"
#include "plugin/bullet/body_reader.h"

namespace carom {

using namespace bullet;
using namespace plugin;

namespace {

/// Removed bodies are looked for when this many more bodies are known than twice those in the
/// world.
constexpr std::size_t kForgotten = 64;

Result<Material> materialNamed(std::string_view name) {
  if (const auto found = findMaterial(name)) return *found;
  std::string names;
  for (const Material& material : builtInMaterials())
    names += (names.empty() ? "" : ", ") + std::string(material.name);
  return Error{"sound: there is no material '" + std::string(name) + "'; there are " + names};
}

/// The properties that were set for a body, a shape or a user index.
struct Given {
  std::optional<Material> material = std::nullopt;
  std::shared_ptr<const ModalModel> modes = nullptr;
  bool hasModes = false;  // they were set, maybe to null: it does not ring
  std::shared_ptr<const SurfaceTexture> texture = nullptr;
  std::shared_ptr<const TextureCoordinates> coordinates = nullptr;  // for the texture
  bool hasTexture = false;  // it was set, maybe to null: that of its material
};

Given given(const Material& material) {
  return {.material = material};
}

Given given(std::shared_ptr<const ModalModel> modes) {
  return {.modes = std::move(modes), .hasModes = true};
}

Given given(std::shared_ptr<const SurfaceTexture> texture,
            std::shared_ptr<const TextureCoordinates> coordinates) {
  return {.texture = std::move(texture), .coordinates = std::move(coordinates), .hasTexture = true};
}

/// Replaces in `earlier` what is set in `later`.
void merge(Given& earlier, const Given& later) {
  if (later.material) earlier.material = later.material;
  if (later.hasModes) {
    earlier.modes = later.modes;
    earlier.hasModes = true;
  }
  if (later.hasTexture) {
    earlier.texture = later.texture;
    earlier.coordinates = later.coordinates;
    earlier.hasTexture = true;
  }
}

/// Returns a model's material. The model does not know its surface: the roughness is that of the
/// built-in material of the same name.
Material ofModes(const ModalModel& modes) {
  Material material = modes.material;
  if (const Material* known = findMaterial(material.name)) material.roughness = known->roughness;
  return material;
}

Status whyRefused(const Given& given) {
  SoundBody body;
  body.material = given.material ? *given.material : builtInMaterials().front();
  if (const std::string reason = whyNot(body); !reason.empty()) return Error{"sound: " + reason};
  if (given.modes != nullptr)
    if (const std::string reason = whyNot(*given.modes); !reason.empty())
      return Error{"sound: modal model: " + reason};
  return std::monostate{};
}

bool isIn(const btDynamicsWorld& world, const btCollisionObject& object) {
  const auto& objects = world.getCollisionObjectArray();
  const int index = object.getWorldArrayIndex();
  return index >= 0 && index < objects.size() && objects[index] == &object;
}

}  // namespace

class Sound::Impl {
 public:
  Impl(btDynamicsWorld& world, const SoundSettings& settings, EventSound events)
      : world_(world), events_(std::move(events)), reader_(settings.radiators) {}

  Status listen(const SoundSettings& settings);
  Status close();
  /// An error if the sound is closed.
  Status whyClosed() const;

  Status give(const btCollisionObject& object, const Given& given);
  Status give(const btCollisionShape& shape, const Given& given);
  Status give(int userIndex, const Given& given);
  void prepare();
  WorldSoundStatistics statistics() const;

  EventSound& events() { return events_; }
  const EventSound& events() const { return events_; }

 private:
  struct Known {
    Given given;  // for this body
    bool isUnsolved = false;
    bool isLink = false;
  };

  void takeOver();
  bool isRead(BodyId id) const { return id < isRead_.size() && isRead_[id]; }
  void readAll();
  void readNew();
  void read(BodyId id, const btCollisionObject& object);
  void forgetRemoved();
  Given givenFor(const Known& known, const btCollisionObject& object) const;

  btDynamicsWorld& world_;
  EventSound events_;
  BodyReader reader_;
  std::unordered_map<BodyId, Known> bodies_;
  std::vector<bool> isRead_;  // by id: it was in bodies_ at some time; asked for every event
  /// The properties set for a body that no substep has seen yet, and that so has no id. Another
  /// body may come to its address.
  struct Early {
    int proxyId = -1;
    Given given;
  };
  std::unordered_map<const btCollisionObject*, Early> early_;
  std::unordered_map<const btCollisionShape*, Given> ofShape_;
  std::unordered_map<int, Given> ofUserIndex_;
  std::string unsolvedReason_;
  std::uint64_t solvedInStep_ = 0;
  std::uint64_t unsupported_ = 0;
  std::optional<BulletBridge> bridge_;  // destroyed first: it calls takeOver
};

Status Sound::Impl::listen(const SoundSettings& settings) {
  BulletBridgeSettings wanted;
  wanted.restSpeed = settings.restSpeed;
  wanted.onSubstep = [this] { takeOver(); };
  if (settings.synth.impulse == ImpulseChoice::physical) wanted.delivery = EventDelivery::prompt;
  Result<BulletBridge> bridge = BulletBridge::attach(world_, wanted);
  if (!bridge) return bridge.error();
  bridge_ = *std::move(bridge);
  prepare();
  // The recording comes last: once begun, it replaces the file, whatever comes of the rest.
  if (!settings.record.empty()) return events_.record(settings.record);
  return std::monostate{};
}

Status Sound::Impl::whyClosed() const {
  if (!bridge_) return Error{"sound: it is closed; attach another"};
  return std::monostate{};
}

/// Takes over the bridge's events and contacts at the end of each substep.
void Sound::Impl::takeOver() {
  for (const ImpulseEvent& event : bridge_->events()) {
    if (!isRead(event.body) || !isRead(event.other)) readNew();
    events_.post(event);
  }
  for (const ContactState& contact : bridge_->contacts())
    events_.updateContact(contact);
  bridge_->clear();
  events_.advanceTo(bridge_->time());
  forgetRemoved();
}

Status Sound::Impl::close() {
  if (bridge_) {
    bridge_->flush();
    for (const ImpulseEvent& event : bridge_->events())
      events_.post(event);
    unsupported_ = bridge_->counters().unsupported;
    bridge_.reset();
  }
  events_.stop();
  return events_.finishRecording();
}

Given Sound::Impl::givenFor(const Known& known, const btCollisionObject& object) const {
  Given all;
  if (const auto found = ofUserIndex_.find(object.getUserIndex()); found != ofUserIndex_.end())
    merge(all, found->second);
  if (const auto found = ofShape_.find(object.getCollisionShape()); found != ofShape_.end())
    merge(all, found->second);
  merge(all, known.given);
  return all;
}

void Sound::Impl::read(BodyId id, const btCollisionObject& object) {
  BodyReading reading = reader_.read(object);
  Known& known = bodies_[id];
  if (isRead_.size() <= id) isRead_.resize(id + 1);
  isRead_[id] = true;
  if (const auto early = early_.find(&object); early != early_.end()) {
    if (early->second.proxyId == proxyIdOf(object)) merge(known.given, early->second.given);
    early_.erase(early);
  }
  known.isUnsolved = reading.unsolved.has_value();
  known.isLink = reading.isLink;
  if (reading.unsolved) unsolvedReason_ = reading.unsolved->message;
  const Given given = givenFor(known, object);
  if (given.material)
    reading.sound.material = *given.material;
  else if (given.modes)
    reading.sound.material = ofModes(*given.modes);
  reading.sound.modal = given.modes;
  reading.sound.texture = given.texture;
  reading.sound.textureCoordinates = given.coordinates;
  // The model of a body that does not move is in the frame of its shape, wherever its centre of
  // mass may be.
  if (object.isStaticOrKinematicObject()) reading.sound.modalOrigin = Vec3::Zero();
  (void)events_.setBody(id, reading.sound);  // refused: its events are counted as rejected
}

void Sound::Impl::readAll() {
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    if (const Result<BodyId> id = bridge_->bodyId(*objects[i])) read(*id, *objects[i]);
}

void Sound::Impl::readNew() {
  const std::uint64_t before = reader_.solved();
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const Result<BodyId> id = bridge_->bodyId(*objects[i]);
    if (id && !bodies_.contains(*id)) read(*id, *objects[i]);
  }
  solvedInStep_ += reader_.solved() - before;
}

void Sound::Impl::prepare() {
  if (!bridge_) return;
  readAll();
  const auto& objects = world_.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i)
    if (!bridge_->bodyId(*objects[i])) (void)reader_.read(*objects[i]);  // solves its shape
}

/// Forgets bodies that have left the world: they would become ever more, as the bridge gives no id
/// twice.
void Sound::Impl::forgetRemoved() {
  const auto& objects = world_.getCollisionObjectArray();
  if (bodies_.size() <= 2 * static_cast<std::size_t>(objects.size()) + kForgotten) return;
  std::unordered_set<BodyId> present;
  std::unordered_set<const btCollisionObject*> there;
  for (int i = 0; i < objects.size(); ++i) {
    there.insert(objects[i]);
    if (const Result<BodyId> id = bridge_->bodyId(*objects[i])) present.insert(*id);
  }
  std::erase_if(early_, [&](const auto& entry) { return !there.contains(entry.first); });
  std::erase_if(bodies_, [&](const auto& entry) {
    if (present.contains(entry.first)) return false;
    events_.removeBody(entry.first);
    return true;
  });
}

Status Sound::Impl::give(const btCollisionObject& object, const Given& given) {
  if (Status closed = whyClosed(); !closed) return closed;
  if (Status refused = whyRefused(given); !refused) return refused;
  if (!isIn(world_, object))
    return Error{"sound: this body is not in the world; add it before anything is set for it"};
  Early& early = early_[&object];
  if (early.proxyId != proxyIdOf(object)) early = {proxyIdOf(object), {}};
  merge(early.given, given);
  if (const Result<BodyId> id = bridge_->bodyId(object)) read(*id, object);
  return std::monostate{};
}

Status Sound::Impl::give(const btCollisionShape& shape, const Given& given) {
  if (Status closed = whyClosed(); !closed) return closed;
  if (Status refused = whyRefused(given); !refused) return refused;
  merge(ofShape_[&shape], given);
  readAll();
  return std::monostate{};
}

Status Sound::Impl::give(int userIndex, const Given& given) {
  if (Status closed = whyClosed(); !closed) return closed;
  if (Status refused = whyRefused(given); !refused) return refused;
  merge(ofUserIndex_[userIndex], given);
  readAll();
  return std::monostate{};
}

WorldSoundStatistics Sound::Impl::statistics() const {
  WorldSoundStatistics all;
  static_cast<SoundStatistics&>(all) = events_.statistics();
  all.unsupportedContacts = bridge_ ? bridge_->counters().unsupported : unsupported_;
  all.radiators.solved = reader_.solved();
  all.radiators.solvedInStep = solvedInStep_;
  all.radiators.unsolvedReason = unsolvedReason_;
  for (const auto& [id, known] : bodies_) {
    all.radiators.unsolved += known.isUnsolved ? 1 : 0;
    all.radiators.links += known.isLink ? 1 : 0;
  }
  return all;
}

Result<Sound> Sound::attach(btDynamicsWorld& world, const SoundSettings& settings) {
  SoundSettings unrecorded = settings;
  unrecorded.record.clear();
  Result<EventSound> events = EventSound::create(unrecorded);
  if (!events) return events.error();
  auto impl = std::make_unique<Impl>(world, settings, *std::move(events));
  if (const Status listening = impl->listen(settings); !listening) return listening.error();
  return Sound(std::move(impl));
}

Sound::Sound(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Sound::Sound(Sound&&) noexcept = default;
Sound& Sound::operator=(Sound&&) noexcept = default;
Sound::~Sound() {
  if (impl_) (void)impl_->close();
}

Status Sound::close() {
  return impl_->close();
}

Status Sound::setMaterial(const btCollisionObject& object, const Material& material) {
  return impl_->give(object, given(material));
}
Status Sound::setMaterial(const btCollisionObject& object, std::string_view name) {
  const Result<Material> material = materialNamed(name);
  return material ? setMaterial(object, *material) : material.error();
}
Status Sound::setMaterial(const btCollisionShape& shape, const Material& material) {
  return impl_->give(shape, given(material));
}
Status Sound::setMaterial(const btCollisionShape& shape, std::string_view name) {
  const Result<Material> material = materialNamed(name);
  return material ? setMaterial(shape, *material) : material.error();
}
Status Sound::setMaterialOfUserIndex(int userIndex, const Material& material) {
  return impl_->give(userIndex, given(material));
}
Status Sound::setMaterialOfUserIndex(int userIndex, std::string_view name) {
  const Result<Material> material = materialNamed(name);
  return material ? setMaterialOfUserIndex(userIndex, *material) : material.error();
}

Status Sound::setModes(const btCollisionObject& object, std::shared_ptr<const ModalModel> modes) {
  return impl_->give(object, given(std::move(modes)));
}
Status Sound::setModes(const btCollisionShape& shape, std::shared_ptr<const ModalModel> modes) {
  return impl_->give(shape, given(std::move(modes)));
}
Status Sound::setModesOfUserIndex(int userIndex, std::shared_ptr<const ModalModel> modes) {
  return impl_->give(userIndex, given(std::move(modes)));
}

Status Sound::setTexture(const btCollisionObject& object,
                         std::shared_ptr<const SurfaceTexture> texture,
                         std::shared_ptr<const TextureCoordinates> coordinates) {
  return impl_->give(object, given(std::move(texture), std::move(coordinates)));
}
Status Sound::setTexture(const btCollisionShape& shape,
                         std::shared_ptr<const SurfaceTexture> texture,
                         std::shared_ptr<const TextureCoordinates> coordinates) {
  return impl_->give(shape, given(std::move(texture), std::move(coordinates)));
}
Status Sound::setTextureOfUserIndex(int userIndex, std::shared_ptr<const SurfaceTexture> texture,
                                    std::shared_ptr<const TextureCoordinates> coordinates) {
  return impl_->give(userIndex, given(std::move(texture), std::move(coordinates)));
}

void Sound::prepare() {
  impl_->prepare();
}
Status Sound::setListener(const Vec3& position, const Quat& orientation, std::size_t listener) {
  const Status closed = impl_->whyClosed();
  return closed ? impl_->events().setListener(position, orientation, listener) : closed;
}
double Sound::time() const {
  return impl_->events().time();
}
void Sound::pause() {
  impl_->events().pause();
}
Status Sound::setTimeScale(double scale) {
  const Status closed = impl_->whyClosed();
  return closed ? impl_->events().setTimeScale(scale) : closed;
}
Status Sound::play() {
  const Status closed = impl_->whyClosed();
  return closed ? impl_->events().play() : closed;
}
Status Sound::prepareRendering(double sampleRate) {
  const Status closed = impl_->whyClosed();
  return closed ? impl_->events().prepareRendering(sampleRate) : closed;
}
void Sound::stop() {
  impl_->events().stop();
}
Status Sound::record(const std::filesystem::path& file) {
  const Status closed = impl_->whyClosed();
  return closed ? impl_->events().record(file) : closed;
}
Status Sound::finishRecording() {
  return impl_->events().finishRecording();
}
void Sound::setGain(double gain) noexcept {
  impl_->events().setGain(gain);
}
void Sound::setMuted(bool muted) noexcept {
  impl_->events().setMuted(muted);
}
std::size_t Sound::channelCount() const {
  return impl_->events().channelCount();
}
double Sound::sampleRate() const {
  return impl_->events().sampleRate();
}
std::size_t Sound::framesReady() const {
  return impl_->events().framesReady();
}
std::size_t Sound::outputDelay() const {
  return impl_->events().outputDelay();
}
void Sound::render(std::span<float* const> channels, std::size_t frames) noexcept {
  impl_->events().render(channels, frames);
}
void Sound::renderInterleaved(float* samples, std::size_t frames) noexcept {
  impl_->events().renderInterleaved(samples, frames);
}
WorldSoundStatistics Sound::statistics() const {
  return impl_->statistics();
}

}  // namespace carom
