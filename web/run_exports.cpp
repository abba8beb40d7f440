// The module's functions that play a run (carom_run_*), for the page of `carom view`; docs/web.md
// has them all. They are no part of the C API: a run comes as the bytes of encodedRun.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "audio/propagation/hrtf.h"
#include "audio/run/head_code.h"
#include "audio/run/run_player.h"
#include "carom/carom.h"
#include "plugin/c_api/c_error.h"

namespace {

using namespace carom;
using namespace carom::audio;
using namespace carom::plugin;

using BodyNumber = std::uint32_t;

/// Formats of the ear, as the page counts them.
constexpr std::array kFormats = {ListenerFormat::mono, ListenerFormat::spacedPair,
                                 ListenerFormat::binaural};

ListenerPose poseFrom(const double* numbers) {
  ListenerPose pose;
  pose.position = {numbers[0], numbers[1], numbers[2]};
  pose.orientation = Quat(numbers[3], numbers[4], numbers[5], numbers[6]);
  return pose;
}

}  // namespace

struct carom_run {
  RunPlayer player;
  double sampleRate = 0.0;
};

extern "C" {

/// Opens a run; null with a message if it is refused. The bytes may be freed afterwards.
CAROM_API carom_run* carom_run_open(const std::byte* bytes, std::size_t size, double sampleRate) {
  Result<PlayableRun> run = decodedRun({bytes, size});
  if (!run) {
    (void)failed(CAROM_ERROR_ARGUMENT, "the run " + run.error().message);
    return nullptr;
  }
  Result<RunPlayer> player = RunPlayer::create(*std::move(run), sampleRate);
  if (!player) {
    (void)failed(CAROM_ERROR_ARGUMENT, player.error().message);
    return nullptr;
  }
  return std::make_unique<carom_run>(carom_run{*std::move(player), sampleRate}).release();
}

CAROM_API void carom_run_close(carom_run* run) {
  const std::unique_ptr<carom_run> owner(run);
}

CAROM_API double carom_run_duration(const carom_run* run) {
  return run->player.run().world.duration;
}

/// Sets the head of binaural ears, from the bytes of encodedHead; before a seek.
CAROM_API carom_status carom_run_set_head(carom_run* run, const std::byte* bytes,
                                          std::size_t size) {
  const Result<HrtfMeasurements> head = decodedHead({bytes, size});
  if (!head) return failed(CAROM_ERROR_ARGUMENT, "the head " + head.error().message);
  Result<HrtfSet> set = HrtfSet::create(*head, run->sampleRate);
  if (!set) return outcome(set.error());
  run->player.setHead(std::make_shared<const HrtfSet>(*std::move(set)));
  return CAROM_OK;
}

/// Sets the format of the ear from the next seek on: 0 mono, 1 a pair of microphones, 2 a head.
CAROM_API carom_status carom_run_set_format(carom_run* run, std::uint32_t format) {
  if (format >= kFormats.size()) return failed(CAROM_ERROR_ARGUMENT, "no such format");
  run->player.setFormat(kFormats[format]);
  return CAROM_OK;
}

/// Moves the ear from where it is: x, y, z (m), and w, x, y, z of its frame to the world's.
CAROM_API carom_status carom_run_set_ear(carom_run* run, const double* pose) {
  return outcome(run->player.moveEar(poseFrom(pose)));
}

/// Puts the ear there at once.
CAROM_API carom_status carom_run_place_ear(carom_run* run, const double* pose) {
  return outcome(run->player.placeEar(poseFrom(pose)));
}

/// Has a listener of the run be heard from the next seek on; below 0, the ear.
CAROM_API carom_status carom_run_follow(carom_run* run, std::int32_t listener) {
  std::optional<std::size_t> followed;
  if (listener >= 0) followed = static_cast<std::size_t>(listener);
  run->player.follow(followed);
  return CAROM_OK;
}

/// Sets what is heard from the next seek on, the sum of 1 for clicks, 2 for rings, 4 for slides.
CAROM_API void carom_run_set_kinds(carom_run* run, std::uint32_t kinds) {
  run->player.setStems({(kinds & 1U) != 0, (kinds & 2U) != 0, (kinds & 4U) != 0});
}

CAROM_API void carom_run_set_audible(carom_run* run, BodyNumber body, std::int32_t isAudible) {
  run->player.setAudible(body, isAudible != 0);
}

/// Has one collision alone be heard from the next seek on, by the place of one of its events in
/// order of time; below 0: all.
CAROM_API void carom_run_set_only(carom_run* run, std::int32_t event) {
  std::optional<std::size_t> only;
  if (event >= 0) only = static_cast<std::size_t>(event);
  run->player.setOnly(only);
}

/// Begins a new sound, see RunPlayer::Start.
CAROM_API carom_status carom_run_seek(carom_run* run, double time, double speed, double prelude) {
  return outcome(run->player.seek({.time = time, .speed = speed, .prelude = prelude}));
}

CAROM_API std::size_t carom_run_channels(const carom_run* run) {
  return run->player.channels();
}

/// Renders the next frames, in Pa, channel by channel.
CAROM_API carom_status carom_run_render(carom_run* run, float* planes, std::size_t frames) {
  std::array<float*, 2> channels{};
  for (std::size_t channel = 0; channel < run->player.channels(); ++channel)
    channels.at(channel) = planes + channel * frames;
  run->player.render(std::span(channels).first(run->player.channels()), frames);
  return CAROM_OK;
}

/// Has a run go on: portions are still to come.
CAROM_API void carom_run_set_open(carom_run* run, std::int32_t isOpen) {
  run->player.setOpen(isOpen != 0);
}

/// Adds what has come to a run that goes on, the bytes of encodedMore. The sound goes on into it.
CAROM_API carom_status carom_run_append(carom_run* run, const std::byte* bytes, std::size_t size) {
  Result<RunMore> more = decodedMore({bytes, size}, run->player.run().world.bodies);
  if (!more) return failed(CAROM_ERROR_ARGUMENT, "what comes to the run " + more.error().message);
  return outcome(run->player.append(*std::move(more)));
}

/// Takes back all portions from one on; a seek is needed then.
CAROM_API void carom_run_cut(carom_run* run, std::size_t portions) {
  run->player.cut(portions);
}

/// Returns the time (s) of the run before which all is known.
CAROM_API double carom_run_known(const carom_run* run) {
  return run->player.known();
}

/// Returns the time (s) of the run, of the next sample.
CAROM_API double carom_run_time(const carom_run* run) {
  return run->player.time();
}

/// Returns the number of events that came too late to be heard whole.
CAROM_API std::uint32_t carom_run_late(const carom_run* run) {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(run->player.late(), UINT32_MAX));
}

}  // extern "C"
