#include "plugin/bullet/shape_solver.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/audio/meshes.h"

namespace carom::plugin {
namespace {

SurfaceMesh someBox(int number) {
  return boxMesh({1.0, 0.5 + 0.01 * number, 0.3});
}

bool haveEqualBits(const RigidRadiator& one, const RigidRadiator& other) {
  return one.volume == other.volume && one.centroid == other.centroid &&
         std::memcmp(one.addedVolume.data(), other.addedVolume.data(), sizeof one.addedVolume) == 0;
}

void expectSolution(const ShapeSolver& solver, ShapeSolver::ShapeId shape,
                    const SurfaceMesh& surface) {
  const auto* const found = solver.solution(shape);
  ASSERT_NE(found, nullptr);
  ASSERT_TRUE(*found);
  EXPECT_TRUE(haveEqualBits(***found, *panelRadiator(surface, {.quick = true})));
}

// Takes what the thread has solved until nothing is pending, or for a minute.
void waitForThread(ShapeSolver& solver) {
  for (int turn = 0; turn < 6000 && solver.pending() > 0; ++turn) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    solver.takeSolved();
  }
  EXPECT_EQ(solver.pending(), 0U);
}

TEST(ShapeSolver, ThreadAndCallerGiveTheSameBits) {
  ShapeSolver background;
  ShapeSolver foreground;
  for (int number = 0; number < 6; ++number) {
    (void)background.request(someBox(number), number);
    (void)foreground.request(someBox(number), number);
  }
  foreground.finishAll();
  waitForThread(background);
  for (int number = 0; number < 6; ++number) {
    const auto shape = static_cast<ShapeSolver::ShapeId>(number);
    expectSolution(background, shape, someBox(number));
    expectSolution(foreground, shape, someBox(number));
  }
  EXPECT_EQ(foreground.solved(), 6U);
}

TEST(ShapeSolver, EqualSurfacesAreOneShape) {
  ShapeSolver solver;
  const auto first = solver.request(someBox(0), 1.0);
  EXPECT_EQ(solver.request(someBox(0), 2.0), first);
  EXPECT_NE(solver.request(someBox(1), 2.0), first);
  solver.finishAll();
  EXPECT_EQ(solver.request(someBox(0), 2.0), first);
  EXPECT_EQ(solver.solved(), 2U);
  EXPECT_EQ(solver.pending(), 0U);
}

TEST(ShapeSolver, AShapeIsUnknownUntilItIsTaken) {
  ShapeSolver solver;
  const auto shape = solver.request(someBox(0), 1.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(solver.solution(shape), nullptr);
  EXPECT_EQ(solver.pending(), 1U);
  waitForThread(solver);
  EXPECT_NE(solver.solution(shape), nullptr);
}

TEST(ShapeSolver, AnUnsolvableSurfaceIsKnownAsSuch) {
  ShapeSolver solver;
  SurfaceMesh open = someBox(0);
  open.triangles.pop_back();
  const auto shape = solver.request(open, 1.0);
  waitForThread(solver);
  ASSERT_NE(solver.solution(shape), nullptr);
  EXPECT_FALSE(*solver.solution(shape));
  EXPECT_EQ(solver.solved(), 0U);
}

// While blockers keep the thread busy, the rest arrives from the least urgent on.
TEST(ShapeSolver, TheMostUrgentComesFirst) {
  constexpr std::size_t kBlockers = 3;
  ShapeSolver solver;
  for (std::size_t blocker = 0; blocker < kBlockers; ++blocker)
    (void)solver.request(ellipsoidMesh({1, 2, 3.0 + static_cast<double>(blocker)}, 4), 1e9);
  std::vector<ShapeSolver::ShapeId> shapes;
  for (int number = 0; number < 6; ++number)
    shapes.push_back(solver.request(someBox(number), number));
  solver.hasten(shapes[2]);
  solver.takeSolved();
  if (solver.known() == kBlockers) GTEST_SKIP() << "the thread was quicker than the requests";
  const std::vector<ShapeSolver::ShapeId> order = {shapes[2], shapes[5], shapes[4],
                                                   shapes[3], shapes[1], shapes[0]};
  while (solver.pending() > 0) {
    solver.takeSolved();
    const auto isKnown = [&](ShapeSolver::ShapeId shape) {
      return solver.solution(shape) != nullptr;
    };
    EXPECT_TRUE(std::ranges::is_partitioned(order, isKnown));
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

TEST(ShapeSolver, ForgetsWhatNobodyAwaits) {
  ShapeSolver solver;
  std::vector<ShapeSolver::ShapeId> shapes;
  for (int number = 0; number < 40; ++number)
    shapes.push_back(solver.request(someBox(number), 100.0 - number));
  solver.keepOnly({shapes[30]});
  EXPECT_LT(solver.kept(), 40U);
  solver.finishAll();
  waitForThread(solver);
  expectSolution(solver, shapes[30], someBox(30));
  EXPECT_LT(solver.solved(), 40U);
  const auto again = solver.request(someBox(39), 1.0);
  EXPECT_EQ(solver.pending(), 1U);
  EXPECT_TRUE(solver.finish(again));
  expectSolution(solver, again, someBox(39));
}

// Surfaces without a solution, which take no time.
TEST(ShapeSolver, KeepsSomeThousandsOfShapesForBodiesToCome) {
  ShapeSolver solver;
  const auto request = [&solver](int number) {
    SurfaceMesh open = someBox(number);
    open.triangles.pop_back();
    return solver.request(open, 1.0);
  };
  const auto first = request(0);
  for (int number = 0; number < 1000; ++number)
    (void)request(number);
  solver.finishAll();
  solver.keepOnly({});
  EXPECT_EQ(solver.kept(), 1000U);
  EXPECT_EQ(request(0), first);
  for (int number = 0; number < 5000; ++number)
    (void)request(number);
  solver.finishAll();
  solver.keepOnly({first});
  EXPECT_EQ(solver.kept(), 1U);
  EXPECT_NE(solver.solution(first), nullptr);
  EXPECT_EQ(solver.pending(), 0U);
}

TEST(ShapeSolver, EndsWhileShapesWait) {
  ShapeSolver stopped;
  for (int number = 0; number < 50; ++number)
    (void)stopped.request(someBox(number), 1.0);
  stopped.stop();
  EXPECT_LT(stopped.known(), 50U);
  (void)stopped.finish(49);
  EXPECT_EQ(stopped.solution(49), nullptr);
  ShapeSolver destroyed;
  for (int number = 0; number < 50; ++number)
    (void)destroyed.request(someBox(number), 1.0);
}

TEST(ShapeSolver, EndsAndGoesOnInTheChildOfAFork) {
  for (const bool goesOn : {false, true}) {
    auto solver = std::make_unique<ShapeSolver>();
    for (int number = 0; number < 20; ++number)
      (void)solver->request(someBox(number), 1.0);
    const pid_t child = fork();
    if (child == 0) {
      alarm(60);
      if (goesOn) solver->finishAll();
      const bool isDone = !goesOn || solver->solved() == 20U;
      solver.reset();
      _exit(isDone ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << goesOn;
    solver->finishAll();
    EXPECT_EQ(solver->solved(), 20U);
  }
}

}  // namespace
}  // namespace carom::plugin
