#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <carom/audio/limiter.h>
#include <carom/audio/listener.h>
#include <carom/audio/synth_settings.h>

namespace carom {

/// The clock of the samples that a host pulls.
enum class SoundClock : std::uint8_t {
  /// The samples' own clock: they are taken as time goes by, by a device or by the host's own
  /// callback. The simulation is followed SoundSettings::latency behind, through its pauses, stalls
  /// and jumps (see SoundTimeline).
  realTime,
  /// The simulation's clock: sample n is heard at n / sample rate on it. For rendering as fast as
  /// the simulation steps; see SoundOutput::framesReady.
  simulation,
};

/// The meaning of a sample of 1.0. Pressures are pascals within, whichever it is.
enum class Level : std::uint8_t {
  /// Automatic on a device and in recordings, unless SoundSettings::fullScale is given; fixed in
  /// samples that the host pulls.
  standard,
  /// Everywhere SoundSettings::fullScale, or where none is given: kDeviceFullScale on a device,
  /// kFullScalePressure in recordings, 1 Pa in samples that the host pulls.
  fixed,
  /// Automatic everywhere, like a camera's exposure. The full scale is in range at the first blow,
  /// by the masses, sizes and heights of a world's bodies; it rises at once with a louder sound,
  /// and falls by 3 dB for each second of the simulation after it, up to 30 dB. A limiter has its
  /// ceiling at -1 dB unless SoundSettings::limiter is set. A recording has one full scale, chosen
  /// at its end: its peak is at -3 dB, and its comment says "full scale 1.25 Pa". No full scale is
  /// below 0.02 Pa: what is hardly audible stays quiet.
  automatic,
};

/// Limits of what sound may cost in real time. Beyond them events are left out whole, before they
/// begin: first those that are inaudible at every listener, then the quietest. All are counted.
struct VoiceBudget {
  /// Share of one core that rendering may take, above 0: no block costs more than this share of its
  /// own duration, but for sound that has begun already. It goes by measured time: whether it
  /// intervenes is the only thing here that depends on the machine. With SoundClock::simulation it
  /// never does.
  double cpuShare = 0.5;
  /// Events whose sound has yet to begin at some listener; 1 to 65536.
  std::size_t voices = 2048;
  /// Sizes of bodies, times channels, times kinds of paths, that sound at the same moment; 1 to
  /// 65536. 45 kB each.
  std::size_t buses = 256;
  /// s, above 0, up to 1. Longer contacts, which sound below 30 Hz or so, are left out.
  double longestContact = 0.05;
  /// Bodies that ring at the same moment, times channels; 1 to 4096. More are not heard to ring.
  std::size_t ringingBodies = 128;
  /// Contacts that slide or roll at the same moment; 0 to 4096. The quietest beyond are left out as
  /// long as there are more; a slide that is left out in its midst ends with a jump of its force.
  /// 0.7 MB each.
  std::size_t slidingContacts = 32;
  /// Modes of each body, at most; 1 to 4096. Higher ones are left out.
  std::size_t modes = 128;
};

/// The settings of a sound over a Bullet world (see also WorldSoundSettings) or over events.
///
///     carom::SoundSettings settings;
///     settings.listeners = {{"ear", {0.6, 0.7, 0.4}}};  // m, one channel each
///     settings.record = "ball.wav";                     // or settings.play = true
struct SoundSettings {
  /// Sample rate, medium, which impulse sounds (the one that Bullet's solver applied is known one
  /// to three substeps later), pulse, sampling, radiation, Doppler effect, room and reverberation.
  /// Lasting contacts are heard as LastingDetail::heard says, unless `lasting` is set.
  SynthSettings synth = defaultSynth();
  /// Channels are those of the first listener, then those of the next: see ListenerFormat. None:
  /// defaultListener(), which stands where a camera would over a Bullet world (see Sound), until
  /// the first SoundOutput::setListener; over events, at the origin.
  std::vector<Listener> listeners = {};
  /// s, the look-ahead: how far sound stays behind the simulation. It has to cover two substeps
  /// (Bullet knows of a contact one to two of them later), the host's frame, a block of samples,
  /// and Synth::leadTime. An event that comes later still sounds, later, and is counted.
  double latency = 0.05;
  SoundClock clock = SoundClock::realTime;
  VoiceBudget budget = {};
  /// Pa, > 0, that come out as a sample of 1.0. None: see `level`.
  std::optional<double> fullScale = std::nullopt;
  /// A look-ahead limiter at the end (a device has one in any case), for an output that holds no
  /// more than its ceiling, in units of the samples. It delays them by SoundOutput::outputDelay, on
  /// top of `latency`. Its sample rate and channels are filled in. None: nothing is turned down.
  std::optional<LimiterSettings> limiter = std::nullopt;
  std::string record = {};  ///< if not empty: SoundOutput::record from the start
  /// SoundOutput::play from the start. Where that is refused, as without a device, the sound is
  /// made nevertheless, unheard: a message says why, and SoundOutput::isPlaying.
  bool play = false;
  Level level = Level::standard;

