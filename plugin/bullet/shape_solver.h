#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/result.h"
#include "carom/audio/rigid_radiator.h"
#include "carom/audio/surface_mesh.h"

namespace carom::plugin {

/// Solves the added mass of surfaces in a thread of its own, of low priority, the most urgent
/// first, and then their recoil, if there is a function that does. The thread is there only as long
/// as a surface waits. Which surfaces are equal is told by their content, which is copied: nothing
/// of the host is looked at later.
///
/// One thread, that of the simulation, calls everything. In the child of a fork, the thread is not
/// there, and its work is done again.
class ShapeSolver {
 public:
  using ShapeId = std::size_t;
  using Radiator = std::shared_ptr<const RigidRadiator>;
  using Recoil = std::shared_ptr<const RigidRecoil>;

  /// `recoil`: null if no recoils are wanted.
  explicit ShapeSolver(RecoilSolver recoil = nullptr);
  /// Waits for the surface that is being solved, if any.
  ~ShapeSolver();
  ShapeSolver(const ShapeSolver&) = delete;
  ShapeSolver& operator=(const ShapeSolver&) = delete;

  /// Returns the id of a surface, the same for equal ones. It will be solved, the larger `urgency`
  /// the sooner; the largest that was given counts.
  ShapeId request(const SurfaceMesh& surface, double urgency);
  /// Has a surface solved before all those for which this was not called.
  void hasten(ShapeId shape);

  /// Returns a radiator, or why there is none; null while that is not known. Valid as long as the
  /// solver lives.
  const Result<Radiator>* solution(ShapeId shape) const;
  /// The same for its recoil; null as well where none is wanted, or the radiator is not solved.
  const Result<Recoil>* recoil(ShapeId shape) const;
  /// True if nothing of the shape is to be solved any more.
  bool isComplete(ShapeId shape) const;
  /// Takes note of what the thread has solved: only then is it known.
  void takeSolved();
  /// Makes the shape complete: solves it here, or waits if the thread has begun with it. Returns
  /// false if it was complete already.
  bool finish(ShapeId shape);
  /// Makes all solutions known.
  void finishAll();
  /// Forgets shapes that wait, but for those given, and, where there are many, those that are
  /// complete. They are asked about no more; an equal surface will be a new shape.
  void keepOnly(const std::unordered_set<ShapeId>& shapes);
  /// Drops what waits, so that it stays unknown, and waits for the surface that is being solved; a
  /// recoil is ended early.
  void stop();

  std::uint64_t known() const { return known_; }    ///< solutions, of radiators and recoils
  std::uint64_t solved() const { return solved_; }  ///< shapes with a radiator
  std::uint64_t pending() const { return shapes_.size() - complete_ - forgotten_; }  ///< shapes
  std::size_t kept() const { return ids_.size(); }  ///< shapes that are not forgotten

 private:
  struct Shape {
    const SurfaceMesh* surface;  // in ids_; null if it is forgotten
    std::optional<Result<Radiator>> radiator{};
    std::optional<Result<Recoil>> recoil{};
  };
  struct Job {
    ShapeId shape;
    const SurfaceMesh* surface;
    double urgency;
    bool isInUse = false;
    bool isRecoil = false;

    bool operator<(const Job& other) const {
      if (isRecoil != other.isRecoil) return isRecoil;
      return isInUse != other.isInUse ? other.isInUse : urgency < other.urgency;
    }
  };
  /// One of the two.
  struct Solution {
    ShapeId shape;
    std::optional<Result<Radiator>> radiator{};
    std::optional<Result<Recoil>> recoil{};
  };

  static void beforeFork();
  static void afterFork();
  void startThread();
  void forgetOtherProcess();
  void work();
  Solution solve(const Job& job, const std::function<bool()>& goesOn) const;
  std::optional<Job> nextOf(const Job& job, const Solution& solution) const;
  std::optional<Job> takeJob(ShapeId shape);
  void enter(Solution solution);

  RecoilSolver solveRecoil_;  // called by one thread at a time, the one that has
  std::unique_ptr<std::mutex> recoilMutex_ = std::make_unique<std::mutex>();

  // The simulation's thread has these. Elements of ids_ stay where they are.
  std::unordered_map<SurfaceMesh, ShapeId, RadiatorCache::Hash> ids_;
  std::vector<Shape> shapes_;  // by id
  std::uint64_t known_ = 0;
  std::uint64_t solved_ = 0;
  std::uint64_t complete_ = 0;
  std::uint64_t forgotten_ = 0;  // of those that are not complete
  std::thread thread_;
  std::int64_t process_ = 0;  // that has the thread

  std::mutex mutex_;
  std::condition_variable changed_;  // underWay_ has
  // Guarded by mutex_:
  std::vector<Job> waiting_;
  std::vector<Solution> done_;
  std::optional<ShapeId> underWay_;
  bool isWorking_ = false;

  std::atomic<bool> hasSolved_ = false;   // done_ is not empty
  std::atomic<bool> isStopping_ = false;  // what is solved is not wanted any more
};

}  // namespace carom::plugin
