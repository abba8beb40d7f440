#pragma once

#include <Eigen/Geometry>

namespace carom {

// Vectors of the public structs. None of them asks for more alignment than a double's: Eigen aligns
// fixed sizes by the widest vector registers that the compiler may use, so that a struct with
// Eigen::Quaterniond in it has one layout in a library and another in a program that is compiled
// with -mavx. Eigen's own types convert to these and back, without a cast.

using Vec2 = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
using Vec3 = Eigen::Vector3d;  ///< world frame unless a field says otherwise
using Mat3 = Eigen::Matrix3d;
using Mat4 = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
using Mat6 = Eigen::Matrix<double, 6, 6, Eigen::DontAlign>;
using Mat23 = Eigen::Matrix<double, 2, 3, Eigen::DontAlign>;
/// Quaternion in Hamilton's convention, of unit length where it is a rotation.
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;

static_assert(alignof(Vec2) == alignof(double) && sizeof(Vec2) == 2 * sizeof(double));
static_assert(alignof(Vec3) == alignof(double) && sizeof(Vec3) == 3 * sizeof(double));
static_assert(alignof(Mat3) == alignof(double) && sizeof(Mat3) == 9 * sizeof(double));
static_assert(alignof(Mat4) == alignof(double) && sizeof(Mat4) == 16 * sizeof(double));
static_assert(alignof(Mat6) == alignof(double) && sizeof(Mat6) == 36 * sizeof(double));
static_assert(alignof(Mat23) == alignof(double) && sizeof(Mat23) == 6 * sizeof(double));
static_assert(alignof(Quat) == alignof(double) && sizeof(Quat) == 4 * sizeof(double));

}  // namespace carom
