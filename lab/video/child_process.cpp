#include "lab/video/child_process.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

namespace carom::lab {

namespace fs = std::filesystem;

namespace {

constexpr int kCannotRun = 127;
/// Descriptors from here on are out of the way of those that a program is given.
constexpr int kFirstFree = 20;
constexpr std::chrono::milliseconds kLook(5);

bool canBeRun(const fs::path& file) {
  std::error_code ignored;
  return fs::is_regular_file(file, ignored) && access(file.c_str(), X_OK) == 0;
}

/// Opens a file as a descriptor of the program. [in the child]
void openAs(const char* file, int flags, int number) {
  const int opened = open(file, flags, 0600);
  if (opened < 0) return;
  dup2(opened, number);
  if (opened != number) close(opened);
}

/// Everything that the new process needs, prepared before there is one, as it must not allocate.
struct Prepared {
  explicit Prepared(const ProgramStart& start) : words(start.words), messages(start.messages) {
    for (std::string& word : words)
      arguments.push_back(word.data());
    arguments.push_back(nullptr);
    for (char** variable = environ; *variable != nullptr; ++variable)
      if (start.home.empty() || !isOfHome(*variable)) variables.emplace_back(*variable);
    for (const char* name : {"HOME=", "TMPDIR="})
      if (!start.home.empty()) variables.push_back(name + start.home.string());
    for (std::string& variable : variables)
      environment.push_back(variable.data());
    environment.push_back(nullptr);
    copies.resize(start.channels.size());
    if (messages.empty()) messages = "/dev/null";
  }

  static bool isOfHome(std::string_view variable) {
    return variable.starts_with("HOME=") || variable.starts_with("TMPDIR=");
  }

  std::vector<std::string> words;
  std::vector<std::string> variables;
  std::vector<char*> arguments;
  std::vector<char*> environment;
  std::vector<int> copies;
  std::string messages;
};

/// Has the system kill this process when the one that started it ends. [in the child]
void dieWith(pid_t parent) {
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotRun);
#else
  static_cast<void>(parent);
#endif
}

/// Becomes the program. [in the child]
[[noreturn]] void become(const ProgramStart& start, Prepared& prepared, pid_t parent) {
  setpgid(0, 0);
  if (start.diesWithUs) dieWith(parent);
  for (std::size_t channel = 0; channel < prepared.copies.size(); ++channel)
    prepared.copies[channel] = fcntl(start.channels[channel].second, F_DUPFD_CLOEXEC, kFirstFree);
  openAs("/dev/null", O_RDWR, STDIN_FILENO);
  openAs("/dev/null", O_RDWR, STDOUT_FILENO);
  openAs(prepared.messages.c_str(), O_WRONLY | O_CREAT | O_TRUNC, STDERR_FILENO);
  for (std::size_t channel = 0; channel < prepared.copies.size(); ++channel)
    dup2(prepared.copies[channel], start.channels[channel].first);
  if (start.prepare != nullptr) start.prepare();
  execve(prepared.arguments.front(), prepared.arguments.data(), prepared.environment.data());
  _exit(kCannotRun);
}

}  // namespace

fs::path findProgram(const std::vector<std::string>& names) {
  const char* const path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  for (const std::string& name : names) {
    if (name.find('/') != std::string::npos) {
      if (canBeRun(name)) return name;
      continue;
    }
    std::istringstream folders(path == nullptr ? "" : path);
    for (std::string folder; std::getline(folders, folder, ':');)
      if (!folder.empty() && canBeRun(fs::path(folder) / name)) return fs::path(folder) / name;
  }
  return {};
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

void Descriptor::close() {
  if (number_ >= 0) ::close(number_);
  number_ = -1;
}

std::pair<Descriptor, Descriptor> connectedPair() {
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return {};
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

bool sendAll(const Descriptor& connection, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(connection.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

ChildProcess::ChildProcess(const ProgramStart& start) {
  Prepared prepared(start);
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ == 0) become(start, prepared, parent);
}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(process_, other.process_);
  return *this;
}

std::optional<int> ChildProcess::wait(std::chrono::milliseconds most) {
  if (!runs()) return -1;
  const auto until = std::chrono::steady_clock::now() + most;
  while (true) {
    int status = 0;
    const pid_t ended = waitpid(process_, &status, WNOHANG);
    if (ended == process_ || (ended < 0 && errno != EINTR)) {
      process_ = -1;
      return ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    if (std::chrono::steady_clock::now() >= until) return std::nullopt;
    std::this_thread::sleep_for(kLook);
  }
}

void ChildProcess::kill() {
  if (!runs()) return;
  ::kill(-process_, SIGKILL);
  ::kill(process_, SIGKILL);
  while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
}

}  // namespace carom::lab
