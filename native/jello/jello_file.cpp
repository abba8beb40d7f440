#include "native/jello/jello_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "audio/model/decimal.h"

namespace carom::native {
namespace {

constexpr std::size_t kPoints = 8;
constexpr double kRoom = 2.0;
constexpr std::size_t kMostForces = 256;  // along each axis of the field
constexpr double kMostFileSteps = 1e9;

/// The numbers that a field accepts. docs/jello.md repeats them.
struct Range {
  const char* what;  ///< with its unit
  double least;
  double most;
};

constexpr Range kStep{"the step dt (s)", 1e-8, 1.0};
constexpr Range kElastic{"kElastic (N/m)", 0.0, 1e12};
constexpr Range kElasticDamping{"dElastic (N s/m)", 0.0, 1e9};
constexpr Range kCollision{"kCollision (N/m)", 0.0, 1e12};
constexpr Range kCollisionDamping{"dCollision (N s/m)", 0.0, 1e9};
constexpr Range kPointMass{"the mass of a point (kg)", 1e-21, 1e18};
constexpr double kMostNormal = 1e6;  // component of the plane's normal
constexpr double kFarthest = 1e6;    // m
constexpr double kMostSpeed = 1e4;   // m/s, along each axis
constexpr double kMostForce = 1e12;  // N, along each axis

/// Returns the shortest decimal that reads back as the same number.
std::string shortest(double value) {
  std::array<char, 32> digits{};
  const auto [end, code] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return {digits.data(), end};
}

/// Splits a text into words, and counts its lines.
class Words {
 public:
  explicit Words(std::string_view text) : left_(text) {}

  /// Line of the word that was read last; at the end, the last line.
  std::size_t line() const { return line_; }

  /// Returns the next word; empty at the end.
  std::string_view next() {
    while (!left_.empty() && isSpace(left_.front())) {
      if (left_.front() == '\n') ++line_;
      left_.remove_prefix(1);
    }
    std::size_t length = 0;
    while (length < left_.size() && !isSpace(left_[length]))
      ++length;
    const std::string_view word = left_.substr(0, length);
    left_.remove_prefix(length);
    return word;
  }

 private:
  static bool isSpace(char letter) {
    return letter == ' ' || letter == '\t' || letter == '\n' || letter == '\r' || letter == '\f' ||
           letter == '\v';
  }
  std::string_view left_;
  std::size_t line_ = 1;
};

/// Quotes a word of a file that may hold anything: printable, and cut off after kLongest
/// characters.
std::string quoted(std::string_view word) {
  constexpr std::size_t kLongest = 40;
  std::string text = "'";
  for (const char letter : word.substr(0, kLongest))
    text += letter > ' ' && letter <= '~' ? letter : '?';
  return text + (word.size() > kLongest ? "...'" : "'");
}

std::optional<JelloIntegrator> integratorOf(std::string_view word) {
  std::string small;
  for (const char letter : word)
    small += static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  if (small == "euler") return JelloIntegrator::explicitEuler;
  for (std::size_t which = 0; which < kJelloIntegrators; ++which)
    if (small == nameOf(static_cast<JelloIntegrator>(which)))
      return static_cast<JelloIntegrator>(which);
  return std::nullopt;
}

/// Reads a world file; its functions return 0 after the first error.
class Reader {
 public:
  explicit Reader(std::string_view text) : words_(text) {}

  Result<JelloFile> read() {
    readStepping();
    JelloWorld& world = file_.world;
    world.lattice.stiffness = number(kElastic);
    world.lattice.damping = number(kElasticDamping);
    world.contact.stiffness = number(kCollision);
    world.contact.damping = number(kCollisionDamping);
    world.lattice.pointMass = number(kPointMass);
    world.room = JelloBox{Vec3::Constant(-kRoom), Vec3::Constant(kRoom)};
    const std::optional<std::array<double, 4>> plane = readPlane();
    readField();
    readPoints(world.positions, "positions", kFarthest);
    readPoints(world.velocities, "velocities", kMostSpeed);
    if (error_.empty()) {
      if (const std::string_view word = words_.next(); !word.empty())
        fail("after the last velocity there is " + quoted(word) + "; expected the end");
    }
    if (!error_.empty()) return Error{error_};
    if (plane) addPlane(*plane);
    return std::move(file_);
  }

