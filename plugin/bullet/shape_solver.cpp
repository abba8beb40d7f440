#include "plugin/bullet/shape_solver.h"

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

#include <unistd.h>

namespace carom::plugin {
namespace {

/// Steps by which the thread is nicer than the others.
constexpr int kNicer = 10;

/// Lack of memory would end the process, in a thread.
Result<ShapeSolver::Radiator> solve(const SurfaceMesh& surface) {
  try {
    const Result<RigidRadiator> radiator = panelRadiator(surface, {.quick = true});
    if (!radiator) return radiator.error();
    return std::make_shared<const RigidRadiator>(*radiator);
  } catch (const std::bad_alloc&) {
    return Error{"shape: there is no memory to solve its added mass, up to 40 MB"};
  }
}

/// Linux has a niceness of each thread; elsewhere it would be that of the whole process.
void giveWay() {
#ifdef __linux__
  [[maybe_unused]] const int niceness = nice(kNicer);
#endif
}

}  // namespace

ShapeSolver::~ShapeSolver() {
  if (!thread_.joinable()) return;
  if (process_ == getpid())
    stop();
  else
    thread_.detach();  // it is in the other process
}

ShapeSolver::ShapeId ShapeSolver::request(const SurfaceMesh& surface, double urgency) {
  const auto [entry, isNew] = ids_.try_emplace(surface, shapes_.size());
  const ShapeId shape = entry->second;
  if (isNew) shapes_.push_back({&entry->first, std::nullopt});
  if (shapes_[shape].radiator) return shape;
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
    const auto next = std::ranges::max_element(waiting_, std::less<>());
    const Job job = *next;
    waiting_.erase(next);
    underWay_ = job.shape;
    lock.unlock();
    Result<Radiator> radiator = solve(*job.surface);
    lock.lock();
    done_.push_back({job.shape, std::move(radiator)});
    hasSolved_.store(true, std::memory_order_release);
    underWay_.reset();
    changed_.notify_all();
  }
  isWorking_ = false;
}

const Result<ShapeSolver::Radiator>* ShapeSolver::solution(ShapeId shape) const {
  const auto& radiator = shapes_[shape].radiator;
  return radiator ? &*radiator : nullptr;
}

void ShapeSolver::enter(Solution solution) {
  ++known_;
  if (solution.radiator) ++solved_;
  shapes_[solution.shape].radiator = std::move(solution.radiator);
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
  if (shapes_[shape].radiator) return false;
  if (const std::optional<Job> job = takeJob(shape)) {
    enter({shape, solve(*job->surface)});
    return true;
  }
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return underWay_ != shape; });
  }
  takeSolved();
  return true;
}

void ShapeSolver::finishAll() {
  for (ShapeId shape = 0; shape < shapes_.size(); ++shape)
    (void)finish(shape);
}

void ShapeSolver::stop() {
  {
    const std::lock_guard lock(mutex_);
    waiting_.clear();
  }
  if (thread_.joinable()) thread_.join();
}

}  // namespace carom::plugin
