// Kills programs that write, at random moments and by random signals, and looks at what is left:
//
//     kills CAROM SCENES KILLS [SEED]   kills `carom render`, `carom record` and an application
//     that
//                                       records, this program itself: `kills record FILE`
//     kills long FILE GIB               writes a recording of so many GiB, and reads it back
//     kills fill FILE                   records until the disk is full, and reads that back
//
// After each kill the earlier output is whole, what was recorded plays to within 0.1 s of what had
// been handed over, and after the next run nothing is left behind. Exit code 0 if all of that held.

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sndfile.h>
#include <sys/wait.h>
#include <unistd.h>

#include "carom/audio/sound_file.h"
#include "carom/event_sound.h"
#include "tests/audio/ball_drop.h"

namespace carom::test {
namespace {

namespace fs = std::filesystem;

constexpr double kKillRate = 48000.0;
constexpr double kMayBeLost = 0.1;  // s

// ---- The application that records

/// Records impacts, 50 a second, as fast as that goes, and says on standard output after each step
/// how much was handed over: the time (s) less the latency.
int recordFor(const fs::path& file, double seconds) {
  SoundSettings settings;
  settings.listeners = {{"near", {0.0, 0.2, 0.3}}};
  settings.record = file;
  Result<EventSound> sound = EventSound::create(settings);
  if (!sound) return 1;
  const BallDrop drop{.radius = 0.01};
  if (!sound->setBody(kBall, drop.ball()) || !sound->setBody(kFloor, drop.floor())) return 1;
  for (int step = 1; 0.02 * step <= seconds; ++step) {
    sound->post(BallDrop{.radius = 0.01, .time = 0.02 * step - 0.01}.event());
    sound->advanceTo(0.02 * step);
    const double handedOver = 0.02 * step - settings.latency;
    if (write(STDOUT_FILENO, &handedOver, sizeof handedOver) < 0) return 1;
    if (step % 50 == 0 && !sound->statistics().recordingError.empty()) return 1;
  }
  return sound->close() ? 0 : 1;
}

// ---- The files that a kill leaves

/// Counts what did not hold, and says it.
class Verdict {
 public:
  void expect(bool holds, const std::string& claim) {
    if (holds) return;
    ++broken_;
    std::cerr << "kills: " << where << ": does not hold: " << claim << '\n';
  }
  int exitCode() const { return broken_ == 0 ? 0 : 1; }

  std::string where;
  int atWork = 0;      // kills that found the program at work
  int left = 0;        // kills at work that left a partial file
  int kept = 0;        // recordings that were found by the next run
  double longest = 0;  // s, the most that was handed over and is not there

 private:
  int broken_ = 0;
};

std::string bytesOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Length (s) of a sound file that can be played and has an impact in each 0.1 s; 0 of another.
double playableSeconds(const fs::path& file) {
  SF_INFO info = {};
  SNDFILE* const opened = sf_open(file.c_str(), SFM_READ, &info);
  if (opened == nullptr) return 0.0;
  std::vector<float> part(4800);
  double seconds = 0.0;
  for (;;) {
    const auto frames = sf_readf_float(opened, part.data(), 4800);
    const bool isHeard = std::any_of(part.begin(), part.begin() + frames,
                                     [](float sample) { return std::abs(sample) > 1e-9F; });
    if (frames > 4000 && !isHeard) break;
    seconds += static_cast<double>(frames) / kKillRate;
    if (frames < 4800) break;
  }
  sf_close(opened);
  return seconds;
}

std::vector<fs::path> filesWith(const fs::path& folder, const std::string& part) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().find(part) != std::string::npos)
      found.push_back(entry.path());
  return found;
}

// ---- The programs

