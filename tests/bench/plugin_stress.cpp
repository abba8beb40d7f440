// Ten minutes of a host that does everything wrong: see tests/plugin/abuse.h.
//     ./bench plugin_stress [-- SECONDS [SEED]]

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/plugin/abuse.h"

int main(int argc, char** argv) {
  carom::test::AbuseSettings settings;
  if (argc > 1) settings.seconds = std::strtod(argv[1], nullptr);
  if (argc > 2) settings.seed = std::strtoull(argv[2], nullptr, 10);
  if (argc > 3 || !(settings.seconds >= 1.0 && settings.seconds <= 1e6)) {
    std::fprintf(stderr,
                 "usage: bench_plugin_stress [SECONDS [SEED]]   (1 to 1e6 s; default 600)\n");
    return 2;
  }
  const carom::test::AbuseReport report = carom::test::abuse(settings);
  std::fputs(report.text().c_str(), stdout);
  return report.notFinite == 0 && report.glitches == 0 ? 0 : 1;
}