  /// Two microphones 17 cm apart, turned outwards, open to the rear: over loudspeakers and over
  /// headphones something comes from where it is, and nothing is silent behind.
  static Listener defaultListener();
  /// SynthSettings with LastingDetail::heard.
  static SynthSettings defaultSynth();

  using MessageFunction = std::function<void(const std::string&)>;
  /// Takes what there is to be told: each sentence of an Error that a sound returns, once. Not set:
  /// standard error, a line each. It must not throw, nor end the sound. [simulation thread]
  MessageFunction onMessage = nullptr;
};

/// Pa for a sample of 1.0 on a device with Level::fixed: peaks of 100 dB, about the loudest of
/// headphones.
inline constexpr double kDeviceFullScale = 2.0;

/// Counts of what became of the events, and the cost of the sound. All counts are since the sound
/// was made, whatever was prepared, stopped or closed meanwhile.
///
/// Each share of a collision that is posted, by the host or by a Bullet world, has one fate, at one
/// output: the one that is played or pulled at that time, or else the recording.
///
///     posted = silenced + skipped + immovable + rejected                      not among `events`
///              + heard                                                        among `events`
///              + inaudible + masked + stolen + overBudget + noBus + tooLong + ringsLeftOut
///              + queueFaults                                                  left out
///              + lost + waiting
///
/// and `rejected` is the sum of its five reasons. `waiting` is 0 once the sound is closed.
struct SoundStatistics : SynthCounters {
  // Events that are not among `events`, beside `immovable` and `rejected`:
  /// Nothing was played, pulled or recorded; no samples were taken yet, or the simulation ran ahead
  /// of time.
  std::uint64_t skipped = 0;
  std::uint64_t silenced = 0;  ///< shares in collisions with a body that BodySound::silent silences
  // Events among `events` that were left out, beside those that SynthCounters has:
  std::uint64_t queueFaults = 0;  ///< no room in the queue: samples are not taken, or too rarely
  // Faults of the clock:
  std::uint64_t stalls = 0;  ///< the simulation fell behind by more than the look-ahead
  /// The clock of the simulation went back; in a recording, also where it went on by more than a
  /// minute.
  std::uint64_t jumps = 0;
  // At this moment:
  std::uint64_t voices = 0;   ///< scheduled events whose sound has yet to begin
  std::uint64_t buses = 0;    ///< buses that are not silent
  std::uint64_t ringing = 0;  ///< bodies, times channels, that ring
  std::uint64_t modes = 0;    ///< modes that sound, of all bodies and channels
  double cpuShare = 0.0;      ///< share of one core, over the last second or so
  // The largest so far:
  double worstBlock = 0.0;     ///< share of its own duration that a block has taken
  double gainReduction = 0.0;  ///< dB that a limiter has turned down
  // Bullet worlds only:
  std::uint64_t solvedShapes = 0;        ///< shapes with a known added mass; equal ones count once
  std::uint64_t shapesSolvedInStep = 0;  ///< those that held up a step of the world; see Sound
  std::uint64_t shapesPending = 0;       ///< now: shapes that a thread has yet to solve
  /// Bodies so far that can move and whose surface is open, too complicated or no solid. They
  /// sound as the sphere of their volume; of half the volume of the box around them if they have
  /// none; and not at all if the box has none either.
  std::uint64_t unsolvedBodies = 0;
  std::uint64_t links = 0;  ///< links of multibodies so far that can move; see Sound
  /// Pairs in contact whose shapes the bridge cannot follow, counted once per substep each.
  std::uint64_t unsupportedContacts = 0;
  // The largest so far, in any channel:
  double peak = 0.0;  ///< Pa
  /// A sample before a limiter, 1 for full scale; 0 where samples are pascals.
  double peakSample = 0.0;
  /// A sentence with the remedy if peaks exceed a fixed full scale (by 6 dB if there is a limiter);
  /// else empty. On stderr at the end, if nobody has seen it.
  std::string warning;
  /// Bodies so far that cannot sound, as a number of theirs is out of range (Synth::setBody): their
  /// events are `rejectedUnknownBody`.
  std::uint64_t refusedBodies = 0;
  /// Shapes and user indices with an assignment (Sound::assign) that no body has used so far.
  std::uint64_t unusedAssignments = 0;
  /// For the latest of the bodies that were not solved, or refused; else empty.
  std::string unsolvedReason;
  std::uint64_t posted = 0;   ///< shares of collisions that were handed over
  std::uint64_t waiting = 0;  ///< of them, those that are yet to be scheduled, or left out
  /// The sentence that ended a recording before it was finished, as of a full disk, and says where
  /// the sound up to there is; else empty. Told at once, as all messages are.
  std::string recordingError;
};

}  // namespace carom
