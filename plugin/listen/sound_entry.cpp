// The functions of the libraries with the sound; see listen_protocol.h.

#include <btBulletDynamicsCommon.h>

#include "plugin/listen/heard_worlds.h"
#include "plugin/listen/listen_protocol.h"

#define CAROM_LISTEN_EXPORT extern "C" __attribute__((visibility("default")))

using carom::listen::HeardWorlds;

CAROM_LISTEN_EXPORT void carom_listen_before_step(void* world) {
  HeardWorlds::instance().beforeStep(*static_cast<btDiscreteDynamicsWorld*>(world));
}

CAROM_LISTEN_EXPORT void carom_listen_after_step(void* world) {
  HeardWorlds::instance().afterStep(world);
}

CAROM_LISTEN_EXPORT void carom_listen_world_ends(void* world) {
  HeardWorlds::instance().end(world);
}
