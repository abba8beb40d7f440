#include "scenes/recording/event_tape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "scenes/run/stopwatch.h"

namespace carom::scenes {

using namespace audio;

namespace {

constexpr double kPortion = 4096.0 / 48000.0;  // s
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// s: a deforming body is heard a few states late, so the tape goes on for so long after the end.
constexpr double kTail = 0.1;

class TapeStepper : public SceneStepper {
 public:
  explicit TapeStepper(std::shared_ptr<const EventTape> tape) : tape_(std::move(tape)) {}

  std::span<const ImpulseEvent> advanceTo(double time) override {
    now_.events.clear();
    now_.contacts.clear();
    now_.poses.clear();
    now_.deformations.clear();
    while (next_ < tape_->portions.size() && settledTime_ < time) {
      const RunPortion& portion = tape_->portions[next_++];
      now_.events.insert(now_.events.end(), portion.events.begin(), portion.events.end());
      now_.contacts.insert(now_.contacts.end(), portion.contacts.begin(), portion.contacts.end());
      now_.poses.insert(now_.poses.end(), portion.poses.begin(), portion.poses.end());
      now_.deformations.insert(now_.deformations.end(), portion.deformations.begin(),
                               portion.deformations.end());
      settledTime_ = portion.settledTime;
    }
    // The tape has ended: no further event can come.
    if (next_ == tape_->portions.size() && settledTime_ < time)
      settledTime_ = std::numeric_limits<double>::infinity();
    return now_.events;
  }
  std::span<const ContactState> contacts() const override { return now_.contacts; }
  bool reportsContacts() const override { return tape_->hasContacts; }
  std::span<const BodyPose> poses() const override { return now_.poses; }
  double settledTime() const override { return settledTime_; }
  double hearDeformations() override { return tape_->deformationStep; }
  std::span<const DeformingState> deformations() const override { return now_.deformations; }
  std::uint64_t jammed() const override { return tape_->jammed; }

 private:
  std::shared_ptr<const EventTape> tape_;
  std::size_t next_ = 0;
  double settledTime_ = 0.0;
  RunPortion now_;
};

}  // namespace

Status runInPortions(SceneStepper& stepper, double duration, double deformationStep,
                     RunGuard* guard, const std::function<Status(RunPortion)>& take) {
  if (guard != nullptr) guard->restart();
  stepper.watch(guard);
  const double end = deformationStep > 0.0 ? duration + kTail : duration;
  for (double target = 0.0; stepper.settledTime() < end;) {
    const double begin = std::max(target, stepper.settledTime());
    // Where contacts last, their steps are handed over one by one, as SceneSound asks for them.
    target = stepper.reportsContacts() ? std::nextafter(begin, kInfinity) : begin + kPortion;
    target = std::min(target, end);
    const Stopwatch stopwatch;
    const auto events = stepper.advanceTo(target);
    RunPortion portion;
    portion.seconds = stopwatch.seconds();
    portion.events.assign(events.begin(), events.end());
    const auto contacts = stepper.contacts();
    portion.contacts.assign(contacts.begin(), contacts.end());
    const auto poses = stepper.poses();
    portion.poses.assign(poses.begin(), poses.end());
    const auto deformations = stepper.deformations();
    portion.deformations.assign(deformations.begin(), deformations.end());
    const auto pictures = stepper.pictures();
    portion.pictures.assign(pictures.begin(), pictures.end());
    portion.settledTime = stepper.settledTime();
    if (Status ended = checkEnded(guard); !ended) return ended;
    if (const std::string failure = stepper.failure(); !failure.empty()) return Error{failure};
    if (Status taken = take(std::move(portion)); !taken) return taken;
  }
  return std::monostate{};
}

Result<EventTape> recordTape(SceneStepper& stepper, double duration, RunGuard* guard) {
  EventTape tape;
  tape.deformationStep = stepper.hearDeformations();
  tape.hasContacts = stepper.reportsContacts();
  const Status run = runInPortions(stepper, duration, tape.deformationStep, guard,
                                   [&tape](RunPortion portion) -> Status {
                                     tape.seconds += portion.seconds;
                                     tape.portions.push_back(std::move(portion));
                                     return std::monostate{};
                                   });
  if (!run) return run.error();
  tape.jammed = stepper.jammed();
  return tape;
}

std::vector<ImpulseEvent> eventsOf(const EventTape& tape) {
  std::vector<ImpulseEvent> events;
  for (const RunPortion& portion : tape.portions)
    events.insert(events.end(), portion.events.begin(), portion.events.end());
  std::stable_sort(events.begin(), events.end(),
                   [](const ImpulseEvent& a, const ImpulseEvent& b) { return a.time < b.time; });
  return events;
}

std::unique_ptr<SceneStepper> tapeStepper(std::shared_ptr<const EventTape> tape) {
  return std::make_unique<TapeStepper>(std::move(tape));
}

}  // namespace carom::scenes
