#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::scenes {

/// Numbers in the order in which a page reads them, as little-endian bytes.
class NumberTable {
 public:
  template <class Number>
  void add(Number number) {
    const auto bytes = std::as_bytes(std::span(&number, 1));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void add(const Vec3& vector) {
    for (const double number : vector)
      add(number);
  }
  /// As w, x, y, z.
  void add(const Quat& turn) {
    for (const double number : {turn.w(), turn.x(), turn.y(), turn.z()})
      add(number);
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

}  // namespace carom::scenes
