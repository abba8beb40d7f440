#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/server_api.h"

namespace carom::plugin {

/// Asks the physics server, from within: it answers at once, also in the middle of a step. Nothing
/// is returned of bodies that it does not know any more. [physics thread]
class ServerClient {
 public:
  /// A body and its link, -1 for the base, by the server's numbers: that of a body may come again
  /// after it was removed.
  struct Key {
    int body = -1;
    int link = -1;
    bool operator==(const Key&) const = default;
    bool operator<(const Key& than) const {
      return body != than.body ? body < than.body : link < than.link;
    }
  };

  ServerClient(b3::ServerFunctions server, b3::Client client)
      : server_(std::move(server)), client_(client) {}

  std::optional<b3::SimulationParameters> parameters();
  /// Returns the numbers of all bodies. Takes long with many: it reads each body's joints too.
  std::vector<int> bodies();
  /// Returns the states of a body: base first, then the links. Empty if there is no such body.
  /// Valid until the next call.
  std::span<const BodyState> states(int body);
  /// Returns all contacts. Valid until the next call.
  std::span<const b3::ContactPoint> contacts();
  /// Returns the dynamics of a body that was seen in a contact: for a base without a collider the
  /// server cannot tell them.
  std::optional<b3::DynamicsInfo> dynamics(Key key);
  /// Returns half the edges (m) of the box, in world axes, around a body or link; nothing without a
  /// collider. Its shape itself must not be asked for: the server takes any set of spheres for a
  /// capsule, and reads beyond it.
  std::optional<Vec3> halfBounds(Key key);

 private:
  b3::ServerFunctions server_;
  b3::Client client_;
  std::vector<BodyState> states_;
};

}  // namespace carom::plugin
