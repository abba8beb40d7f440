#include "lab/report/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "lab/report/report_run.h"

namespace carom::lab {

using namespace scenes;
namespace {

double medianOf(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

RunTime runTimeOf(const std::vector<double>& mechanics, const std::vector<double>& sound,
                  double duration) {
  RunTime time;
  time.runs = std::min(mechanics.size(), sound.size());
  std::vector<double> sums;
  sums.reserve(time.runs);
  for (std::size_t run = 0; run < time.runs; ++run)
    sums.push_back(mechanics[run] + sound[run]);
  const auto [shortest, longest] = std::ranges::minmax(sums);
  const double median = medianOf(sums);
  time.mechanics = medianOf(mechanics) / duration;
  time.sound = medianOf(sound) / duration;
  time.spread = median > 0.0 ? (longest - shortest) / median : 0.0;
  return time;
}

std::vector<Collision> heardCollisions(const EventTape& tape, const ReportChoice& choice,
                                       double duration) {
  std::vector<ImpulseEvent> events = eventsOf(tape);
  std::erase_if(events, [&](const ImpulseEvent& event) { return event.time > duration; });
  if (choice.impulse == ImpulseChoice::applied) {
    for (ImpulseEvent& event : events)
      if (event.hasAppliedImpulse) event.impulse = event.appliedImpulse;
  }
  return collisionsOf(events);
}

/// The choices that two variants with the same mechanics share.
using MechanicsKey = std::tuple<int, double, bool, int, double>;

MechanicsKey keyOf(const ReportChoice& choice) {
  const bool onBullet = choice.stepper.type == StepperType::bullet;
  const int integrator = choice.jello ? static_cast<int>(choice.jello->integrator) : -1;
  return {onBullet ? 1 : 0, onBullet ? choice.stepper.step : 0.0, onBullet && choice.stepper.tuned,
          integrator, choice.jello ? choice.jello->step : 0.0};
}

class SceneReporter {
 public:
  SceneReporter(const Scene& scene, const ReportOptions& options)
      : scene_(scene), options_(options) {}

  Result<SceneReport> run() {
    Result<ReportGrid> grid = affordableGrid();
    if (!grid) return grid.error();
    report_.scene = scene_;
    report_.referenceWhy = grid->why;
    reference_ = grid->reference;
    report_.plan = makePlan(sceneOf(scene_, reference_));
    std::vector<ReportChoice> choices = grid->variants;
    choices.insert(choices.begin(), reference_);
    for (std::size_t index = 0; index < choices.size(); ++index) {
      if (options_.progress) {
        options_.progress(static_cast<double>(index) / static_cast<double>(choices.size()),
                          choices[index].label);
      }
      if (Status done = add(choices[index]); !done) return done.error();
    }
    if (options_.show)
      if (Status shown = showAll(); !shown) return shown.error();
    return std::move(report_);
  }

 private:
  struct Mechanics {
    MechanicsRun run;
    std::vector<Collision> found;                // exact times, physical impulses
    std::shared_ptr<const EventTape> exactTape;  // its sound is the reference of `local`
    std::optional<Signal> exactSignal;           // `exactTape` with the reference's sound
  };

  /// Returns the grid whose reference is as fine as the budget allows; only a jello's reference
  /// depends on it.
  Result<ReportGrid> affordableGrid() const {
    for (const double fineness : {8.0, 4.0}) {
      Result<ReportGrid> grid = reportGrid(scene_, fineness);
      if (!grid) return grid;
      const Result<double> seconds =
          expectedSeconds(sceneOf(scene_, grid->reference), options_.guard);
      if (!seconds) return seconds.error();
      if (*seconds <= options_.budget) return grid;
    }
    return reportGrid(scene_, 2.0);
  }

  Status add(const ReportChoice& choice) {
    const Scene scene = sceneOf(scene_, choice);
    const std::string why = reasonToSkip(choice, scene);
    if (Status ended = checkEnded(options_.guard); !ended) return ended;
    if (!why.empty()) {
      report_.leftOut.push_back({choice.label, why});
      return std::monostate{};
    }
    const MechanicsKey key = keyOf(choice);
    if (!mechanics_.contains(key)) {
      Result<Mechanics> made = makeMechanics(scene);
      if (!made) {
        // The reference has to run; that another variant cannot is a finding.
        if (report_.variants.empty() || !checkEnded(options_.guard)) return made.error();
        report_.leftOut.push_back({choice.label, made.error().message});
        return std::monostate{};
      }
      mechanics_.emplace(key, *std::move(made));
    }
    return measure(choice, scene, mechanics_.at(key));
  }

  /// Returns why a run would take longer than the budget, or why it cannot be run at all; empty if
  /// it can. Bullet's time is estimated from how long coarser steps took.
  std::string reasonToSkip(const ReportChoice& choice, const Scene& scene) const {
    if (report_.variants.empty() || mechanics_.contains(keyOf(choice))) return {};
    Result<double> seconds = expectedSeconds(scene, options_.guard);
    if (!seconds) return seconds.error().message;
    if (choice.stepper.type == StepperType::bullet) {
      for (const auto& [key, mechanics] : mechanics_) {
        const auto& [onBullet, step, tuned, integrator, jelloStep] = key;
        if (onBullet == 1)
          *seconds = std::max(*seconds, mechanics.run.seconds.front() * step / choice.stepper.step);
      }
    }
    if (*seconds <= options_.budget) return {};
    return "a run would take about " + std::to_string(std::lround(*seconds)) + " s";
  }

  Result<Mechanics> makeMechanics(const Scene& scene) const {
    Result<MechanicsRun> run = runMechanics(scene, runs(options_.runs));
    if (!run) return run.error();
    Mechanics mechanics{*std::move(run), {}, {}, {}};
    mechanics.found = heardCollisions(*mechanics.run.tape, reference_, scene.duration);
    mechanics.exactTape = mechanics.run.exact ? std::make_shared<const EventTape>(withEvents(
                                                    *mechanics.run.tape, *mechanics.run.exact))
                                              : mechanics.run.tape;
    return mechanics;
  }

  Status measure(const ReportChoice& choice, const Scene& scene, Mechanics& mechanics) {
    VariantReport variant;
    variant.choice = choice;
    const auto tape = std::make_shared<const EventTape>(chosenTape(mechanics.run, choice));
    Result<SoundRun> sound = runSound(scene, tape, runs(options_.runs));
    if (!sound) return sound.error();
    variant.signal = std::move(sound->signal);
    variant.runTime = runTimeOf(mechanics.run.seconds, sound->seconds, scene.duration);
    if (mechanics.run.memory && sound->memory)
      variant.memory = *mechanics.run.memory + *sound->memory;
    if (!report_.variants.empty()) {
      if (Status local = compareLocally(mechanics, *tape, variant); !local) return local;
      compareGlobally(mechanics, variant);
    } else {
      variant.comparedUntil = scene.duration;
      referenceBands_ = thirdOctaves(variant.signal, scene_.sampleRate);
    }
    report_.variants.push_back(std::move(variant));
    return std::monostate{};
  }

  bool hasReferenceMechanics(const ReportChoice& choice) const {
    return keyOf(choice) == keyOf(reference_);
  }

  Status compareLocally(Mechanics& mechanics, const EventTape& tape, VariantReport& variant) {
    const ReportChoice& choice = variant.choice;
    const bool changed =
        choice.eventTime != EventTime::exact || choice.impulse != ImpulseChoice::physical;
    if (choice.jello || (hasReferenceMechanics(choice) && !changed)) return std::monostate{};
    variant.local = mechanics.run.exact ? LocalKind::path : LocalKind::bridge;
    if (mechanics.run.exact || changed) {
      std::vector<ImpulseEvent> exact = eventsOf(*mechanics.exactTape);
      std::erase_if(exact, [&](const ImpulseEvent& event) { return event.time > scene_.duration; });
      variant.events = matchCollisions(heardCollisions(tape, choice, scene_.duration),
                                       collisionsOf(exact), 3.0 * choice.stepper.step);
    } else {
      variant.notes.emplace_back("its exact collisions are those that the bridge finds");
    }
    if (!mechanics.exactSignal) {
      ReportChoice exactChoice = reference_;
      exactChoice.stepper = choice.stepper;
      Result<SoundRun> exact = runSound(sceneOf(scene_, exactChoice), mechanics.exactTape, runs(1));
      if (!exact) return exact.error();
      mechanics.exactSignal = std::move(exact->signal);
    }
    const double error = waveformError(variant.signal, *mechanics.exactSignal, frames());
    if (std::isfinite(error)) variant.localWaveformError = error;
    return std::monostate{};
  }

  /// Hands the variants over to be seen and heard: the reference first, then presets, which differ
  /// most from it.
  Status showAll() {
    std::vector<const ReportChoice*> choices;
    for (const VariantReport& variant : report_.variants)
      choices.push_back(&variant.choice);
    std::stable_partition(choices.begin() + 1, choices.end(), [](const ReportChoice* choice) {
      return choice->group == VariantGroup::presets;
    });
    for (const ReportChoice* choice : choices) {
      if (options_.isFull && options_.isFull()) return std::monostate{};
      if (Status shown = show(*choice); !shown) return shown;
    }
    return std::monostate{};
  }

  Status show(const ReportChoice& choice) {
    const Scene scene = sceneOf(scene_, choice);
    const MechanicsKey key = keyOf(choice);
    ViewOptions options;
    options.guard = options_.guard;
    if (!viewTape_ || viewTape_->first != key) {
      if (options_.guard != nullptr) options_.guard->restart();
      Result<ViewTape> tape = recordView(withAllImpulses(scene), options);
      if (!tape) return tape.error();
      viewTape_ = {key, *std::move(tape)};
    }
    const MechanicsRun& run = mechanics_.at(key).run;
    options.heardAt = [&](const ImpulseEvent& event) { return heardTime(event, run, choice); };
    Result<ViewRun> view = viewTape(scene, viewTape_->second, options);
    if (!view) return view.error();
    view->id = choice.id;
    view->label = choice.label;
    const Result<bool> taken = options_.show(*view);
    if (!taken) return taken.error();
    if (*taken) report_.shown.push_back(choice.id);
    return std::monostate{};
  }

  RunsOptions runs(std::size_t count) const { return {.runs = count, .guard = options_.guard}; }

  std::size_t frames() const {
    return static_cast<std::size_t>(std::llround(scene_.duration * scene_.sampleRate));
  }

  void compareGlobally(const Mechanics& mechanics, VariantReport& variant) {
    const ReportChoice& choice = variant.choice;
    const VariantReport& reference = report_.variants.front();
    const Mechanics& exact = mechanics_.at(keyOf(reference_));
    if (!hasReferenceMechanics(choice)) {
      const bool onBullet = choice.stepper.type == StepperType::bullet;
      const double limit = (onBullet ? 4.0 * choice.stepper.step : 0.0) + 0.01;
      variant.divergedAt = commonRun(mechanics.found, exact.found, limit).divergedAt;
    }
    variant.comparedUntil = std::min(variant.divergedAt, scene_.duration);
    const auto until = static_cast<std::size_t>(variant.comparedUntil * scene_.sampleRate);
    const double error = waveformError(variant.signal, reference.signal, until);
    if (std::isfinite(error)) {
      variant.waveformError = error;
      variant.aligned = alignedError(variant.signal, reference.signal, until, scene_.sampleRate);
    }
    variant.bands =
        bandDifferences(thirdOctaves(variant.signal, scene_.sampleRate), referenceBands_);
    if (hasReferenceMechanics(choice)) return;
    variant.energyDrift = energyDrift(mechanics.run, exact.run, variant.comparedUntil);
    variant.positionError = positionError(mechanics.run, exact.run);
  }

  /// Returns the difference of the two mechanical energies right before `time`, over the
  /// reference's largest kinetic energy.
  static std::optional<double> energyDrift(const MechanicsRun& run, const MechanicsRun& reference,
                                           double time) {
    using Energy = MechanicsRun::Energy;
    const auto lastOf = [time](const std::vector<Energy>& energies) -> const Energy* {
      const auto after = std::ranges::upper_bound(energies, time, {}, &Energy::time);
      return after == energies.begin() ? nullptr : &*(after - 1);
    };
    const Energy* mine = lastOf(run.energies);
    const Energy* exact = lastOf(reference.energies);
    double largest = 0.0;
    for (const Energy& energy : reference.energies)
      largest = std::max(largest, energy.kinetic);
    if (mine == nullptr || exact == nullptr || !(largest > 0.0)) return std::nullopt;
    return (mine->kinetic + mine->potential - exact->kinetic - exact->potential) / largest;
  }

  static std::optional<double> positionError(const MechanicsRun& run,
                                             const MechanicsRun& reference) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t time = 0; time < std::min(run.places.size(), reference.places.size());
         ++time) {
      for (std::size_t point = 0; point < run.places[time].size(); ++point)
        sum += (run.places[time][point] - reference.places[time][point]).squaredNorm();
      count += run.places[time].size();
    }
    if (count == 0) return std::nullopt;
    return std::sqrt(sum / static_cast<double>(count));
  }

  const Scene& scene_;
  const ReportOptions& options_;
  ReportChoice reference_;
  SceneReport report_;
  std::map<MechanicsKey, Mechanics> mechanics_;
  std::optional<std::pair<MechanicsKey, ViewTape>> viewTape_;  // the latest one
  std::vector<ThirdOctave> referenceBands_;
};

}  // namespace

Result<SceneReport> reportScene(const Scene& scene, const ReportOptions& options) {
  return SceneReporter(scene, options).run();
}

}  // namespace carom::lab