 private:
  void fail(const std::string& reason) {
    if (error_.empty()) error_ = "line " + std::to_string(words_.line()) + ": " + reason;
  }

  double number(const std::string& what) {
    if (!error_.empty()) return 0.0;
    std::string_view word = words_.next();
    if (word.empty()) {
      fail("the file ends where " + what + " should be");
      return 0.0;
    }
    const std::string_view whole = word;
    if (word.size() > 1 && word.front() == '+') word.remove_prefix(1);
    double value = 0.0;
    const auto [end, code] = audio::readDecimal(word.data(), word.data() + word.size(), value);
    if (code != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      fail(quoted(whole) + " is no number; expected " + what);
    return value;
  }
  double number(const std::string& what, double least, double most) {
    const double value = number(what);
    if (!(value >= least && value <= most))
      fail(what + " is " + shortest(value) + "; expected a number from " + shortest(least) +
           " to " + shortest(most));
    return error_.empty() ? value : 0.0;
  }
  double number(const Range& range) { return number(range.what, range.least, range.most); }
  std::size_t count(const std::string& what, double least, double most) {
    const double value = number(what);
    if (!(value >= least && value <= most && value == std::floor(value)))
      fail(what + " is no whole number from " + std::to_string(static_cast<long>(least)) + " to " +
           std::to_string(static_cast<long>(most)));
    return error_.empty() ? static_cast<std::size_t>(value) : 0;
  }
  Vec3 vector(const std::string& what, double most) {
    const double x = number(what, -most, most);
    const double y = number(what, -most, most);
    return {x, y, number(what, -most, most)};
  }

  void readStepping() {
    const std::string_view word = words_.next();
    const auto integrator = integratorOf(word);
    if (integrator)
      file_.integrator = *integrator;
    else
      fail(quoted(word) +
           " is no integrator; expected Euler, RK4, symplectic_euler, midpoint or backward_euler");
    file_.step = number(kStep);
    file_.stepsPerFrame = count("the number of steps to a picture", 1.0, kMostFileSteps);
  }

  std::optional<std::array<double, 4>> readPlane() {
    if (count("the flag of the inclined plane", 0.0, 1.0) == 0) return std::nullopt;
    std::array<double, 4> plane{};
    constexpr std::array<const char*, 4> kNames = {"a", "b", "c", "d"};
    for (std::size_t index = 0; index < plane.size(); ++index)
      plane[index] =
          number(std::string(kNames[index]) + " of the inclined plane", -kMostNormal, kMostNormal);
    const double length = std::hypot(plane[0], plane[1], plane[2]);
    if (!(length > 0.0)) fail("the normal of the inclined plane is 0; expected a direction a b c");
    for (double& part : plane)
      part /= length;
    if (!(std::abs(plane[3]) <= kFarthest))
      fail("the inclined plane is farther than 1e6 m away; expected a smaller d");
    return plane;
  }

  void readField() {
    JelloField& field = file_.world.field;
    field.count = count("the resolution of the force field", 0.0, static_cast<double>(kMostForces));
    field.min = Vec3::Constant(-kRoom);
    field.max = Vec3::Constant(kRoom);
    const std::size_t total = field.count * field.count * field.count;
    for (std::size_t index = 0; index < total && error_.empty(); ++index)
      field.forces.push_back(
          vector("force " + std::to_string(index + 1) + " of " + std::to_string(total) + " (N)",
                 kMostForce));
  }

  void readPoints(std::vector<Vec3>& points, const std::string& what, double most) {
    const std::size_t total = file_.world.pointCount();
    for (std::size_t index = 0; index < total && error_.empty(); ++index)
      points.push_back(vector(
          "number " + std::to_string(index + 1) + " of the " + std::to_string(total) + " " + what,
          most));
  }

  void addPlane(const std::array<double, 4>& plane) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& point : file_.world.positions)
      middle += point / static_cast<double>(file_.world.positions.size());
    Vec3 normal = Vec3(plane[0], plane[1], plane[2]).normalized();
    const double side = normal.dot(middle) + plane[3] < 0.0 ? -1.0 : 1.0;
    file_.world.planes = {{.id = 1, .normal = side * normal, .offset = -side * plane[3]}};
  }

