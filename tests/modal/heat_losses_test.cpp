#include "modal/analysis/heat_losses.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "modal/analysis/solid_model.h"
#include "tests/audio/meshes.h"
#include "tests/support/constants.h"
#include "tests/support/special_functions.h"

namespace carom::test {

using namespace modal;

namespace {

constexpr double kRoom = 293.15;  // K

/// Aluminium by round numbers.
Material conductor() {
  Material material{"conductor", 2700.0, 70e9, 0.33, 0.7};
  material.thermal = {23e-6, 200.0, 900.0};
  return material;
}

/// Returns what a thin beam loses by the sum over the modes in which temperature evens out across
/// it (Zener 1937): relaxations of strength 96 / (pi^4 n^4) and of rate n^2 pi^2 chi / h^2.
double zenerLoss(const Material& material, double thickness, double frequency) {
  const auto& [expansion, conductivity, heatCapacity] = material.thermal;
  const double perVolume = material.density * heatCapacity;
  const double diffusivity = conductivity / perVolume;
  const double strength = material.youngsModulus * expansion * expansion * kRoom / perVolume;
  double sum = 0.0;
  for (int n = 1; n < 4000; n += 2) {
    const double turns = 2.0 * kPi * frequency * std::pow(thickness / (n * kPi), 2.0) / diffusivity;
    sum += 96.0 / std::pow(kPi * n, 4.0) * turns / (1.0 + turns * turns);
  }
  return strength * sum;
}

TEST(ThermoelasticLossFactor, IsTheSumOfZenersRelaxations) {
  const Material material = conductor();
  for (const double thickness : {1e-5, 1e-4, 1e-3, 1e-2, 0.1})
    for (const double frequency : {20.0, 150.0, 1000.0, 20000.0}) {
      const double expected = zenerLoss(material, thickness, frequency);
      EXPECT_NEAR(thermoelasticLossFactor(material, thickness, frequency), expected,
                  1e-6 * expected)
          << thickness << " m, " << frequency << " Hz";
    }
}

// The closed form goes over into its limits without a step.
TEST(ThermoelasticLossFactor, IsContinuous) {
  const Material material = conductor();
  double before = thermoelasticLossFactor(material, 1e-3, 0.001);
  for (int step = 0; step < 20000; ++step) {  // to 480 kHz
    const double frequency = 0.001 * std::pow(1.001, step);
    const double now = thermoelasticLossFactor(material, 1e-3, frequency);
    EXPECT_NEAR(now / before, 1.0, 1.5e-3) << frequency;
    before = now;
  }
}

TEST(ThermoelasticLossFactor, IsNoneWhereAPropertyIsMissing) {
  for (double ThermalProperties::*missing :
       {&ThermalProperties::expansion, &ThermalProperties::conductivity,
        &ThermalProperties::heatCapacity}) {
    Material material = conductor();
    material.thermal.*missing = 0.0;
    EXPECT_EQ(thermoelasticLossFactor(material, 1e-3, 440.0), 0.0);
  }
}

/// The loss factor by heat of a mode.
double heatLoss(const Mode& mode) {
  return mode.heatDecayRate / (kPi * mode.frequency);
}

enum class BarMotion { flat, edgewise, other };

/// Tells a bar's bending along y (`edgewise`) or z (`flat`) from twisting and stretching, by how
/// the middles of its cross-sections move.
BarMotion motionOf(const ModalModel& model, std::size_t mode) {
  Vec3 middles = Vec3::Zero();  // sums of squares
  double all = 0.0;
  const std::size_t count = model.surface.vertices.size();
  for (std::size_t vertex = 0; vertex < count; ++vertex) {
    const Vec3& at = model.surface.vertices[vertex];
    Vec3 sum = Vec3::Zero();
    double corners = 0.0;
    for (std::size_t other = 0; other < count; ++other) {
      if (std::abs(model.surface.vertices[other].x() - at.x()) > 1e-6) continue;
      sum += model.shape(mode, other);
      corners += 1.0;
    }
    middles += (sum / corners).cwiseAbs2();
    all += model.shape(mode, vertex).squaredNorm();
  }
  if (middles.z() > 0.5 * all) return BarMotion::flat;
  if (middles.y() > 0.5 * all) return BarMotion::edgewise;
  return BarMotion::other;
}

// A strip of 100 x 3 x 1 mm, turned: each mode of bending loses as a beam of the thickness in that
// direction does, those that twist next to nothing.
TEST(HeatLosses, OfABarAreZeners) {
  const Material material = conductor();
  SurfaceMesh strip = boxMesh({0.05, 0.0015, 0.0005});
  for (int times = 0; times < 4; ++times)
    strip = splitMesh(strip);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  SurfaceMesh turned = strip;
  for (Vec3& vertex : turned.vertices)
    vertex = turn * vertex;
  Result<ModalModel> model = solidModalModel(turned, material);
  ASSERT_TRUE(model) << model.error().message;
  model->surface = strip;
  for (std::size_t at = 0; at < model->shapes.size(); at += 3) {
    Eigen::Map<Eigen::Vector3f> shape(&model->shapes[at]);
    shape = turn.transpose().cast<float>() * shape;
  }
  int flat = 0;
  int edgewise = 0;
  for (std::size_t mode = 0; mode < model->modes.size(); ++mode) {
    const Mode& found = model->modes[mode];
    if (found.frequency > 10000.0) break;
    const BarMotion motion = motionOf(*model, mode);
    flat += motion == BarMotion::flat ? 1 : 0;
    edgewise += motion == BarMotion::edgewise ? 1 : 0;
    const double thickness = motion == BarMotion::flat ? 0.001 : 0.003;
    const double expected = zenerLoss(material, thickness, found.frequency);
    if (motion == BarMotion::other)
      EXPECT_LT(heatLoss(found), 0.03 * expected) << found.frequency;
    else
      EXPECT_NEAR(heatLoss(found) / expected, 1.0, 0.02) << found.frequency;
    EXPECT_GE(found.decayRate, found.heatDecayRate);
  }
  EXPECT_GE(flat, 5);
  EXPECT_GE(edgewise, 3);
}

/// A disc of radius 1 and thickness 2, with 96 corners around.
SurfaceMesh roundDisc() {
  constexpr std::uint32_t kCorners = 96;
  SurfaceMesh mesh;
  mesh.vertices = {{0.0, 0.0, -1.0}, {0.0, 0.0, 1.0}};
  for (std::uint32_t corner = 0; corner < kCorners; ++corner) {
    const double angle = 2.0 * kPi * corner / kCorners;
    for (const double z : {-1.0, 1.0})
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
  }
  for (std::uint32_t corner = 0; corner < kCorners; ++corner) {
    const std::uint32_t low = 2 + 2 * corner;
    const std::uint32_t next = 2 + 2 * ((corner + 1) % kCorners);
    mesh.triangles.push_back({0, next, low});
    mesh.triangles.push_back({1, low + 1, next + 1});
    mesh.triangles.push_back({low, next, next + 1});
    mesh.triangles.push_back({low, next + 1, low + 1});
  }
  return mesh;
}

double besselI(int order, double x) {
  double term = std::pow(0.5 * x, order);
  for (int k = 2; k <= order; ++k)
    term /= k;
  double sum = term;
  for (int k = 1; k < 60; ++k) {
    term *= 0.25 * x * x / (k * (k + order));
    sum += term;
  }
  return sum;
}

/// The lowest axisymmetric vibration of a thin disc of radius 1 with a free edge, after Kirchhoff:
/// w = J0(k r) + c I0(k r).
class DiscMode {
 public:
  explicit DiscMode(double poissonsRatio) : nu_(poissonsRatio) {
    double low = 2.5;
    double high = 3.5;
    for (int step = 0; step < 60; ++step) {
      setWave(0.5 * (low + high));
      (momentAtEdge() * momentAtEdge(low) > 0.0 ? low : high) = 0.5 * (low + high);
    }
    setWave(0.5 * (low + high));
  }
  double wave() const { return wave_; }

