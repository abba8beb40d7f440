#include "plugin/pybullet/server_api.h"

#include <string>

#include <dlfcn.h>

namespace carom::b3 {
namespace {

std::shared_ptr<void> opened(const char* file) {
  void* const handle = dlopen(file, RTLD_NOW | RTLD_NOLOAD);
  if (handle == nullptr) return nullptr;
  return {handle, [](void* library) { dlclose(library); }};
}

// Opens the library that contains an address. A program cannot be opened by its name, but without
// one, as what everything is linked to.
std::shared_ptr<void> libraryAround(const void* address) {
  Dl_info info{};
  if (dladdr(address, &info) != 0 && info.dli_fname != nullptr) {
    if (std::shared_ptr<void> library = opened(info.dli_fname)) return library;
  }
  return opened(nullptr);
}

// Finds functions by name, and remembers the first name that is not there.
class Finder {
 public:
  explicit Finder(void* library) : library_(library) {}

  template <class Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(dlsym(library_, name));
    if (function == nullptr && missing_.empty()) missing_ = name;
  }

  const std::string& missing() const { return missing_; }

 private:
  void* library_;
  std::string missing_;
};

void findAll(Finder& finder, ServerFunctions& server) {
  finder.find(server.submit, "b3SubmitClientCommandAndWaitStatus");
  finder.find(server.requestParameters, "b3InitRequestPhysicsParamCommand");
  finder.find(server.parameters, "b3GetStatusPhysicsSimulationParameters");
  finder.find(server.requestBodies, "b3InitSyncBodyInfoCommand");
  finder.find(server.bodyCount, "b3GetNumBodies");
  finder.find(server.bodyId, "b3GetBodyUniqueId");
  finder.find(server.requestState, "b3RequestActualStateCommandInit");
  finder.find(server.withLinkVelocities, "b3RequestActualStateCommandComputeLinkVelocity");
  finder.find(server.state, "b3GetStatusActualState");
  finder.find(server.linkCount, "b3GetStatusActualState2");
  finder.find(server.linkState, "b3GetLinkState");
  finder.find(server.requestDynamics, "b3GetDynamicsInfoCommandInit");
  finder.find(server.dynamics, "b3GetDynamicsInfo");
  finder.find(server.requestBounds, "b3RequestCollisionInfoCommandInit");
  finder.find(server.bounds, "b3GetStatusAABB");
  finder.find(server.requestContacts, "b3InitRequestContactPointInformation");
  finder.find(server.contacts, "b3GetContactPointInformation");
}

}  // namespace

Result<ServerFunctions> findServerFunctions(const void* caller) {
  ServerFunctions server;
  server.library = libraryAround(caller);
  if (!server.library) return Error{"the library that loads this plugin cannot be opened"};
  Finder finder(server.library.get());
  findAll(finder, server);
  if (!finder.missing().empty()) {
    return Error{"the physics server does not export " + finder.missing() +
                 "; expected one like PyBullet 3.2.7"};
  }
  return server;
}

}  // namespace carom::b3
