#include "native/jello/jello_worker.h"

namespace carom::native {

#if CAROM_THREADS

bool JelloWorker::isOfUse() {
  return std::thread::hardware_concurrency() > 1;
}

JelloWorker::JelloWorker() : thread_([this] { work(); }) {}

JelloWorker::~JelloWorker() {
  ends_ = true;
  asked_.fetch_add(1, std::memory_order_release);
  asked_.notify_one();
  thread_.join();
}

void JelloWorker::run(const std::function<void(std::size_t)>& half) {
  half_ = &half;
  const std::uint32_t turn = asked_.fetch_add(1, std::memory_order_release) + 1;
  asked_.notify_one();
  half(0);
  for (std::uint32_t done = done_.load(std::memory_order_acquire); done != turn;
       done = done_.load(std::memory_order_acquire))
    done_.wait(done, std::memory_order_acquire);
}

void JelloWorker::work() {
  for (std::uint32_t turn = 0;;) {
    asked_.wait(turn, std::memory_order_acquire);
    ++turn;
    if (ends_) return;
    (*half_)(1);
    done_.store(turn, std::memory_order_release);
    done_.notify_one();
  }
}

#else

bool JelloWorker::isOfUse() {
  return false;
}

void JelloWorker::run(const std::function<void(std::size_t)>& half) {
  half(0);
  half(1);
}

#endif

}  // namespace carom::native
