#include "scenes/run/motion_rows.h"

#include <algorithm>
#include <cstdint>

#include <Eigen/Geometry>

#include "scenes/rows/csv_row.h"

namespace carom::scenes {
namespace {

const char* nameOf(ContactPhase phase) {
  switch (phase) {
    case ContactPhase::begin:
      return "begin";
    case ContactPhase::during:
      return "during";
    case ContactPhase::end:
      break;
  }
  return "end";
}

}  // namespace

std::string_view ContactRows::header() {
  return "time_s,duration_s,phase,body,other,px_m,py_m,pz_m,nx,ny,nz,load_N,slip_x_m_s,slip_y_m_s,"
         "slip_z_m_s,roll_x_m_s,roll_y_m_s,roll_z_m_s\n";
}

std::string ContactRows::row(const ContactState& contact, const Scene& scene) const {
  return CsvRow()
      .add(contact.time)
      .add(contact.duration)
      .add(std::string(nameOf(contact.phase)))
      .add(scene.bodies[contact.body].name)
      .add(scene.bodies[contact.other].name)
      .add(contact.position)
      .add(contact.normal)
      .add(contact.normalLoad)
      .add(contact.slipVelocity)
      .add(contact.rollingVelocity)
      .line();
}

std::string_view PoseRows::header() {
  return "time_s,body,x_m,y_m,z_m,qw,qx,qy,qz\n";
}

std::string PoseRows::rows(const BodyPose& pose, const Scene& scene) {
  const auto [at, isNew] = bodies_.try_emplace(pose.body, Followed{pose.pose});
  Followed& body = at->second;
  const ListenerPose& from = body.last;
  const ListenerPose& to = pose.pose;
  std::string text;
  while (true) {
    const double time = static_cast<double>(body.next) / rate_;
    if (time > to.time) break;
    const double span = to.time - from.time;
    const double share = span > 0.0 ? std::clamp((time - from.time) / span, 0.0, 1.0) : 1.0;
    const Vec3 place = from.position + share * (to.position - from.position);
    const Quat turn = from.orientation.slerp(share, to.orientation);
    text += CsvRow()
                .add(time)
                .add(scene.bodies[pose.body].name)
                .add(place)
                .add(turn.w())
                .add(Vec3(turn.vec()))
                .line();
    ++body.next;
  }
  body.last = to;
  return text;
}

}  // namespace carom::scenes
