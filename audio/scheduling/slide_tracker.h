#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "audio/contact/contact_drive.h"
#include "audio/model/hertz.h"
#include "audio/model/pulse.h"
#include "audio/scheduling/sounding_bodies.h"
#include "carom/audio/contact_state.h"
#include "carom/audio/impulse_event.h"

namespace carom::audio {

/// Returns the square (m^2) of the contact point's way over the surface on which that is longer.
/// [any thread]
double squaredWay(const ContactState& contact);
/// True if the contact point moves over a surface fast enough to sound. [any thread]
bool isMoving(const ContactState& contact);

/// True if all numbers of the contact are finite, its step is not too long and its time is on the
/// clock.
bool isValid(const ContactState& contact, double sampleRate);

/// Returns the two bodies of a contact as Hertz's theory sees them. Edges are blunt, and flat faces
/// touch where they are not flat, as in an impact; so does an edge on a face, as stepped mechanics
/// reports the same face now as lying flat and now as standing on its edge. [any thread]
HertzContact hertzContact(const ContactState& contact, const SoundingBody& body,
                          const SoundingBody& other);

/// Returns about the largest impulse (N s) of a train that comes at once, as there is one node to a
/// sample or less. [any thread]
double loudestImpulse(std::span<const PulseNode> train);

/// The state of two bodies that slide or roll on each other.
struct Slide {
  ContactDrive drive;
  std::vector<PulseNode> nodes;  ///< nodes of the current step
  bool sounds = false;           ///< the previous step had nodes
  bool isHeard = false;          ///< HeardSlides has decided about an earlier step
  double voice = 0.0;            ///< 1, share of a voice of its own at the end of the step, 0 to 1
  /// A contact that was too quiet is not looked at again for a while, unless it becomes faster or
  /// presses harder.
  struct Rest {
    int steps = 0;
    double fastest = 0.0;   ///< m^2, as squaredWay
    double heaviest = 0.0;  ///< N
  } rest;
  /// The latest state of the contact on one of the bodies.
  struct Side {
    bool isKnown = false;
    Vec3 end = Vec3::Zero();  ///< m, body frame: where the contact point's path ended
    /// m, body frame: from the contact point to the point that is used in its place
    Vec3 offset = Vec3::Zero();
    std::optional<Vec3> dipole;  ///< Strike::dipole
  };
  std::array<Side, 2> sides;
};

/// Follows pairs of bodies that slide or roll on each other from step to step: which impulses the
/// bumps give, and on which points of the bodies. [one thread]
class SlideTracker {
 public:
  /// The bodies must outlive it.
  explicit SlideTracker(SoundingBodies& bodies) : bodies_(bodies) {}

  /// Upper bound (N s) of the impulse that comes at once in the step: to twice the speed at which
  /// the steepest bumps push, and back. 0 unless the contact slides: its numbers are finite, its
  /// bodies known and not both smooth, and its step is no longer than a second.
  double steepestImpulse(const ContactState& contact, double sampleRate);
  /// Computes the nodes of a step of a contact whose steepestImpulse is above 0. `sampleRate` (Hz)
  /// is that of the samples in a second of the mechanics.
  Slide& advance(const ContactState& contact, double sampleRate);
  /// True if the slide of a pair whose contact moves goes on resting (Slide::Rest), which it then
  /// does for one step less.
  bool restsOn(const ContactState& contact);
  /// Returns the slide of a pair whose contact moves, and whose numbers are finite; nullptr, and
  /// the slide has ended, if it does not, or a body is not known.
  Slide* find(const ContactState& contact, double sampleRate);
  /// Returns a step of a slide as its drive takes it.
  ContactDrive::Step stepOf(const ContactState& contact, double sampleRate) const;
  /// Follows a step of a slide without computing its nodes; false if nothing moves.
  static bool follow(const ContactState& contact, const ContactDrive::Step& step, Slide& slide);
  /// Computes the nodes of a step; of one that was followed already if `isFollowed`.
  static void advance(const ContactState& contact, const ContactDrive::Step& step, Slide& slide,
                      bool isFollowed);

  bool isSliding(const ContactState& contact) const { return slides_.contains(keyOf(contact)); }
  /// Ends the slide of a pair: if it slides later, that is a new slide.
  void end(const ContactState& contact) {
    if (!slides_.empty()) slides_.erase(keyOf(contact));
  }
  void forget(BodyId body);

  /// Returns the event of an impulse of 1 N s along the normal on the contact's first body, or the
  /// other one, with the friction that goes with it, at `offset` (m, body frame) from the reported
  /// contact point.
  static ImpulseEvent unitImpulse(const ContactState& contact, bool first, const Vec3& offset);

 private:
  using Pair = std::pair<BodyId, BodyId>;
  struct PairHash {
    std::size_t operator()(const Pair& pair) const {
      return static_cast<std::size_t>((pair.first * 0x9E3779B97F4A7C15U) ^
                                      (pair.second * 0xBF58476D1CE4E5B9U));
    }
  };
  static Pair keyOf(const ContactState& contact) { return {contact.body, contact.other}; }

  SoundingBodies& bodies_;
  std::unordered_map<Pair, Slide, PairHash> slides_;
};

}  // namespace carom::audio
