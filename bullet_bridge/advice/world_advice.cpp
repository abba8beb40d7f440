#include "carom/bullet/world_advice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unordered_set>

#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bodies/multibody_link.h"

namespace carom {

using namespace bullet;

namespace {

constexpr double kBulletBreakingFactor = 0.02;  // Bullet's default
constexpr double kUsualPairs = 10.0;  // tolerated ratio of near pairs to pairs that matter
constexpr double kThickMargin = 0.1;  // relative to the half thickness
constexpr double kThinMargin = 0.05;  // relative to the half thickness

// --- what is in the world ---

struct MovingBody {
  const btCollisionObject* object = nullptr;
  bool link = false;         // true for a link of a multibody
  double thickness = 0.0;    // m, the smallest edge of its box
  double speed = 0.0;        // m/s, expected
  double speculative = 0.0;  // m, gap from which Bullet solves its contacts
};

struct Survey {
  const btDynamicsWorld& world;
  AdviceSettings settings;
  double step = 0.0;     // s
  double gravity = 0.0;  // m/s^2
  std::vector<MovingBody> bodies;

  std::size_t links() const {
    return static_cast<std::size_t>(std::ranges::count(bodies, true, &MovingBody::link));
  }
  std::size_t rigid() const { return bodies.size() - links(); }
};

double number(btScalar value) {
  return static_cast<double>(value);
}

const btCollisionDispatcher* dispatcherOf(const btDynamicsWorld& world) {
  return dynamic_cast<const btCollisionDispatcher*>(world.getDispatcher());
}

bool scalesContacts(const btDynamicsWorld& world) {
  const btCollisionDispatcher* dispatcher = dispatcherOf(world);
  return dispatcher == nullptr ||
         (dispatcher->getDispatcherFlags() &
          btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD) != 0;
}

double speculativeGap(const btDynamicsWorld& world, const btCollisionShape& shape) {
  if (!scalesContacts(world)) return number(gContactBreakingThreshold);
  return number(shape.getContactBreakingThreshold(gContactBreakingThreshold));
}

// The smallest edge (m) of a box around a shape, found from support points: Bullet's own boxes hold
// the margin of a hull twice.
template <class Support>
double thinnestExtent(Support&& support) {
  double thinnest = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    btVector3 direction(0, 0, 0);
    direction[axis] = 1;
    const btScalar extent = support(direction)[axis] - support(-direction)[axis];
    thinnest = std::min(thinnest, number(extent));
  }
  return thinnest;
}

double thicknessOf(const btCollisionShape& shape) {
  if (shape.isConvex()) {
    const auto& convex = static_cast<const btConvexShape&>(shape);
    return thinnestExtent([&](const btVector3& d) { return convex.localGetSupportingVertex(d); });
  }
  btVector3 low;
  btVector3 high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  const btVector3 size = high - low;
  return number(std::min({size.x(), size.y(), size.z()}));
}

double thicknessWithoutMargin(const btConvexShape& shape) {
  return thinnestExtent(
      [&](const btVector3& d) { return shape.localGetSupportingVertexWithoutMargin(d); });
}

// True if the object moves by itself; sets its speed.
bool readMotion(const btCollisionObject& object, MovingBody& body) {
  if (object.getInternalType() == btCollisionObject::CO_FEATHERSTONE_LINK) {
    const auto& link = static_cast<const btMultiBodyLinkCollider&>(object);
    body.link = true;
    body.speed = linkVelocity(link).linear.norm();
    return !link.m_multiBody->isLinkAndAllAncestorsStaticOrKinematic(link.m_link);
  }
  const btRigidBody* rigid = btRigidBody::upcast(&object);
  if (rigid == nullptr || rigid->isStaticOrKinematicObject()) return false;
  body.speed = number(rigid->getLinearVelocity().length());
  return true;
}

Survey surveyOf(const btDynamicsWorld& world, double step, const AdviceSettings& settings) {
  Survey survey{.world = world, .settings = settings, .step = step, .bodies = {}};
  survey.gravity = number(world.getGravity().length());
  const double fall = std::sqrt(2.0 * survey.gravity * settings.dropHeight);
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    MovingBody body{.object = objects[i]};
    if (!readMotion(*objects[i], body) || !objects[i]->hasContactResponse()) continue;
    body.thickness = thicknessOf(*objects[i]->getCollisionShape());
    body.speed = std::max(body.speed, fall);
    body.speculative = speculativeGap(world, *objects[i]->getCollisionShape());
    survey.bodies.push_back(body);
  }
  return survey;
}

