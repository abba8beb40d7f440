#pragma once

#include <cstddef>
#include <functional>

namespace carom::modal {

/// Number of threads that the machine runs at a time, at least 1; 1 in a build without threads.
std::size_t processorCount();

/// Calls task(0) to task(count - 1), each once, in no given order: in this thread and in so many
/// others that `threads` work at a time (a build without threads works in this one alone). Tasks
/// share nothing that they write, so results do not depend on how many threads there are.
///
/// Before each of its own tasks this thread calls goesOn with the number of tasks that were begun;
/// once that is false no other one begins. Returns false then, when the last one has ended. What a
/// task throws, this throws. [any thread]
bool runTasks(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& task,
              const std::function<bool(std::size_t)>& goesOn);

}  // namespace carom::modal
