#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/carom.h"
#include "tests/fuzz/fuzz_bullet.h"
#include "tests/fuzz/fuzz_files.h"
#include "tests/fuzz/fuzz_host.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

constexpr std::size_t kMostCalls = 120;
constexpr std::size_t kBodies = 5;

/// Requires what holds after every call: a status that there is, and a sentence if it is no
/// success.
bool succeeded(carom_status status) {
  require(status >= CAROM_OK && status <= CAROM_ERROR_MEMORY);
  const std::string message = carom_last_message();
  require(status == CAROM_OK || (!message.empty() && message.size() < 2000));
  require(std::strlen(carom_status_text(status)) > 0);
  return status == CAROM_OK;
}

/// A struct as a host of another version might hand it over: of a size that may not be its own,
/// with room behind it for any that is larger.
template <class Struct>
class Versioned {
 public:
  Versioned(carom_status (*init)(Struct*, std::size_t), FuzzNumbers& numbers) {
    require(init(&value(), sizeof(Struct)) == CAROM_OK);
    if (numbers.rarely(8)) resize(numbers);
  }
  Struct& operator*() { return value(); }
  Struct* operator->() { return &value(); }

 private:
  Struct& value() { return *reinterpret_cast<Struct*>(room_.data()); }
  void resize(FuzzNumbers& numbers) {
    const std::array<std::size_t, 6> sizes = {0,
                                              sizeof(std::size_t),
                                              sizeof(Struct) - 8,
                                              sizeof(Struct) + 8,
                                              sizeof(Struct) + kBehind,
                                              numbers.below(sizeof(Struct))};
    value().size = sizes[numbers.below(sizes.size())];
    if (numbers.rarely(32)) room_[sizeof(Struct) + 4] = 1;
  }

  static constexpr std::size_t kBehind = 64;
  alignas(std::max_align_t) std::array<unsigned char, sizeof(Struct) + kBehind> room_ = {};
};

/// A ball above a floor, for the sounds of Bullet worlds.
struct World {
  World() {
    bullet.setGravity({0, btScalar(-9.81), 0});
    ball.setRestitution(btScalar(0.7));
    ball.setCenterOfMassTransform(btTransform(btQuaternion::getIdentity(), {0, btScalar(0.05), 0}));
    bullet.addRigidBody(&floor);
    bullet.addRigidBody(&ball);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    bullet.removeRigidBody(&ball);
    bullet.removeRigidBody(&floor);
  }

  btDefaultCollisionConfiguration configuration{smallPools()};
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld bullet{&dispatcher, &broadphase, &solver, &configuration};
  btStaticPlaneShape plane{btVector3(0, 1, 0), 0};
  btSphereShape sphere{btScalar(0.03)};
  btRigidBody floor{0, nullptr, &plane};
  btRigidBody ball{btScalar(0.3), nullptr, &sphere,
                   btVector3(btScalar(1e-4), btScalar(1e-4), btScalar(1e-4))};
};

/// The tables of the library and what can be made without a sound.
class Library {
 public:
  explicit Library(FuzzNumbers& numbers) : numbers_(numbers) {}
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library() {
    carom_free_texture(texture_);
    carom_free_texture_coordinates(coordinates_);
  }

  const carom_texture* texture() const { return texture_; }
  const carom_texture_coordinates* coordinates() const { return coordinates_; }

  void callOne() {
    switch (numbers_.below(5)) {
      case 0:
        askMaterial();
        break;
      case 1:
        makeRoughTexture();
        break;
      case 2:
        makeTexture();
        break;
      case 3:
        makeCoordinates();
        break;
      default:
        askReverb();
    }
  }

