#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "carom/audio/result.h"
#include "carom/event_sound.h"
#include "plugin/pybullet/command.h"
#include "plugin/pybullet/event_table.h"
#include "plugin/pybullet/server_body.h"
#include "plugin/pybullet/server_client.h"
#include "plugin/pybullet/server_world.h"

namespace carom::plugin {

/// The sound of a physics server: hears its world (ServerWorld), and takes commands. A reset of the
/// simulation sets the clock to 0. [physics thread]
class ServerSound final : private ServerEars {
 public:
  /// Refuses what EventSound refuses, and a server that does not tell its parameters.
  static Result<std::unique_ptr<ServerSound>> create(b3::ServerFunctions server, b3::Client client);
  /// Sets what the `describe` command gives for the instance.
  void setName(int name) { name_ = name; }

  ServerWorld& world() { return world_; }
  /// Runs a command; returns the text to be given back for it.
  Result<std::string> execute(std::string_view text);

  /// Frames and events that were captured and wait, and the floats or doubles of each.
  std::size_t framesReady() const { return sound_->capturedFrames(); }
  std::size_t channels() const { return sound_->channelCount(); }
  std::size_t takeFrames(std::span<float> samples) { return sound_->takeCaptured(samples); }
  std::size_t eventsReady() const { return events_ ? events_->ready() : 0; }
  std::size_t eventColumns() const { return EventTable::kColumns + settings_.listeners.size(); }
  std::size_t takeEvents(std::span<double> numbers) { return events_ ? events_->take(numbers) : 0; }

 private:
  using Key = ServerWorld::Key;

  ServerSound(ServerClient client, SoundSettings settings)
      : world_(std::move(client), *this), settings_(std::move(settings)) {}

  void beginSubstep(double duration) override;
  void takePart(const ServerBody& body, ServerPart& part) override;
  void removePart(BodyId id) override;
  void movePart(BodyId id, const ListenerPose& pose) override;
  void hear(const ImpulseEvent& share) override;
  void hear(const ContactState& contact) override;
  void advanceTo(double time) override;
  void restart() override;

  Result<std::string> run(const command::PlaceListener& place);
  Result<std::string> run(const command::SetMaterial& set);
  Result<std::string> run(const command::SetModes& set);
  Result<std::string> run(const command::SetTexture& set);
  Result<std::string> run(const command::SetRoom& set);
  Result<std::string> run(const command::SetLevel& set);
  Result<std::string> run(const command::SetLatency& set);
  Result<std::string> run(const command::Capture& capture);
  Result<std::string> run(const command::Reset& reset);
  Result<std::string> run(const command::Record& record);
  Result<std::string> run(const command::RecordRun& record);
  Result<std::string> run(const command::KeepRun& keep);
  Result<std::string> run(const command::SaveRun& save);
  Result<std::string> run(const command::SetGain& set);
  Result<std::string> run(const command::Mute& mute);
  Result<std::string> run(const command::Play&);
  Result<std::string> run(const command::Stop&);
  Result<std::string> run(const command::Pause&);
  Result<std::string> run(const command::Stats&);
  Result<std::string> run(const command::Report&);
  Result<std::string> run(const command::Describe&);
  Result<std::string> run(const command::TakeSamples&);
  Result<std::string> run(const command::TakeEvents&);
  Result<std::string> run(const command::Help&);

  Status configure(const SoundSettings& settings);
  Status startCapture();
  void followClock();
  Status tell(const ServerBody& body, ServerPart& part);
  template <class Part>
  Status assign(std::string_view command, const command::Target& target,
                std::optional<Part> AssignedParts::*part, const Part& value);

  ServerWorld world_;
  int name_ = 0;
  SoundSettings settings_;
  std::optional<EventSound> sound_;
  std::optional<EventTable> events_;  // while capturing
  bool isCapturing_ = false;
  bool isRecording_ = false;  // sound or run
  double keptRun_ = 0.0;      // s
  bool hasLatency_ = false;   // a command has set it
  bool hasWarned_ = false;    // of a latency that does not suffice
  double gain_ = 1.0;
  bool isMuted_ = false;
};

}  // namespace carom::plugin
