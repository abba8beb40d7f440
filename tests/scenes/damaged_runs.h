#pragma once

#include <memory>
#include <random>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scenes/recording/run_file.h"

namespace carom::test {

/// Reads all of a run. Returns "whole", or why it is refused.
inline std::string verdictOf(const std::string& bytes) {
  Result<scenes::RunReader> reader =
      scenes::RunReader::read(std::make_unique<std::istringstream>(bytes), "run.carom");
  while (reader) {
    const auto portions = reader->next();
    if (!portions) return portions.error().message;
    if (portions->empty()) return "whole";
  }
  return reader.error().message;
}

/// Expects that a run is whole, and refused once it is cut or a bit of it is changed.
inline void expectRefusedIfDamaged(const std::string& whole) {
  EXPECT_EQ(verdictOf(whole), "whole");
  std::minstd_rand random(1);
  for (int trial = 0; trial < 200; ++trial) {
    std::string changed = whole;
    changed[random() % changed.size()] ^= static_cast<char>(1U << (random() % 8));
    EXPECT_THAT(verdictOf(changed), testing::HasSubstr("xpected"));
    EXPECT_THAT(verdictOf(whole.substr(0, random() % whole.size())), testing::HasSubstr("xpected"));
  }
}

}  // namespace carom::test
