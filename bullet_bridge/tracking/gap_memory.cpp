#include "bullet_bridge/tracking/gap_memory.h"

#include <algorithm>
#include <bit>

namespace carom::bullet {
namespace {

constexpr std::size_t kFewest = 256;    // entries
constexpr std::size_t kSpare = 4;       // entries for each pair of a substep
constexpr double kMeasurement = 1e-9;   // error of a gap, relative to the size of the bodies

bool hasBody(const TrackedBody& body) {
  return body.shape == ContactShape::sphere ||
         (body.shape == ContactShape::other && !body.object->getCollisionShape()->isConcave());
}

double travelOf(const ContactPair& pair) {
  return pair.body->travel + pair.other->travel;
}

std::uint32_t shapesOf(const ContactPair& pair) {
  return pair.body->shapeNumber + pair.other->shapeNumber;
}

}  // namespace

void GapMemory::beginSubstep(std::size_t pairs) {
  const std::size_t wanted = std::bit_ceil(std::max(kFewest, kSpare * pairs));
  if (entries_.size() < wanted) entries_.assign(wanted, {});
}

bool GapMemory::canRemember(const ContactPair& pair) {
  return hasBody(*pair.body) && hasBody(*pair.other);
}

// Fibonacci hashing (Knuth, The Art of Computer Programming 3, 6.4).
std::size_t GapMemory::placeOf(std::uint64_t key) const {
  const int unused = 64 - std::countr_zero(entries_.size());
  return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15U) >> unused);
}

double GapMemory::leastGap(const ContactPair& pair) const {
  const std::uint64_t key = pair.key();
  const Entry& entry = entries_[placeOf(key)];
  if (entry.key != key || entry.shapes != shapesOf(pair)) return -1.0;
  return entry.travel - travelOf(pair);
}

void GapMemory::remember(const ContactPair& pair, double gap) {
  const std::uint64_t key = pair.key();
  const double error = kMeasurement * (pair.body->radius + pair.other->radius);
  entries_[placeOf(key)] = {key, travelOf(pair) + gap - error, shapesOf(pair)};
}

}  // namespace carom::bullet
