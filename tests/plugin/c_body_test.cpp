#include "plugin/c_api/c_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "plugin/c_api/c_handles.h"
#include "plugin/c_api/c_structs.h"

namespace carom {

using namespace plugin;

namespace {

using Eigen::Matrix3d;
constexpr double kMass = 0.3;  // kg

carom_body steel(std::int32_t shape) {
  carom_body body = defaultBody();
  body.material = "steel";
  body.mass = kMass;
  body.shape = shape;
  return body;
}

carom_body box(const Vec3& half) {
  carom_body body = steel(CAROM_SHAPE_BOX);
  for (int axis = 0; axis < 3; ++axis)
    body.half_extents[axis] = half[axis];
  return body;
}

/// The tetrahedron between the origin and corners on the axes at the distances `legs`, moved so
/// that its centre of mass, a quarter of the sum of its corners, is at `centre`.
struct Tetrahedron {
  std::array<double, 12> vertices{};
  std::array<std::uint32_t, 12> triangles = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

  explicit Tetrahedron(const Vec3& legs, const Vec3& centre = Vec3::Zero()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<Eigen::Index>(axis);
      for (std::size_t corner = 0; corner < 4; ++corner)
        vertices[3 * corner + axis] = centre[row] - 0.25 * legs[row];
      vertices[3 * (axis + 1) + axis] += legs[row];
    }
  }

  carom_body body() const {
    carom_body body = steel(CAROM_SHAPE_MESH);
    body.vertices = vertices.data();
    body.vertex_count = 4;
    body.triangles = triangles.data();
    body.triangle_count = 4;
    return body;
  }
};

SoundBody readOrFail(const carom_body& body, RadiatorChoice choice = RadiatorChoice::solved) {
  Result<SoundBody> read = CBodyReader(choice).read(&body);
  EXPECT_TRUE(read) << (read ? "" : read.error().message);
  return read ? *read : SoundBody{};
}

TEST(CBody, PartsThatSoundBesideClicksArrive) {
  const carom_modes modes = {std::make_shared<const ModalModel>()};
  Result<SurfaceTexture> rough = SurfaceTexture::rough({1e-6, 1e-4, 0.8}, 1);
  ASSERT_TRUE(rough);
  const carom_texture texture = {std::make_shared<const SurfaceTexture>(*std::move(rough))};
  const std::array<double, 3> origin = {1, 2, 3};
  carom_body input = steel(CAROM_SHAPE_SPHERE);
  input.radius = 0.5;
  EXPECT_EQ(readOrFail(input).modal, nullptr);
  EXPECT_EQ(readOrFail(input).texture, nullptr);
  EXPECT_FALSE(readOrFail(input).modalOrigin);
  input.modes = &modes;
  input.modes_origin = origin.data();
  input.texture = &texture;
  const SoundBody body = readOrFail(input);
  EXPECT_EQ(body.radius, 0.5);
  EXPECT_EQ(body.modal, modes.model);
  EXPECT_EQ(body.modalOrigin, Vec3(1, 2, 3));
  EXPECT_EQ(body.texture, texture.texture);
}

// The moment is m (b^2 + c^2) / 3 for half extents b and c across the axis.
TEST(CBody, BoxTurnsAsOneOfEvenDensity) {
  const Vec3 half(0.01, 0.02, 0.03);
  const SoundBody body = readOrFail(box(half));
  const Vec3 squares = half.cwiseAbs2();
  const Vec3 moments = kMass / 3.0 * (Vec3::Constant(squares.sum()) - squares);
  const Matrix3d expected = moments.cwiseInverse().asDiagonal();
  EXPECT_TRUE(body.inverseInertia.isApprox(expected, 1e-12)) << body.inverseInertia;
}

// About its centre of mass a tetrahedron of mass m has the inertia of four points of m/20 at its
// corners, with the rest in the centre.
TEST(CBody, MeshTurnsAsATetrahedronOfEvenDensity) {
  const Vec3 legs(0.04, 0.02, 0.03);
  const Tetrahedron shape(legs);
  Matrix3d inertia = Matrix3d::Zero();
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const Vec3 at = Eigen::Map<const Vec3>(shape.vertices.data() + 3 * corner);
    inertia += kMass / 20.0 * (at.squaredNorm() * Matrix3d::Identity() - at * at.transpose());
  }
  const SoundBody body = readOrFail(shape.body());
  EXPECT_TRUE((body.inverseInertia * inertia).isIdentity(1e-9)) << body.inverseInertia * inertia;
}

