#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <LinearMath/btTransform.h>

#include "bullet_bridge/bodies/object_identity.h"
#include "carom/bullet/bullet_bridge.h"
#include "carom/sound.h"
#include "plugin/bullet/automatic_listener.h"
#include "plugin/bullet/body_form.h"
#include "plugin/bullet/body_reader.h"
#include "plugin/realtime/sound_session.h"

namespace carom::plugin {

/// The session of a Sound: events of a Bullet world, and bodies as they are read and assigned.
/// [simulation thread]
class WorldSession final : public SoundSession {
 public:
  WorldSession(btDynamicsWorld& world, const SoundSettings& soundSettings,
               const WorldSoundSettings& worldSettings)
      : SoundSession(soundSettings),
        world_(world),
        worldSettings_(worldSettings),
        reader_(worldSettings),
        listener_(worldSettings.metresPerUnit),
        forms_(worldSettings.metresPerUnit) {}

  /// Follows the world's substeps from now on. Refuses what BulletBridge refuses.
  Status attach();
  Status close() override;
  SoundStatistics statistics() const override;

  Status assign(const btCollisionObject& object, const BodySound& sound);
  Status assign(const btCollisionShape& shape, const BodySound& sound);
  Status assign(UserIndex userIndex, const BodySound& sound);
  Status unassign(const btCollisionObject& object);
  Status unassign(const btCollisionShape& shape);
  Status unassign(UserIndex userIndex);
  /// Reads all bodies anew; their shapes will be solved.
  void readBodies();
  double metresPerUnit() const { return worldSettings_.metresPerUnit; }
  /// As Sound::materialOf.
  Result<BodyMaterial> materialOf(const btCollisionObject& object) const;
  std::string report() const override;
  /// As Sound::onCollision.
  void onCollision(std::function<void(const SoundCollision&)> function);
  /// Solves all shapes that wait.
  void finishShapes();

 private:
  /// A body with an id.
  struct KnownBody {
    BodySound assigned;  // to this body
    bool isUnsolved = false;
    bool isRefused = false;
    bool isLink = false;
    bool isGuessed = false;                         // its material is
    double density = 0.0;                           // kg/m^3; 0 if it cannot move
    std::optional<ShapeSolver::ShapeId> pending{};  // its shape, while that is not solved whole
    bool isHastened = false;                        // that
    int absent = 0;                                 // substeps since it left the world, if counted
    Eigen::Matrix3d inverseInertia = Eigen::Matrix3d::Zero();  // for when it does not
  };
  /// Properties of a body that decide how it is read, and that a host may change.
  struct AsRead {
    const btCollisionShape* shape = nullptr;
    btScalar inverseMass = 0;
    bool moves = false;
    bool operator==(const AsRead&) const = default;
  };
  /// The sound assigned to a body that no substep has seen yet, and that so has no id. Another body
  /// may come to its address.
  struct UnseenBody {
    bullet::ObjectIdentity identity;
    BodySound assigned;
  };

  /// A collision that the host has yet to be told of.
  struct Report {
    SoundCollision collision;
    BodyId body = 0;
    BodyId other = 0;
    std::vector<double> peaks;  // Pa, by listener
  };

  void postSubstep();
  void placeListener();
  void predictFirstBlow(const ListenerPose& listener);
  void postEvents();
  void postContacts();
  void moveRinging();
  void describeBodies(RunRecorder& run) override;
  void describe(RunRecorder& run, BodyId id, const btCollisionObject& object);
  void tellPoses();
  void note(const ImpulseEvent& share, bool isFirst);
  void tellNoted();
  void tell(Report& report);
  bool hasWorld() const { return bridge_ && bridge_->isAttached(); }
  Status requireWorld() const;
  std::uint64_t unusedAssignments() const;
  bool isRepeatable() const;
  void awaitShape(BodyId id);
  void takeShapes();
  void giveShape(BodyId id, KnownBody& known);
  bool isPending(BodyId id) const { return id < isPending_.size() && isPending_[id]; }
  bool isRead(BodyId id) const { return id < isRead_.size() && isRead_[id]; }
  bool isSilent(BodyId id) const { return id < isSilent_.size() && isSilent_[id]; }
  Status requirePresent(const btCollisionObject& object) const;
  void beginReading();
  template <class IsWanted>
  void readWhere(const IsWanted& isWanted);
  void readWithShape(const btCollisionShape& shape);
  void readWithIndex(UserIndex userIndex);
  static AsRead seenAs(const btCollisionObject& object);
  void readChanged(BodyId id);
  void readNew();
  void readColliding();
  void read(BodyId id, const btCollisionObject& object);
  void take(BodyId id, KnownBody& known, const SoundBody& body);
  void mergeUnseen(const btCollisionObject& object, BodySound& assigned);
  BodySound assignedTo(const KnownBody& body, const btCollisionObject& object);
  void forgetRemoved();

  btDynamicsWorld& world_;
  WorldSoundSettings worldSettings_;
  BodyReader reader_;
  std::unordered_map<BodyId, KnownBody> known_;
  std::vector<bool> isRead_;       // by id: it was in known_ at some time; asked for every event
  std::vector<AsRead> asRead_;     // by id; as long as isRead_
  std::vector<bool> isSilent_;     // by id; as long as isRead_
  std::vector<bool> isPending_;    // by id; as long as isRead_: it waits for its shape
  std::uint64_t givenShapes_ = 0;  // solutions that were known when bodies got theirs
  std::unordered_map<const btCollisionObject*, UnseenBody> unseen_;
  std::unordered_map<const btCollisionShape*, BodySound> ofShape_;
  std::unordered_map<int, BodySound> ofUserIndex_;
  AutomaticListener listener_;
  std::unordered_map<BodyId, btTransform> toldPoses_;  // to runs
  BodyForms forms_;
  std::unordered_set<const btCollisionShape*> usedShapes_;  // of ofShape_, by a body that was read
  std::unordered_set<int> usedIndices_;                     // of ofUserIndex_
  std::string unsolvedReason_;
  /// Shared, as it may be replaced while it runs; null for none.
  std::shared_ptr<const std::function<void(const SoundCollision&)>> onCollision_;
  std::vector<Report> reports_;
  bool isReporting_ = false;
  std::uint64_t solvedInStep_ = 0;
  std::uint64_t unsupported_ = 0;
  std::uint64_t silenced_ = 0;
  std::uint64_t collisions_ = 0;  // BulletBridgeCounters::collisions, when bodies were last read
  bool isQuiet_ = true;           // nothing was posted yet
  std::optional<BulletBridge> bridge_;  // destroyed first: it calls postSubstep
};

}  // namespace carom::plugin
