#include "lab/report/report_choices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "native/jello/jello_limits.h"
#include "scenes/format/sound_names.h"
#include "scenes/run/bullet_only.h"
#include "scenes/run/jello_scene.h"
#include "scenes/run/native_only.h"

namespace carom::lab {

using namespace scenes;

using namespace native;

namespace {

constexpr std::array kRates = {60, 240, 1000, 8000};  // Hz, rates of Bullet's steps
constexpr int kGameRate = 60;                         // Hz
constexpr int kFilmRate = 1000;                       // Hz
constexpr std::size_t kGameModes = 16;
constexpr std::array<std::size_t, 4> kModes = {64, 16, 4, 0};

const char* nameOf(EventTime time) {
  switch (time) {
    case EventTime::exact:
      return "exact";
    case EventTime::backDated:
      return "back_dated";
    case EventTime::step:
      return "step";
  }
  return "";
}

/// True if some body has modes.
bool rings(const Scene& scene) {
  return std::ranges::any_of(scene.bodies,
                             [](const SceneBody& body) { return body.ringing.has_value(); });
}

StepperSettings bullet(const Scene& scene, int rate, bool tuned) {
  StepperSettings settings = scene.stepper;
  settings.type = StepperType::bullet;
  settings.step = 1.0 / rate;
  settings.tuned = tuned;
  return settings;
}

class Grid {
 public:
  Grid(const Scene& scene, double fineness)
      : scene_(scene),
        fineness_(fineness),
        jello_(jelloOf(scene)),
        onNative_(static_cast<bool>(validateForNative(scene))) {}

  Result<ReportGrid> make() {
    if (Status done = addReference(); !done) return done.error();
    if (jello_ != nullptr) {
      if (Status done = addJello(); !done) return done.error();
    }
    const bool onBullet = jello_ == nullptr && validateForBullet(scene_);
    if (onBullet) addMechanics();
    addSound();
    if (rings(scene_)) addModes();
    if (onBullet) addPresets();
    return std::move(grid_);
  }

 private:
  ReportChoice variant(VariantGroup group, std::string id, std::string label) const {
    ReportChoice choice = grid_.reference;
    choice.group = group;
    choice.id = std::move(id);
    choice.label = std::move(label);
    return choice;
  }
  void add(ReportChoice choice) { grid_.variants.push_back(std::move(choice)); }

  Status addReference() {
    ReportChoice& reference = grid_.reference;
    reference.stepper = scene_.stepper;
    if (jello_ != nullptr) {
      reference.stepper.type = StepperType::native;
      const JelloLimits limits = jelloLimits(jelloWorld(scene_));
      limits_ = limits.touching;
      const double limit = limitOf(JelloIntegrator::rungeKutta4);
      if (!(limit > 0.0)) return Error{scene_.name + ": its jello is stable at no step"};
      reference.jello = JelloStepping{JelloIntegrator::rungeKutta4, wholeStep(limit / fineness_)};
      reference.id = "rk4_fine";
      reference.label =
          "Runge-Kutta 4 at its largest stable step over " + std::to_string(std::lround(fineness_));
      reference.group = VariantGroup::jello;
      grid_.why =
          "The integrator of the highest order, at the shortest step that the budget allows: where "
          "the motion has an order, halving the step divides its error by 16.";
    } else if (onNative_) {
      reference.stepper.type = StepperType::native;
      reference.id = "native";
      reference.label = "native stepper";
      grid_.why =
          "The native stepper finds every collision in closed form, in continuous time; the sound "
          "is that of exactly radiating bodies whose contacts lose energy, within the band.";
    } else {
      reference.stepper = bullet(scene_, kRates.back(), true);
      reference.id = idOf(kRates.back(), true);
      reference.label = labelOf(kRates.back(), true);
      grid_.why =
          "Only Bullet can move these bodies: it does so at its shortest step here, with exact "
          "times and recovered impulses.";
    }
    return std::monostate{};
  }

  static std::string idOf(int rate, bool tuned) {
    return (tuned ? "bullet_tuned_" : "bullet_") + std::to_string(rate);
  }
  static std::string labelOf(int rate, bool tuned) {
    return (tuned ? "tuned Bullet at 1/" : "Bullet at 1/") + std::to_string(rate) + " s";
  }

  void addMechanics() {
    for (const int rate : kRates) {
      // With solids, Bullet is always tuned.
      if (onNative_) addBullet(rate, false);
      if (onNative_ || rate != kRates.back()) addBullet(rate, true);
    }
  }

