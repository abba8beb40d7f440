#pragma once

#include <string>

namespace carom::listen {

/// Version of the Bullet for which Carom was compiled, such as 324.
extern const int kCompiledVersion;

/// The library in which a function of Bullet is.
struct BulletLibrary {
  std::string file;          ///< empty for the program itself
  int version = 0;           ///< such as 324, by its soname libBulletDynamics.so.3.24; 0: unknown
  bool isReachable = false;  ///< others are linked to it without being told its name
};

/// Finds the function of Bullet with that mangled name that `world` would run if this library had
/// no function of the name: Bullet may be linked to the program, or to a library that it has opened
/// for itself alone (RTLD_LOCAL), as plugins are. Null if there is none. Keeps the library open.
/// [any thread]
void* findBulletFunction(const char* name, const void* world);

/// Returns the library that `function` is in; `name` is its mangled name.
BulletLibrary libraryOf(const void* function, const char* name);

}  // namespace carom::listen
