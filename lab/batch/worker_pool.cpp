#include "lab/batch/worker_pool.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>
#include <system_error>
#include <vector>

#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace carom::lab {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kTickMilliseconds = 200;
/// In place of the length of an answer: there is none yet.
constexpr std::uint64_t kGoesOn = std::numeric_limits<std::uint64_t>::max();

/// Sends all bytes. False if nobody is there to take them.
bool sendAll(int socket, const char* bytes, std::size_t size) {
  while (size > 0) {
    const ssize_t sent = ::send(socket, bytes, size, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes += sent;
    size -= static_cast<std::size_t>(sent);
  }
  return true;
}

template <class Number>
bool sendNumber(int socket, Number number) {
  return sendAll(socket, reinterpret_cast<const char*>(&number), sizeof number);
}

/// Reads a job. False if there is none any more.
bool receiveJob(int socket, std::uint64_t& job) {
  auto* at = reinterpret_cast<char*>(&job);
  std::size_t left = sizeof job;
  while (left > 0) {
    const ssize_t got = ::recv(socket, at, left, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    left -= static_cast<std::size_t>(got);
  }
  return true;
}

/// A process of the pool, as its parent sees it.
struct Worker {
  pid_t process = -1;
  int socket = -1;
  std::optional<std::uint64_t> job;
  Clock::time_point since;  // it began its job, or said that it goes on
  std::string received;     // of the answer under way: its length, 8 bytes, and the text
};

class Pool {
 public:
  Pool(const PoolWork& work, const PoolSettings& settings)
      : work_(work), settings_(settings), workers_(settings.processes) {}
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  ~Pool() {
    for (Worker& worker : workers_)
      end(worker);
  }

  Status run() {
    for (Worker& worker : workers_)
      if (Status fed = feed(worker); !fed) return fed;
    while (std::ranges::any_of(workers_, [](const Worker& one) { return one.job.has_value(); })) {
      if (Status waited = wait(); !waited) return waited;
      if (work_.tick) work_.tick();
    }
    return std::monostate{};
  }

 private:
  /// Gives a worker the next job, if there is one, and a process if it has none.
  Status feed(Worker& worker) {
    worker.job.reset();
    if (stopped_) return std::monostate{};
    const std::optional<std::uint64_t> job = work_.next();
    if (!job) return std::monostate{};
    worker.job = job;
    worker.since = Clock::now();
    if (worker.process < 0)
      if (Status begun = begin(worker); !begun) return begun;
    sendNumber(worker.socket, *job);  // a process that has died meanwhile is found by wait()
    return std::monostate{};
  }

  Status begin(Worker& worker) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
      return Error{"no connection to a process: " + std::generic_category().message(errno)};
    const pid_t parent = ::getpid();
    const pid_t process = ::fork();
    if (process < 0) {
      ::close(ends[0]);
      ::close(ends[1]);
      return Error{"no process can be had: " + std::generic_category().message(errno)};
    }
    if (process == 0) serve(ends[1], ends[0], parent);
    ::close(ends[1]);
    worker.process = process;
    worker.socket = ends[0];
    worker.received.clear();
    return std::monostate{};
  }

  /// The whole life of a process of the pool.
  [[noreturn]] void serve(int socket, int parentsEnd, pid_t parent) const {
    ::close(parentsEnd);
    for (const Worker& other : workers_)
      if (other.socket >= 0) ::close(other.socket);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(0);
    if (work_.begin) work_.begin();
    std::uint64_t job = 0;
    while (receiveJob(socket, job)) {
      const std::string answer = work_.answer(job, [socket] { (void)sendNumber(socket, kGoesOn); });
      const bool isTaken = sendNumber(socket, std::uint64_t{answer.size()}) &&
                           sendAll(socket, answer.data(), answer.size());
      if (!isTaken) break;
    }
    ::_exit(0);  // what the parent has buffered for its files is the parent's
  }

  /// Ends a worker's process, which may have ended already. Returns how it ended.
  static int end(Worker& worker) {
    int status = 0;
    if (worker.process < 0) return status;
    ::close(worker.socket);  // by which one without a job ends
    if (worker.job) ::kill(worker.process, SIGKILL);
    while (::waitpid(worker.process, &status, 0) < 0 && errno == EINTR) {
    }
    worker.process = -1;
    worker.socket = -1;
    return status;
  }

  /// Waits for answers, deaths and the time of jobs.
  Status wait() {
    std::vector<pollfd> sockets;
    for (const Worker& worker : workers_)
      sockets.push_back({worker.job ? worker.socket : -1, POLLIN, 0});
    if (::poll(sockets.data(), sockets.size(), kTickMilliseconds) < 0 && errno != EINTR)
      return Error{"processes cannot be waited for: " + std::generic_category().message(errno)};
    for (std::size_t at = 0; at < workers_.size(); ++at) {
      Worker& worker = workers_[at];
      if (!worker.job) continue;
      if (sockets[at].revents != 0) {
        if (Status taken = receive(worker); !taken) return taken;
      } else if (isLate(worker)) {
        end(worker);
        if (Status lost = lose(worker,
                               "its process was ended: it had no answer after " +
                                   std::to_string(std::lround(settings_.longest)) + " s",
                               true);
            !lost)
          return lost;
      }
    }
    return std::monostate{};
  }

  bool isLate(const Worker& worker) const {
    return settings_.longest > 0.0 &&
           Clock::now() - worker.since > std::chrono::duration<double>(settings_.longest);
  }

  Status receive(Worker& worker) {
    std::array<char, 65536> buffer{};
    const ssize_t got = ::recv(worker.socket, buffer.data(), buffer.size(), 0);
    if (got < 0 && errno == EINTR) return std::monostate{};
    if (got <= 0) {
      return lose(worker, deathOf(end(worker)), false);  // it has closed its end: it has died
    }
    worker.received.append(buffer.data(), static_cast<std::size_t>(got));
    std::uint64_t size = kGoesOn;
    while (size == kGoesOn) {
      if (worker.received.size() < sizeof size) return std::monostate{};
      std::memcpy(&size, worker.received.data(), sizeof size);
      if (size != kGoesOn) break;
      worker.received.erase(0, sizeof size);
      worker.since = Clock::now();
    }
    if (worker.received.size() - sizeof size < size) return std::monostate{};
    const JobEnd answered{*worker.job, true, worker.received.substr(sizeof size), false};
    worker.received.clear();
    stopped_ = !work_.ended(answered) || stopped_;
    return feed(worker);
  }

  static std::string deathOf(int status) {
    if (WIFSIGNALED(status)) {
      const int signal = WTERMSIG(status);
      std::string text = "its process has ended by signal " + std::to_string(signal) + " (" +
                         ::strsignal(signal) + ")";
      if (signal == SIGKILL) text += ", as the system does where memory lacks";
      return text;
    }
    return "its process has ended with exit code " + std::to_string(WEXITSTATUS(status));
  }

  Status lose(Worker& worker, const std::string& why, bool isHung) {
    stopped_ = !work_.ended({*worker.job, false, why, isHung}) || stopped_;
    return feed(worker);
  }

  const PoolWork& work_;
  PoolSettings settings_;
  std::vector<Worker> workers_;
  bool stopped_ = false;
};

}  // namespace

Status runPool(const PoolWork& work, const PoolSettings& settings) {
  return Pool(work, settings).run();
}

}  // namespace carom::lab
