#include "audio/long_rule.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace carom {
namespace {

// Of a cell at an end, from that end on.
constexpr std::array<double, 5> kSteps = {0.0, 1.0 / 64.0, 1.0 / 16.0, 1.0 / 4.0, 1.0};

// Gauss's rules on [-1, 1], of degree 5 and 9.
constexpr std::array<PulseNode, 3> kFew = {{{-0.7745966692414834, 0.5555555555555556},
                                            {0.0, 0.8888888888888889},
                                            {0.7745966692414834, 0.5555555555555556}}};
constexpr std::array<PulseNode, 5> kMany = {{{-0.9061798459386640, 0.2369268850561891},
                                             {-0.5384693101056831, 0.4786286704993665},
                                             {0.0, 0.5688888888888889},
                                             {0.5384693101056831, 0.4786286704993665},
                                             {0.9061798459386640, 0.2369268850561891}}};
constexpr std::size_t kAtEnds = 2 * kMany.size() * (kSteps.size() - 1);

// Cells of one sample between those at the ends, of which the last one takes what is left.
std::size_t innerCells(const Pulse& pulse, double samples) {
  const double all = std::floor((pulse.end() - pulse.begin()) * samples);
  return static_cast<std::size_t>(std::max(0.0, all - 2.0));
}

void addCell(const Pulse& pulse, double from, double to, std::span<const PulseNode> rule,
             std::vector<PulseNode>& nodes) {
  const double half = 0.5 * (to - from);
  for (const PulseNode& node : rule) {
    const double u = from + half * (1.0 + node.u);
    nodes.push_back({u, half * node.weight * pulse.force(u)});
  }
}

}  // namespace

std::size_t longRuleSize(const Pulse& pulse, double samples) {
  return kFew.size() * innerCells(pulse, samples) + kAtEnds;
}

void makeLongRule(const Pulse& pulse, double samples, std::vector<PulseNode>& nodes) {
  nodes.clear();
  const std::size_t inner = innerCells(pulse, samples);
  const double width = 1.0 / samples;
  const double first = pulse.begin() + width;
  const double last = first + static_cast<double>(inner) * width;
  for (std::size_t i = 1; i < kSteps.size(); ++i)
    addCell(pulse, first - (1.0 - kSteps[i - 1]) * width, first - (1.0 - kSteps[i]) * width, kMany,
            nodes);
  for (std::size_t cell = 0; cell < inner; ++cell) {
    const double from = first + static_cast<double>(cell) * width;
    addCell(pulse, from, from + width, kFew, nodes);
  }
  const double left = pulse.end() - last;
  for (std::size_t i = kSteps.size() - 1; i > 0; --i)
    addCell(pulse, pulse.end() - kSteps[i] * left, pulse.end() - kSteps[i - 1] * left, kMany,
            nodes);
}

}  // namespace carom