  /// Returns what the loss is multiplied by beside a beam's: a sheet is heated by the sum of its
  /// curvatures, which is not all that its energy depends on.
  double share() const {
    double heated = 0.0;
    double energy = 0.0;
    constexpr int kRings = 2000;
    for (int ring = 0; ring < kRings; ++ring) {
      const double r = (ring + 0.5) / kRings;
      const auto [radial, around] = curvatures(r);
      const double sum = radial + around;
      heated += r * sum * sum;
      energy += r * (sum * sum - 2.0 * (1.0 - nu_) * radial * around);
    }
    return (1.0 + nu_) / (1.0 - nu_) * heated / energy;
  }

 private:
  struct Curvatures {
    double radial = 0.0;
    double around = 0.0;
  };
  void setWave(double wave) {
    wave_ = wave;
    bent_ = -besselJ(1, wave) / besselI(1, wave);
  }
  Curvatures curvatures(double r) const {
    const double x = wave_ * r;
    const double slope = wave_ * (-besselJ(1, x) + bent_ * besselI(1, x));
    const double sum = wave_ * wave_ * (-besselJ(0, x) + bent_ * besselI(0, x));
    return {sum - slope / r, slope / r};
  }
  double momentAtEdge() const {
    const auto [radial, around] = curvatures(1.0);
    return radial + nu_ * around;
  }
  double momentAtEdge(double wave) const {
    DiscMode other = *this;
    other.setWave(wave);
    return other.momentAtEdge();
  }

