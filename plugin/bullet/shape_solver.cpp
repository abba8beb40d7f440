#include "plugin/bullet/shape_solver.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <new>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <pthread.h>
#include <unistd.h>

namespace carom::plugin {
namespace {

/// Complete shapes that are kept for bodies to come.
constexpr std::size_t kManyShapes = 4096;
/// Steps by which the thread is nicer than the others.
constexpr int kNicer = 10;

/// An exception would end the process, in a thread.
Result<ShapeSolver::Radiator> solveRadiator(const SurfaceMesh& surface) {
  try {
    const Result<RigidRadiator> radiator = panelRadiator(surface, {.quick = true});
    if (!radiator) return radiator.error();
    return std::make_shared<const RigidRadiator>(*radiator);
  } catch (const std::bad_alloc&) {
    return Error{"shape: there is no memory to solve its added mass, up to 40 MB"};
  } catch (const std::exception& error) {
    return Error{std::string("shape: its added mass cannot be solved: ") + error.what()};
  }
}

/// The solvers of the process, for when it is copied. Never destroyed: sounds may be static.
struct Solvers {
  std::mutex mutex;
  std::set<ShapeSolver*> all;
};
Solvers& solvers() {
  static Solvers& all = *new Solvers;
  return all;
}

/// Linux has a niceness of each thread; elsewhere it would be that of the whole process.
void giveWay() {
#ifdef __linux__
  [[maybe_unused]] const int niceness = nice(kNicer);
#endif
}

}  // namespace

ShapeSolver::Solution ShapeSolver::solve(const Job& job,
                                         const std::function<bool()>& goesOn) const {
  if (!job.isRecoil) return {.shape = job.shape, .radiator = solveRadiator(*job.surface)};
  Solution solution{.shape = job.shape};
  try {
    const std::lock_guard lock(*recoilMutex_);
    Result<RigidRecoil> recoil = solveRecoil_(*job.surface, goesOn);
    const Status valid = recoil ? validate(*recoil) : Status(recoil.error());
    if (valid)
      solution.recoil = std::make_shared<const RigidRecoil>(*std::move(recoil));
    else
      solution.recoil = valid.error();
  } catch (const std::bad_alloc&) {
    solution.recoil = Error{"shape: there is no memory to solve its recoil"};
  } catch (const std::exception& error) {
    solution.recoil = Error{std::string("shape: its recoil cannot be solved: ") + error.what()};
  }
  return solution;
}

/// Returns what is to be solved of a shape after this.
std::optional<ShapeSolver::Job> ShapeSolver::nextOf(const Job& job,
                                                    const Solution& solution) const {
  const bool isWanted = solveRecoil_ != nullptr && !job.isRecoil && bool(*solution.radiator);
  if (!isWanted) return std::nullopt;
  Job next = job;
  next.isRecoil = true;
  return next;
}

ShapeSolver::ShapeSolver(RecoilSolver recoil) : solveRecoil_(std::move(recoil)) {
  static std::once_flag once;
  std::call_once(once, [] { pthread_atfork(&beforeFork, &afterFork, &afterFork); });
  const std::lock_guard lock(solvers().mutex);
  solvers().all.insert(this);
}

/// Has no thread within a critical section while the process is copied.
void ShapeSolver::beforeFork() {
  solvers().mutex.lock();
  for (ShapeSolver* const solver : solvers().all)
    solver->mutex_.lock();
}

/// In the parent and in the child.
void ShapeSolver::afterFork() {
  for (ShapeSolver* const solver : solvers().all)
    solver->mutex_.unlock();
  solvers().mutex.unlock();
}

ShapeSolver::~ShapeSolver() {
  {
    const std::lock_guard lock(solvers().mutex);
    solvers().all.erase(this);
  }
  if (!thread_.joinable()) return;
  if (process_ == getpid())
    stop();
  else
    thread_.detach();  // it is in the other process
}

/// In the child of a fork, what the parent's thread had in hand waits again.
void ShapeSolver::forgetOtherProcess() {
  if (!thread_.joinable() || process_ == getpid()) return;
  thread_.detach();
  isWorking_ = false;
  (void)recoilMutex_.release();  // the thread may have had it
  recoilMutex_ = std::make_unique<std::mutex>();
  if (!underWay_) return;
  const Shape& shape = shapes_[*underWay_];
  waiting_.push_back({.shape = *underWay_,
                      .surface = shape.surface,
                      .urgency = 0.0,
                      .isRecoil = shape.radiator.has_value()});
  underWay_.reset();
}

ShapeSolver::ShapeId ShapeSolver::request(const SurfaceMesh& surface, double urgency) {
  forgetOtherProcess();
  const auto [entry, isNew] = ids_.try_emplace(surface, shapes_.size());
  const ShapeId shape = entry->second;
  if (isNew) shapes_.push_back({&entry->first});
  if (isComplete(shape)) return shape;
  bool isIdle = false;
  {
    const std::lock_guard lock(mutex_);
    if (isNew) waiting_.push_back({shape, &entry->first, urgency});
    for (Job& job : waiting_)
      if (job.shape == shape) job.urgency = std::max(job.urgency, urgency);
    isIdle = !isWorking_ && !waiting_.empty();
  }
  if (isIdle) startThread();
  return shape;
}

void ShapeSolver::hasten(ShapeId shape) {
  const std::lock_guard lock(mutex_);
  for (Job& job : waiting_)
    if (job.shape == shape) job.isInUse = true;
}

/// Where the system has no thread to spare, surfaces wait for the next request, or for `finish`.
void ShapeSolver::startThread() {
  if (thread_.joinable()) thread_.join();  // its work is over
  process_ = getpid();
  isWorking_ = true;
  try {
    thread_ = std::thread([this] { work(); });
  } catch (const std::system_error&) {
    isWorking_ = false;
  }
}

void ShapeSolver::work() {
  giveWay();
  std::unique_lock lock(mutex_);
  while (!waiting_.empty()) {
    try {
      done_.reserve(done_.size() + 1);
      waiting_.reserve(waiting_.size() + 1);
    } catch (const std::bad_alloc&) {
      break;  // what waits does so until the next request, or `finish`
    }
    const auto next = std::ranges::max_element(waiting_, std::less<>());
    const Job job = *next;
    waiting_.erase(next);
    underWay_ = job.shape;
    lock.unlock();
    Solution solution = solve(job, [this] { return !isStopping_.load(); });
    lock.lock();
    if (!isStopping_.load()) {
      if (const std::optional<Job> then = nextOf(job, solution)) waiting_.push_back(*then);
      done_.push_back(std::move(solution));
      hasSolved_.store(true, std::memory_order_release);
    }
    underWay_.reset();
    changed_.notify_all();
  }
  isWorking_ = false;
}

const Result<ShapeSolver::Radiator>* ShapeSolver::solution(ShapeId shape) const {
  const auto& radiator = shapes_[shape].radiator;
  return radiator ? &*radiator : nullptr;
}

const Result<ShapeSolver::Recoil>* ShapeSolver::recoil(ShapeId shape) const {
  const auto& recoil = shapes_[shape].recoil;
  return recoil ? &*recoil : nullptr;
}

bool ShapeSolver::isComplete(ShapeId shape) const {
  const auto& [surface, radiator, recoil] = shapes_[shape];
  return radiator && (solveRecoil_ == nullptr || !*radiator || recoil);
}

void ShapeSolver::enter(Solution solution) {
  Shape& shape = shapes_[solution.shape];
  ++known_;
  if (solution.radiator) {
    if (*solution.radiator) ++solved_;
    shape.radiator = std::move(solution.radiator);
  } else {
    shape.recoil = std::move(solution.recoil);
  }
  if (isComplete(solution.shape)) ++complete_;
}

void ShapeSolver::takeSolved() {
  if (!hasSolved_.load(std::memory_order_acquire)) return;
  std::vector<Solution> done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
    hasSolved_.store(false, std::memory_order_relaxed);
  }
  for (Solution& solution : done)
    enter(std::move(solution));
}

