// The headers that all files of the command include, compiled once: see carom_precompile().
#ifdef __cplusplus
#include "cmake/precompiled.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#endif
