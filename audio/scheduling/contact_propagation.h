#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "audio/model/acceleration_noise.h"
#include "audio/model/pulse.h"
#include "audio/propagation/listener_tracks.h"
#include "audio/propagation/sound_paths.h"
#include "audio/radiation/radiation_bank.h"
#include "audio/radiation/recoil_filters.h"
#include "audio/scheduling/modal_exciter.h"
#include "audio/scheduling/sample_time.h"
#include "audio/synthesis/scheduled_sound.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// One contact of one body as a source of sound: what the clicks and excitations of all receivers
/// share.
struct ContactSource {
  double time = 0.0;             ///< s, at which it begins
  double duration = 0.0;         ///< s, on the clock of the samples
  const Pulse* pulse = nullptr;  ///< course of the force
  Strike strike = {};
  Vec3 dipoleBefore = Vec3::Zero();  ///< dipole at the begin; strike.dipole is that at the end
  /// m, subtracted from the distance: sound starts at the surface, and the filter delays it
  double ahead = 0.0;
  const RadiationBank::Mix* filters = nullptr;  ///< null: no click
  /// The recoil by which listeners hear the click, in place of `filters`; null: none.
  const RecoilFilters* recoil = nullptr;
  ImpactMotion motion = {};             ///< that the recoil answers to, body frame
  Quat orientation = Quat::Identity();  ///< of the body, to the world frame
  SampleShift shift = {};
  bool rings = false;       ///< the ModalExciter holds the strike's excitation
  bool isFollowed = false;  ///< its ring, in the motion of body and listeners
  double ringShare = 1.0;   ///< of the impulse that the event has: what makes modes ring
  std::span<const PulseNode> train = {};  ///< nodes in place of the pulse
  /// N s, sum of the nodes that come at about the same time; 0 if the pulse bounds their loudness.
  double loudest = 0.0;
  double touch = 0.0;  ///< s, duration of the pulse that bounds the loudness; 0: `duration`
};

/// Carries a contact's sound along all propagation paths to all channels, and puts it on their
/// samples as clicks and modal excitations: delays, gains, directions, visibility of images, and
/// upper bounds of the loudness. [one thread]
class ContactPropagation {
 public:
  /// The tracks and the exciter must outlive it.
  ContactPropagation(std::shared_ptr<const SoundPaths> paths, const ListenerTracks& tracks,
                     ModalExciter& exciter);

  /// Computes the clicks and excitations of a contact, in place of those of the contact before.
  /// Returns false if its numbers are so large that a click cannot be put on the clock.
  bool propagate(const ContactSource& source);
  /// Where `propagate` has returned false: the counter of the reason.
  std::uint64_t SynthCounters::*refusal() const { return refusal_; }
  /// Upper bound of the clicks at any listener, Pa.
  double clickPeak() const { return clickPeak_; }
  /// The loudest that the contact gets at any listener, heard or not, Pa: the upper bound of the
  /// clicks or the estimate of what they excite.
  double peak() const { return std::max(clickPeak_, modalPeak_); }
  /// The clicks and excitations, each only if they can be heard. Valid until the next `propagate`.
  ScheduledSound sound() const;

 private:
  /// The propagation path of a contact's sound to one receiver, at its begin, middle and end.
  struct PropagationPath {
    std::array<double, 3> delays{};  // s
    std::array<double, 3> gains{};   // Pa s^2, per slope of a force of integral 1; 1/m for a recoil
    double distance = 0.0;           // m, in the middle, not below the body's radius
    double stretch = 1.0;            // time stretch by the receiver's own motion, in the middle
    SphereWeights ears;              // direction from which a binaural channel hears it
    Vec3 towardsSource = Vec3::Zero();  // unit, world frame, at the begin
    double receiverGain = 1.0;          // at the begin
  };
  /// The path and the channel of a click or excitation.
  struct Route {
    std::uint32_t chain = 0;
    std::uint32_t channel = 0;
    const Image* image = nullptr;
    std::uint32_t path = 0;  // index into SoundPaths::paths
  };

  bool propagateTo(const ContactSource& source, const Route& route);
  bool propagateToReverb(const ContactSource& source);
  void estimateRing(const ContactSource& source);
  bool findPath(const ContactSource& source, const Route& route, PropagationPath& path) const;
  void hear(const ContactSource& source, const Route& route, const Arrival& arrival,
            std::size_t part, PropagationPath& path) const;
  void keepAsAtBegin(const ContactSource& source, const Route& route, std::size_t part,
                     PropagationPath& path) const;
  bool fitsOnClock(const ContactSource& source, const PropagationPath& path);
  Click onSamples(const ContactSource& source, const PropagationPath& path) const;
  void chooseRule(Click& click) const;
  std::uint16_t airOf(const PropagationPath& path) const;
  Click throughAir(const ContactSource& source, PropagationPath path) const;
  void addRecoil(const ContactSource& source, const PropagationPath& path, const Route& route);
  void addClick(const ContactSource& source, const PropagationPath& path, const Route& route);
  void addExcitation(const ContactSource& source, const PropagationPath& path, const Route& route);
  Click modalDrive(const ContactSource& source, PropagationPath path, const Route& route) const;
  double boundOf(const ContactSource& source, const PropagationPath& path) const;
  double tailOverClick(const ContactSource& source) const;

  std::shared_ptr<const SoundPaths> paths_;
  const SynthSettings& settings_;  // settings of paths_
  const ListenerTracks& tracks_;
  ModalExciter& exciter_;
  std::vector<Click> clicks_;        // of the current contact
  std::vector<SphereWeights> ears_;  // directions of clicks_, if there is a head
  RecoilFilters::Motion recoil_;     // of the current contact
  std::vector<double> peaks_;        // Pa, upper bounds of clicks_ by channel
  double clickPeak_ = 0.0;           // Pa, upper bound of clicks_
  double modalPeak_ = 0.0;   // Pa, estimate of what the excitations sound like at their loudest
  double modalBound_ = 0.0;  // Pa, upper bound of it for a contact of rigid bodies
  std::uint64_t SynthCounters::*refusal_ = nullptr;
};

}  // namespace carom::audio
