// Runs a program and prints its usage: seconds of CPU time, and the largest resident size in bytes.
// It is a small process of its own, because the kernel counts a process's largest size as at least
// that of the process that started it.

#include <cstdio>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const pid_t child = fork();
  if (child == 0) {
    // The program's output is discarded.
    if (std::freopen("/dev/null", "w", stdout) != nullptr) execv(argv[1], argv + 1);
    _exit(127);
  }
  int status = 0;
  rusage used{};
  if (child < 0 || wait4(child, &status, 0, &used) != child || status != 0) return 1;
  const double user = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
  const double rest = 1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  std::printf("%.6f %.0f\n", user + rest, 1024.0 * static_cast<double>(used.ru_maxrss));
  return 0;
}
