#include <cstddef>
#include <vector>

#include <gtest/gtest.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "plugin/realtime/sound_engine.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/sanitizers.h"

namespace carom {

using namespace plugin;

namespace {

using test::BallDrop;

/// From this call on, every system call except the end of the process kills it.
bool forbidSystemCalls() {
  sock_filter program[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
  };
  const sock_fprog filter = {.len = 4, .filter = program};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

/// Returns an engine in which the samples pass every stage, with events in the queue.
std::unique_ptr<SoundEngine> busyEngine() {
  SoundSettings settings;
  settings.listeners = {SoundSettings::defaultListener()};
  settings.clock = SoundClock::simulation;
  settings.fullScale = 0.5;
  settings.limiter.emplace();
  settings.synth.room.reflectors = {{Vec3::UnitX(), -4.0, {}}, {Vec3::UnitZ(), -1.0, {}}};
  std::unique_ptr<SoundEngine> engine = *SoundEngine::create(settings);
  const BallDrop drop;
  EXPECT_TRUE(engine->scheduler().setBody(test::kBall, drop.ball()));
  SoundBody floor = drop.floor();
  floor.modal = test::boxOf({{440.0, 5.0, 1e-3}, {1000.0, 20.0, 1e-3}, {9000.0, 99.0, 1e-3}});
  EXPECT_TRUE(engine->scheduler().setBody(test::kFloor, floor));
  for (int i = 0; i < 3000; ++i) {
    ImpulseEvent event = drop.event();
    event.time = 1e-3 * i;
    event.position.x() += 1.0;
    event.bodyPosition.x() += 1.0;
    engine->post(event);
    ImpulseEvent share = test::floorShare(drop);
    share.time = event.time;
    engine->post(share);
  }
  engine->advanceTo(3.0);
  engine->gain().setGain(0.9);
  return engine;
}

/// Returns the exit status of a child process that renders with system calls forbidden.
int endOfChild(SoundEngine& engine, bool asksTheSystem) {
  std::vector<float> block(std::size_t{2} * 256);
  const pid_t child = fork();
  if (child == 0) {
    if (!forbidSystemCalls()) _exit(77);
    for (int i = 0; i < 600; ++i)
      engine.renderInterleaved(block.data(), 256);
    if (asksTheSystem) (void)getppid();
    _exit(engine.statistics().cpuShare > 0.0 ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

// With SECCOMP_RET_KILL_PROCESS the kernel itself checks: a single call ends the child.
TEST(SystemCalls, RenderingMakesNone) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's own system calls would be counted";
  const auto engine = busyEngine();
  const int asking = endOfChild(*engine, true);
  if (WIFEXITED(asking) && WEXITSTATUS(asking) == 77) GTEST_SKIP() << "no seccomp here";
  ASSERT_TRUE(WIFSIGNALED(asking));  // the oracle works
  const int rendering = endOfChild(*engine, false);
  EXPECT_TRUE(WIFEXITED(rendering));
  EXPECT_EQ(WEXITSTATUS(rendering), 0);
}

}  // namespace
}  // namespace carom
