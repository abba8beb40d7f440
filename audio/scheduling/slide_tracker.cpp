#include "audio/scheduling/slide_tracker.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "audio/model/positive.h"
#include "audio/scheduling/sample_time.h"
#include "carom/audio/material.h"

namespace carom::audio {
namespace {

/// Number of consecutive nodes of a train that are taken to come at once.
constexpr std::size_t kAtOnce = 4;
/// Upper bound of friction over load, for mechanics that reports more.
constexpr double kMostFriction = 2.0;
/// s: a longer step does not tell how its contact moved.
constexpr double kLongestStep = 1.0;
/// s: time in which a slide fades in.
constexpr double kFadingIn = 1e-3;
/// Time constant (s) and largest offset (m) of the contact point in `smooth`.
constexpr double kTurning = 0.03;
constexpr double kFarthestOffset = 1.0;
/// Energy that rolling loses, over load times path, where the mechanics knows of no loss.
constexpr double kRollingLoss = 0.01;

/// Effective mass (kg) of the pair along the normal; 0 if neither body can move.
double massOf(const ContactState& contact, const SoundBody& body, const SoundBody& other) {
  const auto inverseMass = [&contact](const SoundBody& sound, const Vec3& at, const Quat& turn) {
    if (std::isinf(sound.mass)) return 0.0;
    const Vec3 lever = turn.conjugate() * (contact.position - at).cross(contact.normal);
    return 1.0 / sound.mass + (sound.shape ? lever.dot(sound.inverseInertia * lever) : 0.0);
  };
  const double inverse = inverseMass(body, contact.bodyPosition, contact.bodyOrientation) +
                         inverseMass(other, contact.otherPosition, contact.otherOrientation);
  return isPositive(inverse) ? 1.0 / inverse : 0.0;
}

/// Energy (J) that friction takes in the step; at least what rolling loses.
double workOf(const ContactState& contact) {
  const double farthest = std::max((contact.pathEnd - contact.pathStart).norm(),
                                   (contact.otherPathEnd - contact.otherPathStart).norm());
  return std::max(-contact.appliedImpulse.dot(contact.slipVelocity),
                  kRollingLoss * contact.normalLoad * farthest);
}

/// Smooths the contact points: for a body with many of them, stepped mechanics reports now one and
/// now another. The point that is pushed moves on steadily, and approaches the reported one with
/// the time constant kTurning.
void smooth(const ContactState& contact, Slide& slide) {
  const double kept = std::exp(-contact.duration / kTurning);
  const auto smoothOne = [kept](Slide::Side& side, const Vec3& start, const Vec3& end) {
    side.offset = side.isKnown ? Vec3(kept * (side.offset + side.end - start)) : Vec3::Zero();
    if (side.offset.norm() > kFarthestOffset) side.offset.setZero();
    side.isKnown = true;
    side.end = end;
  };
  smoothOne(slide.sides[0], contact.pathStart, contact.pathEnd);
  smoothOne(slide.sides[1], contact.otherPathStart, contact.otherPathEnd);
}

/// Fades in the nodes of a slide's first step, so that its force does not begin with a jump.
void fadeIn(std::vector<PulseNode>& nodes, double duration) {
  for (PulseNode& node : nodes)
    node.weight *= std::min(1.0, node.u * duration / kFadingIn);
}

/// Radius (m) of the contact's curvature, see hertzContact.
double contactRadius(const ContactState& contact, const SoundingBody& body,
                     const SoundingBody& other) {
  const double radius = body.ballRadius() > 0.0 ? body.ballRadius() : contact.radius;
  const double otherRadius = other.ballRadius() > 0.0 ? other.ballRadius() : contact.otherRadius;
  const bool isCurved = isPositive(radius) || isPositive(otherRadius);
  const auto blunt = [isCurved](double given, const SoundingBody& touched) {
    return isCurved && given > 0.0 ? given : touched.sound.edgeRadius;
  };
  return 1.0 / (1.0 / blunt(radius, body) + 1.0 / blunt(otherRadius, other));
}

}  // namespace

double squaredWay(const ContactState& contact) {
  return std::max((contact.pathEnd - contact.pathStart).squaredNorm(),
                  (contact.otherPathEnd - contact.otherPathStart).squaredNorm());
}

bool isMoving(const ContactState& contact) {
  const double least = 0.5 * ContactDrive::kSlowest * contact.duration;
  return squaredWay(contact) >= least * least;
}

bool isValid(const ContactState& contact, double sampleRate) {
  const bool isNumber = std::isfinite(contact.time) && isPositive(contact.duration) &&
                        contact.normal.allFinite() && contact.position.allFinite() &&
                        contact.normalLoad >= 0.0 && std::isfinite(contact.normalLoad) &&
                        contact.radius >= 0.0 && contact.otherRadius >= 0.0 &&
                        contact.slipVelocity.allFinite() && contact.appliedImpulse.allFinite() &&
                        contact.bodyPosition.allFinite() && contact.otherPosition.allFinite() &&
                        contact.bodyVelocity.allFinite() && contact.otherVelocity.allFinite() &&
                        contact.bodyOrientation.coeffs().allFinite() &&
                        contact.otherOrientation.coeffs().allFinite() &&
                        contact.pathStart.allFinite() && contact.pathEnd.allFinite() &&
                        contact.otherPathStart.allFinite() && contact.otherPathEnd.allFinite();
  return isNumber && contact.duration <= kLongestStep &&
         std::abs(contact.time) * sampleRate < kExactSamples;
}

HertzContact hertzContact(const ContactState& contact, const SoundingBody& body,
                          const SoundingBody& other) {
  return {.load = contact.normalLoad,
          .radius = contactRadius(contact, body, other),
          .modulus = contactModulus(body.sound.material, other.sound.material)};
}

double loudestImpulse(std::span<const PulseNode> train) {
  double loudest = 0.0;
  double sum = 0.0;
  for (std::size_t index = 0; index < train.size(); ++index) {
    sum += std::abs(train[index].weight);
    if (index >= kAtOnce) sum -= std::abs(train[index - kAtOnce].weight);
    loudest = std::max(loudest, sum);
  }
  return loudest;
}

double SlideTracker::steepestImpulse(const ContactState& contact, double sampleRate) {
  if (contact.phase == ContactPhase::end || !isMoving(contact) || !isValid(contact, sampleRate))
    return 0.0;
  SoundingBody* const body = bodies_.find(contact.body);
  SoundingBody* const other = bodies_.find(contact.other);
  if (body == nullptr || other == nullptr) return 0.0;
  const auto pushed = [&contact](SoundingBody& scanned, const Vec3& from, const Vec3& to) {
    const SurfaceTexture* texture = scanned.texture();
    return texture == nullptr ? 0.0 : texture->steepest() * (to - from).norm() / contact.duration;
  };
  return 4.0 * massOf(contact, body->sound, other->sound) *
         (pushed(*body, contact.pathStart, contact.pathEnd) +
          pushed(*other, contact.otherPathStart, contact.otherPathEnd));
}

ContactDrive::Step SlideTracker::stepOf(const ContactState& contact, double sampleRate) const {
  SoundingBody& body = *bodies_.find(contact.body);
  SoundingBody& other = *bodies_.find(contact.other);
  const HertzContact hertz = hertzContact(contact, body, other);
  return {
      .duration = contact.duration,
      .load = contact.normalLoad,
      .mass = massOf(contact, body.sound, other.sound),
      .radius = hertz.radius,
      .modulus = hertz.modulus,
      .restitution =
          combinedRestitution(body.sound.material.restitution, other.sound.material.restitution),
      .work = workOf(contact),
      .sampleRate = sampleRate,
      .surfaces = {{{body.texture(), body.textureCoordinates(), contact.pathStart, contact.pathEnd,
                     contact.bodyOrientation.conjugate() * contact.normal, body.ballRadius()},
                    {other.texture(), other.textureCoordinates(), contact.otherPathStart,
                     contact.otherPathEnd, contact.otherOrientation.conjugate() * contact.normal,
                     other.ballRadius()}}}};
}

Slide& SlideTracker::advance(const ContactState& contact, double sampleRate) {
  Slide& slide = slides_[keyOf(contact)];
  advance(contact, stepOf(contact, sampleRate), slide, false);
  return slide;
}

void SlideTracker::advance(const ContactState& contact, const ContactDrive::Step& step,
                           Slide& slide, bool isFollowed) {
  if (isFollowed) {
    slide.drive.giveNodes(step, slide.nodes);
  } else {
    slide.drive.advance(step, slide.nodes);
    smooth(contact, slide);
  }
  if (!slide.sounds) fadeIn(slide.nodes, contact.duration);
  slide.sounds = !slide.nodes.empty();
}

bool SlideTracker::restsOn(const ContactState& contact) {
  if (contact.phase == ContactPhase::end || !isMoving(contact)) return false;
  const auto found = slides_.find(keyOf(contact));
  if (found == slides_.end()) return false;
  Slide::Rest& rest = found->second.rest;
  const bool goesOn =
      rest.steps > 0 && squaredWay(contact) <= rest.fastest && contact.normalLoad <= rest.heaviest;
  if (goesOn) --rest.steps;
  return goesOn;
}

Slide* SlideTracker::find(const ContactState& contact, double sampleRate) {
  const bool moves = contact.phase != ContactPhase::end && isMoving(contact);
  if (!moves || !isValid(contact, sampleRate)) {
    end(contact);
    return nullptr;
  }
  const SoundingBody* const body = bodies_.find(contact.body);
  const SoundingBody* const other = bodies_.find(contact.other);
  if (body == nullptr || other == nullptr) return nullptr;
  return massOf(contact, body->sound, other->sound) > 0.0 ? &slides_[keyOf(contact)] : nullptr;
}

bool SlideTracker::follow(const ContactState& contact, const ContactDrive::Step& step,
                          Slide& slide) {
  slide.nodes.clear();
  slide.sounds = false;
  const bool moves = slide.drive.follow(step);
  smooth(contact, slide);
  return moves;
}

void SlideTracker::forget(BodyId body) {
  std::erase_if(slides_, [body](const auto& entry) {
    return entry.first.first == body || entry.first.second == body;
  });
}

ImpulseEvent SlideTracker::unitImpulse(const ContactState& contact, bool first,
                                       const Vec3& offset) {
  const double pressed = contact.appliedImpulse.dot(contact.normal);
  Vec3 along = Vec3::Zero();
  if (pressed > 0.0) along = contact.appliedImpulse / pressed - contact.normal;
  if (along.norm() > kMostFriction) along *= kMostFriction / along.norm();
  const double sign = first ? 1.0 : -1.0;
  ImpulseEvent event;
  event.time = contact.time;
  event.body = first ? contact.body : contact.other;
  event.other = first ? contact.other : contact.body;
  event.normal = sign * contact.normal;
  event.impulse = sign * (contact.normal + along);
  event.bodyPosition = first ? contact.bodyPosition : contact.otherPosition;
  event.bodyOrientation = first ? contact.bodyOrientation : contact.otherOrientation;
  event.bodyVelocity = first ? contact.bodyVelocity : contact.otherVelocity;
  event.position = contact.position + event.bodyOrientation * offset;
  return event;
}

}  // namespace carom::audio
