#include "carom/bullet/bullet_bridge.h"

#include <cmath>
#include <string>
#include <utility>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/candidate_pairs.h"
#include "bullet_bridge/tracking/contact_classifier.h"
#include "bullet_bridge/tracking/tick_hook.h"

namespace carom {

using namespace bullet;

// One substep: the motions of the bodies, then the pairs that may have met, then what each of them
// did.
class BulletBridge::Impl : public TickHook {
 public:
  Impl(btDynamicsWorld& world, const BulletBridgeSettings& settings)
      : TickHook(world), context_{.world = world, .settings = settings} {
    if (settings.stillSpeed > 0.0) bodies_.setRest(0.5 * settings.restSpeed);
    bodies_.beginSubstep(world, 1.0);  // assigns the ids, in the world's order
  }

  const BridgeContext& context() const { return context_; }
  const BodyTracker& bodies() const { return bodies_; }
  ContactClassifier& classifier() { return classifier_; }

 private:
  void onStepStart(double dt) override { bodies_.beginSubstep(world(), dt); }
  void onStepEnd(double dt) override;

  BridgeContext context_;
  BodyTracker bodies_;
  CandidatePairs candidates_;
  ContactClassifier classifier_{context_, bodies_};
};

void BulletBridge::Impl::onStepEnd(double dt) {
  ++context_.counters.substeps;
  context_.counters.substepsWithoutStart = static_cast<std::uint64_t>(startsMissed());
  context_.clock.begin(dt);
  bodies_.endSubstep(world(), dt);
  const std::span<const ContactPair> pairs = candidates_.find(bodies_, dt);
  classifier_.beginSubstep(pairs.size());
  for (const ContactPair& pair : pairs)
    classifier_.resolve(pair);
  classifier_.endSubstep();
  context_.clock.end();
  if (context_.settings.onSubstep) context_.settings.onSubstep();
}

Result<BulletBridge> BulletBridge::attach(btDynamicsWorld& world,
                                          const BulletBridgeSettings& settings) {
  if (!(settings.restSpeed >= 0.0) || !std::isfinite(settings.restSpeed)) {
    return Error{"BulletBridge: rest speed is " + std::to_string(settings.restSpeed) +
                 "; expected a finite number of m/s, not negative"};
  }
  if (TickHook::isHooked(world)) {
    return Error{
        "BulletBridge: this world has a bridge already; expected one per world, "
        "or the first one destroyed before"};
  }
  return BulletBridge(std::make_unique<Impl>(world, settings));
}

BulletBridge::BulletBridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BulletBridge::BulletBridge(BulletBridge&&) noexcept = default;
BulletBridge& BulletBridge::operator=(BulletBridge&&) noexcept = default;
BulletBridge::~BulletBridge() = default;

std::span<const ImpulseEvent> BulletBridge::events() const {
  return impl_->classifier().log().events();
}
std::span<const ContactState> BulletBridge::contacts() const {
  return impl_->classifier().contacts().states();
}
void BulletBridge::clear() {
  impl_->classifier().log().clear();
  impl_->classifier().contacts().clear();
}
void BulletBridge::flush() {
  impl_->classifier().flush();
}
double BulletBridge::time() const {
  return impl_->context().clock.current().start;
}
double BulletBridge::settledTime() const {
  return impl_->classifier().settledTime();
}
const BulletBridgeCounters& BulletBridge::counters() const {
  return impl_->context().counters;
}

Result<BodyId> BulletBridge::bodyId(const btCollisionObject& object) const {
  if (const TrackedBody* body = impl_->bodies().find(object)) return body->id;
  return Error{
      "BulletBridge: this object has not been in the world for a substep; expected one "
      "that was there at attach or has been stepped since"};
}

}  // namespace carom
