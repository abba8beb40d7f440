#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace carom::lab {

/// Returns the file of the first of these programs that is in PATH, or that is a path itself; empty
/// if there is none.
std::filesystem::path findProgram(const std::vector<std::string>& names);

/// One end of a connection between two processes; closed with the object. Programs that are started
/// do not have it, but for the end that they are given.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor() { close(); }

  int number() const { return number_; }  ///< -1: none
  void close();

 private:
  int number_ = -1;
};

/// Returns both ends of a connection; -1 each if there can be none.
std::pair<Descriptor, Descriptor> connectedPair();

/// Writes all bytes; false if the other end has been closed. No signal tells of that.
bool sendAll(const Descriptor& connection, std::span<const std::byte> bytes);

/// A program that is to be started.
struct ProgramStart {
  std::vector<std::string> words;             ///< the first is the path of the program
  std::vector<std::pair<int, int>> channels;  ///< its descriptor, and the one of this process
  std::filesystem::path messages = {};        ///< gets its stderr; empty: nobody does
  std::filesystem::path home = {};            ///< its HOME and TMPDIR; empty: those of this process
  bool diesWithUs = true;                     ///< it is killed when this process ends in any way
  /// Called in the new process before it becomes the program; may be null. It may do what a handler
  /// of signals may.
  void (*prepare)() = nullptr;
};

/// A program that runs beside this one, in a process group of its own, so that a terminal's Ctrl-C
/// does not reach it. Its stdin and stdout are /dev/null where no channel is. It is killed with the
/// object. [one thread]
class ChildProcess {
 public:
  ChildProcess() = default;
  explicit ChildProcess(const ProgramStart& start);
  ChildProcess(ChildProcess&& other) noexcept : process_(std::exchange(other.process_, -1)) {}
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ~ChildProcess() { kill(); }

  bool runs() const { return process_ > 0; }  ///< as far as is known: it has not been waited for
  /// Waits for its end, and returns its exit code: -1 if a signal has ended it, nothing if it has
  /// not ended by then.
  std::optional<int> wait(std::chrono::milliseconds most);
  /// Kills it, and what it has started in its process group.
  void kill();

 private:
  pid_t process_ = -1;
};

}  // namespace carom::lab
