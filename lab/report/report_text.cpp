#include "lab/report/report_text.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scenes/format/sound_names.h"
#include "scenes/run/plan.h"

namespace carom::lab {

using namespace scenes;

using namespace native;

namespace {

using Json = nlohmann::ordered_json;

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
std::string
format(const char* pattern, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, pattern);
  // NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): it is, one line above
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

Json errors(const ErrorSummary& summary, double scale) {
  return {{"rms", summary.rms * scale}, {"max", summary.max * scale}};
}

std::string planText(const Plan& plan, Detail detail) {
  std::string text = "needs     ";
  for (std::size_t i = 0; i < plan.needed.size(); ++i)
    text += (i > 0 ? ", " : "") + plan.needed[i];
  text += '\n';
  if (detail == Detail::brief)
    return text + "left out  " + std::to_string(plan.leftOut.size()) +
           " stages; -v says which, and why\n";
  const char* label = "left out  ";
  for (const LeftOut& entry : plan.leftOut) {
    text += label + entry.stage + ": " + entry.why + '\n';
    label = "          ";
  }
  return text;
}

const char* stepperName(StepperType type) {
  return type == StepperType::native ? "native" : "bullet";
}

const char* formatName(ListenerFormat format) {
  switch (format) {
    case ListenerFormat::spacedPair:
      return "spaced_pair";
    case ListenerFormat::coincidentPair:
      return "coincident_pair";
    case ListenerFormat::binaural:
      return "binaural";
    case ListenerFormat::mono:
      break;
  }
  return "mono";
}

struct Contents {
  std::size_t planes = 0;
  std::size_t blocks = 0;
  std::size_t solids = 0;
  double solidMass = 0.0;  // kg, of the solids that move
  const JelloShape* jello = nullptr;
  std::size_t given = 0;  // bodies of a host's run
  std::size_t givenMovable = 0;
  std::size_t givenRinging = 0;
  std::map<std::string, std::size_t> spheresByMaterial;
  std::size_t spheres = 0;
  double smallest = std::numeric_limits<double>::infinity();  // m
  double largest = 0.0;                                       // m
  double mass = 0.0;                                          // kg
};

Contents contentsOf(const Scene& scene) {
  Contents contents;
  for (const SceneBody& body : scene.bodies) {
    const auto* sphere = std::get_if<SphereShape>(&body.shape);
    if (const auto* solid = std::get_if<SolidShape>(&body.shape)) {
      ++contents.solids;
      if (solid->canMove()) contents.solidMass += solid->mass;
      continue;
    }
    if (const auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape)) {
      contents.jello = jello->get();
      continue;
    }
    if (const auto* given = std::get_if<GivenShape>(&body.shape)) {
      const SoundBody& sound = given->body->sound;
      ++contents.given;
      contents.givenMovable += std::isfinite(sound.mass) ? 1U : 0U;
      contents.givenRinging += sound.modal != nullptr ? 1U : 0U;
      continue;
    }
    if (sphere == nullptr) {
      ++(std::holds_alternative<PlaneShape>(body.shape) ? contents.planes : contents.blocks);
      continue;
    }
    ++contents.spheres;
    ++contents.spheresByMaterial[body.material.name];
    contents.smallest = std::min(contents.smallest, sphere->radius);
    contents.largest = std::max(contents.largest, sphere->radius);
    contents.mass += sphere->mass;
  }
  return contents;
}

// Returns the count with its noun: "1 click", "2 clicks".
std::string counted(std::uint64_t count, const char* noun) {
  return std::to_string(count) + ' ' + noun + (count == 1 ? "" : "s");
}

std::string rangeText(double smallest, double largest) {
  const std::string low = format("%.3g", smallest);
  const std::string high = format("%.3g", largest);
  return low == high ? low : low + " to " + high;
}

Json givenJson(const Contents& contents) {
  if (contents.given == 0) return nullptr;
  return {{"count", contents.given},
          {"movable", contents.givenMovable},
          {"ringing", contents.givenRinging}};
}

// Describes the spheres; empty if there are none.
std::string spheresText(const Contents& contents) {
  if (contents.spheres == 0) return {};
  std::string text =
      format("spheres   %zu, radius %s mm, %.3g kg in all", contents.spheres,
             rangeText(1e3 * contents.smallest, 1e3 * contents.largest).c_str(), contents.mass);
  const char* separator = ": ";
  for (const auto& [material, count] : contents.spheresByMaterial) {
    text += separator + std::to_string(count) + ' ' + material;
    separator = ", ";
  }
  return text + '\n';
}

// Describes the jello; empty if there is none.
std::string jelloText(const JelloShape* jello) {
  if (jello == nullptr) return {};
  const JelloLattice& lattice = jello->lattice;
  const std::size_t points = lattice.count * lattice.count * lattice.count;
  return format("jello     %zu points, %.3g x %.3g x %.3g m, %.3g kg, springs of %.3g N/m, %s\n",
                points, lattice.size.x(), lattice.size.y(), lattice.size.z(),
                lattice.pointMass * static_cast<double>(points), lattice.stiffness,
                jello->integrator ? nameOf(*jello->integrator) : "auto");
}

// Breaks the text between words into lines of at most kWidth bytes, unless a word is longer.
std::string wrapped(const std::string& text) {
  constexpr std::size_t kWidth = 100;
  std::istringstream words(text);
  std::string lines;
  std::size_t used = 0;
  for (std::string word; words >> word;) {
    const bool fits = used > 0 && used + 1 + word.size() <= kWidth;
    if (used > 0) lines += fits ? ' ' : '\n';
    lines += word;
    used = word.size() + (fits ? used + 1 : 0);
  }
  return lines.empty() ? lines : lines + '\n';
}

std::string peakText(const RenderReport& report) {
  if (report.peak <= 0.0) return "peak      silence\n";
  std::string text = format("peak      %.4g Pa (%.1f dB SPL); 1.0 in the file is %.4g Pa\n",
                            report.peak, soundPressureLevel(report.peak), report.fullScale);
  if (report.gainReduction > 0.0)
    text += format("limited   by %.1f dB at most\n", report.gainReduction);
  return text;
}

// Returns the range of the decay times over the octaves: "0.41 to 0.9 s".
std::string decayText(const DecayTimes& times) {
  const auto [least, most] = std::minmax_element(times.begin(), times.end());
  return rangeText(*least, *most) + " s";
}

// Describes reflections and reverberation; empty in open air.
std::string roomText(std::size_t images, const std::optional<ReverbSettings>& reverb) {
  if (images == 0 && !reverb) return {};
  std::string text = "room      " + counted(images, "image") + " of each source";
  if (reverb) {
    text += format(", reverberation of %.3g m^3, T60 %s", reverb->volume,
                   decayText(reverb->decayTimes).c_str());
  }
  return text + '\n';
}

// Describes a listener: "listener  at (0 1 2) m: ears, binaural, moves".
std::string listenerText(const Listener& listener, const ListenerChannels& channels) {
  std::string text = format("listener  at (%g %g %g) m: ", listener.position.x(),
                            listener.position.y(), listener.position.z()) +
                     listener.name;
  if (channels.format != ListenerFormat::mono)
    text += std::string(", ") + formatName(channels.format);
  if (channels.moves) text += ", moves";
  return text + '\n';
}

// Lists the channels of the listeners; empty if every listener is mono and stands still.
std::string channelsText(const std::vector<ListenerChannels>& listeners) {
  const auto isPlain = [](const ListenerChannels& channels) {
    return channels.format == ListenerFormat::mono && !channels.moves;
  };
  if (std::all_of(listeners.begin(), listeners.end(), isPlain)) return {};
  std::string text;
  for (const ListenerChannels& channels : listeners) {
    text += text.empty() ? "channels  " : "          ";
    text += std::to_string(channels.first);
    if (channels.count > 1) text += ", " + std::to_string(channels.first + 1);
    text += ": " + channels.name + ", " + formatName(channels.format) +
            (channels.moves ? ", moves" : "") + '\n';
  }
  return text;
}

std::string hashText(const Recording& recording) {
  return format("%016llx", static_cast<unsigned long long>(recording.trajectoryHash()));
}

std::string compareRow(const CompareRun& run) {
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const std::string until = std::isfinite(run.global.divergedAt)
                                ? format("%.3g", run.global.divergedAt)
                                : std::string("the end");
  const double level = std::abs(run.levelDifference) < 0.005 ? 0.0 : run.levelDifference;
  return format("%-9.4g %-6llu %-6llu %-6llu %-9llu %-9.3g %-9.3g %-8.2g %-9.2g %-9s %-9.3g %.2f\n",
                run.step, count(run.local.reference), count(run.local.matched),
                count(run.local.missed), count(run.local.spurious), 1e6 * run.local.timeError.rms,
                1e6 * run.local.timeError.max, run.local.impulseError.rms,
                run.local.impulseError.max, until.c_str(), 1e6 * run.global.difference.rms, level);
}

Json vectorJson(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

Json radiusJson(const Contents& contents) {
  if (contents.spheres == 0) return nullptr;
  return {{"min", contents.smallest}, {"max", contents.largest}};
}

// Returns the solids; those that move have their mass, and
// their centre of mass in the frame of the shape.
Json solidsJson(const Scene& scene) {
  Json solids = Json::array();
  for (const SceneBody& body : scene.bodies) {
    const auto* solid = std::get_if<SolidShape>(&body.shape);
    if (solid == nullptr) continue;
    Json entry = {{"name", body.name}, {"shape", formName(*solid)}, {"movable", solid->canMove()}};
    if (solid->canMove()) {
      entry["mass_kg"] = solid->mass;
      entry["centre_of_mass_m"] = vectorJson(solid->centreOfMass);
    }
    solids.push_back(std::move(entry));
  }
  return solids;
}

Json jelloJson(const JelloShape* jello) {
  if (jello == nullptr) return nullptr;
  const JelloLattice& lattice = jello->lattice;
  const auto points = static_cast<double>(lattice.count);
  Json object = {{"points", lattice.count},
                 {"size_m", vectorJson(lattice.size)},
                 {"mass_kg", lattice.pointMass * points * points * points},
                 {"stiffness_n_m", lattice.stiffness},
                 {"damping_n_s_m", lattice.damping},
                 {"integrator", jello->integrator ? nameOf(*jello->integrator) : "auto"}};
  if (jello->step > 0.0)
    object["step_s"] = jello->step;
  else
    object["error_m"] = jello->error;
  return object;
}

Json channelsJson(const ListenerChannels& channels) {
  Json list = Json::array();
  for (std::size_t channel = 0; channel < channels.count; ++channel)
    list.push_back(channels.first + channel);
  return list;
}

Json reverbJson(const std::optional<ReverbSettings>& reverb) {
  if (!reverb) return nullptr;
  Json times = Json::array();
  for (const double time : reverb->decayTimes)
    times.push_back(numberJson(time));
  return {{"volume_m3", reverb->volume},
          {"surface_m2", reverb->surface},
          {"t60_s", times},
          {"onset_s", reverb->onset}};
}

}  // namespace

Json endedJson(const std::optional<EndedEarly>& ended) {
  if (!ended) return nullptr;
  return {{"limit", ended->limit},
          {"what", ended->what},
          {"pointer", ended->pointer},
          {"time_s", ended->time}};
}

double soundPressureLevel(double pressure) {
  return 20.0 * std::log10(pressure / kHearingThreshold);
}

Json numberJson(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

nlohmann::ordered_json planJson(const Plan& plan) {
  Json leftOut = Json::array();
  for (const LeftOut& entry : plan.leftOut) {
    leftOut.push_back({{"stage", entry.stage}, {"why", entry.why}});
  }
  return {{"needed", plan.needed}, {"left_out", leftOut}};
}

std::string infoText(const Scene& scene, Detail detail) {
  const Contents contents = contentsOf(scene);
  std::string text = scene.name + "\n" + wrapped(scene.description);
  text += format("lasts     %g s at %g Hz, gravity (%g %g %g) m/s^2\n", scene.duration,
                 scene.sampleRate, scene.gravity.x(), scene.gravity.y(), scene.gravity.z());
  text += spheresText(contents) + format("planes    %zu\n", contents.planes);
  if (contents.blocks > 0) text += format("blocks    %zu\n", contents.blocks);
  if (contents.solids > 0)
    text += format("solids    %zu, %.3g kg in all\n", contents.solids, contents.solidMass);
  if (contents.given > 0)
    text += format("bodies    %zu of the host, %zu can move, %zu ring\n", contents.given,
                   contents.givenMovable, contents.givenRinging);
  text += jelloText(contents.jello);
  text += roomText(imageCount(scene), scene.sound.reverb);
  const std::vector<ListenerChannels> channels = listenerChannels(scene);
  for (std::size_t index = 0; index < channels.size(); ++index)
    text += listenerText(scene.listeners[index], channels[index]);
  if (contents.given > 0) return text + planText(makePlan(scene), detail);
  text += std::string("stepper   ") + stepperName(scene.stepper.type);
  if (scene.stepper.type == StepperType::bullet)
    text += format(", step %.4g s%s", scene.stepper.step, scene.stepper.tuned ? ", tuned" : "");
  return text + '\n' + planText(makePlan(scene), detail);
}

Json infoJson(const Scene& scene) {
  const Contents contents = contentsOf(scene);
  Json listeners = Json::array();
  for (const ListenerChannels& channels : listenerChannels(scene)) {
    const Listener& listener = scene.listeners[listeners.size()];
    listeners.push_back({{"name", listener.name},
                         {"position_m", vectorJson(listener.position)},
                         {"format", formatName(channels.format)},
                         {"channels", channelsJson(channels)},
                         {"moves", channels.moves}});
  }
  Json stepper = {{"type", stepperName(scene.stepper.type)},
                  {"rest_speed_m_s", scene.stepper.restSpeed}};
  if (scene.stepper.type == StepperType::bullet) {
    stepper["step_s"] = scene.stepper.step;
    stepper["tuned"] = scene.stepper.tuned;
  }
  return {{"name", scene.name},
          {"description", scene.description},
          {"duration_s", scene.duration},
          {"sample_rate_hz", scene.sampleRate},
          {"gravity_m_s2", vectorJson(scene.gravity)},
          {"spheres", contents.spheres},
          {"spheres_by_material", contents.spheresByMaterial},
          {"radius_m", radiusJson(contents)},
          {"mass_kg", contents.mass},
          {"planes", contents.planes},
          {"blocks", contents.blocks},
          {"solids", solidsJson(scene)},
          {"jello", jelloJson(contents.jello)},
          {"host_bodies", givenJson(contents)},
          {"listeners", listeners},
          {"images", imageCount(scene)},
          {"reverb", reverbJson(scene.sound.reverb)},
          {"sound",
           {{"pulse", pulseName(scene.sound.comparison.pulse, scene.sound.dissipative)},
            {"sampling", samplingName(scene.sound.comparison.sampling)},
            {"radiation", radiationName(scene.sound.comparison.radiation)},
            {"ringing", ringingName(scene.sound.ringingContact)}}},
          {"stepper", stepper},
          {"plan", planJson(makePlan(scene))}};
}

namespace {

// Counts what was heard: "clicks    28; 28 events are of planes and blocks, which cannot move".
std::string soundsText(const SynthCounters& synth) {
  std::string text =
      format("clicks    %llu", static_cast<unsigned long long>(synth.events - synth.inaudible));
  if (synth.immovable > 0)
    text += format("; %llu events are of planes and blocks, which cannot move",
                   static_cast<unsigned long long>(synth.immovable));
  text += '\n';
  if (synth.rings > 0)
    text += format("rings     %llu\n", static_cast<unsigned long long>(synth.rings));
  if (synth.slides > 0)
    text += format("slides    %llu steps\n", static_cast<unsigned long long>(synth.slides));
  return text;
}

}  // namespace

std::string renderText(const RenderReport& report, Detail detail) {
  const bool isWhole = detail == Detail::whole;
  std::string text = report.file.string();  // may be longer than the buffer of format()
  text += format(": %.4g s, %s at %g Hz\n", report.duration,
                 counted(report.channels, "channel").c_str(), report.sampleRate);
  text +=
      format("events    %llu, two for each of ", static_cast<unsigned long long>(report.events)) +
      counted(report.events / 2, "collision") + '\n';
  if (isWhole) text += soundsText(report.synth);
  text += channelsText(report.listeners);
  if (isWhole) text += roomText(report.images, report.reverb);
  text += peakText(report);
  if (report.synth.undersampled > 0) {
    text += "aliased   " + counted(report.synth.undersampled, "click") +
            " shorter than 4 samples, of uncertain level; sampling band_limited holds them\n";
  }
  text += format("took      %.3g s, %.*f times faster than real time\n", report.wallTime,
                 report.realtimeFactor() < 100.0 ? 1 : 0, report.realtimeFactor());
  return isWhole ? text + planText(report.plan, detail) : text;
}

Json energyJson(const ContactEnergy& energy) {
  RingEnergy all = energy.removed;
  Json bodies = Json::array();
  for (const RingEnergy& body : energy.bodies) {
    bodies.push_back({{"body", body.body},
                      {"modes_J", body.given},
                      {"damped_J", body.absorbed},
                      {"radiated_J", body.radiated},
                      {"remaining_J", body.remaining}});
    all.absorbed += body.absorbed;
    all.radiated += body.radiated;
    all.remaining += body.remaining;
  }
  const double damped = energy.damped + all.absorbed;
  const double parts = energy.parting + energy.contacts + damped + all.radiated + all.remaining;
  const double error = energy.approach > 0.0 ? parts / energy.approach - 1.0 : 0.0;
  return {{"impacts", energy.impacts},
          {"bound", energy.bound},
          {"approach_J", energy.approach},
          {"parting_J", energy.parting},
          {"contacts_J", energy.contacts},
          {"modes_J", energy.modes},
          {"damped_J", damped},
          {"radiated_J", all.radiated},
          {"remaining_J", all.remaining},
          {"balance_error", error},
          {"bodies", bodies}};
}

Json renderJson(const RenderReport& report) {
  Json listeners = Json::array();
  for (const ListenerChannels& channels : report.listeners) {
    listeners.push_back({{"name", channels.name},
                         {"format", formatName(channels.format)},
                         {"channels", channelsJson(channels)},
                         {"moves", channels.moves}});
  }
  Json stems = Json::array();
  for (const std::filesystem::path& stem : report.stems)
    stems.push_back(stem.string());
  return {{"file", report.file.string()},
          {"stems", stems},
          {"duration_s", report.duration},
          {"sample_rate_hz", report.sampleRate},
          {"channels", report.channels},
          {"listeners", listeners},
          {"images", report.images},
          {"reverb", reverbJson(report.reverb)},
          {"events", report.events},
          {"peak_pa", report.peak},
          {"full_scale_pa", report.fullScale},
          {"clipped_samples", report.clippedSamples},
          {"level_at_end_db", numberJson(report.levelAtEnd)},
          {"limiter", report.limiter},
          {"largest_gain_reduction_db", numberJson(report.gainReduction)},
          {"rings", report.synth.rings},
          {"energy", energyJson(report.energy)},
          {"clicks_inaudible", report.synth.inaudible},
          {"slides", report.synth.slides},
          {"slides_inaudible", report.synth.inaudibleSlides},
          {"clicks_undersampled", report.synth.undersampled},
          {"clicks_late", report.synth.late},
          {"wall_s", report.wallTime},
          {"realtime_factor", report.realtimeFactor()},
          {"ended_early", endedJson(report.endedEarly)},
          {"plan", planJson(report.plan)}};
}

std::string estimateText(const RunEstimate& estimate) {
  return format("estimate  %.2g s, %.2g steps, ", estimate.wall, estimate.steps) +
         (estimate.events ? format("%.2g events, ", *estimate.events) : "") +
         bytesText(estimate.memory) + "\n          most of it for " + estimate.longest + '\n';
}

Json estimateJson(const RunEstimate& estimate) {
  return {{"steps", estimate.steps},
          {"events", estimate.events ? Json(*estimate.events) : Json(nullptr)},
          {"degrees_of_freedom", estimate.degreesOfFreedom},
          {"memory_bytes", estimate.memory},
          {"wall_s", estimate.wall},
          {"longest", estimate.longest}};
}

std::string recordText(const Recording& recording, const RecordReport& report) {
  const std::size_t collisions = recording.collisionCount();
  std::string text = report.file.string();  // may be longer than the buffer of format()
  text += format(": a recording of %g s, %llu bytes\n", recording.end() - recording.begin(),
                 static_cast<unsigned long long>(report.bytes));
  text += "holds     " + counted(collisions, "collision") + " and " +
          counted(recording.segmentCount(), "parabola") + " of " +
          counted(recording.sphereCount(), "sphere") + '\n';
  text += "hash      " + hashText(recording) + " of the trajectory\n";
  if (report.wallTime > 0.0) text += format("took      %.3g s\n", report.wallTime);
  return text;
}

Json recordJson(const Recording& recording, const RecordReport& report) {
  Json object = {{"file", report.file.string()},
                 {"bytes", report.bytes},
                 {"duration_s", recording.end() - recording.begin()},
                 {"spheres", recording.sphereCount()},
                 {"collisions", recording.collisionCount()},
                 {"segments", recording.segmentCount()},
                 {"trajectory_hash", hashText(recording)}};
  if (report.wallTime > 0.0) object["wall_s"] = report.wallTime;
  return object;
}

std::string runText(const RunFileReport& report) {
  const RunReport& run = report.run;
  std::string text = report.file.string();
  text += format(": a run of %g s, %llu bytes (%.3g kB/s)\n", report.duration,
                 static_cast<unsigned long long>(run.bytes),
                 1e-3 * static_cast<double>(run.bytes) / report.duration);
  text += "holds     " + counted(run.events / 2, "collision") + ", " +
          counted(run.contacts, "state") + " of lasting contacts, " + counted(run.poses, "pose");
  if (run.pictures > 0) text += ", " + counted(run.pictures, "picture") + " of the jello";
  return text + format("\ntook      %.3g s\n", report.wallTime);
}

Json runJson(const RunFileReport& report) {
  return {{"file", report.file.string()},          {"bytes", report.run.bytes},
          {"duration_s", report.duration},         {"events", report.run.events},
          {"contact_states", report.run.contacts}, {"poses", report.run.poses},
          {"pictures", report.run.pictures},       {"wall_s", report.wallTime}};
}

std::string compareText(const Scene& scene, const CompareReport& report) {
  std::string text =
      scene.name + ": " + counted(report.nativeCollisions, "collision") +
      format(" on the native stepper, computed in %.3g ms\n\n", 1e3 * report.nativeWallTime) +
      "          against the exact collisions of the path that Bullet took            "
      "against the native run\n"
      "          collisions                     time error us       impulse error      "
      "same      time us   level\n"
      "step s    exact  found  missed spurious  rms       max       rms      max       "
      "until s   rms       dB\n";
  for (const CompareRun& run : report.runs)
    text += compareRow(run);
  return text;
}

Json compareJson(const Scene& scene, const CompareReport& report) {
  Json runs = Json::array();
  for (const CompareRun& run : report.runs) {
    runs.push_back({{"step_s", run.step},
                    {"events_reference", run.local.reference},
                    {"matched", run.local.matched},
                    {"missed", run.local.missed},
                    {"spurious", run.local.spurious},
                    {"time_error_us", errors(run.local.timeError, 1e6)},
                    {"impulse_error", errors(run.local.impulseError, 1.0)},
                    {"global_time_difference_us", errors(run.global.difference, 1e6)},
                    {"global_events_compared", run.global.compared},
                    {"global_diverged_at_s", numberJson(run.global.divergedAt)},
                    {"level_difference_db", numberJson(run.levelDifference)},
                    {"wall_s", run.wallTime}});
  }
  return {{"scene", scene.name},
          {"duration_s", scene.duration},
          {"native", {{"collisions", report.nativeCollisions}, {"wall_s", report.nativeWallTime}}},
          {"runs", runs}};
}

}  // namespace carom::lab
