#include "audio/scheduling/ring_ledger.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>

namespace carom::audio {

/// Lets modes ring on freely: of what each loses, radiation has its share of the decay rate.
void RingLedger::advance(Ring& ring, double time) {
  const double passed = time - ring.time;
  if (!(passed > 0.0)) return;  // an event that comes late counts as of now
  ring.time = time;
  for (std::size_t mode = 0; mode < ring.energies.size(); ++mode) {
    if (ring.energies[mode] == 0.0) continue;
    const double free = -ring.resonators->pole[mode].real();
    const double damped = free + (ring.damping.empty() ? 0.0 : ring.damping[mode]);
    const double most = std::max(free, kMostDamping * ring.resonators->pole[mode].imag());
    const double decay = std::min(damped, most);
    if (!(decay > 0.0)) continue;
    const double lost = -ring.energies[mode] * std::expm1(-2.0 * decay * passed);
    const double radiated = lost * ring.resonators->radiated[mode] / decay;
    ring.energies[mode] -= lost;
    ring.sum.radiated += radiated;
    ring.sum.absorbed += lost - radiated;
  }
}

void RingLedger::add(BodyId body, const ResonatorSet& resonators, double time,
                     std::span<const double> energies) {
  Ring& ring = rings_[body];
  advance(ring, time);
  if (ring.resonators != &resonators) {  // a new body, or one with another model
    ring.sum.absorbed += std::accumulate(ring.energies.begin(), ring.energies.end(), 0.0);
    ring.energies.assign(resonators.modes, 0.0);
    // It may have been touched before anything struck it.
    ring.damping.clear();
    if (ring.next == &resonators) std::swap(ring.damping, ring.nextDamping);
    ring.resonators = &resonators;
    ring.time = time;
    ring.sum.body = body;
  }
  for (std::size_t mode = 0; mode < energies.size(); ++mode) {
    ring.energies[mode] += energies[mode];
    ring.sum.given += energies[mode];
  }
}

void RingLedger::damp(BodyId body, const ResonatorSet& resonators, double time,
                      std::span<const double> rates) {
  Ring& ring = rings_[body];
  const bool isOfRing = ring.resonators == &resonators;
  if (isOfRing) advance(ring, time);
  std::vector<double>& damping = isOfRing ? ring.damping : ring.nextDamping;
  damping.assign(rates.begin(), rates.end());
  if (!damping.empty()) damping.resize(resonators.modes, 0.0);
  if (!isOfRing) ring.next = &resonators;
}

void RingLedger::forget(BodyId body) {
  const auto found = rings_.find(body);
  if (found == rings_.end()) return;
  Ring& ring = found->second;
  ring.damping.clear();  // nothing touches it any more
  advance(ring, std::numeric_limits<double>::infinity());
  removed_.given += ring.sum.given;
  removed_.radiated += ring.sum.radiated;
  removed_.absorbed += ring.sum.absorbed;
  removed_.remaining += std::accumulate(ring.energies.begin(), ring.energies.end(), 0.0);
  rings_.erase(found);
}

std::vector<RingEnergy> RingLedger::at(double time) const {
  std::vector<RingEnergy> all;
  for (const auto& [body, ring] : rings_) {
    if (ring.resonators == nullptr) continue;
    Ring later = ring;
    advance(later, time);
    later.sum.remaining = std::accumulate(later.energies.begin(), later.energies.end(), 0.0);
    all.push_back(later.sum);
  }
  return all;
}

}  // namespace carom::audio
