#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include <carom/audio/result.h>
#include <carom/audio/vector.h>
#include <carom/sound_settings.h>

namespace carom {

namespace plugin {
struct SoundSession;
}

/// The outputs of a sound, its listeners, its clock and its statistics: the part that `Sound` (over
/// a Bullet world) and `EventSound` (over events of any engine) have in common.
///
///     sound->play();                              // or prepareRendering and render, or record
///     sound->setListener(position, orientation);  // once a frame, if it moves
///     sound->close();                             // at the end
///
/// Outputs, any of them, all fed by the same events:
/// - a device: `play`. A thread of the audio library pulls.
/// - the host's own callback: `prepareRendering`, then `render`.
/// - a sound file: `record`. Rendered as the simulation goes on, without a limit on voices: bit for
///   bit the output of Synth, as are the others as long as nothing is late or left out.
/// - memory: `capture`, then `takeCaptured` after each step. Rendered as a recording is.
/// - a file of what happens, to be heard later: `recordRun`, or `keepRun` and `saveRun`.
///
/// Refusals are also told, once for each sentence: on standard error, or to
/// SoundSettings::onMessage. An object that was moved from refuses everything, and is silent.
///
/// Threads: one thread of the simulation calls everything but the functions that are said to be of
/// another. The two meet in one wait-free queue; `render` never allocates, locks, throws or asks
/// the system.
class SoundOutput {
 public:
  /// Ends the sound: detaches it from its world if it has one, closes the device, finishes the
  /// recording and the run. Afterwards all other functions do nothing, and those that can refuse
  /// do. Returns the errors of finishRecording and finishRun, which are only told where the
  /// destructor closes.
  ///
  /// A sound may be closed, or destroyed, in any callback of its world and in its own
  /// (Sound::onCollision). It may be closed, but not destroyed, while `render` runs on another
  /// thread: that one is waited for, and later ones give silence. A recording that nobody has
  /// closed when the process exits, on the thread that began it, is finished then.
  Status close();

  /// Sets where a listener is at the present time of the simulation: call it once a frame. A
  /// listener that would have to move faster than 180 m/s jumps. Of several calls at the same time
  /// the last counts. Refuses: no such listener, not finite, farther than 1e12 m from the origin,
  /// an orientation not of unit length.
  Status setListener(const Vec3& position, const Quat& orientation = Quat::Identity(),
                     std::size_t listener = 0);

  /// Time of the simulation in s: of the latest EventSound::advanceTo, or the sum of all substeps
  /// since Sound::attach.
  double time() const;
  /// Takes note that the simulation rests until its next step: the time that goes by meanwhile does
  /// not count as a stall.
  void pause();
  /// Takes note that the simulation runs at `scale` times real time, 0.001 to 1000: events are
  /// heard 1/scale times as far apart. Their own sound stays as it is. 1 unless set.
  Status setTimeScale(double scale);

  /// Opens the default audio device and plays, at the rate of the device and the level of
  /// SoundSettings::level, unless it plays already:
  /// if another device has become the default, call `stop` first. Refuses: a build without devices,
  /// no device, `prepareRendering` without `stop`.
  Status play();
  /// True while a device plays.
  bool isPlaying() const;
  /// Prepares `render` at a sample rate (Hz), or anew at another one. Present sound stops, and a
  /// device is closed; `render` may run on another thread. Refuses a rate that Synth refuses.
  Status prepareRendering(double sampleRate);
  /// Closes the device; `render`, which may run on another thread, gives silence.
  void stop();

  /// Renders into a WAV file of float samples (see SoundFileWriter), at the rate of the settings,
  /// from the present time of the simulation; leaps of its clock by more than a minute, or back,
  /// are left out, with the sounds of before and after. See SoundSettings::level for what a sample
  /// of 1.0 is; the file's comment says. Beyond 4 GiB the file is RF64.
  ///
  /// The file appears under its name when it is finished. Until then the sound is in
  /// `NAME.wav.<hex>.partial.wav`, which can be played at any moment. A full disk or another error
  /// of writing ends the recording, and is told at once (SoundStatistics::recordingError); what was
  /// recorded is kept under the name, if no file has it, or as `NAME.incomplete.wav` beside it. So
  /// is what a killed program leaves, by the next recording of the same name, which tells of it.
  ///
  /// Refuses: a build without sound files, a name that does not end in .wav, a file that cannot be
  /// written, a recording under way.
  Status record(const std::filesystem::path& file);
  /// Renders what is still to sound, and completes the file. Returns errors from earlier writing,
  /// too, with where the sound up to there is. Without a recording it does nothing.
  Status finishRecording();

