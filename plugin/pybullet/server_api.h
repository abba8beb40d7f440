#pragma once

#include <memory>

#include "carom/audio/result.h"
#include "plugin/pybullet/server_abi.h"

namespace carom::b3 {

/// The functions of the server's C API that this plugin calls, found in the program or library
/// that loaded it: PyBullet's module exports them, but it is not to be linked.
/// Signatures: PhysicsClientC_API.h.
struct ServerFunctions {
  Answer (*submit)(Client, Command) = nullptr;

  Command (*requestParameters)(Client) = nullptr;
  int (*parameters)(Answer, SimulationParameters*) = nullptr;

  Command (*requestBodies)(Client) = nullptr;
  int (*bodyCount)(Client) = nullptr;
  int (*bodyId)(Client, int index) = nullptr;

  Command (*requestState)(Client, int body) = nullptr;
  int (*withLinkVelocities)(Command, int) = nullptr;
  int (*state)(Answer, int* body, int* coordinates, int* velocities, const double** localFrame,
               const double** position, const double** velocity,
               const double** jointForces) = nullptr;
  int (*linkCount)(Answer, int* body, int* links, int*, int*, const double**, const double**,
                   const double**, const double**, const double**, const double**, const double**,
                   const double**) = nullptr;
  int (*linkState)(Client, Answer, int link, LinkState*) = nullptr;

  Command (*requestDynamics)(Client, int body, int link) = nullptr;
  int (*dynamics)(Answer, DynamicsInfo*) = nullptr;

  Command (*requestBounds)(Client, int body) = nullptr;
  int (*bounds)(Answer, int link, double least[3], double most[3]) = nullptr;

  Command (*requestContacts)(Client) = nullptr;
  void (*contacts)(Client, ContactInformation*) = nullptr;

  std::shared_ptr<void> library{};  ///< keeps the functions loaded
};

/// Finds the functions; `caller` is any address in the server's code. Refuses a server that lacks
/// one of them.
Result<ServerFunctions> findServerFunctions(const void* caller);

}  // namespace carom::b3
