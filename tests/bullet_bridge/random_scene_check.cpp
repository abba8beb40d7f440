#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>

#include "tests/bullet_bridge/delivery_time.h"
#include "tests/bullet_bridge/random_scene.h"

namespace carom {
namespace {

constexpr double kRounding = 1e-9;
// Bullet acts on a gap that closes within two substeps; the bound leaves room.
constexpr double kLookAhead = 4.0;  // substeps

bool isFinite(const Vec3& vector) {
  return vector.allFinite();
}

bool isRadius(double radius) {
  return radius >= 0.0;  // may be infinite
}

// Checks the reports of one bridge.
class Watch {
 public:
  Watch(BulletBridge& bridge, double step) : bridge_(bridge), step_(step) {
    settled_ = bridge.settledTime();
  }

  void read(int bodiesEver);
  void finish();
  RandomSceneResult result;

 private:
  template <class... Parts>
  void fail(const Parts&... parts);
  void checkEvent(const ImpulseEvent& event, int bodiesEver);
  void checkShares();
  void checkContact(const ContactState& contact, int bodiesEver);
  void checkPhase(const ContactState& contact);
  void digest(const ImpulseEvent& event);

  BulletBridge& bridge_;
  double step_;
  double settled_;  // s, as of the last reading
  std::uint64_t delivered_ = 0;
  std::map<std::pair<BodyId, BodyId>, bool> lasting_;  // contacts that have begun and not ended
};

template <class... Parts>
void Watch::fail(const Parts&... parts) {
  if (!result.failure.empty()) return;
  std::ostringstream text;
  text.precision(9);
  text << "t = " << bridge_.time() << " s: ";
  (text << ... << parts);
  result.failure = text.str();
}

void Watch::read(int bodiesEver) {
  for (const ImpulseEvent& event : bridge_.events())
    checkEvent(event, bodiesEver);
  checkShares();
  for (const ContactState& contact : bridge_.contacts())
    checkContact(contact, bodiesEver);
  const double settled = bridge_.settledTime();
  if (!(settled >= settled_)) fail("the settled time went back to ", settled);
  settled_ = settled;
  result.contacts += bridge_.contacts().size();
  bridge_.clear();
}

void Watch::checkEvent(const ImpulseEvent& event, int bodiesEver) {
  ++delivered_;
  digest(event);
  const auto ids = [&] {
    return " (" + std::to_string(event.body) + " by " + std::to_string(event.other) + ")";
  };
  if (!isFinite(event.impulse) || !isFinite(event.position) || !isFinite(event.normal) ||
      !isFinite(event.bodyPosition) || !isFinite(event.bodyVelocity) ||
      !isFinite(event.bodyAngularVelocity) || !event.bodyOrientation.coeffs().allFinite() ||
      !isFinite(event.appliedImpulse))
    fail("a vector of an event is not finite", ids());
  if (!isRadius(event.radius) || !isRadius(event.otherRadius)) fail("a radius is none", ids());
  if (!(std::abs(event.normal.norm() - 1.0) < 1e-6)) fail("a normal is not unit", ids());
  if (!(std::abs(event.bodyOrientation.norm() - 1.0) < 1e-4)) fail("a turn is none", ids());
  if (!(event.approachSpeed > 0.0) || !std::isfinite(event.approachSpeed))
    fail("approach at ", event.approachSpeed, " m/s", ids());
  if (!(event.effectiveMass > 0.0) || !std::isfinite(event.effectiveMass))
    fail("effective mass of ", event.effectiveMass, " kg", ids());
  if (!(event.impulse.dot(event.normal) > 0.0)) fail("an impulse draws together", ids());
  if (event.impulse.cross(event.normal).norm() > 1e-6 * event.impulse.norm())
    fail("an impulse is not along its normal", ids());
  if (event.body == event.other || int(std::max(event.body, event.other)) >= bodiesEver)
    fail("an event of bodies that there are not", ids());
  if (!(event.time >= settled_ - kRounding))
    fail("an event at ", event.time, " s, before the settled ", settled_, ids());
  if (!(event.time <= bridge_.time() + kLookAhead * step_))
    fail("an event at ", event.time, " s, too far ahead", ids());
}

// Checks that each collision has two opposite events, delivered together.
void Watch::checkShares() {
  std::vector<const ImpulseEvent*> sorted;
  for (const ImpulseEvent& event : bridge_.events())
    sorted.push_back(&event);
  const auto key = [](const ImpulseEvent& event) {
    return std::tuple(event.time, std::min(event.body, event.other),
                      std::max(event.body, event.other));
  };
  std::sort(sorted.begin(), sorted.end(),
            [&](const auto* a, const auto* b) { return key(*a) < key(*b); });
  if (sorted.size() % 2 != 0) return fail("an event without its other share");
  for (std::size_t i = 0; i < sorted.size(); i += 2) {
    const ImpulseEvent& one = *sorted[i];
    const ImpulseEvent& two = *sorted[i + 1];
    if (key(one) != key(two) || one.body == two.body)
      return fail("an event without its other share, at ", one.time, " s");
    if ((one.impulse + two.impulse).norm() > kRounding * one.impulse.norm() ||
        (one.normal + two.normal).norm() > kRounding)
      return fail("two shares are not opposite, at ", one.time, " s");
    if (one.hasAppliedImpulse != two.hasAppliedImpulse ||
        (one.appliedImpulse + two.appliedImpulse).norm() > kRounding * one.appliedImpulse.norm())
      return fail("two applied shares are not opposite, at ", one.time, " s");
    if (i > 0 && key(one) == key(*sorted[i - 1])) fail("a duplicate, at ", one.time, " s");
  }
}

void Watch::checkContact(const ContactState& contact, int bodiesEver) {
  const auto ids = [&] {
    return " (" + std::to_string(contact.body) + " on " + std::to_string(contact.other) + ")";
  };
  for (const Vec3& vector : {contact.normal, contact.position, contact.appliedImpulse,
                             contact.slipVelocity, contact.rollingVelocity, contact.pathStart,
                             contact.pathEnd, contact.otherPathStart, contact.otherPathEnd}) {
    if (!isFinite(vector)) fail("a vector of a contact is not finite", ids());
  }
  if (!(std::abs(contact.normal.norm() - 1.0) < 1e-6))
    fail("a contact's normal is not unit", ids());
  if (!(contact.normalLoad >= 0.0) || !std::isfinite(contact.normalLoad))
    fail("a contact's load is ", contact.normalLoad, " N", ids());
  if (!(contact.duration > 0.0) || contact.duration > 1.001 * step_)
    fail("a contact lasts ", contact.duration, " s", ids());
  if (!(contact.time >= 0.0) || contact.time > bridge_.time())
    fail("a contact at ", contact.time, " s", ids());
  if (contact.body == contact.other || int(std::max(contact.body, contact.other)) >= bodiesEver)
    fail("a contact of bodies that there are not", ids());
  checkPhase(contact);
}

void Watch::checkPhase(const ContactState& contact) {
  const auto ordered = std::minmax(contact.body, contact.other);
  bool& lasting = lasting_[{ordered.first, ordered.second}];
  const bool begins = contact.phase == ContactPhase::begin;
  if (begins == lasting)
    fail(begins ? "a contact begins that has begun" : "a contact goes on that has not begun", " (",
         contact.body, " on ", contact.other, ")");
  lasting = contact.phase != ContactPhase::end;
}

void Watch::digest(const ImpulseEvent& event) {
  const double numbers[] = {event.time,         event.impulse.x(),  event.impulse.y(),
                            event.impulse.z(),  event.position.x(), event.position.y(),
                            event.position.z(), double(event.body), double(event.other)};
  for (const double number : numbers) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    result.digest = (result.digest ^ bits) * 1099511628211U;
  }
}

void Watch::finish() {
  const BulletBridgeCounters& counters = bridge_.counters();
  result.substeps = counters.substeps;
  result.collisions = counters.collisions;
  result.unsupported = bridge_.counters().unsupported > 0 ? 1 : 0;
  if (2 * counters.collisions != delivered_)
    fail(counters.collisions, " collisions counted, ", delivered_, " events delivered");
}

}  // namespace

RandomSceneResult runRandomScene(std::uint64_t seed, const BulletBridgeSettings& settings) {
  RandomScene scene(seed);
  Result<BulletBridge> bridge = BulletBridge::attach(scene.world(), settings);
  if (!bridge) return {.failure = bridge.error().message};
  Watch watch(*bridge, scene.step());
  for (int call = 0; call < scene.calls(); ++call) {
    scene.advance();
    watch.read(scene.bodiesEver());
  }
  scene.calm(stepsUntilDelivered(scene.step()));
  watch.read(scene.bodiesEver());
  watch.finish();
  return watch.result;
}

}  // namespace carom
