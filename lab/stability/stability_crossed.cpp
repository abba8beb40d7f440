// Extremes of bodies and of motions, heard in rooms, by heads and by listeners that move: clicks,
// rings, slides and rolls. What is heard beside a rigid wall is what the listener and its mirror
// image hear together in the open: the reference has no wall, and so no image of a source.

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lab/stability/stability_cases.h"
#include "lab/stability/stability_sources.h"

#include "audio/dsp/spread_kernel.h"
#include "carom/audio/room.h"
#include "carom/audio/synth.h"

namespace carom::lab {

using namespace audio;

namespace {

using Measurements = std::vector<Measurement>;
using Samples = std::vector<double>;
using Source = std::variant<Impact, Slide, Blow>;

constexpr double kPi = std::numbers::pi;
constexpr double kSound = 343.0;  // m/s

constexpr std::array<const char*, 4> kKinds = {"click", "slide", "ring", "roll"};

std::size_t kindOf(const Source& source) {
  const auto* slide = std::get_if<Slide>(&source);
  return slide != nullptr && slide->rolls ? 3 : source.index();
}

/// Bodies, speeds and loads at the ends of their ranges, as far as one sample rate holds them.
std::vector<Source> extremeSources(double rate) {
  std::vector<Source> sources;
  for (const double radius : {1e-5, 1e-2, 10.0})
    for (const double modulus : {1e5, 1.2e12})
      for (const double speed : {1e-9, 1.0, 1e4})
        sources.emplace_back(Impact{.radius = radius, .modulus = modulus, .speed = speed});
  for (const double density : {1e-3, 2e5})
    sources.emplace_back(Impact{.density = density});
  for (const double frequency : {20.0, std::min(0.99 * kBand * rate, 0.99 * kHighestMode)})
    for (const double decayRate : {0.1, 100.0})
      sources.emplace_back(Blow{.tone = {.frequency = frequency, .decayRate = decayRate}});
  for (const bool rolls : {false, true})
    for (const double radius : {1e-4, 1e-2, 10.0})
      for (const double speed : {1e-2, 1.0, 100.0})
        for (const double load : {1e-6, 1e6})
          sources.emplace_back(Slide{
              .radius = radius, .speed = speed, .load = load, .duration = 0.05, .rolls = rolls});
  return sources;
}

void setBodies(Synth& synth, const Source& source) {
  std::visit([&](const auto& of) { lab::setBodies(synth, of); }, source);
}

/// Calls `event` for each impact of a source and `contact` for each step of its contact, moved to
/// begin at `time` (s).
template <class Event, class Contact>
void forEachOf(Source source, double time, const Event& event, const Contact& contact) {
  if (auto* impact = std::get_if<Impact>(&source)) {
    impact->time = time;
    event(impact->event());
    event(impact->otherEvent());
  } else if (auto* blow = std::get_if<Blow>(&source)) {
    blow->time = time;
    event(blow->event());
  } else if (auto* slide = std::get_if<Slide>(&source)) {
    slide->begin = time;
    for (const ContactState& state : statesOf(*slide))
      contact(state);
  }
}

/// Returns one or two of five sources, where each takes long. Neighbours differ in one extreme.
std::vector<Source> someOf(const std::vector<Source>& sources, StabilityForm form) {
  const std::size_t taken = form == StabilityForm::full ? 2 : 1;
  std::vector<Source> some;
  for (std::size_t index = 0; index < sources.size(); ++index)
    if (index % 5 < taken) some.push_back(sources[index]);
  return some;
}

/// Where and how sources are heard.
struct Hall {
  SynthSettings settings = {.audibleThreshold = 0.0};
  std::vector<Listener> listeners = {};
  std::vector<Vec3> velocities = {};  ///< m/s, of the listeners; empty: they stand
};

Listener microphoneAt(const Vec3& place) {
  return {.name = "microphone", .position = place};
}

void moveEvenly(Synth& synth, const Hall& hall, double until) {
  for (std::size_t index = 0; index < hall.velocities.size(); ++index)
    for (const double time : {-1.0, until})
      orThrow(synth.moveListener(
          index, {.time = time,
                  .position = hall.listeners[index].position + time * hall.velocities[index],
                  .orientation = hall.listeners[index].orientation}));
}

/// Returns the next samples of each channel, Pa.
std::vector<Samples> renderedChannels(Synth& synth, double seconds) {
  const auto frames = static_cast<std::size_t>(seconds * synth.sampleRate());
  std::vector<Samples> planes(synth.channelCount(), Samples(frames));
  std::vector<double*> channels;
  channels.reserve(planes.size());
  for (Samples& plane : planes)
    channels.push_back(plane.data());
  synth.render<double>(channels, frames);
  return planes;
}

/// Part of a sound, in s.
struct Span {
  double begin = 0.0;
  double seconds = 0.1;
};

Synth synthIn(const Hall& hall, const Source& source, const Span& span) {
  Synth synth = orThrow(Synth::create(hall.settings, hall.listeners));
  setBodies(synth, source);
  orThrow(synth.seek(span.begin));
  moveEvenly(synth, hall, span.begin + span.seconds + 1.0);
  return synth;
}

void play(Synth& synth, const Source& source, double time = 0.0) {
  forEachOf(
      source, time, [&](const ImpulseEvent& event) { synth.schedule(event); },
      [&](const ContactState& state) { synth.updateContact(state); });
}

/// Returns all channels, Pa, of a source that begins at 0.
std::vector<Samples> heardIn(const Hall& hall, const Source& source, const Span& span) {
  Synth synth = synthIn(hall, source, span);
  play(synth, source);
  return renderedChannels(synth, span.seconds);
}

double peakOf(const Samples& samples) {
  Worst largest;
  for (const double sample : samples)
    largest.add(std::abs(sample));
  return largest.value();
}

Samples sumOf(const std::vector<Samples>& planes) {
  Samples sum(planes.front().size(), 0.0);
  for (const Samples& plane : planes)
    for (std::size_t sample = 0; sample < sum.size(); ++sample)
      sum[sample] += plane[sample];
  return sum;
}

/// Pa, 60 dB below the threshold of hearing: filters that ring off forget what is below 1e-15 Pa.
constexpr double kLeastPeak = 1e-3 * kHearingThreshold;

/// Errors of sounds beside references, as shares of the reference's peak, but at least of
/// kLeastPeak, by kind of source.
class Errors {
 public:
  void add(const Source& source, const Samples& sound, const Samples& reference) {
    const double peak = peakOf(reference);
    if (peak > 0.0) heard_ += 1.0;
    for (std::size_t sample = 0; sample < sound.size(); ++sample)
      worst_.at(kindOf(source))
          .add(std::abs(sound[sample] - reference[sample]) / std::max(peak, kLeastPeak));
  }
  /// Returns the largest error by kind, and the number of sounds that were not silent.
  Measurements measured(double bound, double least) const {
    Measurements found;
    for (std::size_t kind = 0; kind < kKinds.size(); ++kind)
      found.push_back(
          atMost(std::string(kKinds.at(kind)) + "_share", worst_.at(kind).value(), bound));
    found.push_back(atLeast("sounds_heard", heard_, least));
    return found;
  }