 private:
  void askMaterial() {
    carom_material material = {};
    material.size = numbers_.chance(240) ? sizeof material : numbers_.below(sizeof material);
    const std::size_t index =
        numbers_.chance(250) ? numbers_.below(carom_material_count() + 1) : ~std::size_t{0};
    if (succeeded(carom_material_at(index, &material)) && material.size == sizeof material)
      require(material.density > 0.0 && material.name != nullptr);
    succeeded(carom_find_material(numbers_.chance(128) ? "steel" : nullptr, &material));
    succeeded(carom_find_material("no such material", nullptr));
  }
  void makeRoughTexture() {
    Versioned<carom_roughness> roughness(carom_roughness_init, numbers_);
    roughness->rms_height = numbers_.wild(1e-6);
    roughness->correlation_length = numbers_.wild(1e-4);
    roughness->hurst = numbers_.wild(numbers_.share());
    carom_free_texture(texture_);
    const bool isMade = succeeded(carom_make_rough_texture(&*roughness, 1, &texture_));
    require(isMade == (texture_ != nullptr));
  }
  void makeTexture() {
    const std::array<std::size_t, 5> sides = {1, 2, 4, 8, 3};
    const std::size_t width = sides[numbers_.below(sides.size())];
    const std::size_t height = sides[numbers_.below(sides.size())];
    const std::array<double, 2> texel = {numbers_.wild(1e-3), numbers_.wild(1e-3)};
    std::vector<float> slopes;
    for (std::size_t slope = 0; slope < 2 * width * height; ++slope) {
      const double number = numbers_.wild(numbers_.between(-1.0, 1.0));
      slopes.push_back(std::abs(number) < 3e38 ? static_cast<float>(number) : HUGE_VALF);
    }
    carom_free_texture(texture_);
    const bool isMade =
        succeeded(carom_make_texture(width, height, texel.data(), slopes.data(), &texture_));
    require(isMade == (texture_ != nullptr));
  }
  void makeCoordinates() {
    std::array<double, 12> vertices = {0, 0, 0, 0.1, 0, 0, 0, 0.1, 0, 0, 0, 0.1};
    for (double& number : vertices)
      number = numbers_.wild(number);
    std::array<std::uint32_t, 12> triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    if (numbers_.rarely(8)) triangles[numbers_.below(12)] = 0xffffffffU;
    std::array<double, 24> corners = {};
    for (double& corner : corners)
      corner = numbers_.wild(numbers_.share());
    const carom_mesh mesh = {sizeof mesh, vertices.data(), 4, triangles.data(), 4};
    carom_free_texture_coordinates(coordinates_);
    const bool isMade =
        succeeded(carom_make_texture_coordinates(&mesh, corners.data(), &coordinates_));
    require(isMade == (coordinates_ != nullptr));
    std::array<double, 2> size = {};
    if (isMade && succeeded(carom_texture_coordinates_size(coordinates_, size.data())))
      require(std::isfinite(size[0]) && std::isfinite(size[1]));
  }
  void askReverb() {
    std::array<carom_reflector, 6> walls = {};
    for (std::size_t index = 0; index < walls.size(); ++index) {
      require(carom_reflector_init(&walls[index], sizeof(carom_reflector)) == CAROM_OK);
      walls[index].normal[index / 2] = index % 2 == 0 ? 1.0 : -1.0;
      walls[index].offset = numbers_.wild(numbers_.between(-5.0, -1.0));
      for (double& absorption : walls[index].absorption)
        absorption = numbers_.wild(0.3);
    }
    carom_room room = {};
    require(carom_room_init(&room, sizeof room) == CAROM_OK);
    room.reflectors = walls.data();
    room.reflector_count = numbers_.chance(240) ? 6 : numbers_.below(7);
    room.order = static_cast<std::int32_t>(numbers_.below(4)) - 1;
    carom_reverb reverb = {};
    require(carom_reverb_init(&reverb, sizeof reverb) == CAROM_OK);
    if (!succeeded(carom_reverb_of_box(&room, numbers_.wild(343.0), &reverb))) return;
    for (const double time : reverb.decay_times)
      require(time > 0.0);
  }

  FuzzNumbers& numbers_;
  carom_texture* texture_ = nullptr;
  carom_texture_coordinates* coordinates_ = nullptr;
};

/// A host that calls in any order, with numbers that are mostly sound.
class Host {
 public:
  Host(carom_sound* sound, World* world, FuzzNumbers& numbers)
      : sound_(sound), world_(world), numbers_(numbers), library_(numbers) {}

