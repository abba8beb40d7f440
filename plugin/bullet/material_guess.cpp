#include "plugin/bullet/material_guess.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace carom::plugin {
namespace {

/// The classes of the guess, by ascending density.
constexpr std::array kClasses{"wood", "plastic", "granite", "steel"};

/// Returns the number that lies `share` of the way from one positive number to another, in ratio.
double between(double from, double to, double share) {
  return from * std::pow(to / from, share);
}

Material mixed(const Material& lighter, const Material& heavier, double share) {
  const auto linear = [share](double from, double to) { return from + share * (to - from); };
  Material material = share <= 0.5 ? lighter : heavier;  // its name, and what is not mixed
  material.youngsModulus = between(lighter.youngsModulus, heavier.youngsModulus, share);
  material.poissonsRatio = linear(lighter.poissonsRatio, heavier.poissonsRatio);
  material.restitution = linear(lighter.restitution, heavier.restitution);
  material.dampingAlpha = linear(lighter.dampingAlpha, heavier.dampingAlpha);
  material.dampingBeta = linear(lighter.dampingBeta, heavier.dampingBeta);
  material.lossFactor = linear(lighter.lossFactor, heavier.lossFactor);
  material.lossExponent = linear(lighter.lossExponent, heavier.lossExponent);
  material.thermal = {};  // of what a mesh is analysed for; a guess has no mesh
  const Roughness& fine = lighter.roughness;
  const Roughness& coarse = heavier.roughness;
  material.roughness = {between(fine.rmsHeight, coarse.rmsHeight, share),
                        between(fine.correlationLength, coarse.correlationLength, share),
                        linear(fine.hurst, coarse.hurst)};
  return material;
}

}  // namespace

Material materialByDensity(double density) {
  std::size_t heavier = 1;
  while (heavier + 1 < kClasses.size() && findMaterial(kClasses[heavier])->density < density)
    ++heavier;
  const Material& low = *findMaterial(kClasses[heavier - 1]);
  const Material& high = *findMaterial(kClasses[heavier]);
  const double share = std::log(density / low.density) / std::log(high.density / low.density);
  Material material = mixed(low, high, std::clamp(share, 0.0, 1.0));
  material.density = density;
  return material;
}

}  // namespace carom::plugin
