#include "command/list/materials_command.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "command/command_line.h"
#include "command/terminal/terminal.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "carom/audio/material.h"

namespace carom::command {
namespace {

constexpr double kReference = 1000.0;  // Hz
constexpr std::size_t kNameWidth = 18;

/// Returns the time (s) in which a mode of that frequency (Hz) falls by 60 dB, by the losses of the
/// material alone; infinity without any.
double decayTime(const Material& material, double frequency) {
  return std::log(1000.0) / dampingRate(material, frequency);
}

/// By what factor the damping of a built-in material may be off, by where it comes from
/// (docs/materials.md); 0 of any other material, or with damping of its own.
int dampingFactor(const Material& material) {
  constexpr std::array kMeasured = {"ceramic",   "aluminium", "brass", "copper",
                                    "magnesium", "nickel",    "zinc",  "tin",
                                    "lead",      "silver",    "gold"};
  constexpr std::array kRough = {"steel",         "glass",        "plastic",  "wood",
                                 "polycarbonate", "carbon_steel", "concrete", "cast_iron",
                                 "rubber",        "hdpe",         "ptfe",     "cork"};
  const Material* const builtIn = findMaterial(material.name);
  if (builtIn == nullptr || decayTime(*builtIn, kReference) != decayTime(material, kReference))
    return 0;
  if (std::ranges::find(kMeasured, material.name) != kMeasured.end()) return 2;
  return std::ranges::find(kRough, material.name) != kRough.end() ? 3 : 5;
}

std::string numberText(const char* pattern, double number) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), pattern, number);
  return text.data();
}

nlohmann::ordered_json jsonOf(const Material& material) {
  const double time = decayTime(material, kReference);
  nlohmann::ordered_json object;
  object["name"] = material.name;
  object["density_kg_m3"] = material.density;
  object["youngs_modulus_pa"] = material.youngsModulus;
  object["poissons_ratio"] = material.poissonsRatio;
  object["restitution"] = material.restitution;
  object["damping_alpha_per_s"] = material.dampingAlpha;
  object["damping_beta_s"] = material.dampingBeta;
  object["loss_factor"] = material.lossFactor;
  object["loss_exponent"] = material.lossExponent;
  object["damping_within_factor"] = nullptr;
  if (const int factor = dampingFactor(material); factor > 0)
    object["damping_within_factor"] = factor;
  object["thermal_expansion_per_k"] = material.thermal.expansion;
  object["thermal_conductivity_w_m_k"] = material.thermal.conductivity;
  object["heat_capacity_j_kg_k"] = material.thermal.heatCapacity;
  object["roughness_rms_m"] = material.roughness.rmsHeight;
  object["roughness_correlation_length_m"] = material.roughness.correlationLength;
  object["roughness_hurst"] = material.roughness.hurst;
  object["decay_60_db_at_1_khz_s"] = nullptr;
  if (std::isfinite(time)) object["decay_60_db_at_1_khz_s"] = time;
  return object;
}

std::string rowOf(const Material& material) {
  std::string name = material.name;
  name.resize(std::max(name.size() + 1, kNameWidth), ' ');
  return styled(name, Style::name, Stream::out) + numberText("%9.0f", material.density) +
         numberText("%11.4g", 1e-9 * material.youngsModulus) +
         numberText("%9.2f", material.poissonsRatio) + numberText("%13.2f", material.restitution) +
         numberText("%14.3g", decayTime(material, kReference)) + '\n';
}

/// Tells all of a material, whose properties stand in `source`.
std::string detailOf(const Material& material, const std::string& source) {
  const auto line = [](const char* label, const std::string& text) {
    std::string row = label;
    row.resize(26, ' ');
    return row + text + '\n';
  };
  std::string text = styled(material.name, Style::heading, Stream::out) + '\n';
  text += line("density", numberText("%.6g kg/m^3", material.density));
  text += line("Young's modulus", numberText("%.4g GPa", 1e-9 * material.youngsModulus));
  text += line("Poisson's ratio", numberText("%.3g", material.poissonsRatio));
  text += line("restitution", numberText("%.3g, of two bodies of it", material.restitution));
  text += line("damping", numberText("alpha %.4g 1/s, ", material.dampingAlpha) +
                              numberText("beta %.4g s", material.dampingBeta));
  if (material.lossFactor > 0.0)
    text += line("loss factor", numberText("%.4g at 1 kHz, ", material.lossFactor) +
                                    numberText("exponent %.3g", material.lossExponent));
  if (const int factor = dampingFactor(material); factor > 0)
    text += line("", "known within a factor of " + std::to_string(factor));
  for (const auto& [label, frequency] :
       {std::pair{"60 dB quieter at 250 Hz", 250.0}, {"at 1 kHz", 1000.0}, {"at 4 kHz", 4000.0}})
    text += line(label, numberText("in %.3g s, by its own losses", decayTime(material, frequency)));
  const ThermalProperties& thermal = material.thermal;
  if (thermal.expansion > 0.0)
    text += line("heat", numberText("expansion %.3g 1/K, ", thermal.expansion) +
                             numberText("conductivity %.4g W/(m K), ", thermal.conductivity) +
                             numberText("capacity %.4g J/(kg K)", thermal.heatCapacity));
  const Roughness& roughness = material.roughness;
  text += roughness.rmsHeight > 0.0
              ? line("roughness", numberText("%.3g um rms, ", 1e6 * roughness.rmsHeight) +
                                      numberText("correlation length %.3g mm, ",
                                                 1e3 * roughness.correlationLength) +
                                      numberText("Hurst exponent %.2g", roughness.hurst))
              : line("roughness", "none: it is smooth");
  return text + line("source", source);
}

}  // namespace

MaterialsCommand::MaterialsCommand(CLI::App& app)
    : command_(app.add_subcommand("materials",
                                  "List the built-in materials, or all properties of one\n"
                                  "Scenes, 'carom modes', 'carom strike' and 'carom fit' take "
                                  "these names. docs/materials.md "
                                  "has the sources of every number.")) {
  command_->add_option("NAME", name_, "a material, or a file with the properties of one")
      ->type_name("MATERIAL|FILE.json");
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Examples:\n"
      "  carom materials\n"
      "  carom materials steel\n"
      "\n"
      "With -q only the names are printed.\n");
}

bool MaterialsCommand::parsed() const {
  return command_->parsed();
}

int MaterialsCommand::list() const {
  const bool isBrief = talk().isQuiet() && !json_;
  talk().verbosity = Verbosity::normal;  // the names are what was asked for
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  std::string text = styled(
      "name                density    modulus  Poisson  restitution    60 dB quieter\n"
      "                     kg/m^3        GPa    ratio                at 1 kHz in s\n",
      Style::heading, Stream::out);
  std::string names;
  for (const Material& material : builtInMaterials()) {
    all.push_back(jsonOf(material));
    text += rowOf(material);
    names += material.name + '\n';
  }
  if (json_) return answer(jsonText({{"materials", all}}));
  return answer(isBrief ? names : text);
}

int MaterialsCommand::one() const {
  const Result<Material> material = materialOf(name_, "");
  if (!material) return fail(kBadInput, material.error().message);
  const bool isBuiltIn = findMaterial(name_) != nullptr;
  return answer(json_ ? jsonText(jsonOf(*material))
                      : detailOf(*material, isBuiltIn ? "docs/materials.md" : name_));
}

int MaterialsCommand::run() const {
  return name_.empty() ? list() : one();
}

}  // namespace carom::command
