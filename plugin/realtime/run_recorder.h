#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "audio/run/host_run.h"
#include "audio/run/open_contacts.h"
#include "audio/run/run_portion.h"
#include "audio/run/run_writer.h"
#include "carom/audio/result.h"
#include "carom/sound_settings.h"

namespace carom::plugin {

/// Keeps what a host tells its sound, to be heard again: in a file, as it goes, or in memory, the
/// last seconds of it. Bodies are numbered in the order in which they come; a run has 200,000 at
/// once at most, and leaves others out. Leaps of the clock are left out, as SoundRecorder leaves
/// them out. [simulation thread]
class RunRecorder {
 public:
  /// Refuses what RunWriter refuses.
  static Result<std::unique_ptr<RunRecorder>> toFile(const std::filesystem::path& file,
                                                     const SoundSettings& settings);
  /// Keeps the last `seconds`, and up to kPiece more, in memory.
  static std::unique_ptr<RunRecorder> inMemory(double seconds, const SoundSettings& settings);

  /// The error that has ended it.
  const std::optional<Error>& failure() const { return failure_; }
  /// The sentence for the host on bodies that are left out, if there are more than a run can have.
  const std::optional<Error>& lack() const { return lack_; }
  double seconds() const { return time_ + shift_; }  ///< s, clock of the run

  /// Begins at that time of the simulation.
  void startAt(double seconds);
  /// Sets how a body sounds from now on. It is in the file as it is when it is first needed.
  void setBody(BodyId id, const SoundBody& body);
  /// Sets how a body is called and drawn. To be called before it is needed.
  void describe(BodyId id, std::string name, const audio::BodyForm& form);
  void removeBody(BodyId id);
  /// Leaves out what is of bodies that were not set.
  void post(const ImpulseEvent& event);
  void updateContact(const ContactState& contact);
  void moveBody(BodyId id, const ListenerPose& pose);
  /// A listener that jumps goes there at 170 m/s: paths know no jumps. After kMostPathPoses of all
  /// listeners they stay where they are.
  void moveListener(std::size_t listener, const ListenerPose& pose);
  /// Takes note that the clock leaps to `seconds`.
  void leapTo(double seconds);
  /// Ends a step. Every event before `settled` (s) has been posted.
  void advanceTo(double seconds, double settled);

  /// Completes the file of toFile. Returns the first error since the beginning, up to which the
  /// file has the run if it can be had.
  Status finish();
  /// Writes what is in memory into a file. Refuses what RunWriter refuses.
  Status save(const std::filesystem::path& file);

  static constexpr double kPiece = 1.0;  ///< s, by which old portions go

 private:
  struct Body {
    audio::HostBody record;
    bool isNumbered = false;
    bool isWritten = false;  // as it is now
  };
  struct Extent {
    double seconds = 0.0;  // clock of the run
    std::uint32_t bodies = 0;
  };
  /// A place at which the file could end, and what it would have.
  struct CutPlace {
    audio::RunWriter::Place place;
    Extent extent;
  };
  struct Removed {
    BodyId number = 0;
    double time = 0.0;  // s, clock of the run
  };
  /// Portions in memory, packed, with what begins and ends with them.
  struct Piece {
    double begin = 0.0;  // s, clock of the run
    std::vector<audio::HostBody> changes;
    std::vector<std::byte> portions;
    std::uint64_t count = 0;
    std::vector<audio::BodyPose> ends;  // last poses, of the bodies that have some
    std::vector<ContactState> lasting;  // on bodies that ring, at the end
  };

  RunRecorder(const SoundSettings& settings, std::optional<double> kept);
  std::optional<BodyId> numberOf(BodyId id);
  template <class Record>
  void add(Record record, std::vector<Record>& records);
  bool rings(const ContactState& contact) const;
  bool isOfUse(const ContactState& contact);
  std::optional<BodyId> takeNumber();
  void closePortion(double settled);
  void write(audio::RunPortion portion);
  void notePlace();
  double cutShort();
  void keep(audio::RunPortion portion);
  void closePiece();
  void dropOld();
  void fail(Error error);
  audio::HostWorld world(double begin, const Extent& extent) const;

  SynthSettings synth_;
  std::vector<Listener> listeners_;
  bool hasOwnHeads_ = false;
  std::optional<double> kept_;  // s, in memory
  std::optional<Error> failure_;
  std::optional<Error> lack_;
  std::map<BodyId, Body> bodies_;               // by the host's id
  std::vector<BodyId> fresh_;                   // of these, not numbered yet
  std::uint32_t count_ = 0;                     // of numbers
  std::vector<Removed> removed_;                // bodies that are gone
  std::deque<BodyId> free_;                     // their numbers, where nothing in hand has them
  std::set<std::pair<BodyId, BodyId>> moving_;  // the host's ids: their contact slides or rolls
  audio::OpenContacts lasting_;                 // by number, on bodies that ring
  std::vector<std::vector<ListenerPose>> paths_;
  double since_ = 0.0;            // s, the run's clock: of the listeners' first poses
  std::vector<double> toldAt_;    // s, the run's clock, by listener: when it last stood still
  std::vector<bool> isOnItsWay_;  // by listener: it has jumped, and is not there yet
  double time_ = 0.0;             // s, the host's clock
  double shift_ = 0.0;            // s, from it to the run's
  double settled_ = 0.0;          // s, the run's clock: of the portion before
  audio::RunPortion portion_;     // of the step in hand
  std::vector<audio::HostBody> changes_;  // from the step in hand on

  std::optional<audio::RunWriter> writer_;  // to a file
  std::deque<CutPlace> places_;             // the last ones
  Extent written_;                          // or about to be
  audio::HostEncoder encoder_;

  std::deque<Piece> pieces_;  // in memory
  std::vector<audio::RunPortion> open_;
  std::size_t openSize_ = 0;
  std::map<BodyId, audio::HostBody> before_;  // by number, as they were before the first piece
  std::map<BodyId, ListenerPose> poses_;      // the same
  std::vector<ContactState> contacts_;        // the same, on bodies that ring
};

}  // namespace carom::plugin