  double nu_;
  double wave_ = 0.0;
  double bent_ = 0.0;
};

// A disc that bends into a bowl is curved both ways, and loses about twice what a beam would; one
// that bends like a saddle, much less.
TEST(HeatLosses, OfADiscFollowItsCurvatures) {
  const Material material = conductor();
  constexpr double kRadius = 0.06;
  constexpr double kThickness = 0.001;
  SurfaceMesh disc = roundDisc();
  for (Vec3& vertex : disc.vertices)
    vertex = vertex.cwiseProduct(Vec3(kRadius, kRadius, 0.5 * kThickness));
  const Result<ModalModel> model = solidModalModel(disc, material, {.grid = {}, .maxModes = 6});
  ASSERT_TRUE(model) << model.error().message;
  const DiscMode theory(material.poissonsRatio);
  EXPECT_NEAR(theory.wave() * theory.wave(), 9.084, 2e-2);  // Leissa, Vibration of Plates, 1969
  const double rigidity = material.youngsModulus * std::pow(kThickness, 2.0) /
                          (12.0 * material.density * (1.0 - std::pow(material.poissonsRatio, 2.0)));
  const double frequency =
      std::pow(theory.wave() / kRadius, 2.0) * std::sqrt(rigidity) / (2.0 * kPi);
  ASSERT_GE(model->modes.size(), 3u);
  const Mode& bowl = model->modes[2];
  EXPECT_NEAR(bowl.frequency / frequency, 1.0, 0.01);
  const double expected = theory.share() * zenerLoss(material, kThickness, bowl.frequency);
  EXPECT_NEAR(heatLoss(bowl) / expected, 1.0, 0.02);
  EXPECT_GT(theory.share(), 1.8);
  const Mode& saddle = model->modes[0];
  EXPECT_LT(heatLoss(saddle), 0.35 * zenerLoss(material, kThickness, saddle.frequency));
}

// A mode loses what its shape makes flow, however finely the body is cut into cells.
TEST(HeatLosses, DoNotDependOnTheGrid) {
  const Material material = conductor();
  SurfaceMesh bar = boxMesh({0.04, 0.004, 0.002});
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.4, Vec3(3, 1, 2).normalized()).toRotationMatrix();
  for (Vec3& vertex : bar.vertices)
    vertex = turn * vertex;
  const auto lossOn = [&](std::size_t freedom) {
    SolidSettings settings;
    settings.maxModes = 4;
    settings.grid.degreesOfFreedom = freedom;
    const Result<ModalModel> model = solidModalModel(bar, material, settings);
    return model ? heatLoss(model->modes.front()) : 0.0;
  };
  EXPECT_NEAR(lossOn(1500) / lossOn(12000), 1.0, 0.02);
}

TEST(HeatLosses, AreNotOfMaterialsThatDoNotConduct) {
  Material material = conductor();
  material.thermal = {};
  const Result<ModalModel> model =
      solidModalModel(boxMesh({0.04, 0.004, 0.002}), material, {.grid = {}, .maxModes = 4});
  ASSERT_TRUE(model) << model.error().message;
  for (const Mode& mode : model->modes)
    EXPECT_EQ(mode.heatDecayRate, 0.0);
}

}  // namespace
}  // namespace carom::test
