#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "audio/dsp/resonator_kernels.h"
#include "audio/model/pulse.h"

namespace carom::audio {

/// A mode of either body, as a contact feels it.
struct ContactMode {
  double frequency = 0.0;  ///< rad/s, damped, > 0
  double decay = 0.0;      ///< 1/s, >= 0
  /// 1/sqrt(kg): how far the surface gives way along the push, for a modal coordinate of 1.
  double shape = 0.0;
};

/// An impact of two bodies that may ring.
struct CoupledImpact {
  double stiffness = 0.0;              ///< N/m^(3/2): K = 4/3 sqrt(R) E*, > 0
  double mass = 0.0;                   ///< kg, effective mass of the rigid bodies, > 0
  double speed = 0.0;                  ///< m/s, approach speed, > 0
  double impulse = 0.0;                ///< N s, the impulse that the mechanics gives, >= 0
  std::span<const ContactMode> modes;  ///< of both bodies
  /// How many of the modes, the last ones, only stand for what lies above the others: see
  /// addModesBeyond.
  std::size_t beyond = 0;
};

/// Adds up to four modes that stand for those of a body above the ones that are known, the `count`
/// from `first` on: as many in the next octave, of the same mean shape, as the highest known octave
/// lets expect, which in a thin plate is twice as many. In a contact that is shorter than their
/// distance asks for, it does not matter where they are: all that comes back from the body's edges
/// comes later (Zener 1941). The octaves beyond that one are left out, as those of a thick wall are
/// part of the dent of Hertz's law: in meshes of a plate, a bar and a bell, the next octave gives
/// way as much as all that lies above (`./bench contact_direct`). Few modes say little of others: N
/// of them count N / (N + 1). [any thread]
void addModesBeyond(std::vector<ContactMode>& modes, std::size_t first, std::size_t count);

/// Duration in s of the impact without modes (Johnson 1985, section 11.4). [any thread]
double elasticDuration(const CoupledImpact& impact);

/// The energy of an impact in J. What approaches is what is left, rigid, in the modes, in those
/// beyond, damped in them, and lost in the contact.
struct ContactLedger {
  double approach = 0.0;  ///< m V^2 / 2
  double rigid = 0.0;     ///< of the rigid bodies' relative motion, once they part
  double modes = 0.0;     ///< in the known modes, once they part
  double beyond = 0.0;    ///< in what stands for those above
  double damped = 0.0;    ///< taken from the modes by their damping, until they part
  double lost = 0.0;      ///< taken by the contact itself
  double balance() const { return approach - rigid - modes - beyond - damped - lost; }
};

/// The course of an impact. Times count from first touch.
struct ContactCourse {
  double duration = 0.0;         ///< s, until the last touch ends
  std::vector<PulseNode> nodes;  ///< u: share of the duration; weight: N s. Ascending in u
  double impulse = 0.0;          ///< N s, sum of the nodes
  double damping = 0.0;          ///< s/m: chi of the law
  std::size_t touches = 0;       ///< runs of contact: more than one if the surface swings back
  ContactLedger energy;
  std::vector<double> modes;  ///< J, the parts of energy.modes: of the known ones
  /// True if the wanted impulse would take more energy than the modes leave: `impulse` is then the
  /// most that there is.
  bool energyBound = false;
};

/// Integrates an impact of two bodies together with the modes of both:
///
///     m x'' = -F,   q_i'' + 2 d_i q_i' + w_i^2 q_i = s_i F,   d = x - sum s_i q_i
///     F = K d^(3/2) (1 + chi d')   while d > 0,   else 0
///
/// with x the approach of the rigid bodies. The law is that of Hertz,
/// with the loss of Hunt and Crossley (1975, J. Appl. Mech. 42, 440), as in
/// Pulse::dissipativeHertz; chi is found such that the impulse is the wanted one. A plate that
/// gives way in this manner is Zener's (1941, Phys. Rev. 59, 669) if its modes are those of a large
/// plate.
///
/// Method. In a step the force is constant, so rigid motion and modes are stepped exactly. Its
/// value is the difference of the contact's potential over the change of d (the discrete gradient
/// of Gonzalez 1996, J. Nonlinear Sci. 6, 449), times the loss. So the force does as much work as
/// the contact gives, to rounding, whatever the step: no impact has more energy than approaches.
///
/// That is of second order in the step s, and its error is known: all goes as if the contact felt
/// d + s^2/12 d'', and its force acted as F + s^2/12 F''. So a mode rings by sin(w s) / (w s) of
/// the work that it should have got, and both bodies give way by s^2/6 (1/m + sum s_i^2) F too
/// much. Where the contact is elastic, modes are given shapes larger by the root of the inverse,
/// and the contact's spring is harder by what remains: then the error is of fourth order but for
/// the instants at which a touch begins and ends, the energy still that of a contact, and a step
/// may be a sixth of the fastest mode's period. [one thread]
class CoupledContact {
 public:
  /// Returns the course of an impact, valid until the next call.
  const ContactCourse& solve(const CoupledImpact& impact);

