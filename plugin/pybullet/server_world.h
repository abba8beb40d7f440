#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"
#include "carom/audio/panel_radiator.h"
#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/lasting_pairs.h"
#include "plugin/pybullet/server_body.h"
#include "plugin/pybullet/server_client.h"

namespace carom::plugin {

/// The receiver of all that a ServerWorld tells. Bodies go by their ids, which no two have had.
/// [physics thread]
class ServerEars {
 public:
  virtual ~ServerEars() = default;

  /// A substep of that duration (s) is about to begin.
  virtual void beginSubstep(double duration) = 0;
  /// A part of a body was described, for the first time or anew.
  virtual void takePart(const ServerBody& body, ServerPart& part) = 0;
  virtual void removePart(BodyId id) = 0;
  /// A part that rings is there at the time of the pose.
  virtual void movePart(BodyId id, const ListenerPose& pose) = 0;
  virtual void hear(const ImpulseEvent& share) = 0;
  virtual void hear(const ContactState& contact) = 0;
  /// The simulation has come to that time (s), and all before it has been told but what becomes
  /// known later.
  virtual void advanceTo(double time) = 0;
  /// The simulation was reset: there are no bodies, and the time is 0.
  virtual void restart() = 0;

 protected:
  ServerEars() = default;
  ServerEars(const ServerEars&) = default;
  ServerEars& operator=(const ServerEars&) = default;
};

/// The bodies of a physics server, and what happens to them, as a plugin is told and asks for.
///
/// Bodies and links are described (describeBody) when they are first in a contact; later changes of
/// their dynamics count from the next contact on. Before each substep the server is asked for its
/// parameters and for the states that it has not told (BodyMotion), after it for the contacts: once
/// it has told that it has stepped, or before the next substep within a step. Its solver has run
/// then in any world; one with deformable bodies tells the end of a substep before that. The time
/// is the sum of the substeps since the world was made, or the clock was set. [physics thread]
class ServerWorld final : private SubstepMotions {
 public:
  using Key = ServerClient::Key;

  /// Borrows the ears, which must outlive this. Hears nothing of what there is before `begin`.
  ServerWorld(ServerClient client, ServerEars& ears) : client_(std::move(client)), ears_(ears) {}

  /// Looks which bodies there are.
  void begin();
  void beginSubstep();
  void endSubstep();
  void hear(std::span<const b3::Notification> notifications);
  /// Sets the clock (s).
  void setTime(double seconds);

  double time() const { return time_; }  ///< s
  /// True if no substep has begun since the clock was at 0.
  bool isAtStart() const { return steps_ == 0 && !(epoch_ > 0.0); }
  std::uint64_t impacts() const { return impacts_; }
  std::uint64_t softContacts() const { return softContacts_; }  ///< points, in all substeps
  std::size_t bodyCount() const;

  /// Number of a body's links besides its base; below 0 if the server has no such body.
  int linkCount(int body);
  /// Returns a body that the server has.
  ServerBody& body(int number);
  ServerPart& partOf(Key key);
  /// The server's numbers of a part that was told to the ears.
  Key keyOf(BodyId id) const { return keys_[id]; }
  /// Tells the ears all parts that have been described once more.
  void tellParts();

 private:
  void takeStates();
  void askFor(int body, BodyMotion& motion, BodyMotion::Source source);
  void beginMotions();
  void hearStep(std::span<const b3::Notification> told);
  void hearPlace(const b3::Notification& told);
  void place(ServerBody& body, BodyState state);
  void readContacts();
  void addImpulse(const b3::ContactPoint& contact, ServerBody& body, double sign);
  void correctMotions();
  void correct(int number, ServerBody& body);
  void finishSubstep();
  void addBody(int body);
  void removeBody(int body);
  ServerBody* find(int body);
  const ServerBody* find(int body) const;
  const ServerBody* bodyOf(BodyId id) const;
  const ServerPart& described(Key key);
  void describe(Key key, ServerPart& part);
  std::optional<BodyState> stateAfter(BodyId id);
  std::optional<BodyState> stateOf(Key key);
  std::optional<SubstepMotion> motionOf(BodyId id) const override;
  const BodyState* endStateOf(BodyId id) const override;

  ServerClient client_;
  ServerEars& ears_;
  ContactListener listener_;
  LastingPairs lasting_;
  RadiatorCache radiators_{PanelSettings{.quick = true}};
  std::vector<ServerBody> bodies_;  // by number
  std::vector<Key> keys_;           // by id, of all parts that were; without a body, of gone ones
  double epoch_ = 0.0;              // s, time at which substeps of the present duration began
  std::uint64_t steps_ = 0;         // substeps since then
  double counted_ = 0.0;            // s, their duration
  double time_ = 0.0;               // s
  double duration_ = 0.0;           // s, of the present substep; 0 where the server did not tell
  double outer_ = 0.0;              // s, of the whole step
  Vec3 gravity_ = Vec3::Zero();     // m/s^2
  double pushDistance_ = 0.0;       // m, see splitImpulseDistance
  std::uint64_t impacts_ = 0;
  std::uint64_t softContacts_ = 0;
  std::uint64_t substep_ = 0;  // number of the present one, from 1
  bool isOpen_ = false;        // the substep is still to be finished
  bool isTold_ = false;        // the server tells of its steps
  std::vector<TouchPoint> points_;
};

/// Duration (s) of the substeps of a server.
double substepOf(const b3::SimulationParameters& parameters);

}  // namespace carom::plugin