  void addBullet(int rate, bool tuned) {
    ReportChoice choice = variant(VariantGroup::mechanics, idOf(rate, tuned), labelOf(rate, tuned));
    choice.stepper = bullet(scene_, rate, tuned);
    add(choice);
    // The effect of tuning is measured with exact times only.
    if (tuned && onNative_) return;
    ReportChoice applied = choice;
    applied.id += "_applied";
    applied.label += ", its own impulses";
    applied.impulse = ImpulseChoice::applied;
    add(applied);
    ReportChoice backDated = choice;
    backDated.id += "_back_dated";
    backDated.label += ", back-dated";
    backDated.eventTime = EventTime::backDated;
    add(backDated);
    ReportChoice step = choice;
    step.id += "_step";
    step.label += ", times of steps";
    step.eventTime = EventTime::step;
    add(step);
  }

  void addPulse(PulseShape shape, const std::string& label) {
    ReportChoice choice =
        variant(VariantGroup::sound, std::string("pulse_") + scenes::nameOf(shape), label);
    choice.dissipative = false;
    choice.pulse = shape;
    add(choice);
  }

  void addSound() {
    addPulse(PulseShape::hertz, "pulse of an elastic contact (Hertz)");
    addPulse(PulseShape::halfSine, "pulse: half a sine");
    addPulse(PulseShape::gaussian, "pulse: a Gaussian of the same impulse");
    addPulse(PulseShape::mitchellNetravali, "pulse: Mitchell and Netravali's");
    addPulse(PulseShape::courseGaussian, "pulse: the course Gaussian");
    ReportChoice naive = variant(VariantGroup::sound, "naive", "naive sampling");
    naive.sampling = Sampling::naive;
    add(naive);
    ReportChoice compact = variant(VariantGroup::sound, "compact", "compact radiation");
    compact.radiation = Radiation::compact;
    add(compact);
    ReportChoice still = variant(VariantGroup::sound, "no_doppler", "distances stand still");
    still.doppler = false;
    add(still);
    ReportChoice clear = variant(VariantGroup::sound, "no_air", "the air absorbs nothing");
    clear.air = false;
    add(clear);
    ReportChoice courseGaussian =
        variant(VariantGroup::sound, "course_gaussian", "all simplifications of the sound");
    asInTheHandOut(courseGaussian);
    add(courseGaussian);
  }

  static void asInTheHandOut(ReportChoice& choice) {
    choice.dissipative = false;
    choice.pulse = PulseShape::courseGaussian;
    choice.sampling = Sampling::naive;
    choice.radiation = Radiation::compact;
    choice.doppler = false;
    choice.air = false;
  }

  void addModes() {
    ReportChoice pressed = variant(VariantGroup::modes, "pressed", "modes do not give way");
    pressed.ringing = RingingContact::pressed;
    add(pressed);
    for (const std::size_t most : kModes) {
      const std::string number = std::to_string(most);
      ReportChoice choice = variant(VariantGroup::modes, "modes_" + number,
                                    most > 0 ? number + " modes for each body" : "nothing rings");
      choice.mostModes = most;
      add(choice);
    }
  }

  void addPresets() {
    ReportChoice game = variant(VariantGroup::presets, "game", "");
    game.label =
        "game: tuned Bullet at 1/" + std::to_string(kGameRate) + " s, elastic contacts, compact";
    game.stepper = bullet(scene_, kGameRate, true);
    game.dissipative = false;
    game.radiation = Radiation::compact;
    game.doppler = false;
    if (rings(scene_)) {
      game.mostModes = kGameModes;
      game.label += ", " + std::to_string(kGameModes) + " modes";
    }
    add(game);
    ReportChoice plain = variant(VariantGroup::presets, "plain", "");
    plain.label = "without a bridge: Bullet at 1/" + std::to_string(kGameRate) +
                  " s, its times and impulses, simplified sound";
    plain.stepper = bullet(scene_, kGameRate, !onNative_);
    plain.eventTime = EventTime::step;
    plain.impulse = ImpulseChoice::applied;
    asInTheHandOut(plain);
    add(plain);
    ReportChoice film = variant(VariantGroup::presets, "film", "");
    film.label = "film: tuned Bullet at 1/" + std::to_string(kFilmRate) + " s, exact sound";
    film.stepper = bullet(scene_, kFilmRate, true);
    add(film);
  }

  double limitOf(JelloIntegrator integrator) const {
    return limits_[static_cast<std::size_t>(integrator)];
  }