  Words words_;
  JelloFile file_;
  std::string error_;
};

Status validateWritable(const JelloFile& file) {
  const JelloWorld& world = file.world;
  if (Status valid = validate(world); !valid) return valid;
  if (file.stepsPerFrame < 1 || static_cast<double>(file.stepsPerFrame) > kMostFileSteps)
    return Error{"there must be 1 to 10^9 steps to a picture"};
  if (world.lattice.count != kPoints || world.lattice.size != Vec3::Ones())
    return Error{"a world file is of 8 x 8 x 8 points in a cube of 1 m"};
  const auto isRoom = [](const Vec3& min, const Vec3& max) {
    return min == Vec3::Constant(-kRoom) && max == Vec3::Constant(kRoom);
  };
  if (!world.room || !isRoom(world.room->min, world.room->max))
    return Error{"a world file is of a room from -2 m to 2 m"};
  if (world.field.count > kMostForces) return Error{"a world file has at most 256^3 forces"};
  if (world.field.count > 0 && !isRoom(world.field.min, world.field.max))
    return Error{"the field of a world file is over all of its room"};
  if (!world.gravity.isZero(0.0))
    return Error{"a world file has no gravity; a field of forces is one"};
  if (!world.balls.empty()) return Error{"a world file has no balls"};
  if (world.planes.size() > 1) return Error{"a world file has one inclined plane at most"};
  return std::monostate{};
}

/// Appends the shortest decimal that reads back as the same number, followed by `after`.
void put(std::string& text, double value, char after) {
  text += shortest(value);
  text += after;
}

void put(std::string& text, const Vec3& value) {
  put(text, value.x(), ' ');
  put(text, value.y(), ' ');
  put(text, value.z(), '\n');
}

}  // namespace

Result<JelloFile> jelloFromText(std::string_view text, const std::string& name) {
  Result<JelloFile> file = Reader(text).read();
  if (!file) return Error{name + ": " + file.error().message};
  if (const Status valid = validate(file->world); !valid)
    return Error{name + ": " + valid.error().message};
  return file;
}

Result<std::string> jelloText(const JelloFile& file) {
  if (const Status valid = validateWritable(file); !valid)
    return Error{"world file: " + valid.error().message};
  const JelloWorld& world = file.world;
  std::string text;
  if (file.integrator == JelloIntegrator::explicitEuler)
    text = "Euler\n";
  else if (file.integrator == JelloIntegrator::rungeKutta4)
    text = "RK4\n";
  else
    text = std::string(nameOf(file.integrator)) + "\n";
  put(text, file.step, ' ');
  text += std::to_string(file.stepsPerFrame) + "\n";
  put(text, world.lattice.stiffness, ' ');
  put(text, world.lattice.damping, ' ');
  put(text, world.contact.stiffness, ' ');
  put(text, world.contact.damping, '\n');
  put(text, world.lattice.pointMass, '\n');
  if (world.planes.empty()) {
    text += "0\n";
  } else {
    text += "1\n";
    for (const double part : world.planes.front().normal)
      put(text, part, ' ');
    put(text, -world.planes.front().offset, '\n');
  }
  text += std::to_string(world.field.count) + "\n";
  for (const std::vector<Vec3>* list : {&world.field.forces, &world.positions, &world.velocities})
    for (const Vec3& value : *list)
      put(text, value);
  // Reading it finds what is out of range.
  if (const Result<JelloFile> read = Reader(text).read(); !read)
    return Error{"world file: " + read.error().message};
  return text;
}

}  // namespace carom::native
