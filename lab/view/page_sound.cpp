#include "lab/view/page_sound.h"

#include <cmath>
#include <complex>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "lab/view/rounding.h"

#include "audio/scheduling/slide_tracker.h"

namespace carom::lab {

using namespace audio;

namespace {

// Poses, which tell where and how turned a body rings: to 4e-9 m, 2e-7 rad. Multipoles to 26
// digits, within -156 dB.
constexpr int kPosePlace = -28;
constexpr int kPoseDirection = -22;
constexpr int kMultipoleDigits = 26;

/// Returns a number as a multiple of so small a power of two.
double onGrid(double number, int power) {
  return std::isfinite(number) ? std::ldexp(std::nearbyint(std::ldexp(number, -power)), power)
                               : number;
}
template <class Numbers>
void putOnGrid(Numbers& numbers, int power) {
  for (double& number : numbers)
    number = onGrid(number, power);
}

// Powers of two of what a step of a contact tells: the way of a contact point over a body to 30 nm,
// half of the last digit that Bullet's own floats have at 1 m, as the sound is in its differences;
// so too the point itself, as the way from there tells the sample from which on it damps a ring;
// other places to 8 um, directions to 4e-6. What damps rings so stays 120 dB below them.
constexpr int kContactPath = -25;
constexpr int kContactBody = -17;
constexpr int kContactDirection = -18;
// Digits: of loads, which damp modes (-156 dB), of impulses, of which the direction counts, and of
// velocities, which tell how much energy friction takes.
constexpr int kLoadDigits = 26;
constexpr int kContactImpulseDigits = 12;
constexpr int kContactSpeedDigits = 8;

/// Rounds what a step of a contact tells, so that many steps do not make most of a page. The bumps
/// bounce on one another, so that the contact sounds as loud as before but has not its samples, as
/// a page's engine has not them anyway (docs/view.md). How it rolls, no sound asks.
void roundMoving(ContactState& contact) {
  for (Vec3* const place :
       {&contact.pathStart, &contact.pathEnd, &contact.otherPathStart, &contact.otherPathEnd})
    putOnGrid(*place, kContactPath);
  putOnGrid(contact.position, kContactPath);
  putOnGrid(contact.bodyPosition, kContactBody);
  putOnGrid(contact.otherPosition, kContactBody);
  putOnGrid(contact.normal, kContactDirection);
  putOnGrid(contact.bodyOrientation.coeffs(), kContactDirection);
  putOnGrid(contact.otherOrientation.coeffs(), kContactDirection);
  roundVector(contact.appliedImpulse, kContactImpulseDigits);
  for (Vec3* const speed : {&contact.slipVelocity, &contact.bodyVelocity, &contact.otherVelocity})
    roundVector(*speed, kContactSpeedDigits);
  contact.rollingVelocity.setZero();
}

/// Leaves of a contact that is too slow to sound how hard it presses, and where on the bodies and
/// in the world: it only damps modes. The rest repeats the step before, which packs to nothing.
void roundResting(ContactState& contact, const ContactState& before) {
  ContactState resting = before;
  resting.time = contact.time;
  resting.duration = contact.duration;
  resting.phase = contact.phase;
  resting.body = contact.body;
  resting.other = contact.other;
  resting.normalLoad = contact.normalLoad;
  resting.radius = contact.radius;
  resting.otherRadius = contact.otherRadius;
  resting.position = contact.position;
  putOnGrid(resting.position, kContactPath);
  resting.pathStart = contact.pathStart;
  resting.otherPathStart = contact.otherPathStart;
  putOnGrid(resting.pathStart, kContactPath);
  putOnGrid(resting.otherPathStart, kContactPath);
  resting.pathEnd = resting.pathStart;
  resting.otherPathEnd = resting.otherPathStart;
  contact = resting;
}

/// The latest steps of contacts that were rounded, by their bodies.
using LatestContacts = std::map<std::pair<BodyId, BodyId>, ContactState>;

void round(std::vector<ContactState>& contacts, LatestContacts& latest) {
  for (ContactState& contact : contacts) {
    contact.normalLoad = rounded(contact.normalLoad, kLoadDigits);
    ContactState& before = latest[{contact.body, contact.other}];
    if (isMoving(contact))
      roundMoving(contact);
    else
      roundResting(contact, before);
    before = contact;
  }
}

/// Rounds how a model radiates.
std::shared_ptr<const ModalModel> roundedModel(const ModalModel& model) {
  ModalModel fewer = model;
  for (Mode& mode : fewer.modes)
    for (std::complex<double>& multipole : mode.radiation.multipoles)
      multipole = {rounded(multipole.real(), kMultipoleDigits),
                   rounded(multipole.imag(), kMultipoleDigits)};
  return std::make_shared<const ModalModel>(std::move(fewer));
}

/// Rounds the models of bodies; what is shared stays so.
void roundModels(std::vector<PlayableRun::Bodies>& all) {
  std::map<std::shared_ptr<const ModalModel>, std::shared_ptr<const ModalModel>> known;
  for (PlayableRun::Bodies& bodies : all)
    for (HostBody& body : bodies.bodies) {
      if (body.sound.modal == nullptr) continue;
      std::shared_ptr<const ModalModel>& fewer = known[body.sound.modal];
      if (fewer == nullptr) fewer = roundedModel(*body.sound.modal);
      body.sound.modal = fewer;
    }
}

}  // namespace

PlayableRun pageSound(PlayableRun run) {
  LatestContacts latest;
  for (RunPortion& portion : run.portions) {
    for (BodyPose& pose : portion.poses) {
      putOnGrid(pose.pose.position, kPosePlace);
      putOnGrid(pose.pose.orientation.coeffs(), kPoseDirection);
    }
    round(portion.contacts, latest);
  }
  roundModels(run.bodies);
  return run;
}

}  // namespace carom::lab