 private:
  std::array<Worst, 4> worst_;
  double heard_ = 0.0;
};

// ---- Rooms

std::vector<double> ratesOf(StabilityForm form) {
  if (form == StabilityForm::full) return {8000.0, 44100.0, 192000.0};
  return {48000.0};
}

std::vector<double> distancesOf(StabilityForm form) {
  if (form == StabilityForm::full) return {1e-3, 3.0, 1000.0};
  return {3.0};
}

const Vec3 kAside(0.48, 0.36, 0.8);  // unit, from the source towards the listener

/// Begins shortly before the sound of time 0 arrives from that distance (m).
Span spanAt(double distance) {
  return {.begin = std::max(0.0, std::floor(100.0 * distance / kSound) / 100.0 - 0.01)};
}

constexpr double kWall = -0.7;  // m, height of the wall

Vec3 mirrored(const Vec3& place, double wall = kWall) {
  return {place.x(), 2.0 * wall - place.y(), place.z()};
}

/// Compares a listener beside a rigid wall with itself and its mirror image in the open.
void lookAtWall(const Source& source, Hall hall, const Span& span, Errors& errors) {
  Hall open = hall;
  open.listeners.push_back(microphoneAt(mirrored(hall.listeners[0].position)));
  if (!hall.velocities.empty()) open.velocities.push_back(mirrored(hall.velocities[0], 0.0));
  hall.settings.room.reflectors = {{.normal = Vec3::UnitY(), .offset = kWall}};
  errors.add(source, heardIn(hall, source, span)[0], sumOf(heardIn(open, source, span)));
}

Measurements wall(StabilityForm form) {
  Errors errors;
  for (const double rate : ratesOf(form))
    for (const double distance : distancesOf(form))
      for (const Source& source : extremeSources(rate)) {
        Hall hall{.listeners = {microphoneAt(distance * kAside)}};
        hall.settings.sampleRate = rate;
        lookAtWall(source, hall, spanAt(distance), errors);
      }
  return errors.measured(1e-9, form == StabilityForm::full ? 400.0 : 45.0);
}

const Vec3 kLow(-2.0, kWall, -1.5);  // m, corner of the box
const Vec3 kHigh(3.0, 2.5, 4.0);     // m, the opposite one

Room boxOf(int order, double absorption) {
  Room room;
  room.order = order;
  for (int axis = 0; axis < 3; ++axis) {
    Reflector low{.normal = Vec3::Unit(axis), .offset = kLow[axis]};
    low.absorption.coefficients.fill(absorption);
    Reflector high{.normal = -Vec3::Unit(axis), .offset = -kHigh[axis]};
    high.absorption.coefficients.fill(absorption);
    room.reflectors.push_back(low);
    room.reflectors.push_back(high);
  }
  return room;
}

/// Returns a coordinate after `count` reflections at the two walls of an axis by turns, the first
/// at the wall that the sign of `count` says.
double reflected(double place, int axis, int count) {
  const double length = kHigh[axis] - kLow[axis];
  const double from = place - kLow[axis];
  return kLow[axis] + (count % 2 == 0 ? from : length - from) + length * count;
}

std::vector<Listener> mirrorImages(const Vec3& place, int order) {
  std::vector<Listener> images;
  for (int x = -order; x <= order; ++x)
    for (int y = -order; y <= order; ++y)
      for (int z = -order; z <= order; ++z)
        if (std::abs(x) + std::abs(y) + std::abs(z) <= order)
          images.push_back(microphoneAt({reflected(place.x(), 0, x), reflected(place.y(), 1, y),
                                         reflected(place.z(), 2, z)}));
  return images;
}

/// Returns sources of each kind that are, and stay, in the box.
std::vector<Source> boxedSources(double rate, StabilityForm form) {
  std::vector<Source> sources = someOf(extremeSources(rate), form);
  std::erase_if(sources, [](const Source& source) {
    const auto* slide = std::get_if<Slide>(&source);
    return slide != nullptr && (slide->speed > 1.0 || slide->radius > 1.0);
  });
  return sources;
}

Measurements box(StabilityForm form) {
  const int order = form == StabilityForm::full ? 3 : 2;
  const Vec3 place = 2.0 * kAside;
  Errors errors;
  for (const double rate : ratesOf(form))
    for (const Source& source : boxedSources(rate, form)) {
      Hall room{.listeners = {microphoneAt(place)}};
      room.settings.sampleRate = rate;
      Hall open = room;
      open.listeners = mirrorImages(place, order);
      room.settings.room = boxOf(order, 0.0);
      errors.add(source, heardIn(room, source, {})[0], sumOf(heardIn(open, source, {})));
    }
  return errors.measured(1e-6, 8.0);
}

// Walls that absorb all are as good as none, but for what their filters leave, 140 dB below.
Measurements absorbing(StabilityForm form) {
  Errors errors;
  for (const double rate : ratesOf(form))
    for (const Source& source : boxedSources(rate, form)) {
      Hall open{.listeners = {microphoneAt(2.0 * kAside)}};
      open.settings.sampleRate = rate;
      Hall room = open;
      room.settings.room = boxOf(3, 1.0);
      errors.add(source, heardIn(room, source, {})[0], heardIn(open, source, {})[0]);
    }
  return errors.measured(1e-6, 8.0);
}

/// A diffuse field at the ends of its ranges.
struct Field {
  double volume = 100.0;   ///< m^3
  double decayTime = 1.0;  ///< s
};

double energyOf(const Samples& samples, double from, double to) {
  double sum = 0.0;
  for (auto at = static_cast<std::size_t>(from); at < static_cast<std::size_t>(to); ++at)
    sum += samples[at] * samples[at];
  return sum;
}

// By 60 dB in the decay time, and silent in the end, whatever has made the sound.
/// The decay of a diffuse field, over half of its decay time, after a source.
struct Decay {
  double level = 0.0;  ///< dB
  bool ends = false;   ///< in silence, after ten decay times
};

Decay decayOf(const Field& field, const Source& source, double rate) {
  ReverbSettings reverb{.volume = field.volume, .surface = 6.0 * std::pow(field.volume, 2.0 / 3.0)};
  reverb.decayTimes.fill(field.decayTime);
  Hall hall{.listeners = {microphoneAt(kAside)}};
  hall.settings.sampleRate = rate;
  hall.settings.reverb = reverb;
  const Span span{.seconds = 0.1 + field.decayTime};
  Synth synth = synthIn(hall, source, span);
  play(synth, source);
  const Samples sound = renderedChannels(synth, span.seconds)[0];
  const double begin = rate * (0.05 + 0.1 * field.decayTime);
  const double quarter = 0.25 * field.decayTime * rate;
  const double early = energyOf(sound, begin, begin + quarter);
  const double late = energyOf(sound, begin + 2.0 * quarter, begin + 3.0 * quarter);
  for (int more = 0; more < 9 && !synth.isSilent(); ++more)
    renderedChannels(synth, field.decayTime);
  return {.level = 10.0 * std::log10(early / late), .ends = synth.isSilent()};
}

// By 60 dB in the decay time, and silent in the end, whatever has made the sound. The field is
// noise, whose level in a short time is uncertain: the mean of the sources is looked at.
Measurements reverberation(StabilityForm form) {
  const std::vector<Source> sources = {Impact{}, Impact{.modulus = 1e5, .speed = 1e4},
                                       Blow{.tone = {.frequency = 300.0, .decayRate = 400.0}},
                                       Blow{.tone = {.frequency = 3000.0, .decayRate = 400.0}}};
  Worst slope;
  double endless = 0.0;
  for (const double rate : ratesOf(form))
    for (const Field& field :
         {Field{0.1, 0.05}, Field{0.1, 10.0}, Field{100.0, 1.0}, Field{1e5, 10.0}}) {
      double sum = 0.0;
      for (const Source& source : sources) {
        const Decay decay = decayOf(field, source, rate);
        sum += decay.level;
        if (!decay.ends) endless += 1.0;
      }
      slope.add(std::abs(sum / static_cast<double>(sources.size()) - 30.0));
    }
  return {atMost("half_of_the_decay_beside_30_dB", slope.value(), 3.0, "dB"),
          exactly("that_still_sound_after_10_decay_times", endless, 0.0)};
}

// ---- Heads

/// The responses of the default head at a sample rate, which take long to prepare.
using Head = std::shared_ptr<const HrtfSet>;

Listener headAt(const Head& responses, const Vec3& place,
                const Quat& orientation = Quat::Identity()) {
  Listener head{.name = "head", .position = place, .orientation = orientation};
  head.format = ListenerFormat::binaural;
  head.hrtf = responses;
  return head;
}

ImpulseEvent turnedBy(const Quat& turn, ImpulseEvent event) {
  for (Vec3* vector : {&event.impulse, &event.position, &event.normal, &event.bodyPosition,
                       &event.bodyVelocity, &event.bodyAngularVelocity})
    *vector = turn * *vector;
  event.bodyOrientation = turn * event.bodyOrientation;
  return event;
}

ContactState turnedBy(const Quat& turn, ContactState state) {
  for (Vec3* vector : {&state.normal, &state.position, &state.appliedImpulse, &state.slipVelocity,
                       &state.rollingVelocity, &state.bodyPosition, &state.bodyVelocity,
                       &state.otherPosition, &state.otherVelocity})
    *vector = turn * *vector;
  state.bodyOrientation = turn * state.bodyOrientation;
  state.otherOrientation = turn * state.otherOrientation;
  return state;
}

// A head and all that it hears, turned together: both ears hear the same. The bell is a monopole.
Measurements turnedHead(StabilityForm form) {
  const Quat turn(Eigen::AngleAxisd(2.1, Vec3(0.6, -0.64, 0.48)));
  Errors errors;
  for (const double rate : ratesOf(form)) {
    const Head responses = orThrow(loadHrtf("", rate));
    for (const double distance : distancesOf(form))
      for (const Source& source : extremeSources(rate)) {
        Hall hall{.listeners = {headAt(responses, distance * kAside)}};
        hall.settings.sampleRate = rate;
        Hall other = hall;
        other.listeners = {headAt(responses, turn * (distance * kAside), turn)};
        const Span span = spanAt(distance);
        const std::vector<Samples> plain = heardIn(hall, source, span);
        Synth synth = synthIn(other, source, span);
        forEachOf(
            source, 0.0, [&](const ImpulseEvent& event) { synth.schedule(turnedBy(turn, event)); },
            [&](const ContactState& state) { synth.updateContact(turnedBy(turn, state)); });
        const std::vector<Samples> turned = renderedChannels(synth, span.seconds);
        for (std::size_t ear = 0; ear < 2; ++ear)
          errors.add(source, turned[ear], plain[ear]);
      }
  }
  return errors.measured(1e-6, form == StabilityForm::full ? 800.0 : 90.0);
}

// A head that is far away hears at each ear what a microphone does, times what its direction makes
// of it: the same from 10 m as from 10 km.
Measurements farHead(StabilityForm form) {
  Worst apart;
  Worst level;
  for (const double rate : ratesOf(form)) {
    const Head responses = orThrow(loadHrtf("", rate));
    for (const Source& source :
         {Source(Impact{}), Source(Impact{.radius = 1e-4, .speed = 1e4}),
          Source(Impact{.modulus = 1e5}), Source(Blow{.tone = {1000.0, 10.0}})}) {
      std::array<std::array<double, 2>, 2> levels{};
      for (std::size_t far = 0; far < 2; ++far) {
        const double distance = far == 0 ? 1e2 : 1e4;
        Hall hall{
            .listeners = {microphoneAt(distance * kAside), headAt(responses, distance * kAside)}};
        hall.settings.sampleRate = rate;
        hall.settings.airAbsorption = false;  // not the distance, but the direction
        const std::vector<Samples> sound = heardIn(hall, source, spanAt(distance));
        const auto frames = static_cast<double>(sound[0].size());
        for (std::size_t ear = 0; ear < 2; ++ear)
          levels.at(far).at(ear) = 10.0 * std::log10(energyOf(sound[ear + 1], 0.0, frames) /
                                                     energyOf(sound[0], 0.0, frames));
      }
      for (std::size_t ear = 0; ear < 2; ++ear) {
        apart.add(std::abs(levels[0].at(ear) - levels[1].at(ear)));
        level.add(std::abs(levels[0].at(ear)));
      }
    }
  }
  return {atMost("level_from_10_km_beside_that_from_100_m", apart.value(), 0.1, "dB"),
          atMost("level_beside_a_microphone", level.value(), 25.0, "dB")};
}

// ---- Listeners that move

/// A microphone that comes closer at `closing` (m/s), or goes, hears a slide over waves.
struct Passing {
  double sampleRate = 48000.0;  ///< Hz
  double slide = 1.0;           ///< m/s
  double closing = 0.0;         ///< m/s