// --- how to say it ---

// Formats a number with three digits and a unit.
std::string text(double value, const char* unit = "") {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.3g%s", value, unit);
  return buffer;
}

std::string length(double metres) {
  return metres < 0.1 ? text(1000.0 * metres, " mm") : text(metres, " m");
}

std::string percent(double share) {
  return text(100.0 * share, " %");
}

// --- the advice ---

using List = std::vector<Advice>;

Advice blank(AdviceKind kind, const char* setting) {
  Advice advice;
  advice.kind = kind;
  advice.setting = setting;
  return advice;
}

std::string pushText(double share) {
  return "adds up to " + percent(share) + " of the approach speed to a bounce (" +
         percent(share / 2.0) + " on average, at any step)";
}

void adviseSplitImpulse(const Survey& survey, List& list) {
  const btContactSolverInfo& info = survey.world.getSolverInfo();
  const double share = number(info.m_erp2);
  if (survey.rigid() == 0 || share <= 0.0) return;
  if (info.m_splitImpulse == 0) {
    list.push_back({.kind = AdviceKind::splitImpulse,
                    .setting = "btContactSolverInfo::m_splitImpulse",
                    .current = 0.0,
                    .advised = 1.0,
                    .reason = "What pushes penetrating bodies apart becomes motion: it " +
                              pushText(share) + ".",
                    .applicable = true});
  }
  const double threshold = number(info.m_splitImpulsePenetrationThreshold);
  if (threshold < 0.0) {
    list.push_back({.kind = AdviceKind::splitImpulseThreshold,
                    .setting = "btContactSolverInfo::m_splitImpulsePenetrationThreshold",
                    .current = threshold,
                    .advised = 0.0,
                    .reason = "What pushes bodies apart becomes motion where they penetrate less "
                              "than " +
                              length(-threshold) + ": it " + pushText(share) + ".",
                    .applicable = true});
  }
}

void adviseLinkPush(const Survey& survey, List& list) {
  const double share = number(survey.world.getSolverInfo().m_erp2);
  if (survey.links() == 0 || share <= 0.0) return;
  double depth = 0.0;
  for (const MovingBody& body : survey.bodies)
    if (body.link) depth = std::max(depth, body.speed * survey.step);
  list.push_back({.kind = AdviceKind::linkPush,
                  .setting = "btContactSolverInfo::m_erp2",
                  .current = share,
                  .advised = 0.0,
                  .reason = "Multibodies know no split impulse, so what pushes links apart " +
                            pushText(share) +
                            "; with 0, a link that does not bounce stays inside by up to " +
                            length(depth) + ".",
                  .bodies = survey.links(),
                  .applicable = survey.settings.leaveLinksInside});
}

// Bullet solves a contact at a gap d for v_out = e |v| - d/dt: no bounce if |v| dt < gap / (1 + e).
void adviseSpeculativeContact(const Survey& survey, List& list) {
  Advice advice =
      blank(AdviceKind::speculativeContact, "btCollisionObject::m_contactProcessingThreshold");
  advice.applicable = true;
  double gap = 0.0;
  for (const MovingBody& body : survey.bodies) {
    const double processed = number(body.object->getContactProcessingThreshold());
    if (processed <= 0.0) continue;
    ++advice.bodies;
    advice.current = std::max(advice.current, processed);
    gap = std::max(gap, std::min(processed, body.speculative));
  }
  if (advice.bodies == 0) return;
  advice.reason = "Contacts are solved at gaps of up to " + length(gap) +
                  ", before the bodies touch: bounces are up to " +
                  text(gap / survey.step, " m/s") + " too slow, and all below " +
                  text(gap / (2.0 * survey.step), " m/s") + " vanish.";
  list.push_back(std::move(advice));
}