 private:
  /// The relative motion of the two bodies where they touch.
  struct State {
    double approach = 0.0;  // m, of the rigid bodies
    double speed = 0.0;     // m/s, of the same
    double depth = 0.0;     // m: approach, less what the modes give way
    double root = 0.0;      // m^(1/2), of the depth; 0 for none
  };
  class Spring;
  struct Law;

  void begin(const CoupledImpact& impact);
  double amend(const CoupledImpact& impact, bool isElastic);
  void run(const CoupledImpact& impact, double restitution);
  double mostChange(const CoupledImpact& impact, double restitution, bool isToGrow) const;
  void fit(const CoupledImpact& impact);
  double forceTo(double freeDepth, const Law& law, double guess);
  std::optional<double> forceWithin(double freeDepth, const Law& law, double guess);
  double forceAcross(double freeDepth, const Law& law, double guess) const;
  TurningModes turning();
  double idleSteps();
  std::size_t leapBy(std::size_t steps);
  void keepStates();
  void close(const CoupledImpact& impact, double end);

  double step_ = 0.0;          // s
  std::size_t mostSteps_ = 0;  // until a run counts as over
  double compliance_ = 0.0;    // m/N: by how much less deep a step ends for each newton

  const ResonatorKernels& kernels_ = fastestResonators();
  // By mode, padded with zeros for the kernels. A state is s (q' + d q + i w q), which turns as
  // exp((-d + i w) t).
  using Numbers = Eigen::ArrayXd;
  struct Turn {
    Numbers re;
    Numbers im;
  };
  Numbers inverse_;  // 1/w
  Numbers decay_;    // d
  Numbers bend_;     // (d^2 + w^2)/w: of a state, its mode's greatest acceleration
  Numbers turnRe_;   // of a step
  Numbers turnIm_;
  Numbers giveRe_;  // the same over w
  Numbers giveIm_;
  Numbers aheadRe_;  // of two steps, over w
  Numbers aheadIm_;
  Numbers freeRe_;  // what a newton adds in a step
  Numbers freeIm_;
  Numbers amends_;   // the factor that makes up for the step: see "Method"
  Numbers amended_;  // the same in this run; 1 where it does without
  Numbers pushRe_;   // what a newton adds in a step of this run
  Numbers pushIm_;
  Numbers re_;
  Numbers im_;
  Numbers leftRe_;  // as the last touch left them
  Numbers leftIm_;
  Numbers nextRe_;  // scratch
  Numbers nextIm_;
  std::vector<Turn> leaps_;  // of 2^n steps, as far as they were needed
  double slack_ = 1.0;       // by how much a mode's speed may exceed its state

  State state_;
  double work_ = 0.0;  // J, done on the modes
  ContactCourse course_;
};

}  // namespace carom::audio
