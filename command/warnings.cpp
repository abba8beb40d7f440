#include "command/warnings.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <numbers>
#include <optional>
#include <sstream>
#include <variant>

#include "command/terminal/terminal.h"
#include "lab/report/report_text.h"

namespace carom::command {

using namespace scenes;

namespace {

constexpr double kLightest = 20.0;       // kg/m^3, lighter are only foams and aerogels
constexpr std::size_t kMostNamed = 5;    // bodies
constexpr double kHighestLevel = 200.0;  // dB, of --full-scale

std::string numberText(double value, int digits) {
  std::ostringstream text;
  text << std::setprecision(digits) << value;
  return text.str();
}

struct VolumeOf {
  double operator()(const std::shared_ptr<const SolidMesh>& mesh) const {
    return measuresOf(mesh->surface).volume;
  }
  template <class Form>
  double operator()(const Form& form) const {
    return measuresOf(form).volume;
  }
};

/// Returns mass over volume (kg/m^3) of a sphere or a solid that can move.
std::optional<double> densityOf(const SceneBody& body) {
  if (const auto* sphere = std::get_if<SphereShape>(&body.shape))
    return sphere->mass / (4.0 / 3.0 * std::numbers::pi * std::pow(sphere->radius, 3));
  const auto* solid = std::get_if<SolidShape>(&body.shape);
  if (solid == nullptr || !solid->canMove()) return std::nullopt;
  return solid->mass / std::visit(VolumeOf{}, solid->form);
}

std::vector<std::string> densityWarnings(const Scene& scene) {
  std::vector<std::string> warnings;
  std::size_t more = 0;
  for (const SceneBody& body : scene.bodies) {
    const std::optional<double> density = densityOf(body);
    if (!density || !(*density < kLightest)) continue;
    if (warnings.size() == kMostNamed) {
      ++more;
      continue;
    }
    warnings.push_back(
        body.name + " has a density of " + numberText(*density, 3) +
        " kg/m^3, which only foams have; are its mass and its size in kilograms and metres?");
  }
  if (more > 0)
    warnings.push_back(std::to_string(more) + " more bodies have a density below " +
                       numberText(kLightest, 3) + " kg/m^3");
  return warnings;
}

// Listeners behind a wall are not refused, for some may be meant to stand outside; but it is a
// mistake more often.
std::vector<std::string> outsideWarnings(const Scene& scene) {
  std::vector<std::string> warnings;
  if (scene.sound.room.reflectors.empty()) return warnings;
  for (const Listener& listener : scene.listeners) {
    const auto wall = std::ranges::find_if(scene.bodies, [&listener](const SceneBody& body) {
      const auto* plane = std::get_if<PlaneShape>(&body.shape);
      return plane != nullptr && plane->normal.dot(listener.position) < plane->offset;
    });
    if (wall != scene.bodies.end())
      warnings.push_back(listener.name + " stands behind " + wall->name +
                         ", out of the room: it hears no reflections there");
  }
  return warnings;
}

/// Returns the option that gives the peak room: the next whole dB.
std::string roomFor(double peak) {
  const double level = std::ceil(lab::soundPressureLevel(peak));
  return "--full-scale " + numberText(std::min(level, kHighestLevel), 3) + "dB";
}

std::string overText(const RenderReport& report) {
  return "the peak, " + numberText(report.peak, 4) + " Pa, is " +
         numberText(std::round(200.0 * std::log10(report.peak / report.fullScale)) / 10.0, 4) +
         " dB above full scale, " + numberText(report.fullScale, 4) + " Pa";
}

/// Returns the warning of a peak above full scale; empty where there is none, or where it is
/// limited as asked for.
std::string peakWarning(const RenderReport& report, const RenderOptions& options) {
  if (!(report.peak > report.fullScale) || options.limit == true) return {};
  const std::string text = report.file.string() + ": " + overText(report);
  const std::string room = roomFor(report.peak);
  if (report.clippedSamples > 0)
    return text + ": " + std::to_string(report.clippedSamples) + " samples were clipped; " + room +
           " makes room for them, --limit turns them down instead, --format float32 keeps them, "
           "--normalize scales the file down";
  if (report.limiter)
    return text + ", and was turned down by up to " +
           numberText(std::round(10.0 * report.gainReduction) / 10.0, 4) + " dB; " + room +
           ", --normalize or --format float32 makes room for it";
  return text + ", and players clip it; " + room +
         " makes room for it, --limit turns it down, --normalize scales the file down";
}

}  // namespace

void Warnings::add(const std::string& text) {
  if (text.empty()) return;
  warn(text);
  texts_.push_back(text);
}

void Warnings::add(const std::vector<std::string>& texts) {
  for (const std::string& text : texts)
    add(text);
}

std::vector<std::string> sceneWarnings(const Scene& scene) {
  std::vector<std::string> warnings = densityWarnings(scene);
  for (std::string& outside : outsideWarnings(scene))
    warnings.push_back(std::move(outside));
  return warnings;
}

std::vector<std::string> renderWarnings(const RenderReport& report, const RenderOptions& options) {
  std::vector<std::string> warnings = report.notes;
  if (std::string peak = peakWarning(report, options); !peak.empty())
    warnings.push_back(std::move(peak));
  if (report.synth.late > 0)
    warnings.push_back(std::to_string(report.synth.late) +
                       " contacts lost the beginning of their sound: they last longer than 50 ms, "
                       "or came as the sound began");
  return warnings;
}

}  // namespace carom::command
