#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "carom/audio/result.h"

namespace carom::lab {

/// The end of a job: what it answered, or why it did not.
struct JobEnd {
  std::uint64_t job = 0;
  bool hasAnswer = false;
  std::string text;     ///< the answer, or the second half of a sentence
  bool isHung = false;  ///< its process was ended for its time
};

/// The work of a pool of processes.
struct PoolWork {
  /// Returns the next job, or nothing if there is none left.
  std::function<std::optional<std::uint64_t>()> next;
  /// Does a job, in a process of the pool, which is a copy of this one as it was when the pool
  /// began or when the last one like it died. To be called within PoolSettings::longest again and
  /// again: `goesOn`, which says that the process has not hung.
  std::function<std::string(std::uint64_t job, const std::function<void()>& goesOn)> answer;
  /// Takes the end of each job. False lets no other begin; those under way are ended.
  std::function<bool(const JobEnd& end)> ended;
  /// Called some times a second while jobs are under way; may be empty.
  std::function<void()> tick = {};
  /// Called in each process before its first job; may be empty.
  std::function<void()> begin = {};
};

struct PoolSettings {
  std::size_t processes = 1;
  /// s without an answer or a word, after which a process is ended by force; 0: never
  double longest = 0.0;
};

/// Does jobs in processes of their own, so that one that crashes, hangs or eats its memory costs
/// itself only: its process is replaced. To be called where this process has no other thread that
/// holds locks. The error says why there can be no process. [one thread; blocks]
Status runPool(const PoolWork& work, const PoolSettings& settings);

}  // namespace carom::lab
