#include "audio/scheduling/coupled_impacts.h"

#include <algorithm>
#include <cmath>

#include "audio/scheduling/modal_exciter.h"

namespace carom::audio {
namespace {

/// Share of the energy of approach below which what modes would take, if they did not give way, is
/// nothing to the contact: it changes the force by about as much.
constexpr double kFewModes = 1e-3;
/// Radians in a contact's duration beyond which a mode follows its force as a spring does.
constexpr double kStiff = 12.0;

/// Samples within which the parts of a force become one: at 10 kHz, 1e-3 less of it is heard.
constexpr double kFinestNodes = 1.0 / 16.0;

/// Durations (s) within which an impact is solved; others have nothing that modes could be heard
/// by.
constexpr double kShortest = 1e-9;
constexpr double kLongest = 1.0;

/// True if a body is known to have more modes than its model: one that says nothing of others may
/// be all that there is.
bool hasMore(const SoundingBody& body) {
  return body.modes != nullptr && !body.modes->resonators->model->residualVolumes.empty();
}

/// True if the modes take part in the contact: by what they would take of the energy as its force
/// is without them.
bool modesMatter(const CoupledImpact& impact) {
  const double duration = elasticDuration(impact);
  if (!(duration >= kShortest && duration <= kLongest)) return false;
  double mobility = 0.0;  // 1/kg
  for (const ContactMode& mode : impact.modes) {
    const double turn = mode.frequency * duration;
    const double follows = turn > kStiff ? kStiff / turn : 1.0;
    mobility += mode.shape * mode.shape * follows * follows;
  }
  return mobility * impact.mass > kFewModes;
}

}  // namespace

const CoupledImpacts::Course* CoupledImpacts::courseOf(const ImpulseEvent& event,
                                                       const SoundingBody& body,
                                                       const SoundingBody& other) {
  if (body.modes == nullptr && other.modes == nullptr) return nullptr;
  if (!isSameImpact(event)) solve(event, body, other);
  return isCoupled_ ? &course_ : nullptr;
}

/// True if the event is a share of the impact that was solved last.
bool CoupledImpacts::isSameImpact(const ImpulseEvent& event) const {
  const bool isOther = event.body == solvedFor_.other && event.other == solvedFor_.body;
  const bool isSame = event.body == solvedFor_.body && event.other == solvedFor_.other;
  const Vec3& impulse = solvedFor_.impulse;
  return (isOther || isSame) && event.time == solvedFor_.time &&
         event.position == solvedFor_.position &&
         event.impulse == (isSame ? impulse : Vec3(-impulse)) &&
         event.approachSpeed == solvedFor_.approachSpeed &&
         event.hasOtherPose == solvedFor_.hasOtherPose;
}

void CoupledImpacts::solve(const ImpulseEvent& event, const SoundingBody& body,
                           const SoundingBody& other) {
  solvedFor_ = event;
  isCoupled_ = false;
  const double impulse = event.impulse.norm();
  if (!(impulse > 0.0)) return;
  const Vec3 direction = event.impulse / impulse;
  modes_.clear();
  if (body.modes != nullptr)
    ModalExciter::addModes({.point = event.position,
                            .direction = direction,
                            .position = event.bodyPosition,
                            .orientation = event.bodyOrientation},
                           body.sound, *body.modes, modes_);
  if (other.modes != nullptr && event.hasOtherPose)
    ModalExciter::addModes({.point = event.position,
                            .direction = -direction,
                            .position = event.otherPosition,
                            .orientation = event.otherOrientation},
                           other.sound, *other.modes, modes_);
  const std::size_t known = modes_.size();
  const std::size_t own = body.modes != nullptr ? body.modes->resonators->modes : 0;
  if (hasMore(body)) addModesBeyond(modes_, 0, own);
  if (hasMore(other)) addModesBeyond(modes_, own, known - own);
  const CoupledImpact impact{
      .stiffness = ContactDurations::stiffnessOf(event, body.sound, other.sound),
      .mass = event.effectiveMass,
      .speed = event.approachSpeed,
      .impulse = impulse,
      .modes = modes_,
      .beyond = modes_.size() - known};
  if (!modesMatter(impact)) return;
  const ContactCourse& course = contact_.solve(impact);
  if (!(course.impulse > 0.0 && course.duration > 0.0 && std::isfinite(course.impulse))) return;
  keepNodes(course);
  course_ = {nodes_, course.duration, std::min(course.impulse / impulse, 1.0)};
  isCoupled_ = true;
  enter(event, body, other, course);
}

/// Keeps the course's nodes, those that are closer together than samples can tell as one.
void CoupledImpacts::keepNodes(const ContactCourse& course) {
  const double finest = std::max(kFinestNodes / (sampleRate_ * course.duration),
                                 1.0 / static_cast<double>(kMostImpactNodes - 1));
  nodes_.clear();
  double begin = 0.0;  // u, of the node that is being gathered
  for (const PulseNode& node : course.nodes) {
    const double weight = node.weight / course.impulse;
    if (nodes_.empty() || node.u - begin > finest) {
      nodes_.push_back({node.u, weight});
      begin = node.u;
      continue;
    }
    PulseNode& last = nodes_.back();
    last.u += (node.u - last.u) * weight / (last.weight + weight);
    last.weight += weight;
  }
}

void CoupledImpacts::enter(const ImpulseEvent& event, const SoundingBody& body,
                           const SoundingBody& other, const ContactCourse& course) {
  const double end = event.time + course.duration;
  std::span<const double> energies = course.modes;
  if (body.modes != nullptr) {
    const ResonatorSet& set = *body.modes->resonators;
    rings_.add(event.body, set, end, energies.first(set.modes));
    energies = energies.subspan(set.modes);
  }
  if (!energies.empty()) rings_.add(event.other, *other.modes->resonators, end, energies);
  ++energy_.impacts;
  energy_.bound += course.energyBound ? 1 : 0;
  energy_.approach += course.energy.approach;
  energy_.parting += course.energy.rigid;
  energy_.modes += course.energy.modes;
  energy_.damped += course.energy.damped + course.energy.beyond;
  energy_.contacts += course.energy.lost;
}

ContactEnergy CoupledImpacts::energyAt(double time) const {
  ContactEnergy energy = energy_;
  energy.bodies = rings_.at(time);
  energy.removed = rings_.removed();
  return energy;
}

}  // namespace carom::audio