void ShapeSolver::keepOnly(const std::unordered_set<ShapeId>& shapes) {
  const bool areMany = ids_.size() > kManyShapes;
  const std::lock_guard lock(mutex_);
  const auto isForgotten = [&](ShapeId shape) {
    if (shapes.contains(shape) || shape == underWay_) return false;
    return isComplete(shape) ? areMany
                             : std::ranges::find(done_, shape, &Solution::shape) == done_.end();
  };
  for (auto entry = ids_.begin(); entry != ids_.end();) {
    const ShapeId shape = entry->second;
    if (!isForgotten(shape)) {
      ++entry;
      continue;
    }
    if (!isComplete(shape)) ++forgotten_;
    std::erase_if(waiting_, [shape](const Job& job) { return job.shape == shape; });
    shapes_[shape] = {nullptr, Error{"shape: forgotten"}};
    entry = ids_.erase(entry);
  }
}

std::optional<ShapeSolver::Job> ShapeSolver::takeJob(ShapeId shape) {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(waiting_, shape, &Job::shape);
  if (found == waiting_.end()) return std::nullopt;
  const Job job = *found;
  waiting_.erase(found);
  return job;
}

bool ShapeSolver::finish(ShapeId shape) {
  takeSolved();
  forgetOtherProcess();
  if (isComplete(shape)) return false;
  while (!isComplete(shape)) {
    if (const std::optional<Job> job = takeJob(shape)) {
      Solution solution = solve(*job, [] { return true; });
      if (const std::optional<Job> then = nextOf(*job, solution)) {
        const std::lock_guard lock(mutex_);
        waiting_.push_back(*then);
      }
      enter(std::move(solution));
      continue;
    }
    {
      std::unique_lock lock(mutex_);
      if (underWay_ != shape && done_.empty()) break;  // `stop` has dropped it
      changed_.wait(lock, [&] { return underWay_ != shape; });
    }
    takeSolved();
  }
  return true;
}

void ShapeSolver::finishAll() {
  for (ShapeId shape = 0; shape < shapes_.size(); ++shape)
    (void)finish(shape);
}

void ShapeSolver::stop() {
  forgetOtherProcess();
  {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
    isStopping_ = true;
  }
  if (thread_.joinable()) thread_.join();
  isStopping_ = false;
}

}  // namespace carom::plugin
