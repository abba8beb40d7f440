#include "native/mechanics/rolling.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kTurn = 0.05;          ///< rad, largest turn of a direction in one course
constexpr double kLongestTurn = 2e-3;   ///< s, longest course whose direction turns
constexpr double kStillTime = 1e-9;     ///< s; slower than this times the support is rounding
constexpr double kAligned = 1e-12;      ///< relative to the pull: a smaller part across is rounding
constexpr double kInertia = 2.0 / 5.0;  ///< moment of inertia over m r^2

Vec3 inSurface(const Vec3& vector, const Vec3& normal) {
  return vector - dotInOrder(vector, normal) * normal;
}

/// The next course of a velocity that is slowed against its direction.
struct Slowing {
  Vec3 direction;         ///< unit, of the slowing at the middle of the course
  double duration = 0.0;  ///< s, until the motion has ended or turned
};

/// Returns the course of a velocity that is accelerated by `pull` and slowed by `slowing` m/s^2.
Slowing slowed(const Vec3& velocity, const Vec3& pull, double slowing) {
  const double speed = lengthOf(velocity);
  const Vec3 direction = velocity / speed;
  const double with = dotInOrder(pull, direction);
  const Vec3 across = pull - with * direction;
  const double ending = slowing - with;
  const double end = ending > 0.0 ? speed / ending : kNever;
  const double turning = lengthOf(across);
  if (turning <= kAligned * lengthOf(pull)) return {direction, end};
  const double duration = std::min({end, kLongestTurn, kTurn * speed / turning});
  const Vec3 middle = velocity + (0.5 * duration) * (pull - slowing * direction);
  const double left = lengthOf(middle);
  return {left > 0.0 ? Vec3(middle / left) : direction, duration};
}

/// Adds the slowing of the spin about the normal, by the torque of pivoting friction.
void pivot(const RollingContact& contact, RollingCourse& course) {
  const double spin = dotInOrder(course.spin.velocity, contact.normal);
  const double slowing =
      contact.pivoting * contact.support / (kInertia * contact.radius * contact.radius);
  if (slowing <= 0.0) return;
  if (std::abs(spin) <= kStillTime * slowing) {
    course.spin.velocity -= spin * contact.normal;
    return;
  }
  course.spin.acceleration -= std::copysign(slowing, spin) * contact.normal;
  course.duration = std::min(course.duration, std::abs(spin) / slowing);
}

/// Spin (rad/s) of a sphere that rolls at `velocity` (m/s); the same relation holds for
/// accelerations.
Vec3 rollingSpin(const RollingContact& contact, const Vec3& velocity) {
  return cross(contact.normal, velocity) / contact.radius;
}

RollingCourse slide(const RollingContact& contact, const Vec3& velocity, const Vec3& spin,
                    const Slowing& slip) {
  const double friction = contact.sliding * contact.support;
  RollingCourse course{
      velocity, contact.pull - friction * slip.direction, {spin, Vec3::Zero()}, slip.duration};
  course.spin.acceleration =
      (friction / (kInertia * contact.radius)) * cross(contact.normal, slip.direction);
  return course;
}

RollingCourse roll(const RollingContact& contact, const Vec3& velocity, const Vec3& spin) {
  const Vec3 pull = contact.pull / (1.0 + kInertia);
  const double resistance = contact.rolling * contact.support;
  RollingCourse course{velocity, pull, {spin, Vec3::Zero()}, kNever};
  const double drawn = lengthOf(pull);
  if (resistance > 0.0) {
    if (lengthOf(velocity) > kStillTime * contact.support) {
      const Slowing slowing = slowed(velocity, pull, resistance);
      course.acceleration -= resistance * slowing.direction;
      course.duration = slowing.duration;
    } else if (drawn <= resistance) {
      course.velocity.setZero();
      course.acceleration.setZero();
    } else {
      course.acceleration -= (resistance / drawn) * pull;
    }
  }
  course.spin.velocity =
      rollingSpin(contact, course.velocity) + dotInOrder(spin, contact.normal) * contact.normal;
  course.spin.acceleration = rollingSpin(contact, course.acceleration);
  return course;
}

}  // namespace

Vec3 spinChange(const Vec3& arm, const Vec3& impulse, double mass, double radius) {
  return cross(arm, impulse) / (kInertia * mass * radius * radius);
}

Vec3 frictionImpulse(const FrictionContact& contact, double impulse) {
  const Vec3 turning = cross(contact.spin, -contact.radius * contact.normal) -
                       cross(contact.otherSpin, contact.otherRadius * contact.normal);
  const Vec3 slip = inSurface(contact.velocity + turning, contact.normal);
  const double speed = lengthOf(slip);
  if (!(speed > 0.0)) return Vec3::Zero();
  const double slipPerImpulse =
      (1.0 + 1.0 / kInertia) * (contact.inverseMass + contact.otherInverseMass);
  return (-std::min(contact.friction * impulse, speed / slipPerImpulse) / speed) * slip;
}

RollingCourse rollingCourse(const RollingContact& contact, const Vec3& velocity, const Vec3& spin) {
  const double friction = contact.sliding * contact.support;
  const double slipPerSlowing = 1.0 + 1.0 / kInertia;  // the spin changes, too
  const Vec3 slip =
      velocity - contact.radius * inSurface(cross(spin, contact.normal), contact.normal);
  RollingCourse course;
  if (lengthOf(slip) > kStillTime * contact.support) {
    course = slide(contact, velocity, spin, slowed(slip, contact.pull, slipPerSlowing * friction));
  } else if (lengthOf(contact.pull) > slipPerSlowing * friction) {
    course = slide(contact, velocity, spin, {contact.pull / lengthOf(contact.pull), kNever});
  } else {
    // The last slip is removed in the way that friction would remove it.
    course = roll(contact, velocity - slip / slipPerSlowing, spin);
  }
  pivot(contact, course);
  return course;
}

}  // namespace carom::native
