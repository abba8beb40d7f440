#include "plugin/realtime/sound_report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace carom::plugin {
namespace {

// Largest ratio of a body's mass to that of its modal model, or the other way round, at which the
// model may still be meant for it.
constexpr double kSameMass = 1.25;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string counted(std::uint64_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

void addPart(std::string& list, std::uint64_t count, const std::string& what) {
  if (count > 0) list += (list.empty() ? "" : ", ") + std::to_string(count) + " " + what;
}

std::string bodies(const SoundFacts& facts) {
  if (!facts.hasWorld && !facts.isClosed) return "The world is gone.\n";
  std::string text = counted(facts.movable, "body", "bodies") + " can move, " +
                     std::to_string(facts.immovable) + " cannot";
  if (facts.silent > 0) text += "; " + std::to_string(facts.silent) + " silenced";
  text += ".\n";
  std::string materials;
  for (const auto& [name, count] : facts.given)
    addPart(materials, count, name);
  for (const auto& [name, count] : facts.guessed)
    addPart(materials, count, name + " (guessed)");
  return materials.empty() ? text : text + "Materials: " + materials + ".\n";
}

std::string listener(const SoundFacts& facts) {
  const Vec3& place = facts.listener;
  return "The listener " + std::string(facts.isListenerAutomatic ? "stands" : "was set") + " at (" +
         number(place.x()) + ", " + number(place.y()) + ", " + number(place.z()) + ") m" +
         (!facts.isListenerAutomatic ? ".\n"
          : facts.isHosted           ? ", as none was set.\n"
                                     : ", where a camera would.\n");
}

std::string heard(const SoundFacts& facts) {
  const SoundStatistics& all = facts.statistics;
  const std::uint64_t leftOut = all.masked + all.inaudible + all.stolen + all.overBudget +
                                all.noBus + all.tooLong + all.queueFaults;
  std::string text =
      "Heard: " + counted(all.events - std::min(all.events, leftOut), "click", "clicks") + ", " +
      counted(all.rings, "ring", "rings") + ", " +
      counted(all.slides, "step of a slide", "steps of slides") + ".\n";
  std::string missing;
  addPart(missing, all.inaudible, "too quiet to be heard");
  addPart(missing, all.masked, "too quiet beside louder ones");
  addPart(missing, all.stolen + all.overBudget + all.noBus, "beyond the budget");
  addPart(missing, all.tooLong, "longer than the longest contact");
  addPart(missing, all.skipped + all.queueFaults,
          facts.isHeard ? "while no samples were taken" : "as there is no output for sound");
  addPart(missing, all.silenced, "silenced");
  addPart(missing, all.rejected, "rejected, as their numbers cannot sound");
  return missing.empty() ? text : text + "Left out: " + missing + ".\n";
}

std::string level(const SoundStatistics& all) {
  if (!(all.peak > 0.0)) return "";
  constexpr double kHearing = 2e-5;  // Pa
  std::string text = "The loudest so far has " + number(all.peak) + " Pa (" +
                     number(20.0 * std::log10(all.peak / kHearing)) + " dB)";
  if (all.peakSample > 0.0) {
    const double above = 20.0 * std::log10(all.peakSample);
    text +=
        ", " + number(std::abs(above)) + (above > 0.0 ? " dB above" : " dB below") + " full scale";
  }
  text += ".\n";
  if (all.gainReduction > 0.0)
    text += "A limiter has taken up to " + number(all.gainReduction) + " dB.\n";
  return all.warning.empty() ? text : text + all.warning + "\n";
}

std::string silence(const SoundFacts& facts) {
  if (facts.isClosed) return "The sound is closed.\n";
  if (!facts.isHeard && facts.isRun)
    return "What happens is recorded as a run, of which `carom replay` makes sound.\n";
  if (!facts.isHeard && facts.isHosted) return "Nothing plays, records or pulls this sound yet.\n";
  if (!facts.isHeard)
    return "Nothing plays, records or pulls this sound: SoundSettings::play or record, or "
           "prepareRendering.\n";
  if (facts.statistics.posted > 0 || !facts.hasWorld) return "";
  if (facts.movable == 0) return "No body can move, and what cannot is silent unless it rings.\n";
  if (facts.isHosted) return "No collision has been told yet.\n";
  return "No collision has been faster than the rest speed of " + number(facts.restSpeed) +
         " m/s yet.\n";
}

std::string oddities(const SoundFacts& facts) {
  const SoundStatistics& all = facts.statistics;
  std::string text;
  if (facts.light > 0)
    text += counted(facts.light, "body has less than 20 kg/m^3, and clicks",
                    "bodies have less than 20 kg/m^3, and click") +
            " as what is hollow: set masses, or WorldSoundSettings::metresPerUnit.\n";
  if (facts.unlikeModel > 0)
    text += counted(facts.unlikeModel, "body does", "bodies do") +
            " not weigh what the modal model does: one has " + number(facts.massUnlikeModel) +
            " kg, its model " + number(facts.massOfModel) +
            " kg. It is struck as what it weighs, and rings as the model.\n";
  if (all.unsolvedBodies + all.refusedBodies > 0)
    text += counted(all.unsolvedBodies + all.refusedBodies, "body does", "bodies do") +
            " not sound by their shape: " + all.unsolvedReason + ".\n";
  if (all.shapesPending > 0)
    text += counted(all.shapesPending, "shape is", "shapes are") +
            " yet to be solved: bodies sound as spheres until then.\n";
  if (all.unsupportedContacts > 0)
    text +=
        "Some contacts cannot be followed: concave shapes against each other, or signed "
        "distance fields.\n";
  if (all.unusedAssignments > 0)
    text += counted(all.unusedAssignments, "assignment is", "assignments are") +
            " to shapes or user indices that no body has.\n";
  return text;
}

}  // namespace

void SoundFacts::compareMasses(double mass, double modelMass) {
  if (mass <= kSameMass * modelMass && modelMass <= kSameMass * mass) return;
  ++unlikeModel;
  massUnlikeModel = mass;
  massOfModel = modelMass;
}

std::string wordsOf(const SoundFacts& facts) {
  return bodies(facts) + listener(facts) + heard(facts) + level(facts.statistics) + silence(facts) +
         oddities(facts);
}

}  // namespace carom::plugin
