#include "scenes/limits/run_guard.h"

#include <sstream>

#include "scenes/limits/machine_memory.h"

namespace carom::scenes {
namespace {

std::string quantity(double value, const char* unit) {
  std::ostringstream text;
  text << value << ' ' << unit;
  return text.str();
}

std::string residentText() {
  return bytesText(static_cast<double>(residentMemory()));
}

}  // namespace

RunGuard::RunGuard(const Scene& scene, const RunLimits& limits)
    : scene_(scene), limits_(limits), watch_(limits), bodies_(scene.bodies.size()) {}

void RunGuard::restart() {
  events_ = 0;
  time_ = 0.0;
  bodies_.assign(scene_.bodies.size(), {});
}

std::string RunGuard::nameOf(BodyId body) const {
  if (body >= scene_.bodies.size()) return "a body";
  const SceneBody& of = scene_.bodies[body];
  return '"' + of.name + '"' + (of.pointer.empty() ? "" : " (" + of.pointer + ")");
}

/// Returns the body with the most events; nothing if there is none.
std::optional<BodyId> RunGuard::busiestBody() const {
  std::optional<BodyId> most;
  for (std::size_t body = 0; body < bodies_.size(); ++body)
    if (bodies_[body].events > (most ? bodies_[*most].events : 0)) most = static_cast<BodyId>(body);
  if (most) return most;
  for (std::size_t body = 0; body < scene_.bodies.size(); ++body)
    if (std::holds_alternative<std::shared_ptr<const JelloShape>>(scene_.bodies[body].shape))
      return static_cast<BodyId>(body);
  return std::nullopt;
}

/// Says how many events there were, and which pair has the most of them.
std::string RunGuard::busiest() const {
  const auto body = busiestBody();
  std::string text = std::to_string(events_) + " events so far";
  if (!body) return text;
  if (bodies_[*body].events == 0) return text + ", with the jello " + nameOf(*body);
  return text + ", most of them of " + nameOf(*body) + ", last with " +
         nameOf(bodies_[*body].other);
}

void RunGuard::end(std::string limit, const std::string& why, double time) {
  if (ended_) return;
  const auto body = busiestBody();
  std::ostringstream text;
  text << "the run ends at " << time << " s of " << scene_.duration << " s: " << why;
  ended_ = EndedEarly{std::move(limit), text.str(), body ? scene_.bodies[*body].pointer : "", time};
}

bool RunGuard::addOne(const ImpulseEvent& event) {
  ++events_;
  if (event.body >= bodies_.size()) return true;
  Body& body = bodies_[event.body];
  ++body.events;
  body.other = event.other;
  if (body.streak == 0) body.since = event.time;
  if (++body.streak < kRattle || limits_.events > 0) return true;
  const double span = event.time - body.since;
  body.streak = 0;
  if (span > kRattlePeriod * kRattle) return true;
  end("rattle",
      nameOf(event.body) + " rattles without end: " + std::to_string(kRattle) +
          " collisions within " + quantity(span, "s") + ", the last with " + nameOf(event.other) +
          "; expected a wider gap, a restitution below 1, or --max-events, which lets it rattle "
          "to that number",
      event.time);
  return false;
}

bool RunGuard::add(std::span<const ImpulseEvent> events, double time) {
  for (const ImpulseEvent& event : events) {
    if (!addOne(event)) return false;
    if (limits_.events == 0 || events_ < limits_.events) continue;
    end("events",
        busiest() + "; expected at most " + std::to_string(limits_.events) +
            " (--max-events), a shorter duration, or a lower restitution",
        event.time);
    return false;
  }
  return mayGoOn(time);
}

void RunGuard::runOut() {
  endForMemory("it can have no more memory than " + residentText());
}

void RunGuard::endForMemory(const std::string& why) {
  end("memory",
      why + ", with " + busiest() + "; expected at most " +
          bytesText(static_cast<double>(limits_.memory)) +
          " (--max-memory), fewer collisions, points or images, or a shorter duration",
      time_);
}

bool RunGuard::mayGoOn(double time) {
  if (ended_) return false;
  time_ = time;
  const std::string limit = watch_.exceeded();
  if (limit.empty()) return true;
  if (limit == "time") {
    end("time",
        "it has taken " + quantity(limits_.time, "s") + ", with " + busiest() +
            "; expected a shorter duration, coarser steps, fewer or softer bodies, or more "
            "(--max-time)",
        time);
    return false;
  }
  endForMemory("its memory has grown to " + residentText());
  return false;
}

Status checkEnded(const RunGuard* guard) {
  if (guard != nullptr && guard->ended()) return Error{guard->ended()->what};
  return std::monostate{};
}

Progress withinLimits(RunGuard* guard, const Progress& progress) {
  return [guard, &progress](std::string_view stage, double share) {
    if (guard != nullptr && !guard->mayGoOn()) return false;
    return !progress || progress(stage, share);
  };
}

}  // namespace carom::scenes
