#pragma once

#include <cstddef>
#include <vector>

#include "audio/pulse.h"

namespace carom {

// A quadrature for contacts that last many samples: three points in each sample, so that what they
// repeat of the spectrum lies at whole multiples of the sample rate, where the kernel is dark and
// nothing can come out at another frequency; and many points at either end, where a force may
// begin like a root. [any thread]

/// Nodes for a contact of so many samples.
std::size_t longRuleSize(const Pulse& pulse, double samples);

/// Replaces `nodes`, which allocates only where their capacity is below longRuleSize.
void makeLongRule(const Pulse& pulse, double samples, std::vector<PulseNode>& nodes);

}  // namespace carom
