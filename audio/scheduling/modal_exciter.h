#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "audio/contact/coupled_contact.h"
#include "audio/model/pulse_spectrum.h"
#include "audio/model/surface_locator.h"
#include "audio/propagation/sound_paths.h"
#include "audio/synthesis/click.h"
#include "audio/synthesis/modal_excitation.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/sound_body.h"

namespace carom::audio {

/// The route from a ringing body to one receiver.
struct ModalRoute {
  Vec3 toReceiver = Vec3::Zero();  ///< m, world frame, from the centre of mass; mirrored back for
                                   ///< an image, so that it leaves the body where the sound does
  double gain = 1.0;               ///< 1, gain of the receiver in that direction
  const HrtfSet* head = nullptr;   ///< responses, if the receiver is an ear
  SphereWeights ears;
  Ear ear = Ear::left;
  std::uint32_t chain = 0;  ///< index into SoundPaths::chains, the wall filters
  bool isFollowed = false;  ///< in its motion: ModalExcitation::isFollowed and what follows there
  std::uint32_t path = 0;
  double rate = 1.0;
};

/// Turns events into modal excitations: decides which modes a contact excites, and how they are
/// heard.
///
/// An impulse j at the point y gives mode i the velocity phi_i(y) . j; y is the nearest point of
/// the model's surface, phi_i there the mean of its triangle's corners. The pulse of the contact,
/// which drives the resonators, shapes their gains. The path from the mode to the ear (radiation,
/// walls, an ear's response) is evaluated at the mode's own frequency, as one complex factor; so it
/// is exact for modes that ring long, and blurs the first period. Motion after the contact changes
/// how the ring is heard, where it is followed (RingTracks).
///
/// A lasting contact damps the modes of both bodies. It is modelled as a spring between them, of
/// Hertz's stiffness at its load, that loses energy by a loss factor eta: a dashpot of eta k / w at
/// the contact, which adds eta k (phi . n)^2 / (2 w) to the decay rate of a mode (first order of
/// perturbation; Rayleigh, Theory of Sound, section 102). Not modelled: that the spring raises
/// frequencies, and that two bodies exchange their vibration.
///
/// [one thread]
class ModalExciter {
 public:
  explicit ModalExciter(std::shared_ptr<const SoundPaths> paths);

  /// A body's model at the sample rate of the paths, and the surface where it can be hit. Lives as
  /// long as the ModalExciter.
  struct Source {
    explicit Source(const ResonatorSet& modes);
    const ResonatorSet* resonators;
    SurfaceLocator locator;
    double radius = 0.0;  ///< m, about the centre of mass, of a sphere that holds the model
    /// Responses of the walls of each chain at the modes' frequencies, chain by chain.
    std::vector<std::complex<double>> walls;
    std::vector<double> air;  ///< 1/m, of the modes' pressure; empty where the air absorbs nothing
    /// Pa s^2 / (m sqrt(kg)): transfers in the mean over directions at 1 m, against which those of
    /// a ring in motion count; 1 for modes that do not radiate.
    std::vector<double> means;
  };
  /// Returns the source of a model, which validate must accept.
  const Source& sourceOf(const std::shared_ptr<const ModalModel>& model);

  bool knows(const ModalModel& model) const { return sources_.contains(&model); }

  /// Adds the modes of a body as a push (unit, world frame) at the event's contact meets them.
  struct Push {
    Vec3 point = Vec3::Zero();            ///< m, world frame
    Vec3 direction = Vec3::UnitX();       ///< unit, world frame, onto the body
    Vec3 position = Vec3::Zero();         ///< m, world frame: the body's origin
    Quat orientation = Quat::Identity();  ///< body to world
  };
  static void addModes(const Push& push, const SoundBody& body, const Source& source,
                       std::vector<ContactMode>& modes);

  /// Begins the excitations of an event; those of the event before are dropped. Returns false if it
  /// excites nothing.
  bool strike(const ImpulseEvent& event, const SoundBody& body, const Source& source);
  /// m, world frame: the centre of mass of the body that has been struck.
  const Vec3& position() const { return position_; }
  double radius() const { return source_->radius; }
  /// Adds the excitation with this drive over a route.
  void excite(const Click& drive, const ModalRoute& route);
  /// Adds the excitation with this drive into the reverberation: the mean over all directions, at 1
  /// m. All excitations of a blow are followed in their motion, or none.
  void exciteReverb(const Click& drive, bool isFollowed);

  /// How a ring's motion over a stretch of time changes what is heard at a receiver.
  struct Motion {
    BodyId body = 0;
    std::int64_t first = 0;    ///< sample at which it begins
    std::uint32_t length = 0;  ///< samples
    std::uint32_t channel = 0;
    std::uint32_t path = 0;  ///< ModalExcitation::path
    double rate = 1.0;       ///< seconds of the body in a second of the receiver
  };
  /// A route, and how the body is turned when the sound leaves it.
  struct View {
    ModalRoute route;
    Quat orientation = Quat::Identity();
  };
  /// Makes a motion the only excitation. It ends with this view; with several, which sound in one
  /// bank, with the root of the sum of their squares.
  void move(const Motion& motion, std::span<const View> views, const Source& source);
  /// s: time in which the excitations so far fall to where ModalBank ends them.
  double longestRing() const;
  /// s: time in which they would at the loudest of where they are heard, and 1 m away.
  double longestRingAnywhere();