TEST(CBody, InertiaThatIsGivenCounts) {
  carom_body body = box({0.01, 0.02, 0.03});
  Matrix3d inertia;
  inertia << 3e-4, 1e-5, 0, 1e-5, 2e-4, 0, 0, 0, 1e-4;
  Eigen::Map<Matrix3d>(body.inertia) = inertia;
  EXPECT_TRUE((readOrFail(body).inverseInertia * inertia).isIdentity(1e-12));
}

TEST(CBody, DoesNotTurnAboutAnAxisOfInfiniteInertia) {
  carom_body body = box({0.01, 0.02, 0.03});
  body.inertia[0] = std::numeric_limits<double>::infinity();
  body.inertia[4] = 0.5;
  body.inertia[8] = 0.25;
  const Matrix3d expected = Vec3(0.0, 2.0, 4.0).asDiagonal();
  EXPECT_EQ(readOrFail(body).inverseInertia, expected);
}

TEST(CBody, RefusesInertiaThatNoBodyHas) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const std::array<double, 9>& inertia :
       std::vector<std::array<double, 9>>{{1, 0, 0, 0, 1, 0, 0, 0, 0},
                                          {1, 2, 0, 2, 1, 0, 0, 0, 1},
                                          {1, 0.5, 0, 0, 1, 0, 0, 0, 1},
                                          {infinity, 0.5, 0, 0.5, 1, 0, 0, 0, 1},
                                          {std::nan(""), 0, 0, 0, 1, 0, 0, 0, 1}}) {
    carom_body body = box({0.01, 0.02, 0.03});
    std::copy(inertia.begin(), inertia.end(), body.inertia);
    const Result<SoundBody> read = CBodyReader(RadiatorChoice::solved).read(&body);
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().message.find("inertia"), std::string::npos) << read.error().message;
  }
}

TEST(CBody, RefusesAMeshThatDoesNotLieAboutItsCentreOfMassUnlessItsInertiaIsGiven) {
  const Tetrahedron shape({0.04, 0.02, 0.03}, {0.01, 0.0, 0.0});
  carom_body body = shape.body();
  const Result<SoundBody> read = CBodyReader(RadiatorChoice::solved).read(&body);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("0.01"), std::string::npos) << read.error().message;
  body.inertia[0] = body.inertia[4] = body.inertia[8] = 1e-4;
  EXPECT_EQ(readOrFail(body).inverseInertia, Matrix3d(1e4 * Matrix3d::Identity()));
}

TEST(CBody, RefusesCountsThatNoMeshHas) {
  for (const std::size_t count : {SIZE_MAX, SIZE_MAX / 3 + 2, std::size_t{1} << 40U}) {
    const Tetrahedron shape({0.1, 0.1, 0.1});
    carom_body vertices = shape.body();
    vertices.vertex_count = count;
    carom_body triangles = shape.body();
    triangles.triangle_count = count;
    for (const carom_body& body : {vertices, triangles}) {
      const Result<SoundBody> read = CBodyReader(RadiatorChoice::solved).read(&body);
      ASSERT_FALSE(read);
      EXPECT_NE(read.error().message.find("expected at most"), std::string::npos);
    }
  }
}

TEST(CBody, IsTheSphereOfItsVolumeWhereThatIsChosen) {
  const SoundBody body = readOrFail(box({0.01, 0.02, 0.03}), RadiatorChoice::equivalentSphere);
  EXPECT_EQ(body.shape, nullptr);
  EXPECT_NEAR(4.0 / 3.0 * std::acos(-1.0) * std::pow(body.radius, 3), 8 * 0.01 * 0.02 * 0.03,
              1e-18);
}

TEST(CBody, SolvesEqualShapesOnce) {
  CBodyReader reader(RadiatorChoice::solved);
  const carom_body first = box({0.01, 0.02, 0.03});
  carom_body second = first;
  second.mass = 2.0 * kMass;
  const Result<SoundBody> one = reader.read(&first);
  const Result<SoundBody> other = reader.read(&second);
  ASSERT_TRUE(one && other);
  EXPECT_NE(one->shape, nullptr);
  EXPECT_EQ(one->shape, other->shape);
}

TEST(CBody, NeedsNoShapeWhereItIsImmovable) {
  carom_body body = steel(CAROM_SHAPE_BOX);
  body.mass = std::numeric_limits<double>::infinity();
  EXPECT_EQ(readOrFail(body).shape, nullptr);
}

}  // namespace
}  // namespace carom
