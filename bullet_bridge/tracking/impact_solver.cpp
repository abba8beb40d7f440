#include "bullet_bridge/tracking/impact_solver.h"

#include <algorithm>
#include <cmath>

namespace carom::bullet {

PairInertia::PairInertia(const PairMotion& motion, double s, MultibodyMass& multibodies)
    : body_(responseOf(*motion.pair().body, motion.body(), s)),
      other_(responseOf(*motion.pair().other, motion.other(), s)),
      multibodies_(&multibodies) {}

PairInertia::Response PairInertia::responseOf(const TrackedBody& body, const RigidMotion& motion,
                                              double s) {
  Response response;
  response.centre = motion.centre.positionAt(s);
  if (body.kind == BodyKind::link) response.link = btMultiBodyLinkCollider::upcast(body.object);
  if (body.kind != BodyKind::rigid) return response;
  const auto& rigid = static_cast<const btRigidBody&>(*body.object);
  response.inverseMass = body.inverseMass * toVec3(rigid.getLinearFactor());
  if (body.shape == ContactShape::sphere) return response;  // no impulse along the normal turns it
  const Vec3 angularFactor = toVec3(rigid.getAngularFactor());
  const Eigen::Matrix3d turn = motion.poseAt(s).rotation;
  response.inverseInertia = angularFactor.asDiagonal() * turn *
                            toVec3(rigid.getInvInertiaDiagLocal()).asDiagonal() * turn.transpose();
  return response;
}

double PairInertia::response(const Response& body, const ContactPoint& at,
                             const ContactPoint& by) const {
  if (body.link != nullptr) {
    return multibodies_->inverseEffectiveMass(*body.link, by.position, by.normal);
  }
  const Vec3 lever = (by.position - body.centre).cross(by.normal);
  const Vec3 atLever = (at.position - body.centre).cross(at.normal);
  return at.normal.dot(body.inverseMass.cwiseProduct(by.normal)) +
         atLever.dot(body.inverseInertia * lever);
}

double PairInertia::between(const ContactPoint& at, const ContactPoint& by) const {
  if (body_.link != nullptr && other_.link != nullptr) {
    return multibodies_->inverseEffectiveMass(*body_.link, by.position, *other_.link, by.position,
                                              by.normal);
  }
  return response(body_, at, by) + response(other_, at, by);
}

ContactPoint ImpactSolver::meanOf(std::span<const ContactPoint> points) {
  ContactPoint mean;
  mean.normal = Vec3::Zero();
  const auto count = static_cast<double>(points.size());
  for (const ContactPoint& point : points) {
    mean.position += point.position / count;
    mean.normal += point.normal;
    mean.approachSpeed += point.approachSpeed / count;
  }
  mean.normal.normalize();
  return mean;
}

// Sets the initial guess: the impulses if all points bore the same. It decides the shares where the
// equations do not, as for a body that cannot turn.
void ImpactSolver::shareEvenly(std::span<const ContactPoint> points, double restitution) {
  const std::size_t count = points.size();
  for (std::size_t row = 0; row < count; ++row) {
    double sum = 0.0;
    for (std::size_t column = 0; column < count; ++column)
      sum += matrix_[row * count + column];
    if (sum > 0.0) impulses_[row] = (1.0 + restitution) * points[row].approachSpeed / sum;
  }
}

std::span<const double> ImpactSolver::solve(std::span<const ContactPoint> points,
                                            const PairInertia& inertia, double restitution) {
  constexpr int kSweeps = 500;
  constexpr double kEnough = 1e-12;  // relative to the largest impulse
  const std::size_t count = points.size();
  matrix_.resize(count * count);
  impulses_.assign(count, 0.0);
  for (std::size_t row = 0; row < count; ++row) {
    for (std::size_t column = 0; column < count; ++column)
      matrix_[row * count + column] = inertia.between(points[row], points[column]);
  }
  shareEvenly(points, restitution);
  for (int number = 0; number < kSweeps; ++number) {
    const Sweep done = sweep(points, restitution);
    if (done.change <= kEnough * done.largest) break;
  }
  return impulses_;
}

// Solves each point once for its own impulse, with the others as they are.
ImpactSolver::Sweep ImpactSolver::sweep(std::span<const ContactPoint> points, double restitution) {
  const std::size_t count = points.size();
  Sweep done;
  for (std::size_t row = 0; row < count; ++row) {
    double missing = (1.0 + restitution) * points[row].approachSpeed;
    for (std::size_t column = 0; column < count; ++column)
      missing -= matrix_[row * count + column] * impulses_[column];
    const double before = impulses_[row];
    const double own = matrix_[row * count + row];
    if (own > 0.0) impulses_[row] = std::max(0.0, before + missing / own);
    done.change = std::max(done.change, std::abs(impulses_[row] - before));
    done.largest = std::max(done.largest, impulses_[row]);
  }
  return done;
}

ImpactSolution ImpactSolver::sum(std::span<const ContactPoint> points,
                                 std::span<const double> impulses, double restitution) {
  ImpactSolution solution;
  double sum = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    solution.impulse += impulses[i] * points[i].normal;
    solution.position += impulses[i] * points[i].position;
    solution.approachSpeed += impulses[i] * points[i].approachSpeed;
    sum += impulses[i];
  }
  if (!(sum > 0.0)) return {};
  solution.position /= sum;
  solution.approachSpeed /= sum;
  const double size = solution.impulse.norm();
  solution.normal = size > 0.0 ? Vec3(solution.impulse / size) : points.front().normal;
  solution.effectiveMass = size / ((1.0 + restitution) * solution.approachSpeed);
  return solution;
}

}  // namespace carom::bullet