  /// A lasting contact, as it damps one of its bodies.
  struct DampingContact {
    BodyId body = 0;
    BodyId other = 0;
    Vec3 point = Vec3::Zero();                              ///< m, model frame
    double stiffness = 0.0;                                 ///< N/m; 0: the contact has ended
    double mass = std::numeric_limits<double>::infinity();  ///< kg, of the other body
    Vec3 place = Vec3::Zero();                              ///< m, world frame
  };
  /// Makes the change of damping that follows the only excitation, from `first` (sample of the
  /// clock) on, but behind the body's last change, which may have come a longer way. Returns false
  /// if there is no change that counts.
  bool updateContact(const DampingContact& contact, const Source& source, std::int64_t first);
  /// A body that a contact has damped, and where (m, world frame) that was.
  struct Damped {
    BodyId body = 0;
    Vec3 place = Vec3::Zero();
  };
  /// Forgets the contacts of a body. Returns the bodies that they have damped, as they still are
  /// until `undamp`.
  std::vector<Damped> forgetContacts(BodyId body);
  /// Forgets all contacts, for sound that begins anew.
  void forgetContacts() {
    dampers_.clear();
    lastChanges_.clear();
  }
  /// Forgets when a body that is gone was damped.
  void forgetChanges(BodyId body) { lastChanges_.erase(body); }
  /// Makes the damping of a body by the contacts that it has now, from `first` on, the only
  /// excitation.
  void undamp(BodyId body, const ResonatorSet& set, std::int64_t first);
  /// Returns the decay rates (1/s) that all lasting contacts of a body add to those of its modes,
  /// one per mode of the set, as of the last change.
  std::span<const double> addedDamping(BodyId body, const ResonatorSet& set);

  /// Upper bound in Pa of the excitations so far, for a contact of that pulse and duration (s).
  double peak(const Pulse& pulse, double duration);
  /// Upper bound in Pa of the excitations so far, for a train of impulses (N s): as if all of them
  /// came at a mode's crests.
  double peak(std::span<const PulseNode> train) const;
  /// The force of a blow over time: a pulse that lasts for a time (s), or nodes over a duration
  /// (s).
  struct Force {
    const Pulse& pulse;
    double touch = 0.0;
    std::span<const PulseNode> nodes;  ///< in place of the pulse, if there are any
    double duration = 0.0;
  };
  /// Estimate in Pa of the loudest moment of the excitations so far: the modes, as the force drives
  /// them, add up in power, as their phases are anything at a listener.
  double loudness(const Force& force);
  std::span<const ModalExcitation> excitations() const { return excitations_; }
  std::span<const double> taps() const { return taps_; }

 private:
  /// A mode's resonator.
  struct Tuning {
    std::complex<double> step;  // what its oscillation is multiplied by in a sample
    double a1 = 0.0;
    std::complex<double> dimming;  // as ResonatorSet::dimming
  };
  Tuning tuningOf(std::size_t mode, double rate) const;
  void findTransfers(const ModalRoute& route, const Source& source, const Quat& orientation);
  void boundRing(std::size_t mode, double transfer);
  void putFactors(const Source& source, std::span<double> taps) const;
  void addExcitation(const Click& drive, const ModalRoute& route);
  void addResidual(RestTaps<double>& rest);
  void addDamping(BodyId body, const ResonatorSet& set, std::int64_t first);

  std::shared_ptr<const SoundPaths> paths_;
  std::vector<std::unique_ptr<ResonatorSet>> sets_;
  std::unordered_map<const ModalModel*, std::unique_ptr<Source>> sources_;
  std::unordered_map<const Pulse*, PulseSpectrum> spectra_;
  /// The decay rates that a contact adds to a body; kept by the body and the one in contact with
  /// it.
  struct Damper {
    const ResonatorSet* modes = nullptr;  // of which `rates` are
    double stiffness = 0.0;
    Vec3 point = Vec3::Zero();
    Vec3 place = Vec3::Zero();
    std::vector<double> rates;  // 1/s, one for each mode
  };
  std::map<std::pair<BodyId, BodyId>, Damper> dampers_;
  std::unordered_map<BodyId, std::int64_t> lastChanges_;  // sample of each body's last damping
  std::vector<double> added_;                             // 1/s, by mode: addedDamping
  std::vector<double> response_;                          // response of an ear

  // The state of the current event.
  BodyId body_ = 0;
  const Source* source_ = nullptr;
  Vec3 position_ = Vec3::Zero();
  Quat orientation_ = Quat::Identity();
  std::vector<double> excitation_;  // N s / sqrt(kg), one for each mode
  double residual_ = 0.0;           // m^3 s: the residual volume times the impulse
  /// 1/m: by how much the current excitation hears a source without direction, walls, air and ears
  /// as at the highest mode's frequency.
  double hears_ = 1.0;
  double loudestRest_ = 0.0;  // Pa, for the whole impulse within a sample, over all excitations
  std::vector<std::complex<double>> amplitudes_;        // Pa, of the current excitation
  std::vector<double> loudest_;                         // Pa, of each mode over all excitations
  std::vector<double> powers_;                          // Pa^2, by mode, of the views so far
  std::vector<std::pair<double, std::size_t>> driven_;  // Pa, bound, and mode, loudest first
  std::vector<ModalExcitation> excitations_;
  std::vector<double> taps_;
};

}  // namespace carom::audio
