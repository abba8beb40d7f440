#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/result.h"
#include "carom/event_sound.h"
#include "plugin/pybullet/command.h"
#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/event_table.h"
#include "plugin/pybullet/lasting_pairs.h"
#include "plugin/pybullet/server_body.h"
#include "plugin/pybullet/server_client.h"

namespace carom::plugin {

/// The sound of a physics server: asks it in every substep, and takes commands.
///
/// Bodies and links are described (describeBody) when they are first in a contact; later changes of
/// their dynamics count from the next contact on. Before each substep the server is asked for its
/// parameters and for the states that it has not told (BodyMotion), after it for the contacts: once
/// it has told that it has stepped, or before the next substep within a step. Its solver has run
/// then in any world; one with deformable bodies tells the end of a substep before that. Simulation
/// time is the sum of the substeps since the plugin was loaded, or the simulation was reset.
/// [physics thread]
class ServerSound final : private SubstepMotions {
 public:
  /// Refuses what EventSound refuses, and a server that does not tell its parameters. `name` is
  /// what the `describe` command gives for it.
  static Result<std::unique_ptr<ServerSound>> create(b3::ServerFunctions server, b3::Client client,
                                                     int name);

  void beginSubstep();
  void endSubstep();
  void hear(std::span<const b3::Notification> notifications);
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
  using Key = ServerClient::Key;

  ServerSound(ServerClient client, int name, SoundSettings settings)
      : client_(std::move(client)), name_(name), settings_(std::move(settings)) {}

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
  Result<std::string> run(const command::SetGain& set);
  Result<std::string> run(const command::Mute& mute);
  Result<std::string> run(const command::Play&);
  Result<std::string> run(const command::Stop&);
  Result<std::string> run(const command::Pause&);
  Result<std::string> run(const command::Stats&);
  Result<std::string> run(const command::Describe&);
  Result<std::string> run(const command::TakeSamples&);
  Result<std::string> run(const command::TakeEvents&);
  Result<std::string> run(const command::Help&);

  Status configure(const SoundSettings& settings);
  Status startCapture();
  void resetTo(double seconds);
  void addBody(int body);
  void removeBody(int body);
  ServerBody* find(int body);
  const ServerBody* find(int body) const;
  const ServerBody* bodyOf(BodyId id) const;
  ServerPart& partOf(Key key);
  const ServerPart& described(Key key);
  void describe(Key key, ServerPart& part);
  Status tell(const ServerBody& body, ServerPart& part);
  Status tellAll();
  template <class Part>
  Status assign(std::string_view command, const command::Target& target,
                std::optional<Part> AssignedParts::*part, const Part& value);
  std::optional<BodyState> stateAfter(BodyId id);
  std::optional<BodyState> stateOf(Key key);
  void takeStates();
  void askFor(int body, BodyMotion& motion, BodyMotion::Source source);
  void beginMotions();
  void hearStep(std::span<const b3::Notification> told);
  void hearPlace(const b3::Notification& told);
  void readContacts();
  void addImpulse(const b3::ContactPoint& contact, ServerBody& body, double sign);
  void correctMotions();
  void correct(int number, ServerBody& body);
  void finishSubstep();
  void post(const ImpulseEvent& event);
  void hearLasting();
  std::optional<SubstepMotion> motionOf(BodyId id) const override;
  const BodyState* endStateOf(BodyId id) const override;
  void suitLatency();

  ServerClient client_;
  int name_;
  SoundSettings settings_;
  std::optional<EventSound> sound_;
  std::optional<EventTable> events_;  // while capturing
  bool isCapturing_ = false;
  bool isRecording_ = false;
  bool hasLatency_ = false;  // a command has set it
  double gain_ = 1.0;
  bool isMuted_ = false;
  ContactListener listener_;
  LastingPairs lasting_;
  RadiatorCache radiators_{PanelSettings{.quick = true}};
  std::vector<ServerBody> bodies_;  // by number
  std::vector<Key> keys_;           // by id, of all parts that were; without a body, of gone ones
  double epoch_ = 0.0;              // s, time at which substeps of the present duration began
  std::uint64_t steps_ = 0;         // substeps since then
  double counted_ = 0.0;            // s, their duration
  double time_ = 0.0;               // s
  double duration_ = 0.0;           // s, of the present substep; 0 where the server did not tell
  double outer_ = 0.0;              // s, of the whole step
  std::uint64_t impacts_ = 0;
  std::uint64_t softContacts_ = 0;  // contacts of soft bodies, in substeps
  Vec3 gravity_ = Vec3::Zero();     // m/s^2
  double pushDistance_ = 0.0;       // m, see splitImpulseDistance
  std::uint64_t substep_ = 0;       // number of the present one, from 1
  bool isOpen_ = false;             // the substep is still to be finished
  bool isTold_ = false;             // the server tells of its steps
  std::vector<TouchPoint> points_;
};

}  // namespace carom::plugin
