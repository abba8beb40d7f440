#pragma once

#include <Eigen/Geometry>

namespace carom {

using Vec3 = Eigen::Vector3d;  ///< world frame unless a field says otherwise
using Quat = Eigen::Quaterniond;

}  // namespace carom