void adviseRestitutionThreshold(const Survey& survey, List& list) {
  const double perStep = survey.gravity * survey.step;
  const double threshold = number(survey.world.getSolverInfo().m_restitutionVelocityThreshold);
  Advice advice = blank(AdviceKind::restitutionThreshold,
                        "btContactSolverInfo::m_restitutionVelocityThreshold");
  advice.current = threshold;
  advice.advised = 2.0 * perStep;
  advice.applicable = true;
  if (threshold > 1.001 * advice.advised) {
    advice.reason = "Nothing bounces below " + text(threshold, " m/s");
    if (survey.gravity > 0.0) {
      advice.reason += ", a fall of " + length(threshold * threshold / (2.0 * survey.gravity)) +
                       ", so the last chatter is lost; the advised value loses only bounces that "
                       "last less than four steps";
    }
  } else if (survey.links() > 0 && threshold < 1.5 * perStep) {
    advice.reason = "Links at rest bounce for ever, at up to " + text(perStep, " m/s") +
                    " or more, because Bullet counts what gravity adds in a step as approach; the "
                    "advised value costs falls of less than " +
                    length(2.0 * perStep * survey.step);
  } else {
    return;
  }
  advice.reason += ".";
  list.push_back(std::move(advice));
}

void adviseImpulseWriteBack(const Survey& survey, List& list) {
  const int mode = survey.world.getSolverInfo().m_solverMode;
  if (survey.rigid() == 0 || (mode & SOLVER_USE_WARMSTARTING) != 0) return;
  list.push_back({.kind = AdviceKind::impulseWriteBack,
                  .setting = "btContactSolverInfo::m_solverMode",
                  .current = static_cast<double>(mode),
                  .advised = static_cast<double>(mode | SOLVER_USE_WARMSTARTING),
                  .reason = "Without SOLVER_USE_WARMSTARTING m_appliedImpulse reads 0 at every "
                            "contact of rigid bodies; m_warmstartingFactor = 0 keeps the solver "
                            "cold.",
                  .applicable = true});
}

void adviseRelativeBreakingDistance(const Survey& survey, List& list) {
  if (scalesContacts(survey.world)) return;
  const int flags = dispatcherOf(survey.world)->getDispatcherFlags();
  const int wanted = flags | btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD;
  const double fixed = number(gContactBreakingThreshold);
  double share = 0.0;
  std::size_t bodies = 0;
  for (const MovingBody& body : survey.bodies) {
    const btCollisionShape& shape = *body.object->getCollisionShape();
    if (number(shape.getContactBreakingThreshold(gContactBreakingThreshold)) >= fixed) continue;
    ++bodies;
    share = std::max(share, fixed / body.thickness);
  }
  if (bodies == 0) return;
  list.push_back({.kind = AdviceKind::relativeBreakingDistance,
                  .setting = "btCollisionDispatcher::setDispatcherFlags",
                  .current = static_cast<double>(flags),
                  .advised = static_cast<double>(wanted),
                  .reason = "Contacts are kept and merged over " + length(fixed) +
                            " whatever the size of the bodies, which is up to " + percent(share) +
                            " of their thickness.",
                  .bodies = bodies,
                  .applicable = true});
}

void adviseBreakingDistance(const Survey& survey, List& list) {
  const double factor = number(gContactBreakingThreshold);
  if (survey.bodies.empty() || dispatcherOf(survey.world) == nullptr ||
      !scalesContacts(survey.world) || factor <= 1.5 * kBulletBreakingFactor)
    return;
  list.push_back({.kind = AdviceKind::breakingDistance,
                  .setting = "gContactBreakingThreshold",
                  .current = factor,
                  .advised = kBulletBreakingFactor,
                  .reason = "Contacts are kept and merged over " + percent(factor) +
                            " of the bodies' size, in every world of the process.",
                  .applicable = survey.settings.processWide});
}

void adviseStep(const Survey& survey, List& list) {
  double advised = survey.step;
  std::size_t bodies = 0;
  const MovingBody* worst = nullptr;
  for (const MovingBody& body : survey.bodies) {
    if (body.speed * survey.step <= body.thickness) continue;
    ++bodies;
    const double enough = body.thickness / body.speed;
    if (worst != nullptr && enough >= advised) continue;
    advised = enough;
    worst = &body;
  }
  if (worst == nullptr) return;
  list.push_back({.kind = AdviceKind::coarseStep,
                  .setting = "fixedTimeStep of stepSimulation",
                  .current = survey.step,
                  .advised = advised,
                  .reason = "At " + text(worst->speed, " m/s") + " a body goes " +
                            length(worst->speed * survey.step) +
                            " in a step, more than its thickness of " + length(worst->thickness) +
                            ": it may pass through others of its size.",
                  .bodies = bodies});
}

// True for shapes that Bullet inflates by their margin; the others keep theirs inside.
bool wearsMarginOutside(const btCollisionShape& shape) {
  const int type = shape.getShapeType();
  return type == CONVEX_HULL_SHAPE_PROXYTYPE || type == CONVEX_TRIANGLEMESH_SHAPE_PROXYTYPE ||
         type == CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE || type == CONE_SHAPE_PROXYTYPE;
}