  /// Returns the largest step that divides 1/60 s into whole parts and is not above `step` (s).
  static double wholeStep(double step) {
    constexpr double kPicture = 1.0 / 60.0;
    return kPicture / std::max(1.0, std::ceil(kPicture / step));
  }

  Status addJello() {
    for (std::size_t index = 0; index < kJelloIntegrators; ++index) {
      const auto integrator = static_cast<JelloIntegrator>(index);
      double limit = limitOf(integrator);
      if (!(limit > 0.0)) continue;
      // An integrator that is stable at any step is tried at steps like the others'.
      if (!std::isfinite(limit)) limit = limitOf(JelloIntegrator::rungeKutta4);
      double last = 0.0;
      for (const double share : {0.9, 0.6, 0.3}) {
        const JelloStepping stepping = {integrator, wholeStep(share * limit)};
        if (stepping.step == last) continue;
        last = stepping.step;
        addJello(stepping);
      }
    }
    return std::monostate{};
  }

  void addJello(const JelloStepping& stepping) {
    const auto rate = static_cast<std::int64_t>(std::llround(1.0 / stepping.step));
    const std::string name = native::nameOf(stepping.integrator);
    std::string words = name;
    std::ranges::replace(words, '_', ' ');
    ReportChoice choice = variant(VariantGroup::jello, name + "_" + std::to_string(rate),
                                  words + " at 1/" + std::to_string(rate) + " s");
    choice.jello = stepping;
    add(choice);
  }

  const Scene& scene_;
  double fineness_;
  const JelloShape* jello_;
  bool onNative_;
  std::array<double, kJelloIntegrators> limits_{};
  ReportGrid grid_;
};

std::shared_ptr<const JelloShape> stepped(const JelloShape& jello, const JelloStepping& stepping) {
  auto shape = std::make_shared<JelloShape>(jello);
  shape->integrator = stepping.integrator;
  shape->step = stepping.step;
  return shape;
}

}  // namespace

Result<ReportGrid> reportGrid(const Scene& scene, double fineness) {
  return Grid(scene, fineness).make();
}

Scene sceneOf(const Scene& scene, const ReportChoice& choice) {
  Scene result = scene;
  result.stepper = choice.stepper;
  result.sound.impulse = choice.impulse;
  result.sound.comparison.pulse = choice.pulse;
  result.sound.dissipative = choice.dissipative;
  result.sound.comparison.sampling = choice.sampling;
  result.sound.comparison.radiation = choice.radiation;
  result.sound.doppler = choice.doppler;
  result.sound.airAbsorption = choice.air;
  result.sound.ringingContact = choice.ringing;
  result.mostModes = choice.mostModes;
  if (!choice.jello) return result;
  for (SceneBody& body : result.bodies)
    if (auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape))
      *jello = stepped(**jello, *choice.jello);
  return result;
}

std::vector<std::pair<std::string, std::variant<std::string, double, bool>>> namesOf(
    const ReportChoice& choice) {
  using Value = std::variant<std::string, double, bool>;
  std::vector<std::pair<std::string, Value>> names;
  const auto word = [&names](const char* key, const char* value) {
    names.emplace_back(key, std::string(value));
  };
  const bool onBullet = choice.stepper.type == StepperType::bullet;
  word("stepper", onBullet ? "bullet" : "native");
  if (onBullet) {
    names.emplace_back("step", choice.stepper.step);
    names.emplace_back("tuned", choice.stepper.tuned);
    word("event_time", nameOf(choice.eventTime));
    word("impulse", choice.impulse == ImpulseChoice::physical ? "physical" : "applied");
  }
  if (choice.jello) {
    word("integrator", native::nameOf(choice.jello->integrator));
    names.emplace_back("step", choice.jello->step);
  }
  word("pulse", pulseName(choice.pulse, choice.dissipative));
  word("sampling", samplingName(choice.sampling));
  word("radiation", radiationName(choice.radiation));
  names.emplace_back("doppler", choice.doppler);
  names.emplace_back("air", choice.air);
  word("ringing", ringingName(choice.ringing));
  if (choice.mostModes) names.emplace_back("modes", static_cast<double>(*choice.mostModes));
  return names;
}

const char* nameOf(VariantGroup group) {
  switch (group) {
    case VariantGroup::mechanics:
      return "mechanics";
    case VariantGroup::sound:
      return "sound";
    case VariantGroup::modes:
      return "modes";
    case VariantGroup::jello:
      return "jello";
    case VariantGroup::presets:
      return "presets";
  }
  return "";
}

}  // namespace carom::lab
