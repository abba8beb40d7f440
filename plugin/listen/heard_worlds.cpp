#include "plugin/listen/heard_worlds.h"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>
#include <sys/uio.h>
#include <unistd.h>

#include "audio/model/decimal.h"
#include "plugin/listen/listen_protocol.h"
#include "plugin/listen/listen_report.h"

namespace carom::listen {
namespace {

/// The end of a program waits so long for a step under way.
constexpr std::chrono::seconds kLongestWait{2};

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : std::string_view();
}

/// Returns the table of an object's class, which its memory begins with; null where there is no
/// memory any more. The system reads it, as the program may have unmapped it.
const void* tableOf(const void* object) {
  const void* table = nullptr;
  iovec to{.iov_base = static_cast<void*>(&table), .iov_len = sizeof(table)};
  iovec from{.iov_base = const_cast<void*>(object), .iov_len = sizeof(table)};
  const ssize_t read = process_vm_readv(getpid(), &to, 1, &from, 1, 0);
  return read == static_cast<ssize_t>(sizeof(table)) ? table : nullptr;
}

/// Reads as many numbers as there are, with spaces between them. The command has looked at them.
std::vector<double> numbersIn(std::string_view text) {
  std::vector<double> numbers;
  while (!text.empty()) {
    double number = 0.0;
    const auto [end, fault] = audio::readDecimal(text.data(), text.data() + text.size(), number);
    if (fault != std::errc()) break;
    numbers.push_back(number);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (!text.empty()) text.remove_prefix(1);
  }
  return numbers;
}

/// The listener at the place that the user has chosen, of the same kind as the automatic one.
Listener listenerAt(const std::vector<double>& pose) {
  constexpr std::size_t kNumbers = 7;
  Listener listener = SoundSettings::defaultListener();
  if (pose.size() != kNumbers) return listener;
  listener.position = Vec3(pose[0], pose[1], pose[2]);
  listener.orientation = Quat(pose[6], pose[3], pose[4], pose[5]);
  return listener;
}

SoundSettings settingsFor(int world) {
  SoundSettings settings;
  settings.record = fileOfWorld(std::string(variable(kFileVariable)), world).string();
  settings.play = variable(kPlayVariable) == "1";
  settings.onMessage = [](const std::string& sentence) {
    if (sentence.find("SoundSettings::fullScale") == std::string::npos) tellUser(sentence);
  };
  if (const auto scale = numbersIn(variable(kFullScaleVariable)); !scale.empty())
    settings.fullScale = scale.front();
  if (const auto pose = numbersIn(variable(kListenerVariable)); !pose.empty())
    settings.listeners = {listenerAt(pose)};
  return settings;
}

WorldSoundSettings worldSettings() {
  WorldSoundSettings settings;
  if (const auto units = numbersIn(variable(kUnitsVariable)); !units.empty())
    settings.metresPerUnit = units.front();
  return settings;
}

/// Takes the next number of a world, of all in this process. Both libraries with the sound may be
/// at work in it. 0 if there are too many.
int nextWorld() {
  for (int world = 1; world <= kMostWorlds; ++world)
    if (claim("world-" + std::to_string(world))) return world;
  if (claim("too-many"))
    tellUser("only the first " + std::to_string(kMostWorlds) + " of its worlds are heard");
  return 0;
}

std::string decimal(double number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

constexpr const char* precision() {
  return sizeof(btScalar) == sizeof(double) ? "double" : "float";
}

/// Tells the command what became of a world's recording.
void reportEnd(int number, const Status& finished, const SoundStatistics& statistics) {
  if (finished)
    addToReport("end " + std::to_string(number) + " " + std::to_string(statistics.posted) + " " +
                decimal(statistics.peak));
  else
    tellUser(finished.error().message);
}

}  // namespace

HeardWorlds& HeardWorlds::instance() {
  static HeardWorlds& worlds = *new HeardWorlds;
  return worlds;
}

std::shared_ptr<HeardWorlds::HeardWorld> HeardWorlds::find(const void* world) {
  const std::lock_guard lock(mutex_);
  const auto found = worlds_.find(world);
  return found == worlds_.end() ? nullptr : found->second;
}

std::shared_ptr<HeardWorlds::HeardWorld> HeardWorlds::add(btDiscreteDynamicsWorld& world) {
  auto heard = std::make_shared<HeardWorld>();
  heard->mutex.lock();
  {
    const std::lock_guard lock(mutex_);
    process_ = getpid();
    worlds_.emplace(&world, heard);
  }
  attach(*heard, world);
  return heard;
}

void HeardWorlds::attach(HeardWorld& heard, btDiscreteDynamicsWorld& world) {
  heard.number = nextWorld();
  if (heard.number == 0) return;
  Result<Sound> sound = Sound::attach(world, settingsFor(heard.number), worldSettings());
  if (!sound) return;  // onMessage was told why
  heard.sound.emplace(*std::move(sound));
  heard.table = tableOf(&world);
  addToReport("begin " + std::to_string(heard.number) + " " + precision());
  // After the sound has registered what completes its recording at exit, so as to come before.
  static const int registered = std::atexit([] { instance().endAll(); });
  (void)registered;
}

void HeardWorlds::beforeStep(btDiscreteDynamicsWorld& world) {
  if (const auto known = find(&world))
    known->mutex.lock();
  else
    add(world);
}

void HeardWorlds::afterStep(const void* world) {
  if (const auto heard = find(world)) heard->mutex.unlock();
}

void HeardWorlds::close(HeardWorld& heard) {
  if (!heard.sound) return;
  const Status closed = heard.sound->close();
  const SoundStatistics statistics = heard.sound->statistics();
  if (closed && statistics.peakSample > 1.0)  // as the sound has said, with another remedy
    tellUser("the peak of " + decimal(statistics.peak) + " Pa is above the full scale; expected " +
             "--full-scale " + decimal(std::ceil(statistics.peak)) + " or more");
  reportEnd(heard.number, closed, statistics);
  heard.sound.reset();
}

/// Completes the recording of a world whose memory has gone without a destructor: nothing of it may
/// be touched, so that its sound stays attached for good.
void HeardWorlds::abandon(HeardWorld& heard) {
  if (!heard.sound) return;
  Sound& sound = *new Sound(*std::move(heard.sound));  // NOLINT(*-owning-memory): see above
  heard.sound.reset();
  const Status finished = sound.finishRecording();
  const SoundStatistics statistics = sound.statistics();
  reportEnd(heard.number, finished, statistics);
}

void HeardWorlds::end(const void* world) {
  std::shared_ptr<HeardWorld> heard;
  {
    const std::lock_guard lock(mutex_);
    const auto found = worlds_.find(world);
    if (found == worlds_.end()) return;
    heard = found->second;
    worlds_.erase(found);
  }
  const std::lock_guard lock(heard->mutex);
  close(*heard);
}

bool HeardWorlds::isOwnProcess() const {
  return process_ == getpid();
}

void HeardWorlds::endAll() {
  if (!isOwnProcess()) return;
  std::vector<std::pair<const void*, std::shared_ptr<HeardWorld>>> all;
  {
    const std::lock_guard lock(mutex_);
    all.assign(worlds_.begin(), worlds_.end());
  }
  for (const auto& [world, heard] : all) {
    const std::unique_lock lock(heard->mutex, kLongestWait);
    if (!lock) continue;
    if (tableOf(world) == heard->table)
      close(*heard);
    else
      abandon(*heard);
  }
}

}  // namespace carom::listen
