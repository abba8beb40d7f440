#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

/// The plugin ABI of Bullet's physics server, the one inside PyBullet, as far as this plugin needs
/// it. Declared anew because no package ships its headers. Names, order and types of the fields are
/// those of bulletphysics/bullet3, examples/SharedMemory/SharedMemoryPublic.h, PhysicsClientC_API.h
/// and plugins/b3PluginContext.h (zlib licence), which have been the same since October 2020 and
/// still are in PyBullet 3.2.7. Sizes and offsets are checked below against what a compiler says of
/// those headers on 64-bit Linux. A change of layout in the server comes with another magic number.
namespace carom::b3 {

/// The value that initPlugin has to return: the server refuses any other.
inline constexpr int kMagicNumber = 202010061;

inline constexpr int kTextLength = 1024;  ///< bytes of a command, with its final zero
inline constexpr int kArguments = 128;

/// Opaque: the server's own client, a command under construction, an answer.
using Client = struct ClientStruct*;
using Command = struct CommandStruct*;
using Answer = struct AnswerStruct*;

struct UserDataValue {
  int type = 0;  ///< 1: text
  int length = 0;
  const char* data = nullptr;
};
inline constexpr int kTextValue = 1;

struct PluginArguments {
  std::array<char, kTextLength> text;
  int intCount;
  std::array<int, kArguments> ints;
  int floatCount;
  std::array<double, kArguments> floats;
};

enum NotificationType : int {
  kSimulationReset = 0,
  kBodyAdded = 1,
  kBodyRemoved = 2,
  kLinkDynamicsChanged = 5,
  kTransformChanged = 7,  ///< of each body and link that does not sleep, after kSimulationStepped
  kSimulationStepped = 8,
  kSoftBodyChanged = 9,
};

/// A change of a body since the last notifications. The fields depend on the type; every type that
/// concerns a body begins with `body` and `link`, but those that concern whole bodies end after
/// `body`. kTransformChanged goes on with the place of the collider (m) and its orientation (x, y,
/// z, w).
struct Notification {
  int type;
  int padding;
  int body;
  int link;
  std::array<double, 3> position;
  std::array<double, 4> orientation;
  std::array<double, 26> rest;
};

struct PluginContext {
  Client client;
  void* userPointer;  ///< the plugin's own: the server keeps it
  const UserDataValue* returnData;
  const void* vrEvents;
  int vrEventCount;
  const void* keyEvents;
  int keyEventCount;
  const void* mouseEvents;
  int mouseEventCount;
  const Notification* notifications;
  int notificationCount;
  void* remoteProcessor;
};

struct SimulationParameters {
  double deltaTime;  ///< s, of one stepSimulation
  double timestamp;
  std::array<double, 3> gravity;
  int substeps;  ///< in one stepSimulation; 0 is one
  int iterations;
  std::array<double, 2> warmStarting;
  int realTime;
  int splitImpulse;                ///< 1: on
  double splitImpulseDistance;     ///< m, below 0: rigid bodies that overlap more are pushed
  double contactBreakingDistance;  ///< m
  int flags;
  double contactErp;
  int filterMode;
  int fileCaching;
  double restitutionSpeed;  ///< m/s, below it nothing bounces
  std::array<double, 8> friction;
  double contactSlop;  ///< m, added to the distance of contacts
  std::array<double, 4> rest;
};

struct ContactPoint {
  int flags;
  int bodyA;
  int bodyB;
  int linkA;  ///< -1: the base
  int linkB;
  std::array<double, 3> positionOnA;
  std::array<double, 3> positionOnB;
  std::array<double, 3> normalOnB;       ///< from B towards A
  double distance;                       ///< m, below 0 where they overlap
  double normalForce;                    ///< N: impulse / deltaTime, whatever the substep
  std::array<double, 2> frictionForces;  ///< N, as normalForce
  std::array<double, 3> frictionDirection;
  std::array<double, 3> secondFrictionDirection;
};

struct ContactInformation {
  int count;
  const ContactPoint* points;
};

struct DynamicsInfo {
  double mass;
  std::array<double, 3> inertia;  ///< principal, in the frame of the state
  std::array<double, 7> inertialFrame;
  std::array<double, 3> friction;
  double restitution;  ///< not filled in for kRigidBody
  std::array<double, 2> contact;
  int activation;
  int bodyType;
  std::array<double, 4> unused;
  int frictionAnchor;
  double margin;    ///< m: the radius of a sphere and of a capsule
  int dynamicType;  ///< 0: the body moves by itself
};
inline constexpr int kRigidBody = 1;
inline constexpr int kMultiBody = 2;
inline constexpr int kSoftBody = 3;

struct LinkState {
  std::array<double, 3> position;     ///< centre of mass
  std::array<double, 4> orientation;  ///< x, y, z, w
  std::array<double, 14> frames;
  std::array<double, 3> velocity;
  std::array<double, 3> angularVelocity;
  std::array<double, 6> bounds;
};

static_assert(sizeof(void*) == 8, "the layouts below are those of 64-bit systems");
static_assert(sizeof(UserDataValue) == 16 && offsetof(UserDataValue, data) == 8);
static_assert(sizeof(PluginArguments) == 2568 && offsetof(PluginArguments, floats) == 1544);
static_assert(sizeof(Notification) == 280 && offsetof(Notification, body) == 8);
static_assert(offsetof(Notification, position) == 16 && offsetof(Notification, orientation) == 40);
static_assert(sizeof(PluginContext) == 96 && offsetof(PluginContext, returnData) == 16);
static_assert(offsetof(PluginContext, notifications) == 72);
static_assert(offsetof(PluginContext, remoteProcessor) == 88);
static_assert(sizeof(SimulationParameters) == 224);
static_assert(offsetof(SimulationParameters, gravity) == 16);
static_assert(offsetof(SimulationParameters, substeps) == 40);
static_assert(offsetof(SimulationParameters, contactErp) == 96);
static_assert(offsetof(SimulationParameters, restitutionSpeed) == 112);
static_assert(offsetof(SimulationParameters, contactSlop) == 184);
static_assert(sizeof(ContactPoint) == 176 && offsetof(ContactPoint, bodyA) == 4);
static_assert(offsetof(ContactPoint, linkB) == 16 && offsetof(ContactPoint, positionOnA) == 24);
static_assert(offsetof(ContactPoint, distance) == 96);
static_assert(offsetof(ContactPoint, normalForce) == 104);
static_assert(sizeof(ContactInformation) == 16);
static_assert(sizeof(DynamicsInfo) == 200 && offsetof(DynamicsInfo, inertia) == 8);
static_assert(offsetof(DynamicsInfo, restitution) == 112);
static_assert(offsetof(DynamicsInfo, bodyType) == 140 && offsetof(DynamicsInfo, margin) == 184);
static_assert(offsetof(DynamicsInfo, dynamicType) == 192);
static_assert(sizeof(LinkState) == 264 && offsetof(LinkState, orientation) == 24);
static_assert(offsetof(LinkState, velocity) == 168 && offsetof(LinkState, bounds) == 216);
static_assert(std::is_standard_layout_v<PluginContext> && std::is_trivial_v<ContactPoint>);

}  // namespace carom::b3
