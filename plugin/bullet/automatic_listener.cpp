#include "plugin/bullet/automatic_listener.h"

#include <algorithm>
#include <cmath>

#include <btBulletDynamicsCommon.h>

#include "plugin/bullet/world_survey.h"

namespace carom::plugin {
namespace {

/// Share of its radius by which the sphere in view may be off, and factors that its radius may
/// have.
constexpr double kOff = 0.6;
constexpr double kSmaller = 0.4;
constexpr double kLarger = 1.5;

}  // namespace

bool AutomaticListener::isFitting(const PlacementSphere& sphere) const {
  const PlacementSphere& seen = goal_->seen;
  return (sphere.centre - seen.centre).norm() <= kOff * seen.radius &&
         sphere.radius >= kSmaller * seen.radius && sphere.radius <= kLarger * seen.radius;
}

void AutomaticListener::look(const btDynamicsWorld& world, double time, bool isQuiet) {
  const WorldSurvey survey = surveyOf(world, metres_);
  const std::optional<PlacementSphere> sphere = sphereAround(survey.movable, survey.scene);
  if (!sphere || (goal_ && isFitting(*sphere))) return;
  const ListenerPlacement goal = placeListener(*sphere, survey.movable, survey.scene);
  if (!goal.position.allFinite()) return;
  up_ = survey.scene.up;
  isNew_ = true;
  std::optional<Glide> glide;
  if (goal_ && !isQuiet) {
    const ListenerPlacement from = placeAt(time);
    const double way = (goal.position - from.position).norm();
    glide = {from, time, std::clamp(way / kSpeed, kShortestGlide, kLongestGlide)};
  }
  glide_ = glide;
  goal_ = goal;
}

/// Returns where the listener is, and what it looks at: on the way from one place to another it
/// begins and ends at rest.
ListenerPlacement AutomaticListener::placeAt(double time) const {
  if (!glide_) return *goal_;
  const double share = std::clamp((time - glide_->begin) / glide_->duration, 0.0, 1.0);
  const double smooth = share * share * (3.0 - 2.0 * share);
  ListenerPlacement place = *goal_;
  const ListenerPlacement& from = glide_->from;
  place.position = from.position + smooth * (goal_->position - from.position);
  place.seen.centre = from.seen.centre + smooth * (goal_->seen.centre - from.seen.centre);
  return place;
}

std::optional<ListenerPose> AutomaticListener::update(const btDynamicsWorld& world, double time,
                                                      bool isQuiet) {
  const int objects = world.getNumCollisionObjects();
  if (time >= nextLook_ || (isQuiet && objects != objects_)) {
    look(world, time, isQuiet);
    nextLook_ = time + kPeriod;
    objects_ = objects;
  }
  if (!goal_ || (!isNew_ && !glide_)) return std::nullopt;
  const ListenerPlacement place = placeAt(time);
  if (glide_ && time >= glide_->begin + glide_->duration) glide_.reset();
  isNew_ = false;
  return ListenerPose{time, place.position, lookingAt(place.position, place.seen.centre, up_)};
}

}  // namespace carom::plugin