struct Margin {
  double margin = 0.0;         // m
  double halfThickness = 1.0;  // m, without the margin
  double share() const { return margin / halfThickness; }
};

Margin worstMargin(const btCollisionShape& shape) {
  Margin worst;
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int child = 0; child < compound.getNumChildShapes(); ++child) {
      const Margin margin = worstMargin(*compound.getChildShape(child));
      if (margin.share() > worst.share()) worst = margin;
    }
  } else if (wearsMarginOutside(shape)) {
    worst.margin = number(shape.getMargin());
    const auto& convex = static_cast<const btConvexShape&>(shape);
    worst.halfThickness = std::max(0.5 * thicknessWithoutMargin(convex), 1e-9);
  }
  return worst;
}

void adviseHullMargin(const Survey& survey, List& list) {
  Margin worst;
  std::size_t bodies = 0;
  for (const MovingBody& body : survey.bodies) {
    const Margin margin = worstMargin(*body.object->getCollisionShape());
    if (margin.share() <= kThickMargin) continue;
    ++bodies;
    if (margin.share() > worst.share()) worst = margin;
  }
  if (bodies == 0) return;
  list.push_back({.kind = AdviceKind::hullMargin,
                  .setting = "btCollisionShape::setMargin",
                  .current = worst.margin,
                  .advised = kThinMargin * worst.halfThickness,
                  .reason = "The hull collides " + length(worst.margin) +
                            " outside of its surface, " + percent(worst.share()) + " of its half " +
                            "thickness; less also means that the body sits lower.",
                  .bodies = bodies});
}

// Boxes that are larger by the margin on each side overlap with (1 + 2 margin / size)^3 times as
// many others.
void adviseBroadphaseMargin(const Survey& survey, List& list) {
  if (survey.bodies.empty() ||
      dynamic_cast<const btDbvtBroadphase*>(survey.world.getBroadphase()) == nullptr)
    return;
  std::vector<double> sizes;
  for (const MovingBody& body : survey.bodies)
    sizes.push_back(body.thickness);
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::ranges::nth_element(sizes, middle);
  const double margin = number(gDbvtMargin);
  const double pairs = std::pow(1.0 + 2.0 * margin / *middle, 3.0);
  if (pairs <= kUsualPairs) return;
  list.push_back({.kind = AdviceKind::broadphaseMargin,
                  .setting = "gDbvtMargin",
                  .current = margin,
                  .advised = kThinMargin * *middle,
                  .reason = "Boxes of bodies of " + length(*middle) + " with margins of " +
                            length(margin) + " overlap with up to " + text(pairs) +
                            " times as many others, each of which costs a contact test in every "
                            "step.",
                  .applicable = survey.settings.processWide});
}

void adviseContinuousCollision(const Survey& survey, List& list) {
  const double allowed = number(survey.world.getDispatchInfo().m_allowedCcdPenetration);
  Advice advice = blank(AdviceKind::continuousCollision, "btCollisionObject::m_ccdMotionThreshold");
  double slowest = INFINITY;
  for (const MovingBody& body : survey.bodies) {
    const double threshold = number(body.object->getCcdMotionThreshold());
    const double motion = std::max(threshold, allowed);
    if (body.link || threshold <= 0.0 || body.speed * survey.step <= motion) continue;
    ++advice.bodies;
    advice.current = std::max(advice.current, threshold);
    slowest = std::min(slowest, motion / survey.step);
  }
  if (advice.bodies == 0) return;
  advice.reason = "Above " + text(slowest, " m/s") +
                  " it stops bodies before they touch, at restitution 0, so that bounces are too "
                  "slow by a third or more; a smaller step does without.";
  list.push_back(std::move(advice));
}

// --- changes ---

using Objects = std::unordered_set<const btCollisionObject*>;

Objects objectsOf(const btDynamicsWorld& world) {
  const btCollisionObjectArray& objects = world.getCollisionObjectArray();
  Objects present;
  for (int i = 0; i < objects.size(); ++i)
    present.insert(objects[i]);
  return present;
}

