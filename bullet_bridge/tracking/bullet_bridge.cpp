#include "carom/bullet/bullet_bridge.h"

#include <cmath>
#include <string>
#include <utility>

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorldMt.h>
#include <LinearMath/btThreads.h>
#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/bodies/object_identity.h"
#include "bullet_bridge/tracking/bridge_context.h"
#include "bullet_bridge/tracking/contact_classifier.h"
#include "bullet_bridge/tracking/tick_hook.h"

namespace carom {

using namespace bullet;

// One substep: the motions of the bodies, then the pairs that may have met, then what each of them
// did.
class BulletBridge::Impl : public TickHook, public std::enable_shared_from_this<Impl> {
 public:
  Impl(btDiscreteDynamicsWorld& world, const BulletBridgeSettings& settings)
      : TickHook(world), context_{.world = world, .settings = settings} {
    if (settings.stillSpeed > 0.0) bodies_.setRest(0.5 * settings.restSpeed);
    bodies_.beginSubstep(world, 1.0);  // assigns the ids, in the world's order
  }

  const BridgeContext& context() const { return context_; }
  const BodyTracker& bodies() const { return bodies_; }
  ContactClassifier& classifier() { return classifier_; }
  const btCollisionObject* find(BodyId id) const;

 private:
  void onStepStart(double dt) override { bodies_.beginSubstep(world(), dt); }
  void onStepEnd(double dt) override;

  BridgeContext context_;
  BodyTracker bodies_;
  ContactClassifier classifier_{context_, bodies_};
  int missed_ = 0;  // starts, at the end of the substep before
};

void BulletBridge::Impl::onStepEnd(double dt) {
  const auto kept = shared_from_this();  // the callback may end the bridge
  ++context_.counters.substeps;
  context_.counters.substepsWithoutStart = static_cast<std::uint64_t>(startsMissed());
  context_.clock.begin(dt);
  // Without its start, bodies that have gone meanwhile are known as they were.
  if (std::exchange(missed_, startsMissed()) != startsMissed()) bodies_.leaveOutRemoved(world());
  bodies_.endSubstep(world(), dt);
  classifier_.resolveAll();
  context_.clock.end();
  if (context_.settings.onSubstep) context_.settings.onSubstep();
}

/// A body may have left the world in this substep, and another have come to its address.
const btCollisionObject* BulletBridge::Impl::find(BodyId id) const {
  std::size_t place = 0;
  const TrackedBody* const body = isAttached() ? bodies_.find(id, place) : nullptr;
  if (body == nullptr) return nullptr;
  const auto& objects = world().getCollisionObjectArray();
  const auto known = static_cast<int>(place);
  const bool isInPlace = known < objects.size() && objects[known] == body->object;
  const int index =
      isInPlace ? known : objects.findLinearSearch(const_cast<btCollisionObject*>(body->object));
  const bool isThere = index < objects.size() &&
                       isSameObject(body->identity, identityOf(*objects[index]), isInPlace);
  return isThere ? body->object : nullptr;
}

namespace {

/// Refuses a world whose substeps cannot be followed, or that cannot make any.
Result<btDiscreteDynamicsWorld*> followed(btDynamicsWorld& world) {
  auto* const discrete = dynamic_cast<btDiscreteDynamicsWorld*>(&world);
  if (discrete == nullptr) {
    return Error{
        std::string("BulletBridge: this world is ") +
        (world.getWorldType() == BT_SIMPLE_DYNAMICS_WORLD
             ? "a btSimpleDynamicsWorld, which calls no actions, so its substeps cannot be followed"
             : "no btDiscreteDynamicsWorld") +
        "; expected a btDiscreteDynamicsWorld, or a world of a class derived from it"};
  }
  if (dynamic_cast<btDiscreteDynamicsWorldMt*>(&world) != nullptr &&
      btGetTaskScheduler() == nullptr) {
    return Error{
        "BulletBridge: this btDiscreteDynamicsWorldMt has no task scheduler, without which it "
        "cannot step; expected btSetTaskScheduler before, with btGetSequentialTaskScheduler() "
        "where there is no other"};
  }
  return discrete;
}

}  // namespace

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
  const Result<btDiscreteDynamicsWorld*> discrete = followed(world);
  if (!discrete) return discrete.error();
  return BulletBridge(std::make_shared<Impl>(**discrete, settings));
}

BulletBridge::BulletBridge(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}
BulletBridge::BulletBridge(BulletBridge&&) noexcept = default;
BulletBridge& BulletBridge::operator=(BulletBridge&& other) noexcept {
  if (impl_ != nullptr) impl_->detach();
  impl_ = std::exchange(other.impl_, nullptr);
  return *this;
}
BulletBridge::~BulletBridge() {
  if (impl_ != nullptr) impl_->detach();
}

bool BulletBridge::isAttached() const {
  return impl_->isAttached();
}
const btCollisionObject* BulletBridge::bodyOf(BodyId id) const {
  return impl_->find(id);
}

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
  impl_->classifier().flush(impl_->isAttached());
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
  if (!impl_->isAttached())
    return Error{"BulletBridge: the world is gone; expected one that still exists"};
  if (const TrackedBody* body = impl_->bodies().find(object)) return body->id;
  return Error{
      "BulletBridge: this object has not been in the world for a substep; expected one "
      "that was there at attach or has been stepped since"};
}

}  // namespace carom