  void run() {
    callInAnyOrder(numbers_, kMostCalls, [this] { callOne(); });
  }

 private:
  void callOne() {
    switch (numbers_.below(16)) {
      case 0:
        setBody();
        break;
      case 1:
        succeeded(carom_remove_body(sound_, body()));
        break;
      case 2:
        setListener();
        break;
      case 3:
        setOutput();
        break;
      case 4:
        record();
        break;
      case 5:
        ask();
        break;
      case 6:
        library_.callOne();
        break;
      case 7:
        assign();
        break;
      case 8:
        updateContact();
        break;
      case 9:
      case 10:
        advance();
        break;
      case 11:
        render();
        break;
      default:
        post();
    }
  }
  std::uint32_t body() { return static_cast<std::uint32_t>(numbers_.below(kBodies + 1)); }
  void give(double (&to)[3], const Vec3& sound) {
    const Vec3 number = numbers_.wild(sound);
    std::copy_n(number.data(), 3, to);
  }
  void giveTurn(double (&to)[4]) {
    if (!numbers_.rarely(32)) return;
    for (double& number : to)
      number = numbers_.wild(0.5);
  }
  void setBody() {
    Versioned<carom_body> set(carom_body_init, numbers_);
    constexpr std::array kMaterials = {"steel", "glass", "wood", "none such"};
    set->material = numbers_.chance(250) ? kMaterials[numbers_.below(kMaterials.size())] : nullptr;
    set->mass = numbers_.wild(numbers_.logBetween(1e-3, 100.0));
    set->radius = numbers_.wild(numbers_.logBetween(1e-3, 1.0));
    set->edge_radius = numbers_.wild(1e-3);
    set->texture = library_.texture();
    set->texture_coordinates = numbers_.rarely(16) ? library_.coordinates() : nullptr;
    set->shape = static_cast<std::int32_t>(numbers_.chance(250) ? 0 : numbers_.below(5));
    for (double& half : set->half_extents)
      half = numbers_.wild(0.05);
    carom_material own = {};
    if (numbers_.rarely(64)) {
      own = {sizeof own,
             nullptr,
             numbers_.wild(1000.0),
             numbers_.wild(1e9),
             numbers_.wild(0.3),
             numbers_.wild(0.5),
             numbers_.wild(1.0),
             numbers_.wild(1e-6),
             nullptr,
             numbers_.chance(128) ? numbers_.wild(1e-3) : 0.0,
             numbers_.wild(1.0),
             numbers_.wild(1e-5),
             numbers_.wild(100.0),
             numbers_.wild(500.0)};
      set->own_material = &own;
    }
    succeeded(carom_set_body(sound_, body(), &*set));
  }
  void setListener() {
    double position[3] = {};
    double turn[4] = {0, 0, 0, 1};
    give(position, numbers_.inCube(3.0));
    giveTurn(turn);
    const std::size_t listener = numbers_.chance(250) ? 0 : ~std::size_t{0};
    succeeded(
        carom_set_listener(sound_, listener, position, numbers_.chance(128) ? turn : nullptr));
  }
  void setOutput() {
    switch (numbers_.below(6)) {
      case 0:
        succeeded(carom_pause(sound_));
        break;
      case 1:
        succeeded(carom_set_time_scale(sound_, numbers_.wild(numbers_.logBetween(0.1, 4.0))));
        break;
      case 2:
        succeeded(carom_set_gain(sound_, numbers_.wild(1.0)));
        break;
      case 3:
        succeeded(carom_set_muted(sound_, static_cast<std::int32_t>(numbers_.below(3))));
        break;
      case 4:
        if (numbers_.rarely(64)) succeeded(carom_stop(sound_));
        break;
      default:
        succeeded(carom_prepare_rendering(sound_, numbers_.wild(kRate)));
    }
  }
  void record() {
    if (numbers_.chance(128)) return (void)succeeded(carom_finish_recording(sound_));
    const std::string path = scratchFolder() / (numbers_.chance(240) ? "c.wav" : "none/c.wav");
    succeeded(carom_record(sound_, numbers_.chance(250) ? path.c_str() : nullptr));
  }
  void ask() {
    carom_statistics statistics = {};
    statistics.size = numbers_.chance(240) ? sizeof statistics : numbers_.below(sizeof statistics);
    succeeded(carom_get_statistics(sound_, &statistics));
    std::array<char, 64> text = {};
    const std::size_t size = numbers_.below(text.size());
    for (const auto& write :
         {carom_report, carom_warning, carom_recording_error, carom_unsolved_reason}) {
      text.fill('x');
      write(sound_, text.data(), size);
      require(size == 0 || std::find(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size),
                                     '\0') != text.begin() + static_cast<std::ptrdiff_t>(size));
      require(text[size] == 'x');
    }
    require(std::isfinite(carom_time(sound_)));
    if (world_ == nullptr) return;
    carom_material material = {};
    material.size = sizeof material;
    succeeded(carom_material_of(sound_, &world_->ball, &material, nullptr, nullptr));
  }
  void assign() {
    Versioned<carom_body_sound> set(carom_body_sound_init, numbers_);
    if (numbers_.chance(128)) set->material = "glass";
    set->silent = static_cast<std::int32_t>(numbers_.below(4));
    set->no_texture = static_cast<std::int32_t>(numbers_.below(3));
    set->texture = library_.texture();
    const btCollisionObject* object = world_ != nullptr ? &world_->ball : nullptr;
    succeeded(carom_assign_user_index(sound_, static_cast<int>(numbers_.below(3)) - 1, &*set));
    succeeded(carom_assign_body(sound_, object, &*set));
    if (numbers_.rarely(64)) succeeded(carom_unassign_body(sound_, object));
    if (numbers_.rarely(64)) succeeded(carom_unassign_user_index(sound_, -1));
  }
  void advance() {
    if (world_ != nullptr) {
      world_->ball.activate(true);
      if (numbers_.rarely(16))
        world_->ball.setLinearVelocity({0, static_cast<btScalar>(numbers_.wild(-3.0)), 0});
      world_->bullet.stepSimulation(btScalar(1.0 / 60.0), 4, btScalar(1.0 / 240.0));
      return;
    }
    time_ += numbers_.logBetween(1e-4, 0.05);
    const double told = numbers_.wild(time_);
    if (succeeded(carom_advance(sound_, told))) time_ = std::abs(told) < 1e6 ? told : 0.0;
  }
  void render() {
    pullFinite([this](std::array<float*, 2> channels, std::size_t frames) {
      const std::size_t count = numbers_.chance(250) ? 2 : numbers_.below(4);
      const carom_status status = carom_render(sound_, channels.data(), count, frames);
      require((status == CAROM_OK) == (count == carom_channel_count(sound_)));
    });
  }
  void post() {
    Versioned<carom_event> event(carom_event_init, numbers_);
    event->time = numbers_.wild(time_ + numbers_.between(-0.01, 0.05));
    event->body = body();
    event->other = body();
    give(event->normal, Vec3::UnitY());
    event->approach_speed = numbers_.wild(numbers_.logBetween(1e-3, 100.0));
    event->effective_mass = numbers_.wild(numbers_.logBetween(1e-4, 10.0));
    give(event->impulse, event->approach_speed * event->effective_mass * Vec3::UnitY());
    event->radius = numbers_.wild(numbers_.logBetween(1e-3, 1.0));
    event->other_radius = numbers_.wild(numbers_.logBetween(1e-3, 1.0));
    give(event->position, numbers_.inCube(3.0));
    give(event->body_position, numbers_.inCube(3.0));
    give(event->body_velocity, numbers_.inCube(10.0));
    giveTurn(event->body_orientation);
    if (numbers_.rarely(4)) event->has_other_pose = 1;
    if (numbers_.rarely(4)) event->has_other_pose = 2;
    succeeded(carom_post(sound_, &*event));
  }
  void updateContact() {
    Versioned<carom_contact> contact(carom_contact_init, numbers_);
    contact->time = numbers_.wild(time_);
    contact->duration = numbers_.wild(numbers_.logBetween(1e-4, 0.02));
    contact->phase = static_cast<std::int32_t>(numbers_.below(4));
    contact->body = body();
    contact->other = body();
    give(contact->normal, Vec3::UnitY());
    give(contact->position, numbers_.inCube(2.0));
    contact->normal_load = numbers_.wild(numbers_.logBetween(1e-3, 1e3));
    give(contact->slip_velocity, {numbers_.between(-3.0, 3.0), 0.0, 0.0});
    give(contact->path_end, {numbers_.between(-0.05, 0.05), 0.0, 0.0});
    giveTurn(contact->body_orientation);
    succeeded(carom_update_contact(sound_, &*contact));
  }

  carom_sound* sound_;
  World* world_;
  FuzzNumbers& numbers_;
  Library library_;
  double time_ = 0.0;  // s
};

