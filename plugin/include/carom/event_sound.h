#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include <carom/audio/contact_state.h>
#include <carom/audio/impulse_event.h>
#include <carom/audio/listener.h>
#include <carom/audio/result.h>
#include <carom/audio/sound_body.h>
#include <carom/sound_settings.h>

namespace carom {

/// The sound of events from any physics engine, in real time or into a file: the sound layer, a
/// queue between two threads, a clock, and what comes out.
///
///     auto sound = carom::EventSound::create();
///     sound->setBody(0, body);                       // once
///     sound->play();                                 // or prepareRendering, or record
///     ...
///     sound->post(event);                            // while a step is worked on
///     sound->advanceTo(time);                        // at its end
///
/// Outputs, any of them, all fed by the same events:
/// - a device: `play`. A thread of the audio library pulls.
/// - the host's own callback: `prepareRendering`, then `render`.
/// - a sound file: `record`. Rendered by `advanceTo`, without a limit on voices: bit for bit what
///   Synth gives, as is the rest as long as nothing is late or left out.
///
/// Threads: one thread of the simulation calls everything but what is said to be of another. The
/// two meet in one wait-free queue; `render` never allocates, locks, throws or asks the system.
class EventSound {
 public:
  /// Refuses what Synth and Limiter refuse, and settings out of the ranges that SoundSettings
  /// gives. With SoundSettings::record or ::play, what those refuse.
  static Result<EventSound> create(const SoundSettings& settings = {});
  EventSound(EventSound&&) noexcept;
  EventSound& operator=(EventSound&&) noexcept;
  /// Stops the device and finishes the file, whose errors are lost here: see `finishRecording`.
  ~EventSound();

  /// Says what a body radiates as, from now on. Refuses what Synth::setBody refuses.
  Status setBody(BodyId id, const SoundBody& body);
  /// What it sounds now goes on; its events are rejected from now on.
  void removeBody(BodyId id);

  /// Where a listener is, at the time that `advanceTo` told last: call it once a frame. From one
  /// place to one that nobody reaches at 180 m/s it jumps. Of several calls at the same time the
  /// last counts. Refuses: no such listener, not finite, farther than 1e12 m from the origin, an
  /// orientation not of unit length.
  Status setListener(const Vec3& position, const Quat& orientation = Quat::Identity(),
                     std::size_t listener = 0);

  /// Hands over one body's share of a collision; its time is that of the simulation's clock.
  void post(const ImpulseEvent& event);
  /// Hands over a lasting contact, over one step: it damps what rings in the bodies that it holds
  /// together (see Synth::touch).
  void touch(const ContactState& contact);
  /// The simulation has come to `seconds`, at most 1e9, or nothing happens; what was posted is on
  /// its way. The clock begins at 0: one that begins elsewhere is told so before the first `post`.
  /// One that goes back begins anew there, and is counted as a jump.
  void advanceTo(double seconds);
  double time() const;  ///< s, of the latest advanceTo

  /// The simulation rests, or goes on: that time goes by meanwhile is no fault.
  void pause();
  /// The simulation runs at `scale` times real time, above 0: events are heard 1/scale times as far
  /// apart. Their own sound stays as it is. 1 unless set.
  Status setTimeScale(double scale);

  /// Opens the default audio device and plays, at the rate of the device, unless it plays already:
  /// `stop` first for what has become the default device since. Refuses: a build without devices,
  /// no device, `prepareRendering` without `stop`.
  Status play();
  /// Gets ready for `render` at a sample rate (Hz); again for another one. What was sounding stops,
  /// and a device is closed.
  /// Not while `render` runs on another thread. Refuses a rate that Synth refuses.
  Status prepareRendering(double sampleRate);
  /// Closes the device; `render` gives silence. Not while the host's `render` runs.
  void stop();

  /// Renders into a WAV file of float samples (see SoundFileWriter), at the rate of the settings,
  /// from the present time of the simulation; leaps of its clock by more than a minute, or back,
  /// are left out. A sample of 1.0 is SoundSettings::fullScale, or else kFullScalePressure. The
  /// file appears under its name when it is finished. Refuses: a build without sound files, a file
  /// that cannot be written, a recording under way.
  Status record(const std::filesystem::path& file);
  /// Renders what is still to sound, and completes the file. What went wrong while it was written,
  /// too: then there is no file. Without a recording it does nothing.
  Status finishRecording();

  /// Factor on what comes out, 0 to 1000, changed within 20 ms. Not on recordings.
  void setGain(double gain) noexcept;
  void setMuted(bool muted) noexcept;

  SoundStatistics statistics() const;

  std::size_t channelCount() const;  ///< of all listeners together
  double sampleRate() const;         ///< Hz, of what is pulled or played
  /// With SoundClock::simulation: samples that can be rendered now, so that nothing in them is
  /// late.
  std::size_t framesReady() const;
  /// Frames by which a limiter delays what is rendered; 0 without.
  std::size_t outputDelay() const;
  /// Overwrites `frames` samples of each channel, in Pa or by SoundSettings::fullScale. Requires
  /// channels.size() == channelCount(). Silence before prepareRendering. [audio thread]
  void render(std::span<float* const> channels, std::size_t frames) noexcept;
  /// The same, interleaved: channelCount() samples for each of the frames. [audio thread]
  void renderInterleaved(float* samples, std::size_t frames) noexcept;

 private:
  class Impl;
  explicit EventSound(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
