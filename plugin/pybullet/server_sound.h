#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/result.h"
#include "carom/event_sound.h"
#include "plugin/pybullet/command.h"
#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/server_client.h"

namespace carom::plugin {

/// The sound of a physics server: asks it in every substep, and takes commands.
///
/// Bodies and links are described (describeBody) when they are first in a contact; later changes of
/// their dynamics count from the next contact on. The server is asked before each substep for the
/// parameters and the states of all bodies that may move, and after it for the contacts; in a world
/// with deformable bodies, where the solver runs after the server has told the end of a substep,
/// before the next one. Simulation time is the sum of the substeps since the plugin was loaded; a
/// reset of the simulation does not turn it back. [physics thread]
class ServerSound {
 public:
  /// Refuses what EventSound refuses, and a server that does not tell its parameters.
  static Result<std::unique_ptr<ServerSound>> create(b3::ServerFunctions server, b3::Client client);

  void beginSubstep();
  void endSubstep();
  void hear(std::span<const b3::Notification> notifications);
  /// Runs a command; returns the text to be shown for it.
  Result<std::string> execute(std::string_view text);

 private:
  using Key = ServerClient::Key;

  /// A body or a link of the server.
  struct Known {
    BodyId id = 0;
    bool isDescribed = false;  // as its dynamics are now
    SoundBody sound{};         // with the material that was guessed
  };

  ServerSound(ServerClient client, EventSound sound)
      : client_(std::move(client)), sound_(std::move(sound)) {}

  Result<std::string> run(const command::PlaceListener& place);
  Result<std::string> run(const command::SetMaterial& set);
  Result<std::string> run(const command::Record& record);
  Result<std::string> run(const command::SetGain& set);
  Result<std::string> run(const command::Mute& mute);
  Result<std::string> run(const command::Play&);
  Result<std::string> run(const command::Stop&);
  Result<std::string> run(const command::Pause&);
  Result<std::string> run(const command::Stats&);
  Result<std::string> run(const command::Help&);

  void addBody(int body);
  void removeBody(int body);
  Known& entry(Key key);
  Known& knownAs(Key key);
  void describe(Key key, Known& known);
  Status tell(Key key, const Known& known);
  BodyId idOf(Key key);
  std::optional<BodyState> stateOf(BodyId id);
  std::optional<BodyState> stateOf(Key key);
  void readContacts();
  void finishSubstep();
  void lookForSolver();

  ServerClient client_;
  EventSound sound_;
  ContactListener listener_;
  RadiatorCache radiators_{PanelSettings{.quick = true}};
  std::map<int, bool> bodies_;  // by number: true if any part of it may move
  std::map<Key, Known> known_;
  std::map<Key, std::string> materials_;  // names, as they were set
  BodyId nextId_ = 0;
  double time_ = 0.0;      // s
  double duration_ = 0.0;  // s, of the present substep; 0 where the server did not tell
  double outer_ = 0.0;     // s, of the whole step
  std::uint64_t impacts_ = 0;
  // A place (m) at the start of the substep, of a body that moves, by which it is found whether the
  // server tells the end of a substep before its solver has run: worlds with deformable bodies do.
  struct Probe {
    int body = -1;
    Vec3 position = Vec3::Zero();
  };
  std::optional<Probe> probe_;
  std::optional<bool> solverComesLater_;  // not known before something has moved
  bool isOpen_ = false;                   // the substep before is still to be finished
  std::vector<TouchPoint> points_;
};

}  // namespace carom::plugin
