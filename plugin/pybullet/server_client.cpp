#include "plugin/pybullet/server_client.h"

#include <algorithm>
#include <cstddef>

namespace carom::plugin {
namespace {

Vec3 vectorAt(const double* values) {
  return {values[0], values[1], values[2]};
}

// Reads a quaternion. The server's order is x, y, z, w, and its length is that of rounded floats.
Quat orientationAt(const double* values) {
  return Quat(values[3], values[0], values[1], values[2]).normalized();
}

}  // namespace

std::optional<b3::SimulationParameters> ServerClient::parameters() {
  const b3::Answer answer = server_.submit(client_, server_.requestParameters(client_));
  b3::SimulationParameters parameters{};
  if (answer == nullptr || server_.parameters(answer, &parameters) == 0) return std::nullopt;
  return parameters;
}

std::vector<int> ServerClient::bodies() {
  server_.submit(client_, server_.requestBodies(client_));
  std::vector<int> bodies(static_cast<std::size_t>(std::max(0, server_.bodyCount(client_))));
  for (int index = 0; int& body : bodies)
    body = server_.bodyId(client_, index++);
  return bodies;
}

std::span<const BodyState> ServerClient::states(int body) {
  states_.clear();
  const b3::Command command = server_.requestState(client_, body);
  server_.withLinkVelocities(command, 1);
  const b3::Answer answer = server_.submit(client_, command);
  const double* position = nullptr;
  const double* velocity = nullptr;
  // `state` looks whether there is an answer; `linkCount` does not.
  if (answer == nullptr ||
      server_.state(answer, nullptr, nullptr, nullptr, nullptr, &position, &velocity, nullptr) == 0)
    return states_;
  states_.push_back({vectorAt(position), orientationAt(position + 3), vectorAt(velocity),
                     vectorAt(velocity + 3)});
  int links = 0;
  server_.linkCount(answer, nullptr, &links, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr,
                    nullptr, nullptr, nullptr, nullptr);
  b3::LinkState link{};
  for (int index = 0; index < links && server_.linkState(client_, answer, index, &link) != 0;
       ++index) {
    states_.push_back({vectorAt(link.position.data()), orientationAt(link.orientation.data()),
                       vectorAt(link.velocity.data()), vectorAt(link.angularVelocity.data())});
  }
  return states_;
}

std::span<const b3::ContactPoint> ServerClient::contacts() {
  server_.submit(client_, server_.requestContacts(client_));
  b3::ContactInformation found{};
  server_.contacts(client_, &found);
  return {found.points, static_cast<std::size_t>(std::max(0, found.count))};
}

std::optional<b3::DynamicsInfo> ServerClient::dynamics(Key key) {
  const b3::Answer answer =
      server_.submit(client_, server_.requestDynamics(client_, key.body, key.link));
  b3::DynamicsInfo info{};
  if (answer == nullptr || server_.dynamics(answer, &info) == 0) return std::nullopt;
  return info;
}

std::optional<Vec3> ServerClient::halfBounds(Key key) {
  const b3::Answer answer = server_.submit(client_, server_.requestBounds(client_, key.body));
  Vec3 least = Vec3::Zero();
  Vec3 most = Vec3::Zero();
  if (answer == nullptr || server_.bounds(answer, key.link, least.data(), most.data()) == 0)
    return std::nullopt;
  const Vec3 half = 0.5 * (most - least);
  if (!half.allFinite() || !(half.array() >= 0.0).all()) return std::nullopt;
  return half;
}

}  // namespace carom::plugin
