// What the files of the command include, compiled once: see carom_precompile().
#ifdef __cplusplus
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cmake/precompiled.h"
#endif