/// A program that runs, and whose standard output can be read.
class Running {
 public:
  explicit Running(const std::vector<std::string>& command) {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) std::abort();
    std::vector<char*> arguments;
    for (const std::string& argument : command)
      arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    child_ = fork();
    if (child_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
      close(ends[0]);
      close(ends[1]);
      execv(arguments.front(), arguments.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() { close(output_); }

  /// Reads what the program says for so long (s), or until it ends; then sends a signal. Returns
  /// how it ended, as waitpid does.
  int killAfter(double seconds, int signal) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    fcntl(output_, F_SETFL, O_NONBLOCK);
    while (std::chrono::steady_clock::now() < end) {
      read();
      usleep(200);
    }
    kill(child_, signal);
    int status = 0;
    waitpid(child_, &status, 0);
    read();
    return status;
  }
  int wait() {
    char buffer[4096];
    while (::read(output_, buffer, sizeof buffer) > 0) {
    }
    int status = 0;
    waitpid(child_, &status, 0);
    return status;
  }
  /// The latest number that the program has written whole.
  double latest() const {
    const std::size_t whole = said_.size() / sizeof(double);
    double number = 0.0;
    if (whole > 0) std::memcpy(&number, &said_[(whole - 1) * sizeof(double)], sizeof number);
    return number;
  }

 private:
  void read() {
    char buffer[65536];
    for (ssize_t count = 0; (count = ::read(output_, buffer, sizeof buffer)) > 0;)
      said_.append(buffer, static_cast<std::size_t>(count));
  }

  pid_t child_ = 0;
  int output_ = -1;
  std::string said_;
};

/// A program to be killed, and the run after it.
struct Victim {
  std::string name;
  std::vector<std::string> command;  // of a long run
  std::vector<std::string> next;     // of a short one, with the same output
  fs::path output;
  std::string before;  // bytes of the output of `next`
  std::string after;   // bytes of the output of `command`; empty if it never ends
  double seconds = 0.3;
};

double secondsOf(const std::vector<std::string>& command) {
  const auto begin = std::chrono::steady_clock::now();
  Running(command).wait();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Learns what the runs write, and how long the one to be killed takes.
void learn(Victim& victim) {
  const bool ends = victim.name != "an application";
  if (ends) victim.seconds = 1.1 * secondsOf(victim.command);
  if (ends) victim.after = bytesOf(victim.output);
  Running(victim.next).wait();
  victim.before = bytesOf(victim.output);
}

std::vector<Victim> victimsOf(const std::string& self, const std::string& carom,
                              const std::string& scenes, const fs::path& folder) {
  const std::string longer = scenes + "/marbles_in_a_box.json";
  const std::string shorter = scenes + "/bouncing_ball.json";
  const std::string wav = folder / "render.wav";
  const std::string run = folder / "run.carom";
  const std::string app = folder / "app.wav";
  std::vector<Victim> victims = {
      {"carom render",
       {carom, "render", longer, "-o", wav},
       {carom, "render", shorter, "-o", wav},
       wav,
       {},
       {}},
      {"carom record",
       {carom, "record", longer, "-o", run},
       {carom, "record", shorter, "-o", run},
       run,
       {},
       {}},
      {"an application", {self, "record", app}, {self, "record", app, "0.2"}, app, {}, {}}};
  for (Victim& victim : victims)
    learn(victim);
  return victims;
}

/// Kills a victim once, and looks at the files that are left.
void killOnce(Victim& victim, int signal, double moment, Verdict& verdict) {
  const fs::path folder = victim.output.parent_path();
  Running running(victim.command);
  const int status = running.killAfter(moment, signal);
  const std::string now = bytesOf(victim.output);
  verdict.expect(now == victim.before || (!victim.after.empty() && now == victim.after),
                 "the earlier output is whole, or the new one is");
  const bool isCommand = victim.name != "an application";
  const bool hasEnded = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  verdict.expect(hasEnded || (WIFSIGNALED(status) && WTERMSIG(status) == signal),
                 "it ends by the signal");
  if (isCommand && signal != SIGKILL)
    verdict.expect(filesWith(folder, ".partial").empty(), "a signal leaves no partial file");
  verdict.atWork += hasEnded ? 0 : 1;
  verdict.left += filesWith(folder, ".partial").empty() ? 0 : 1;
  for (const fs::path& partial : filesWith(folder, ".partial.wav"))
    verdict.longest = std::max(verdict.longest, running.latest() - playableSeconds(partial));
  for (const fs::path& partial : filesWith(folder, ".partial.wav"))
    verdict.expect(playableSeconds(partial) >= running.latest() - kMayBeLost,
                   "what was handed over plays, " + std::to_string(running.latest()) + " s");
  const bool hasSound = running.latest() > kMayBeLost;
  verdict.expect(Running(victim.next).wait() == 0, "the next run succeeds");
  verdict.expect(filesWith(folder, ".partial").empty(), "the next run leaves no partial file");
  verdict.expect(bytesOf(victim.output) == victim.before, "the next run has its output");
  const std::vector<fs::path> kept = filesWith(folder, ".incomplete");
  verdict.expect(kept.size() <= 1 && (isCommand ? kept.empty() : !hasSound || kept.size() == 1),
                 "what was recorded has a name");
  for (const fs::path& file : kept) {
    ++verdict.kept;
    verdict.expect(playableSeconds(file) >= running.latest() - kMayBeLost, "and plays");
    fs::remove(file);
  }
}

int killMany(const std::vector<std::string>& arguments) {
  std::string name = (fs::temp_directory_path() / "carom_kills_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) return 2;
  const fs::path folder = name;
  std::vector<Victim> victims = victimsOf(arguments[0], arguments[1], arguments[2], folder);
  const int kills = std::atoi(arguments[3].c_str());
  std::mt19937_64 random(arguments.size() > 4 ? std::stoull(arguments[4]) : 1);
  constexpr std::array kSignals = {SIGKILL, SIGINT, SIGTERM};
  Verdict verdict;
  for (int i = 0; i < kills; ++i) {
    Victim& victim = victims[static_cast<std::size_t>(i) % victims.size()];
    const int signal = kSignals[random() % kSignals.size()];
    const double moment = victim.seconds * static_cast<double>(random() >> 11U) * 0x1p-53;
    verdict.where = "kill " + std::to_string(i) + ", of " + victim.name + " by signal " +
                    std::to_string(signal) + " after " + std::to_string(moment) + " s";
    killOnce(victim, signal, moment, verdict);
  }
  fs::remove_all(folder);
  std::cout << kills << " kills, " << verdict.atWork << " of them at work; " << verdict.left
            << " left a partial file, " << verdict.kept << " a recording, which lacks "
            << 1e3 * verdict.longest << " ms at most\n";
  return verdict.exitCode();
}

// ---- Long files and small disks

int writeLong(const fs::path& file, double gibibytes) {
  Result<SoundFileWriter> writer =
      SoundFileWriter::create(file, {.channels = 2, .keepIncomplete = true});
  if (!writer) return 1;
  const std::vector<float> block(1U << 20U, 0.0F);
  const std::vector<float> last(1, 10.0F);
  const auto blocks = static_cast<int>(gibibytes * 128.0);  // of 8 MiB
  for (int i = 0; i < blocks; ++i)
    if (!writer->write(std::array{block.data(), block.data()}, block.size())) return 1;
  if (!writer->write(std::array{last.data(), last.data()}, 1) || !writer->finish()) return 1;
  SF_INFO info = {};
  SNDFILE* const opened = sf_open(file.c_str(), SFM_READ, &info);
  if (opened == nullptr) return 1;
  float samples[2] = {};
  sf_seek(opened, -1, SEEK_END);
  sf_readf_float(opened, samples, 1);
  const char* const comment = sf_get_string(opened, SF_STR_COMMENT);
  std::cout << info.frames << " frames, " << fs::file_size(file) << " bytes, the last "
            << samples[1] << ", comment '" << (comment != nullptr ? comment : "") << "'\n";
  const bool isWhole = info.frames == sf_count_t{blocks} * (1 << 20) + 1 && samples[1] == 0.5F;
  sf_close(opened);
  return isWhole ? 0 : 1;
}

int fillDisk(const fs::path& file) {
  std::signal(SIGXFSZ, SIG_IGN);
  const int code = recordFor(file, 1e4);
  const double seconds = playableSeconds(file);
  std::cerr << seconds << " s are kept\n";
  return code == 1 && seconds > 0.1 ? 0 : 1;
}

int run(const std::vector<std::string>& arguments) {
  const std::size_t count = arguments.size();
  const std::string mode = count > 1 ? arguments[1] : "";
  if (mode == "record" && count >= 3)
    return recordFor(arguments[2], count > 3 ? std::stod(arguments[3]) : 1e9);
  if (mode == "long" && count == 4) return writeLong(arguments[2], std::stod(arguments[3]));
  if (mode == "fill" && count == 3) return fillDisk(arguments[2]);
  if (count >= 4) return killMany(arguments);
  std::cerr << "kills CAROM SCENES KILLS [SEED] | record FILE [S] | long FILE GIB | fill FILE\n";
  return 2;
}

}  // namespace
}  // namespace carom::test

int main(int argc, char** argv) {
  std::vector<std::string> arguments(argv, argv + argc);
  arguments[0] = std::filesystem::absolute(arguments[0]).string();
  return carom::test::run(arguments);
}
