#include "command/strike_command.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "command/command_line.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/terminal/terminal.h"
#include "lab/report/report_text.h"
#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <nlohmann/json.hpp>

#include "audio/model/surface_locator.h"
#include "carom/audio/panel_radiator.h"
#include "carom/audio/sound_file.h"
#include "carom/audio/synth.h"
#include "carom/modal/mesh_analysis.h"
#include "scenes/format/model_file.h"

namespace carom::command {

using namespace scenes;

using namespace audio;

namespace {

constexpr double kLongest = 60.0;           // s
constexpr double kFarthest = 1e4;           // limit of coordinates in m, and of impulses in N s
constexpr double kNearest = 1e-3;           // m, least distance of the listener
constexpr double kBefore = 0.02;            // s, silence before the impact
constexpr double kHardlyHeard = -40.0;      // dB of full scale
constexpr double kHammerRestitution = 0.5;  // of the impact of the hammer
constexpr BodyId kBody = 0;
constexpr BodyId kHammer = 1;
constexpr std::size_t kStrikeBlock = 1024;

/// Returns the effective mass of the body in kg where it is hit, in the direction n.
double massAt(const ModalModel& model, const Vec3& arm, const Vec3& n) {
  const Vec3 turning = arm.cross(n);
  double inverse = 1.0 / model.mass;
  if (model.inertia.determinant() > 0.0) inverse += turning.dot(model.inertia.inverse() * turning);
  return 1.0 / inverse;
}

/// Makes the impact of a ball on the body, whose centre of mass is at the origin.
ImpulseEvent strikeEvent(const ModalModel& model, const Vec3& place, const Vec3& impulse,
                         double hammerMass, double hammerRadius) {
  ImpulseEvent event;
  event.time = kBefore;
  event.body = kBody;
  event.other = kHammer;
  event.impulse = impulse;
  event.normal = impulse.normalized();
  event.position = place - model.centreOfMass;
  const double mass = massAt(model, event.position, event.normal);
  event.effectiveMass = 1.0 / (1.0 / mass + 1.0 / hammerMass);
  event.approachSpeed = impulse.norm() / ((1.0 + kHammerRestitution) * event.effectiveMass);
  event.otherRadius = hammerRadius;
  return event;
}

/// Makes the body that is hit.
SoundBody struckBody(std::shared_ptr<const ModalModel> model) {
  SoundBody body;
  body.material = model->material;
  body.modal = std::move(model);
  return body;
}

/// Adds the click of the recoil of a body that rings, if its surface is closed; by its shape where
/// that can be solved. False if `progress` has cancelled it.
bool addClick(SoundBody& body, ModelCache& cache, const Progress& progress) {
  const ModalModel& model = *body.modal;
  if (!closedSurface(model.surface) || !(model.inertia.determinant() > 0.0)) return true;
  SurfaceMesh surface = model.surface;
  for (Vec3& vertex : surface.vertices)
    vertex -= model.centreOfMass;
  const Result<RigidRadiator> radiator = panelRadiator(surface);
  if (!radiator) return true;
  body.mass = model.mass;
  body.shape = std::make_shared<const RigidRadiator>(*radiator);
  body.inverseInertia = model.inertia.inverse();
  Result<RigidRecoil> recoil = analyseRecoil(surface, &cache, progress);
  if (!recoil) return recoil.error().message != kCancelled;
  body.recoil = std::make_shared<const RigidRecoil>(*std::move(recoil));
  return true;
}

/// The file that a strike is rendered into, its settings and its length.
struct StrikeOutput {
  std::string file;
  SoundFileSettings settings;
  double seconds = 0.0;  // s; 0: until it is silent
};

struct StrikeReport {
  std::string limit;      // that has ended it; empty if none has
  double peak = 0.0;      // Pa
  double duration = 0.0;  // s
  double contact = 0.0;   // s
  std::size_t modes = 0;
};

Result<StrikeReport> renderStrike(Synth& synth, const ImpulseEvent& event,
                                  const StrikeOutput& output, ResourceWatch& watch) {
  Result<SoundFileWriter> writer = SoundFileWriter::create(output.file, output.settings);
  if (!writer) return writer.error();
  StrikeReport report;
  report.contact = synth.contactDuration(event);
  synth.schedule(event);
  const double limit = output.seconds > 0.0 ? output.seconds : kLongest;
  std::vector<double> samples(kStrikeBlock);
  std::vector<float> rounded(kStrikeBlock);
  const auto most = static_cast<std::size_t>(std::llround(limit * output.settings.sampleRate));
  // A strike that no listener hears makes a file of silence, and not an empty one.
  const auto least = static_cast<std::size_t>(std::llround(kBefore * output.settings.sampleRate));
  std::size_t left = most;
  while (left > 0 && (output.seconds > 0.0 || most - left <= least || !synth.isSilent())) {
    report.limit = watch.exceeded();
    if (!report.limit.empty()) return report;
    const std::size_t frames = std::min(left, kStrikeBlock);
    double* const channel = samples.data();
    synth.render<double>(std::span(&channel, 1), frames);
    std::copy_n(samples.begin(), frames, rounded.begin());
    const float* const plane = rounded.data();
    if (const Status written = writer->write(std::span(&plane, 1), frames); !written)
      return written.error();
    left -= frames;
  }
  report.duration = static_cast<double>(most - left) / output.settings.sampleRate;
  if (const Status finished = writer->finish(); !finished) return finished.error();
  report.peak = writer->peakPressure();
  return report;
}

}  // namespace

StrikeCommand::StrikeCommand(CLI::App& app)
    : command_(app.add_subcommand("strike",
                                  "Hit a body once, and hear it ring\n"
                                  "A ball hits a model of 'carom modes' with an impulse at a "
                                  "point: what a listener hears of "
                                  "the ring, and of the click of the recoil.")) {
  command_->add_option("MODEL", model_, "model file that 'carom modes' wrote, or glTF")
      ->required()
      ->type_name("FILE");
  command_->add_option("--node", node_, "of a glTF file with several models: whose model")
      ->type_name("NAME");
  const auto three = [](double limit, const char* unit) {
    const auto check = [limit, unit](const std::string& text) -> std::string {
      if (threeNumbers(text, limit)) return {};
      return "'" + text + "' is not x,y,z; expected three numbers, " + unit + ", with commas";
    };
    return CLI::Validator(check, "X,Y,Z", std::string("three numbers of ") + unit);
  };
  command_->add_option("--at", at_, "where, in the frame of its mesh; the nearest point counts")
      ->required()
      ->check(three(kFarthest, "metres"));
  command_->add_option("--impulse", impulse_, "how hard and which way")
      ->required()
      ->check(three(kFarthest, "newton seconds"));
  command_->option_defaults()->group(kOutput);
  command_->add_option("-o,--output", output_, "WAV file to write; '-' is standard output")
      ->required()
      ->type_name("FILE.wav")
      ->check(fileName());
  addScale(*command_, normalize_, fullScale_);
  command_->add_option("--sample-rate", sampleRate_, "samples in a second")
      ->check(wholeNumberRange(8000, 192000, "Hz"))
      ->capture_default_str();
  command_
      ->add_option("--duration", duration_,
                   "of the file; default: until it is silent, at most 60 s")
      ->check(numberRange(0.01, 3600.0, "seconds"));
  command_->option_defaults()->group(kSound);
  command_->add_option("--listener", listener_, "from the centre of mass, in the frame of the mesh")
      ->check(three(kFarthest, "metres"))
      ->capture_default_str();
  command_->add_option("--hammer", hammerMaterial_, "material of the ball that hits")
      ->check(builtInMaterial())
      ->capture_default_str();
  command_->add_option("--hammer-mass", hammerMass_, "of the ball")
      ->check(numberRange(1e-9, 1e6, "kilograms"))
      ->capture_default_str();
  command_->add_option("--hammer-radius", hammerRadius_, "of the ball where it touches")
      ->check(numberRange(1e-6, 1e3, "metres"))
      ->capture_default_str();
  command_->add_option("--modal-radiation", radiation_, "how modes become pressure")
      ->check(oneOf({"directional", "monopole", "constant"}))
      ->capture_default_str();
  command_->add_flag("--no-click", noClick_, "leave out the click of its recoil");
  addResourceLimits(*command_, run_);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  command_->footer(
      "Example:\n"
      "  carom strike wrench.carom_modes --at 0.1,0,0.004 --impulse 0,0,-0.05 -o wrench.wav");
}

bool StrikeCommand::parsed() const {
  return command_->parsed();
}

int StrikeCommand::run() const {
  if (!isWavName(output_))
    return fail(kBadInput,
                "--output: '" + output_ + "' is not the name of a WAV file; expected FILE.wav");
  if (const Status kept = checkKept({{"--output", output_}}, {model_}); !kept)
    return fail(kBadInput, kept.error().message);
  const Result<OutputTarget> target = OutputTarget::create(output_, "--output");
  if (!target) return fail(kBadInput, target.error().message);
  const Vec3 impulse = *threeNumbers(impulse_, kFarthest);
  if (impulse.norm() < 1e-12)
    return fail(kBadInput, "--impulse: nothing hits; expected at least 1e-12 N s");
  const Vec3 listener = *threeNumbers(listener_, kFarthest);
  if (listener.norm() < kNearest)
    return fail(kBadInput,
                "--listener: it is in the centre of mass; expected at least 1 mm away from it");
  capMemory(run_.limits().memory);
  ResourceWatch watch(run_.limits());
  Result<ModalModel> loaded = loadModel({model_, node_});
  if (!loaded) return fail(kBadInput, loaded.error().message);
  std::string limit;
  ProgressBar bar("radiation of " + std::filesystem::path(model_).filename().string());
  ModelCache cache;
  const Progress progress = [&](std::string_view, double share) {
    bar.show(share);
    limit = watch.exceeded();
    return limit.empty();
  };
  const Status heard = addRadiation(*loaded, {}, &cache, progress);
  if (!limit.empty()) return endedEarly(model_, watch, limit);
  if (!heard) return fail(kBadInput, model_ + ": " + heard.error().message);
  const auto model = std::make_shared<const ModalModel>(*std::move(loaded));
  SoundBody body = struckBody(model);
  if (!noClick_ && !addClick(body, cache, progress)) return endedEarly(model_, watch, limit);
  bar.clear();

  SynthSettings settings;
  settings.sampleRate = sampleRate_;
  settings.medium = model->medium;
  if (radiation_ == "monopole") settings.modalRadiation = ModalRadiation::monopole;
  if (radiation_ == "constant") settings.modalRadiation = ModalRadiation::constant;
  Result<Synth> synth = Synth::create(settings, {{"listener", listener}});
  if (!synth) return fail(kBadInput, synth.error().message);
  if (const Status set = synth->setBody(kBody, body); !set)
    return fail(kBadInput, model_ + ": " + set.error().message);
  if (const Status set = synth->setBody(kHammer, {.material = *findMaterial(hammerMaterial_)});
      !set)
    return fail(kFailed, set.error().message);
  const ImpulseEvent event =
      strikeEvent(*model, *threeNumbers(at_, kFarthest), impulse, hammerMass_, hammerRadius_);
  SoundFileSettings file;
  file.sampleRate = sampleRate_;
  file.normalize = normalize_;
  file.fullScalePressure = fullScalePressure(fullScale_).value_or(kFullScalePressure);
  const Result<StrikeReport> report = renderStrike(
      *synth, event, {.file = target->path(), .settings = file, .seconds = duration_}, watch);
  if (!report) return fail(kFailed, report.error().message);
  if (!report->limit.empty()) return endedEarly(model_, watch, report->limit);
  if (const Status sent = target->finish(); !sent) return fail(kFailed, sent.error().message);
  const double level = lab::soundPressureLevel(std::max(report->peak, 1e-12)) -
                       lab::soundPressureLevel(file.fullScalePressure);  // dB
  if (!normalize_ && level < kHardlyHeard)
    warn(target->shown() + ": the peak is " + std::to_string(std::lround(level)) +
         " dB of full scale, hardly heard: --normalize brings it up, --full-scale says what 1.0 "
         "is, --listener where it is heard");
  if (json_) {
    nlohmann::ordered_json object;
    object["file"] = target->shown();
    object["duration_s"] = report->duration;
    object["contact_s"] = report->contact;
    object["peak_pa"] = report->peak;
    object["modes"] = model->modes.size();
    return answer(jsonText(object));
  }
  std::ostringstream text;
  text << target->shown() << ": " << report->duration << " s, peak " << report->peak << " Pa ("
       << lab::soundPressureLevel(std::max(report->peak, 1e-12)) << " dB), " << model->modes.size()
       << " modes, contact of " << 1e3 * report->contact << " ms\n";
  return answer(text.str());
}

}  // namespace carom::command
