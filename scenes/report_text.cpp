#include "scenes/report_text.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <limits>
#include <map>

#include <nlohmann/json.hpp>

#include "scenes/plan.h"

namespace carom {
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

// JSON has no infinity: what never happened is null.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json errors(const ErrorSummary& summary, double scale) {
  return {{"rms", summary.rms * scale}, {"max", summary.max * scale}};
}

Json planJson(const Plan& plan) {
  Json leftOut = Json::array();
  for (const LeftOut& entry : plan.leftOut) {
    leftOut.push_back({{"stage", entry.stage}, {"why", entry.why}});
  }
  return {{"needed", plan.needed}, {"left_out", leftOut}};
}

std::string planText(const Plan& plan) {
  std::string text = "needs     ";
  for (std::size_t i = 0; i < plan.needed.size(); ++i)
    text += (i > 0 ? ", " : "") + plan.needed[i];
  text += '\n';
  const char* label = "left out  ";
  for (const LeftOut& entry : plan.leftOut) {
    text += label + entry.stage + ": " + entry.why + '\n';
    label = "          ";
  }
  return text;
}

double soundPressureLevel(double pressure) {
  return 20.0 * std::log10(pressure / kHearingThreshold);
}

const char* stepperName(StepperType type) {
  return type == StepperType::native ? "native" : "bullet";
}

struct Contents {
  std::size_t planes = 0;
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
    if (sphere == nullptr) {
      ++contents.planes;
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

Json vectorJson(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

std::string infoText(const Scene& scene) {
  const Contents contents = contentsOf(scene);
  std::string text =
      scene.name + "\n" + (scene.description.empty() ? "" : scene.description + "\n");
  text += format("lasts     %g s at %g Hz, gravity %g %g %g m/s^2\n", scene.duration,
                 scene.sampleRate, scene.gravity.x(), scene.gravity.y(), scene.gravity.z());
  text += format("spheres   %zu, radius %g to %g mm, %.4g kg in all:", contents.spheres,
                 1e3 * contents.smallest, 1e3 * contents.largest, contents.mass);
  for (const auto& [material, count] : contents.spheresByMaterial) {
    text += format(" %zu %s", count, material.c_str());
  }
  text += format("\nplanes    %zu\nlisteners", contents.planes);
  for (const Listener& listener : scene.listeners) {
    text += format(" %s (%g %g %g)", listener.name.c_str(), listener.position.x(),
                   listener.position.y(), listener.position.z());
  }
  text += std::string("\nstepper   ") + stepperName(scene.stepper.type);
  if (scene.stepper.type == StepperType::bullet) text += format(", step %g s", scene.stepper.step);
  return text + '\n' + planText(makePlan(scene));
}

Json infoJson(const Scene& scene) {
  const Contents contents = contentsOf(scene);
  Json listeners = Json::array();
  for (const Listener& listener : scene.listeners) {
    listeners.push_back({{"name", listener.name}, {"position_m", vectorJson(listener.position)}});
  }
  Json stepper = {{"type", stepperName(scene.stepper.type)},
                  {"rest_speed_m_s", scene.stepper.restSpeed}};
  if (scene.stepper.type == StepperType::bullet) stepper["step_s"] = scene.stepper.step;
  return {{"name", scene.name},
          {"description", scene.description},
          {"duration_s", scene.duration},
          {"sample_rate_hz", scene.sampleRate},
          {"gravity_m_s2", vectorJson(scene.gravity)},
          {"spheres", contents.spheres},
          {"spheres_by_material", contents.spheresByMaterial},
          {"radius_m", {{"min", contents.smallest}, {"max", contents.largest}}},
          {"mass_kg", contents.mass},
          {"planes", contents.planes},
          {"listeners", listeners},
          {"stepper", stepper},
          {"plan", planJson(makePlan(scene))}};
}

std::string renderText(const RenderReport& report) {
  std::string text = report.file.string();
  text += format(": %.4g s, %zu channel%s at %g Hz\n", report.duration, report.channels,
                 report.channels == 1 ? "" : "s", report.sampleRate);
  text += format("events    %llu (two per collision)\n",
                 static_cast<unsigned long long>(report.events));
  if (report.peak > 0.0) {
    text += format("peak      %.4g Pa (%.1f dB SPL); 1.0 in the file is %g Pa\n", report.peak,
                   soundPressureLevel(report.peak), kFullScalePressure);
  } else {
    text += "peak      silence\n";
  }
  if (report.synth.undersampled > 0) {
    text +=
        format("aliased   %llu clicks are shorter than 4 samples (docs/acceleration_noise.md)\n",
               static_cast<unsigned long long>(report.synth.undersampled));
  }
  text +=
      format("time      %.3g s, %.3g times real time\n", report.wallTime, report.realtimeFactor());
  return text + planText(report.plan);
}

Json renderJson(const RenderReport& report) {
  return {{"file", report.file.string()},
          {"duration_s", report.duration},
          {"sample_rate_hz", report.sampleRate},
          {"channels", report.channels},
          {"events", report.events},
          {"peak_pa", report.peak},
          {"full_scale_pa", kFullScalePressure},
          {"clipped_samples", report.clippedSamples},
          {"clicks_inaudible", report.synth.inaudible},
          {"clicks_undersampled", report.synth.undersampled},
          {"clicks_late", report.synth.late},
          {"wall_s", report.wallTime},
          {"realtime_factor", report.realtimeFactor()},
          {"plan", planJson(report.plan)}};
}

std::string compareText(const Scene& scene, const CompareReport& report) {
  std::string text =
      format("%s: %llu collisions on the native stepper, in %.3g s\n\n", scene.name.c_str(),
             static_cast<unsigned long long>(report.nativeCollisions), report.nativeWallTime);
  text +=
      "Bullet    collisions on its own path      time error us     impulse error    against "
      "native\n"
      "step s    exact  found  missed  spurious  rms      max      rms      max      to s    rms "
      "us  "
      "  level dB\n";
  for (const CompareRun& run : report.runs) {
    text += format(
        "%-9.4g %-6llu %-6llu %-7llu %-9llu %-8.3g %-8.3g %-8.2g %-8.2g %-7.3g %-9.3g %+.2f\n",
        run.step, static_cast<unsigned long long>(run.reference),
        static_cast<unsigned long long>(run.matched), static_cast<unsigned long long>(run.missed),
        static_cast<unsigned long long>(run.spurious), 1e6 * run.timeError.rms,
        1e6 * run.timeError.max, run.impulseError.rms, run.impulseError.max,
        std::min(run.divergedAt, scene.duration), 1e6 * run.globalDifference.rms,
        run.levelDifference);
  }
  return text;
}

Json compareJson(const Scene& scene, const CompareReport& report) {
  Json runs = Json::array();
  for (const CompareRun& run : report.runs) {
    runs.push_back({{"step_s", run.step},
                    {"events_reference", run.reference},
                    {"matched", run.matched},
                    {"missed", run.missed},
                    {"spurious", run.spurious},
                    {"time_error_us", errors(run.timeError, 1e6)},
                    {"impulse_error", errors(run.impulseError, 1.0)},
                    {"global_time_difference_us", errors(run.globalDifference, 1e6)},
                    {"global_events_compared", run.globalCompared},
                    {"global_diverged_at_s", number(run.divergedAt)},
                    {"level_difference_db", number(run.levelDifference)},
                    {"wall_s", run.wallTime}});
  }
  return {{"scene", scene.name},
          {"duration_s", scene.duration},
          {"native", {{"collisions", report.nativeCollisions}, {"wall_s", report.nativeWallTime}}},
          {"runs", runs}};
}

}  // namespace carom
