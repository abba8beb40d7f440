#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <sstream>
#include <string>

#include "lab/fit/fit_files.h"
#include <nlohmann/json.hpp>

namespace carom::lab {

using Json = nlohmann::ordered_json;

namespace {

/// Rounds for the answer: what lies beyond is not known anyway.
double digits(double value, int count) {
  if (value == 0.0 || !std::isfinite(value)) return 0.0;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - count + 1);
  return std::round(value / unit) * unit;
}

const Material& materialOf(const FitOutcome& outcome) {
  return outcome.fit ? outcome.fit->material : outcome.alone->model.material;
}

Json lawJson(const DampingFit& damping) {
  Json object;
  object["law"] = damping.isRayleigh ? "rayleigh" : "loss_factor";
  object["damping_alpha"] = digits(damping.law.alpha, 5);
  object["damping_beta"] = digits(damping.law.beta, 5);
  object["loss_factor"] = digits(damping.law.lossFactor, 5);
  object["loss_exponent"] = digits(damping.law.lossExponent, 4);
  object["modes"] = damping.modes;
  object["rayleigh_residual"] = digits(damping.rayleighResidual, 3);
  object["loss_factor_residual"] = digits(damping.lossFactorResidual, 3);
  return object;
}

Json materialJson(const FitOutcome& outcome) {
  const Material& material = materialOf(outcome);
  Json object;
  if (!outcome.builtIn.empty()) object["like"] = outcome.builtIn;
  object["density"] = digits(material.density, 6);
  object["youngs_modulus"] = digits(material.youngsModulus, 6);
  object["poissons_ratio"] = digits(material.poissonsRatio, 4);
  if (outcome.builtIn.empty()) {
    object["restitution"] = material.restitution;
    if (material.roughness.rmsHeight > 0.0)
      object["roughness"] = {{"rms_height", material.roughness.rmsHeight},
                             {"correlation_length", material.roughness.correlationLength},
                             {"hurst", material.roughness.hurst}};
    object["thermal_expansion"] = material.thermal.expansion;
    object["thermal_conductivity"] = material.thermal.conductivity;
    object["heat_capacity"] = material.thermal.heatCapacity;
  }
  addDamping(object, outcome.fit ? outcome.fit->damping.law : outcome.alone->damping.law);
  return object;
}

Json modeJson(const TapMode& mode) {
  Json object;
  object["measured_hz"] = digits(mode.frequency, 7);
  object["computed_hz"] = nullptr;
  object["decay_per_s"] = digits(mode.decayRate, 4);
  object["level_db"] = digits(mode.level, 4);
  object["over_noise_db"] = digits(mode.overNoise, 4);
  object["confidence"] = digits(mode.confidence, 3);
  object["frequency_error_hz"] = digits(mode.frequencyError, 2);
  object["decay_error_per_s"] = digits(mode.decayError, 2);
  object["subspace"] = mode.bySubspace;
  object["peak"] = mode.byPeak;
  return object;
}

void addFit(Json& object, const TapFit& fit, const FitOutcome& outcome) {
  object["modulus_over_density"] = digits(fit.material.youngsModulus / fit.material.density, 6);
  object["modulus_error"] = digits(fit.modulusError, 2);
  object["density_known"] = outcome.isDensityKnown;
  object["poisson_fitted"] = fit.isPoissonFitted;
  if (fit.isPoissonFitted) object["poisson_error"] = digits(fit.poissonError, 2);
  object["scale"] = digits(fit.scale, 6);
  object["thickness_m"] = fit.thickness > 0.0 ? Json(digits(fit.thickness, 5)) : Json(nullptr);
  if (outcome.isThicknessFree) object["thickness_error_m"] = digits(fit.thicknessError, 2);
  object["damping"] = lawJson(fit.damping);
  object["match"] = {{"matched", fit.match.matched},
                     {"explained", digits(fit.match.explained, 4)},
                     {"residual", digits(fit.match.residual, 3)},
                     {"score", digits(fit.match.score, 4)},
                     {"chance_score", digits(fit.match.chanceScore, 4)},
                     {"chance_distance", digits(fit.match.chanceDistance, 4)}};
}

void addModes(Json& object, const FitOutcome& outcome) {
  object["modes"] = Json::array();
  object["unexplained"] = Json::array();
  if (!outcome.fit) {
    for (const TapMode& mode : outcome.found.modes)
      object["modes"].push_back(modeJson(mode));
    return;
  }
  for (const FittedMode& mode : outcome.fit->modes) {
    Json entry = modeJson(mode.measured);
    if (!mode.computed) {
      object["unexplained"].push_back(std::move(entry));
      continue;
    }
    entry["computed_hz"] = digits(*mode.computed, 7);
    entry["computed_decay_per_s"] = digits(mode.computedDecay.value_or(0.0), 4);
    entry["radiation_decay_per_s"] = digits(mode.radiationDecay.value_or(0.0), 4);
    object["modes"].push_back(std::move(entry));
  }
}

/// Writes a number with so many digits.
std::string number(double value, int count) {
  std::ostringstream text;
  text << std::setprecision(count) << value;
  return text.str();
}

std::string bodyText(const TapFit& fit, const FitOutcome& outcome) {
  std::ostringstream text;
  text << "\nYoung's modulus " << number(fit.material.youngsModulus / 1e9, 4) << " GPa (+- "
       << number(100.0 * fit.modulusError, 2) << " %) at " << number(fit.material.density, 5)
       << " kg/m^3" << (outcome.isDensityKnown ? "" : ", which is a guess") << "; Poisson's ratio "
       << number(fit.material.poissonsRatio, 3)
       << (fit.isPoissonFitted ? " +- " + number(fit.poissonError, 2)
                               : std::string(", not told by this tap"))
       << '\n';
  if (fit.scale != 1.0) text << "scale " << number(fit.scale, 5) << '\n';
  if (fit.thickness > 0.0) text << "wall " << number(1e3 * fit.thickness, 4) << " mm\n";
  return text.str();
}

std::string dampingText(const DampingFit& damping) {
  std::ostringstream text;
  if (damping.isRayleigh)
    text << "damping alpha " << number(damping.law.alpha, 4) << " 1/s, beta "
         << number(damping.law.beta, 4) << " s";
  else
    text << "loss factor " << number(damping.law.lossFactor, 4) << " at 1 kHz, exponent "
         << number(damping.law.lossExponent, 3);
  text << "; decays off by " << number(100.0 * damping.rayleighResidual, 3)
       << " % by Rayleigh's law, " << number(100.0 * damping.lossFactorResidual, 3)
       << " % by a loss factor\n";
  return text.str();
}

void addRow(std::ostringstream& text, const TapMode& mode, double computed, double decay) {
  text << std::fixed << std::setw(12) << std::setprecision(2) << mode.frequency;
  if (computed > 0.0)
    text << std::setw(12) << computed << std::setw(9) << 100.0 * (computed / mode.frequency - 1.0);
  else
    text << std::setw(12) << '-' << std::setw(9) << '-';
  text << std::setw(12) << std::setprecision(3) << mode.decayRate;
  if (decay > 0.0)
    text << std::setw(12) << decay;
  else
    text << std::setw(12) << '-';
  text << std::setw(9) << std::setprecision(1) << mode.level << std::setw(9) << mode.overNoise
       << std::setw(12) << std::setprecision(2) << mode.confidence << '\n';
}

}  // namespace

