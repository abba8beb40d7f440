#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/server_api.h"

namespace carom::plugin {

/// Asks the physics server, from within: it answers at once, also in the middle of a step.
/// What it does not know any more is nothing here. [physics thread]
class ServerClient {
 public:
  /// Of a contact, -1 for the base of a body. Both as the server says them: the body's number may
  /// come again after it was removed.
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
  /// Numbers of all bodies. Takes long where there are many: it reads each body's joints too.
  std::vector<int> bodies();
  /// Base first, then the links. Empty if there is no such body. Valid until the next call.
  std::span<const BodyState> states(int body);
  std::vector<b3::ContactPoint> contacts();
  /// Only of what was seen in a contact: of a base without a collider the server cannot tell.
  std::optional<b3::DynamicsInfo> dynamics(Key key);
  std::vector<b3::CollisionShape> shapes(Key key);

 private:
  b3::ServerFunctions server_;
  b3::Client client_;
  std::vector<BodyState> states_;
};

}  // namespace carom::plugin