  static constexpr double kFar = 400.0;  // m, distance of the microphone at 0 s

  /// Returns the time (s) of emission of what arrives at `time`, at the place of the ball then.
  double emissionOf(double time) const {
    const Vec3 place = (kFar - closing * time) * kAside;
    double emission = time - place.norm() / kSound;
    for (int turn = 0; turn < 8; ++turn)
      emission = time - (place - emission * slide * Vec3::UnitX()).norm() / kSound;
    return emission;
  }
  /// Returns the amplitude (Pa m) of the tone of the waves as it was emitted, over 0.3 s.
  double amplitude() const {
    Hall hall{.listeners = {microphoneAt(kFar * kAside)}, .velocities = {-closing * kAside}};
    hall.settings.sampleRate = sampleRate;
    hall.settings.airAbsorption = false;  // the distance alone, and the Doppler shift
    const double end = (kFar + 0.45 * kSound) / (kSound + closing);  // s, of emissions up to 0.45 s
    const Samples sound =
        heardIn(hall, Slide{.speed = slide, .duration = 0.5}, {.seconds = end})[0];
    std::complex<double> sum = 0.0;
    double weight = 0.0;
    for (std::size_t sample = 0; sample < sound.size(); ++sample) {
      const double time = static_cast<double>(sample) / sampleRate;
      const double emission = emissionOf(time);
      if (emission < 0.1 || emission > 0.4) continue;
      const double window = 1.0 - std::cos(2.0 * kPi * (emission - 0.1) / 0.3);
      const double distance = kSound * (time - emission);
      const double turned = 2.0 * kPi * slide / kWaveLength * emission;
      sum += window * distance * sound[sample] * std::polar(1.0, -turned);
      weight += window;
    }
    return 2.0 * std::abs(sum) / weight;
  }
};

// The tone is that of the waves at the time of its emission, as loud as to a microphone that
// stands.
Measurements doppler(StabilityForm form) {
  Worst level;
  for (const double rate : ratesOf(form))
    for (const double slide : {0.3, 1.0, 4.0}) {
      const double standing = Passing{.sampleRate = rate, .slide = slide}.amplitude();
      for (const double speed : {1e-9, 1.0, 100.0, 179.0})
        for (const double sign : {1.0, -1.0}) {
          const Passing passing{.sampleRate = rate, .slide = slide, .closing = sign * speed};
          level.add(std::abs(20.0 * std::log10(passing.amplitude() / standing)));
        }
    }
  double taken = 0.0;
  Synth synth = synthIn({.listeners = {microphoneAt(kAside)}}, Impact{}, {});
  orThrow(synth.moveListener(0, {.time = 0.0, .position = kAside}));
  for (const double speed : {181.0, 343.0, 1e4, 1e300, std::numeric_limits<double>::infinity()})
    if (synth.moveListener(0, {.time = 1.0, .position = speed * Vec3::UnitX()})) taken += 1.0;
  return {atMost("tone_beside_that_of_a_microphone_that_stands", level.value(), 0.1, "dB"),
          exactly("paths_above_180_m/s_taken", taken, 0.0)};
}

Measurements movingByAWall(StabilityForm form) {
  Errors errors;
  for (const double rate : ratesOf(form))
    for (const double speed : {1e-9, 1.0, 179.0})
      for (const Source& source : extremeSources(rate)) {
        Hall hall{.listeners = {microphoneAt(3.0 * kAside)},
                  .velocities = {speed * Vec3(0.6, 0.0, -0.8)}};
        hall.settings.sampleRate = rate;
        lookAtWall(source, hall, {}, errors);
      }
  return errors.measured(1e-9, form == StabilityForm::full ? 400.0 : 130.0);
}

// ---- All at once

bool addsUp(const SynthCounters& counters) {
  return counters.events == counters.heard + counters.inaudible + counters.masked +
                                counters.stolen + counters.overBudget + counters.noBus +
                                counters.tooLong + counters.ringsLeftOut + counters.lost +
                                waitingEvents(counters);
}

/// A room with reverberation, and in it a microphone that flies through the source, a pair and a
/// head.
Hall fullHall(double rate, const Head& responses) {
  Hall hall;
  hall.settings.sampleRate = rate;
  hall.settings.room = boxOf(2, 0.3);
  hall.settings.reverb = orThrow(reverbOfBox(hall.settings.room, kSound));
  Listener pair{.name = "pair", .position = Vec3(1.0, 1.0, 1.0)};
  pair.format = ListenerFormat::spacedPair;
  const Vec3 velocity = 170.0 * kAside;
  hall.listeners = {microphoneAt(-0.02 * velocity), pair, headAt(responses, Vec3(-0.5, 0.3, 0.5))};
  hall.velocities = {velocity, Vec3::Zero(), Vec3(0.0, 0.0, -20.0)};
  return hall;
}

double oddSamples(const std::vector<Samples>& planes) {
  double odd = 0.0;
  for (const Samples& plane : planes)
    odd += static_cast<double>(
        std::ranges::count_if(plane, [](double sample) { return !std::isfinite(sample); }));
  return odd;
}

Measurements everything(StabilityForm form) {
  double odd = 0.0;
  double lost = 0.0;
  double sounds = 0.0;
  for (const double rate : ratesOf(form)) {
    const Hall hall = fullHall(rate, orThrow(loadHrtf("", rate)));
    for (const Source& source : someOf(extremeSources(rate), form)) {
      Synth synth = synthIn(hall, source, {});
      play(synth, source);
      // A jump to the end of the world and back, in the middle of the sound.
      odd += oddSamples(renderedChannels(synth, 0.02));
      orThrow(synth.placeListener(0, {.time = 0.02, .position = Vec3::Constant(1e6)}));
      play(synth, source, 0.03);
      odd += oddSamples(renderedChannels(synth, 0.02));
      orThrow(synth.placeListener(0, {.time = 0.04, .position = Vec3::Zero()}));
      play(synth, source, 0.05);
      odd += oddSamples(renderedChannels(synth, 0.06));
      sounds += 1.0;
      if (!addsUp(synth.counters())) lost += 1.0;
    }
  }
  return {atLeast("sounds", sounds, 12.0), exactly("not_finite", odd, 0.0),
          exactly("whose_counters_do_not_add_up", lost, 0.0)};
}

/// Returns events that no body can have, but whose numbers are finite.
std::vector<ImpulseEvent> poison() {
  std::vector<ImpulseEvent> events;
  for (const ImpulseEvent& plain : {Impact{.time = 0.01}.event(), Blow{.time = 0.01}.event()}) {
    const auto add = [&](auto change) {
      ImpulseEvent event = plain;
      change(event);
      events.push_back(event);
    };
    for (const double huge : {1e20, 1e45, 1e300}) {
      add([huge](ImpulseEvent& event) { event.impulse *= huge; });
      add([huge](ImpulseEvent& event) { event.bodyOrientation.coeffs() *= huge; });
      add([huge](ImpulseEvent& event) { event.position.y() = huge; });
      add([huge](ImpulseEvent& event) { event.bodyPosition.x() = -huge; });
      add([huge](ImpulseEvent& event) { event.time = huge; });
      add([huge](ImpulseEvent& event) { event.effectiveMass = huge; });
    }
  }
  return events;
}

// Each event is refused, or sounds and ends: what comes later is as if it had never been there.
Measurements poisoned(StabilityForm form) {
  double odd = 0.0;
  double lost = 0.0;
  Worst after;
  const Blow blow{.tone = {.frequency = 440.0, .decayRate = 1.0}};
  for (const double rate : ratesOf(form)) {
    Hall hall = fullHall(rate, orThrow(loadHrtf("", rate)));
    hall.velocities.clear();
    const auto sound = [&](const ImpulseEvent* bad) {
      Synth synth = synthIn(hall, blow, {});
      synth.schedule(blow.event());
      if (bad != nullptr) synth.schedule(*bad);
      odd += oddSamples(renderedChannels(synth, 0.1));
      play(synth, blow, 0.12);
      std::vector<Samples> later = renderedChannels(synth, 0.1);
      odd += oddSamples(later);
      if (!addsUp(synth.counters())) lost += 1.0;
      return std::pair(std::move(later), synth.counters().rejected);
    };
    const auto [clean, none] = sound(nullptr);
    for (const ImpulseEvent& bad : poison()) {
      const auto [later, rejected] = sound(&bad);
      if (rejected == none) continue;  // it may ring on
      for (std::size_t channel = 0; channel < clean.size(); ++channel)
        for (std::size_t sample = 0; sample < clean[channel].size(); ++sample)
          after.add(std::abs(later[channel][sample] - clean[channel][sample]));
    }
  }
  return {exactly("not_finite", odd, 0.0),
          exactly("difference_after_what_is_refused", after.value(), 0.0, "Pa"),
          exactly("whose_counters_do_not_add_up", lost, 0.0)};
}

}  // namespace

void addCrossedCases(std::vector<StabilityCase>& cases) {
  const char* const kMirror =
      "what the listener and its mirror images hear together in the open: walls mirror them";
  const std::vector<StabilityCase> all = {
      {"room.wall", "rooms",
       "clicks, rings, slides and rolls of extreme bodies and speeds by a rigid wall, from 1 mm to "
       "1 km, at 8 to 192 kHz",
       kMirror, wall},
      {"room.box", "rooms", "the same in a rigid box, reflected twice (full: three times)", kMirror,
       box},
      {"room.absorbing", "rooms", "the same in a box whose walls absorb all", "as in the open",
       absorbing},
      {"room.reverberation", "rooms",
       "decay times of 0.05 to 10 s in 0.1 to 1e5 m^3, after clicks and rings",
       "30 dB in half of the decay time; then silence", reverberation},
      {"head.turned", "heads", "the same sources at a head, and turned together with the head",
       "space has no direction: each ear hears the same", turnedHead},
      {"head.far", "heads", "clicks and a ring at a head 100 m and 10 km away",
       "its direction decides how loud each ear is beside a microphone, not its distance", farHead},
      {"moving.doppler", "moving listeners",
       "a slide over waves at microphones that come and go at 1e-9 to 179 m/s",
       "the tone of the waves at the time of emission, over the distance; faster paths are refused",
       doppler},
      {"moving.wall", "moving listeners",
       "the same sources by a rigid wall, at a microphone of 1e-9 to 179 m/s", kMirror,
       movingByAWall},
      {"crossed.everything", "nonsense",
       "the same sources in a room with reverberation, at a pair, a head that moves, and a "
       "microphone that flies through them and jumps",
       "every sample is finite, and every event has one fate", everything},
      {"crossed.poisoned", "nonsense",
       "impulses to 1e298 N s, orientations of length 1e20, places and times of 1e300, in that "
       "room",
       "refused, or finite; what comes after a refused one is the same bits", poisoned},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
