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
/// queue between two threads, a clock, and outputs.
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
/// - a sound file: `record`. Rendered by `advanceTo`, without a limit on voices: bit for bit the
///   output of Synth, as are the others as long as nothing is late or left out.
///
/// Threads: one thread of the simulation calls everything but the functions that are said to be of
/// another. The two meet in one wait-free queue; `render` never allocates, locks, throws or asks
/// the system.
class EventSound {
 public:
  /// Refuses what Synth and Limiter refuse, and settings out of the ranges that SoundSettings
  /// gives; with SoundSettings::record or ::play, also what `record` or `play` refuses.
  static Result<EventSound> create(const SoundSettings& settings = {});
  EventSound(EventSound&&) noexcept;
  EventSound& operator=(EventSound&&) noexcept;
  /// Stops the device and finishes the file, whose errors are lost here: see `finishRecording`.
  ~EventSound();

  /// Says what a body radiates as, from now on. Refuses what Synth::setBody refuses.
  Status setBody(BodyId id, const SoundBody& body);
  /// Removes a body: its events are rejected from now on, but its present sound goes on.
  void removeBody(BodyId id);

  /// Sets where a listener is at the time of the latest `advanceTo`: call it once a frame. A
  /// listener that would have to move faster than 180 m/s jumps. Of several calls at the same time
  /// the last counts. Refuses: no such listener, not finite, farther than 1e12 m from the origin,
  /// an orientation not of unit length.
  Status setListener(const Vec3& position, const Quat& orientation = Quat::Identity(),
                     std::size_t listener = 0);

  /// Hands over one body's share of a collision; its time is that of the simulation's clock.
  void post(const ImpulseEvent& event);
  /// Hands over a lasting contact, over one step: it damps what rings in the bodies that it holds
  /// together (see Synth::updateContact).
  void updateContact(const ContactState& contact);
  /// Takes note that the simulation has come to `seconds`, and sends off what was posted. Beyond
  /// 1e9 nothing happens. The clock begins at 0: if it begins elsewhere, call this before the first
  /// `post`. A clock that goes back begins anew there, and is counted as a jump.
  void advanceTo(double seconds);
  double time() const;  ///< s, of the latest advanceTo

  /// Takes note that the simulation rests until the next `advanceTo`: the time that goes by
  /// meanwhile does not count as a stall.
  void pause();
  /// Takes note that the simulation runs at `scale` times real time, 0.001 to 1000: events are
  /// heard 1/scale times as far apart. Their own sound stays as it is. 1 unless set.
  Status setTimeScale(double scale);

  /// Opens the default audio device and plays, at the rate of the device, unless it plays already:
  /// if another device has become the default, call `stop` first. Refuses: a build without devices,
  /// no device, `prepareRendering` without `stop`.
  Status play();
  /// Prepares `render` at a sample rate (Hz), or anew at another one. Present sound stops, and a
  /// device is closed. Not while `render` runs on another thread. Refuses a rate that Synth
  /// refuses.
  Status prepareRendering(double sampleRate);
  /// Closes the device; `render` gives silence. Not while the host's `render` runs.
  void stop();

  /// Renders into a WAV file of float samples (see SoundFileWriter), at the rate of the settings,
  /// from the present time of the simulation; leaps of its clock by more than a minute, or back,
  /// are left out. A sample of 1.0 is SoundSettings::fullScale, or else kFullScalePressure. The
  /// file appears under its name when it is finished. Refuses: a build without sound files, a file
  /// that cannot be written, a recording under way.
  Status record(const std::filesystem::path& file);
  /// Renders what is still to sound, and completes the file. Returns errors from earlier writing,
  /// too: then there is no file. Without a recording it does nothing.
  Status finishRecording();

  /// Sets a factor on the output, 0 to 1000, changed within 20 ms. Not on recordings.
  void setGain(double gain) noexcept;
  void setMuted(bool muted) noexcept;

  SoundStatistics statistics() const;

  std::size_t channelCount() const;  ///< channels of all listeners together
  double sampleRate() const;         ///< Hz, of the samples that are pulled or played
  /// With SoundClock::simulation: frames that can be rendered now with nothing in them late.
  std::size_t framesReady() const;
  /// Frames by which a limiter delays the rendered samples; 0 without one.
  std::size_t outputDelay() const;
  /// Overwrites `frames` samples of each channel, in Pa or by SoundSettings::fullScale. Requires
  /// channels.size() == channelCount(). Silence before prepareRendering. [audio thread]
  void render(std::span<float* const> channels, std::size_t frames) noexcept;
  /// Renders interleaved samples: channelCount() of them for each of the frames. [audio thread]
  void renderInterleaved(float* samples, std::size_t frames) noexcept;

 private:
  class Impl;
  explicit EventSound(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