// Updates the copies of the bodies' thresholds that contacts hold. Predictive contacts may outlive
// their bodies.
void refreshContacts(btDynamicsWorld& world) {
  const Objects present = objectsOf(world);
  btDispatcher& dispatcher = *world.getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    const btCollisionObject* first = manifold.getBody0();
    const btCollisionObject* second = manifold.getBody1();
    if (!present.contains(first) || !present.contains(second)) continue;
    manifold.setContactProcessingThreshold(
        std::min(first->getContactProcessingThreshold(), second->getContactProcessingThreshold()));
  }
}

void set(btDynamicsWorld& world, AdviceKind kind, btCollisionObject* object, double value) {
  btContactSolverInfo& info = world.getSolverInfo();
  const auto scalar = static_cast<btScalar>(value);
  switch (kind) {
    case AdviceKind::splitImpulse:
      info.m_splitImpulse = static_cast<int>(value);
      break;
    case AdviceKind::splitImpulseThreshold:
      info.m_splitImpulsePenetrationThreshold = scalar;
      break;
    case AdviceKind::linkPush:
      info.m_erp2 = scalar;
      break;
    case AdviceKind::speculativeContact:
      object->setContactProcessingThreshold(scalar);
      break;
    case AdviceKind::restitutionThreshold:
      info.m_restitutionVelocityThreshold = scalar;
      break;
    case AdviceKind::impulseWriteBack:
      info.m_solverMode = static_cast<int>(value);
      break;
    case AdviceKind::relativeBreakingDistance:
      static_cast<btCollisionDispatcher*>(world.getDispatcher())
          ->setDispatcherFlags(static_cast<int>(value));
      break;
    case AdviceKind::breakingDistance:
      gContactBreakingThreshold = scalar;
      break;
    case AdviceKind::broadphaseMargin:
      gDbvtMargin = scalar;
      break;
    case AdviceKind::coarseStep:
    case AdviceKind::hullMargin:
    case AdviceKind::continuousCollision:
      break;  // only the host can change these
  }
}

void change(btDynamicsWorld& world, const Tuning::Change& made, double value, Tuning& tuning) {
  tuning.changes.push_back(made);
  set(world, made.kind, made.object, value);
}

void changeBodies(const Survey& survey, btDynamicsWorld& world, Tuning& tuning) {
  for (const MovingBody& body : survey.bodies) {
    const double before = number(body.object->getContactProcessingThreshold());
    if (before <= 0.0) continue;
    btCollisionObject* object = world.getCollisionObjectArray()[body.object->getWorldArrayIndex()];
    change(world, {AdviceKind::speculativeContact, object, before}, 0.0, tuning);
  }
}

bool isPositive(double value) {
  return std::isfinite(value) && value > 0.0;
}

}  // namespace

Result<std::vector<Advice>> recommend(const btDynamicsWorld& world, double step,
                                      const AdviceSettings& settings) {
  if (!isPositive(step))
    return Error{"the step is " + text(step, " s") + ", and has to be positive and finite"};
  if (!isPositive(settings.dropHeight))
    return Error{"dropHeight is " + text(settings.dropHeight, " m") +
                 ", and has to be positive and finite"};
  const Survey survey = surveyOf(world, step, settings);
  List list;
  for (const auto advise :
       {adviseSplitImpulse, adviseLinkPush, adviseSpeculativeContact, adviseRestitutionThreshold,
        adviseImpulseWriteBack, adviseRelativeBreakingDistance, adviseBreakingDistance, adviseStep,
        adviseHullMargin, adviseBroadphaseMargin, adviseContinuousCollision})
    advise(survey, list);
  return list;
}

Result<Tuning> tune(btDynamicsWorld& world, double step, const AdviceSettings& settings) {
  Result<std::vector<Advice>> list = recommend(world, step, settings);
  if (!list) return list.error();
  Tuning tuning;
  for (Advice& advice : *list) {
    if (!advice.applicable) continue;
    if (advice.kind == AdviceKind::speculativeContact)
      changeBodies(surveyOf(world, step, settings), world, tuning);
    else
      change(world, {advice.kind, nullptr, advice.current}, advice.advised, tuning);
    tuning.applied.push_back(std::move(advice));
  }
  refreshContacts(world);
  return tuning;
}

void undo(btDynamicsWorld& world, const Tuning& tuning) {
  const Objects present = objectsOf(world);
  for (auto made = tuning.changes.rbegin(); made != tuning.changes.rend(); ++made)
    if (made->object == nullptr || present.contains(made->object))
      set(world, made->kind, made->object, made->before);
  refreshContacts(world);
}

}  // namespace carom