Json fitJson(const FitOutcome& outcome) {
  Json object;
  object["accepted"] = outcome.fit ? outcome.fit->accepted : true;
  object["reason"] = outcome.fit ? outcome.fit->reason : "";
  object["taps"] = outcome.taps.size();
  if (!outcome.fit || outcome.fit->accepted) object["material"] = materialJson(outcome);
  if (outcome.fit) addFit(object, *outcome.fit, outcome);
  if (outcome.alone) {
    object["mass_kg"] = outcome.alone->model.mass;
    object["damping"] = lawJson(outcome.alone->damping);
  }
  addModes(object, outcome);
  object["hum_hz"] = Json::array();
  for (const double hum : outcome.found.hum)
    object["hum_hz"].push_back(digits(hum, 5));
  return object;
}

std::string fitText(const FitOutcome& outcome) {
  std::ostringstream text;
  text << outcome.name << ": " << outcome.found.modes.size() << " modes in " << outcome.taps.size()
       << (outcome.taps.size() == 1 ? " tap" : " taps");
  if (outcome.fit) text << ", " << outcome.fit->match.matched << " of them the mesh's";
  text << "\n\n    measured    computed  differs       decay    computed    level"
          "    over noise  confidence\n"
          "          Hz          Hz        %         1/s         1/s       dB       dB\n";
  if (outcome.fit) {
    for (const FittedMode& mode : outcome.fit->modes)
      addRow(text, mode.measured, mode.computed.value_or(0.0), mode.computedDecay.value_or(0.0));
    if (outcome.fit->accepted) text << bodyText(*outcome.fit, outcome);
    if (outcome.fit->accepted) text << dampingText(outcome.fit->damping);
  } else {
    for (const TapMode& mode : outcome.found.modes)
      addRow(text, mode, 0.0, 0.0);
    text << '\n' << dampingText(outcome.alone->damping);
  }
  return text.str();
}

std::string materialText(const FitOutcome& outcome) {
  return materialJson(outcome).dump(2) + "\n";
}

std::string modesCsv(const FitOutcome& outcome) {
  std::ostringstream text;
  text << "measured_hz,computed_hz,decay_per_s,computed_decay_per_s,radiation_decay_per_s,level_db,"
          "over_noise_db,confidence\r\n"
       << std::setprecision(8);
  const auto add = [&text](const FittedMode& mode) {
    const auto cell = [&text](const std::optional<double>& value) {
      text << ',';
      if (value) text << *value;
    };
    text << mode.measured.frequency;
    cell(mode.computed);
    cell(mode.measured.decayRate);
    cell(mode.computedDecay);
    cell(mode.radiationDecay);
    cell(mode.measured.level);
    cell(mode.measured.overNoise);
    cell(mode.measured.confidence);
    text << "\r\n";
  };
  if (outcome.fit) {
    for (const FittedMode& mode : outcome.fit->modes)
      add(mode);
  } else {
    for (const TapMode& mode : outcome.found.modes)
      add({mode, {}, {}, {}, {}});
  }
  return text.str();
}

}  // namespace carom::lab
