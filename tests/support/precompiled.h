// The headers that most tests include, compiled once: see carom_precompile().
#ifdef __cplusplus
#include <atomic>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "cmake/precompiled.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#endif
