#include "lab/stability/stability_sources.h"

#include <cmath>
#include <utility>
#include <vector>

#include "lab/stability/stability_cases.h"

#include "carom/audio/surface_texture.h"

namespace carom::lab {

namespace {

constexpr double kPi = std::numbers::pi;

Material materialOf(double density, double modulus, double restitution) {
  return {.name = "any",
          .density = density,
          .youngsModulus = modulus,
          .poissonsRatio = 0.3,
          .restitution = restitution};
}

std::shared_ptr<const SurfaceTexture> wavyFloor() {
  std::vector<SurfaceTexture::Slope> slopes;
  slopes.reserve(16);
  for (int texel = 0; texel < 16; ++texel)
    slopes.emplace_back(
        kWaveSteepness * static_cast<float>(std::cos(2.0 * kPi * (texel + 0.5) / 16.0)), 0.0F);
  return std::make_shared<const SurfaceTexture>(
      orThrow(SurfaceTexture::ofSlopes({16, 1}, {kWaveLength / 16.0, kWaveLength / 16.0}, slopes)));
}

}  // namespace

// ---- Impacts

Material Impact::material() const {
  return materialOf(density, modulus, restitution);
}

SoundBody Impact::ball() const {
  return {.material = material(), .mass = massOf(radius), .radius = radius};
}

SoundBody Impact::other() const {
  if (otherRadius == 0.0) return {.material = material()};
  return {.material = material(), .mass = massOf(otherRadius), .radius = otherRadius};
}

double Impact::effectiveMass() const {
  if (otherRadius == 0.0) return massOf(radius);
  return 1.0 / (1.0 / massOf(radius) + 1.0 / massOf(otherRadius));
}

ImpulseEvent Impact::event() const {
  ImpulseEvent event;
  event.time = time;
  event.body = kBall;
  event.other = kPartner;
  event.normal = Vec3::UnitZ();
  event.impulse = impulse() * Vec3::UnitZ();
  event.approachSpeed = speed;
  event.effectiveMass = effectiveMass();
  event.radius = radius;
  if (otherRadius > 0.0) event.otherRadius = otherRadius;
  event.position = -radius * Vec3::UnitZ();
  event.bodyVelocity = -speed * Vec3::UnitZ();
  return event;
}

ImpulseEvent Impact::otherEvent() const {
  ImpulseEvent share = event();
  std::swap(share.body, share.other);
  std::swap(share.radius, share.otherRadius);
  share.normal = -share.normal;
  share.impulse = -share.impulse;
  share.bodyPosition = -(radius + otherRadius) * Vec3::UnitZ();
  share.bodyVelocity = Vec3::Zero();
  return share;
}

void setBodies(Synth& synth, const Impact& impact) {
  orThrow(synth.setBody(kBall, impact.ball()));
  orThrow(synth.setBody(kPartner, impact.other()));
}

// ---- Slides

Material Slide::material() const {
  return materialOf(8000.0, modulus, 0.5);
}

double Slide::mass() const {
  return 4.0 / 3.0 * kPi * radius * radius * radius * 8000.0;
}

ContactState Slide::stateAt(double time) const {
  ContactState state;
  state.time = begin + time;
  state.duration = step;
  state.phase = time == 0.0 ? ContactPhase::begin : ContactPhase::during;
  state.body = kBall;
  state.other = kPartner;
  state.normal = Vec3::UnitZ();
  state.position = {speed * time, 0.0, 0.0};
  state.normalLoad = load;
  state.appliedImpulse = load * step * Vec3::UnitZ();
  state.radius = radius;
  state.slipVelocity = rolls ? Vec3::Zero() : Vec3(speed * Vec3::UnitX());
  state.rollingVelocity = (rolls ? 1.0 : 0.5) * speed * Vec3::UnitX();
  state.bodyPosition = state.position + radius * Vec3::UnitZ();
  state.bodyVelocity = speed * Vec3::UnitX();
  state.pathStart = state.pathEnd = -radius * Vec3::UnitZ();
  state.otherPathStart = state.position;
  state.otherPathEnd = state.position + speed * step * Vec3::UnitX();
  if (!rolls) return state;
  const auto turned = [this](double at) {
    return Quat(Eigen::AngleAxisd(speed * at / radius, Vec3::UnitY()));
  };
  state.bodyOrientation = turned(time);
  state.pathStart = turned(time).conjugate() * state.pathStart;
  state.pathEnd = turned(time + step).conjugate() * state.pathEnd;
  return state;
}

void setBodies(Synth& synth, const Slide& slide) {
  SoundBody floor{.material = slide.material()};
  floor.texture = wavyFloor();
  orThrow(synth.setBody(
      kBall, {.material = slide.material(), .mass = slide.mass(), .radius = slide.radius}));
  orThrow(synth.setBody(kPartner, floor));
}

std::vector<ContactState> statesOf(const Slide& slide) {
  std::vector<ContactState> states;
  const auto steps = std::lround(slide.duration / slide.step);
  for (long step = 0; step < steps; ++step)
    states.push_back(slide.stateAt(static_cast<double>(step) * slide.step));
  return states;
}

// ---- Bells

double Tone::damped() const {
  const double w = 2.0 * kPi * frequency;
  return std::sqrt(w * w - decayRate * decayRate);
}

std::shared_ptr<const ModalModel> bellOf(const Tone& tone) {
  ModalModel model;
  model.name = "bell";
  model.material = *findMaterial("steel");
  model.mass = 1.0;
  model.inertia.setIdentity();
  model.surface.vertices = {Vec3(0.1, 0.0, -0.1), Vec3(-0.1, 0.1, -0.1), Vec3(-0.1, -0.1, -0.1),
                            Vec3(0.0, 0.0, 0.1)};
  model.surface.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  Mode mode;
  mode.frequency = tone.frequency;
  mode.decayRate = tone.decayRate;
  mode.radiation.volume = kBellVolume;
  model.modes = {mode};
  const auto shape = static_cast<float>(kBellShape);
  for (std::size_t vertex = 0; vertex < model.surface.vertices.size(); ++vertex)
    model.shapes.insert(model.shapes.end(), {0.0F, 0.0F, shape});
  return std::make_shared<const ModalModel>(std::move(model));
}

ImpulseEvent Blow::event() const {
  ImpulseEvent event;
  event.time = time;
  event.body = kPartner;
  event.other = kBall;
  event.normal = Vec3::UnitZ();
  event.impulse = kBlowImpulse * Vec3::UnitZ();
  event.approachSpeed = 100.0;
  event.effectiveMass = 1e-9;
  event.otherRadius = 1e-6;
  event.radius = 1e-6;
  event.position = Vec3(0.0, 0.0, 0.1);
  return event;
}

void setBodies(Synth& synth, const Blow& blow) {
  SoundBody bell{.material = *findMaterial("steel")};
  bell.modal = bellOf(blow.tone);
  orThrow(synth.setBody(kPartner, bell));
  orThrow(synth.setBody(kBall, {.material = *findMaterial("steel")}));
}

}  // namespace carom::lab