void requireOneFateEach(const carom_sound* sound) {
  carom_statistics of = {};
  of.size = sizeof of;
  require(carom_get_statistics(sound, &of) == CAROM_OK);
  require(of.posted == of.silenced + of.skipped + of.immovable + of.rejected + of.heard +
                           of.inaudible + of.masked + of.stolen + of.over_budget + of.no_bus +
                           of.too_long + of.rings_left_out + of.queue_faults + of.lost +
                           of.waiting);
}

/// Settings of which some may be wild, and which two listeners of one channel each hear.
carom_sound* made(World* world, FuzzNumbers& numbers) {
  Versioned<carom_settings> settings(carom_settings_init, numbers);
  settings->sample_rate = numbers.wild(kRate);
  settings->voices = numbers.chance(250) ? 1 + numbers.below(64) : ~std::size_t{0};
  settings->buses = numbers.chance(250) ? 1 + numbers.below(16) : 0;
  settings->ringing_bodies = 2;
  settings->modes = 4;
  settings->sliding_contacts = numbers.chance(250) ? 2 : ~std::size_t{0};
  settings->radiators = CAROM_RADIATORS_EQUIVALENT_SPHERE;
  settings->on_message = [](void*, const char*) {};
  if (numbers.rarely(64)) {
    settings->clock = static_cast<std::int32_t>(numbers.below(3));
    settings->level = static_cast<std::int32_t>(numbers.below(4));
    settings->pulse = static_cast<std::int32_t>(numbers.below(6));
    settings->limiter = static_cast<std::int32_t>(numbers.below(3));
    settings->latency = numbers.wild(0.05);
    settings->speed_of_sound = numbers.wild(343.0);
    settings->air_temperature = numbers.wild(293.15);
    settings->air_humidity = numbers.wild(0.5);
    settings->air_pressure = numbers.wild(101325.0);
    settings->air_absorption = static_cast<std::int32_t>(numbers.below(3));
    settings->longest_contact = numbers.wild(0.05);
    settings->full_scale = numbers.wild(1.0);
    settings->metres_per_unit = numbers.wild(1.0);
  }
  carom_sound* sound = nullptr;
  const carom_status status = world != nullptr ? carom_attach(&world->bullet, &*settings, &sound)
                                               : carom_create(&*settings, &sound);
  require(succeeded(status) == (sound != nullptr));
  return sound;
}

void call(FuzzNumbers& numbers) {
  std::optional<World> world;
  if (numbers.rarely(64)) world.emplace();
  carom_sound* sound = made(world ? &*world : nullptr, numbers);
  if (sound == nullptr) return;
  if (numbers.chance(200)) succeeded(carom_prepare_rendering(sound, kRate));
  Host(sound, world ? &*world : nullptr, numbers).run();
  requireOneFateEach(sound);
  succeeded(carom_destroy(sound));
}

}  // namespace
}  // namespace carom::fuzz

/// Calls the C interface in the order and with the numbers that the bytes stand for, structs of
/// other versions among them: each refusal must have a sentence, no sample may be anything but
/// finite, and each share that was posted must have one fate.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  carom::fuzz::keepTables();
  carom::fuzz::FuzzNumbers numbers({data, size});
  carom::fuzz::call(numbers);
  return 0;
}