  /// Renders into memory, from the present time of the simulation on, at the rate of the settings:
  /// the samples of `record`, but in Pa, and SoundSettings::latency later. When t seconds of the
  /// simulation have gone by there have been t times the sample rate frames, to the frame, whatever
  /// the steps, beginning with the latency's silence. Leaps of the clock by more than a minute, or
  /// back, add no frames. Begun once more, it begins anew: frames that wait, and what sounds, go.
  Status capture();
  /// Frames that wait to be taken; 0 before `capture`.
  std::size_t capturedFrames() const;
  /// Moves the oldest frames that wait to `samples`, as many as fit: channelCount() samples for
  /// each. Returns the number of frames.
  std::size_t takeCaptured(std::span<float> samples);

  /// Writes all that happens from now on, instead of its sound, into a file: bodies as they sound,
  /// impulses, lasting contacts, where bodies and listeners are. `carom replay` makes the sound of
  /// it, from any seat and as long as one likes; from the listeners of this sound it is that of
  /// `record`. Some 250 bytes for each step of what slides or rolls, and 180 for each event. Leaps
  /// of the clock are left out, as in `record`. A binaural listener has the default head there, and
  /// one that jumps goes there at 170 m/s.
  ///
  /// The file appears under its name when it is finished. Refuses: a build without Zstandard, a
  /// file that cannot be written, a run that is being written already.
  Status recordRun(const std::filesystem::path& file);
  /// Completes the file of the run. Returns errors from earlier writing, too, and refuses a run
  /// without a step. Without a run it does nothing.
  Status finishRun();
  /// Keeps the last `seconds` of the run in memory, up to a day, from now on, for `saveRun` when
  /// something has happened; 0 ends it. Begun once more, it begins anew.
  Status keepRun(double seconds);
  /// Writes the run that is kept in memory: at most a second more than keepRun was asked for. What
  /// rang or slid before it begins is not heard. It goes on being kept.
  Status saveRun(const std::filesystem::path& file);

  /// Sets a factor on the output, 0 to 1000, changed within 20 ms. Not on recordings.
  void setGain(double gain) noexcept;
  /// Mutes the output, or unmutes it, within 20 ms. Not recordings.
  void setMuted(bool muted) noexcept;

  /// Returns the counts since the sound was made, and the cost. [simulation thread]
  SoundStatistics statistics() const;
  /// Says in some sentences, a line each, what sounds and how loud, and why something is silent,
  /// quiet or loud: bodies and their materials, the listener, peaks, what was left out.
  /// [simulation thread]
  std::string report() const;

  std::size_t channelCount() const;  ///< channels of all listeners together
  double sampleRate() const;         ///< Hz, of the samples that are pulled or played
  /// With SoundClock::simulation: frames that can be rendered now with nothing in them late.
  std::size_t framesReady() const;
  /// Frames by which a limiter delays the rendered samples; 0 without one.
  std::size_t outputDelay() const;
  /// Overwrites `frames` samples of each channel, in Pa or as SoundSettings::level says. Requires
  /// channels.size() == channelCount(). Silence before prepareRendering. [audio thread]
  void render(std::span<float* const> channels, std::size_t frames) noexcept;
  /// Renders interleaved samples: channelCount() of them for each of the frames. [audio thread]
  void renderInterleaved(float* samples, std::size_t frames) noexcept;

 protected:
  explicit SoundOutput(std::shared_ptr<plugin::SoundSession> session);
  SoundOutput(SoundOutput&&) noexcept;
  SoundOutput& operator=(SoundOutput&&) noexcept;
  ~SoundOutput();

  /// Shared with the session's own functions, in the midst of which a host's callback may end the
  /// sound. Null once it is moved from.
  std::shared_ptr<plugin::SoundSession> session_;
};

}  // namespace carom
