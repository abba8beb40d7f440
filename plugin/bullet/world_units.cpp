#include "plugin/bullet/world_units.h"

namespace carom::plugin {

ImpulseEvent inMetres(const ImpulseEvent& event, double metres) {
  ImpulseEvent scaled = event;
  for (Vec3* const vector : {&scaled.impulse, &scaled.appliedImpulse, &scaled.position,
                             &scaled.bodyPosition, &scaled.bodyVelocity})
    *vector *= metres;
  for (double* const number : {&scaled.approachSpeed, &scaled.radius, &scaled.otherRadius})
    *number *= metres;
  return scaled;
}

ContactState inMetres(const ContactState& contact, double metres) {
  ContactState scaled = contact;
  for (Vec3* const vector :
       {&scaled.position, &scaled.appliedImpulse, &scaled.slipVelocity, &scaled.rollingVelocity,
        &scaled.bodyPosition, &scaled.bodyVelocity, &scaled.otherPosition, &scaled.otherVelocity,
        &scaled.pathStart, &scaled.pathEnd, &scaled.otherPathStart, &scaled.otherPathEnd})
    *vector *= metres;
  for (double* const number : {&scaled.normalLoad, &scaled.radius, &scaled.otherRadius})
    *number *= metres;
  return scaled;
}

}  // namespace carom::plugin
