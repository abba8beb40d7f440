// Ten minutes of a host that misuses everything: see tests/plugin/abuse.h.
//     ./bench plugin_stress [--short] [-- SECONDS [SEED]]

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/bench/scale.h"
#include "tests/plugin/abuse.h"

int main(int argc, char** argv) {
  carom::test::AbuseSettings settings;
  const carom::bench::Scale scale = carom::bench::scaleOf(argc, argv);
  settings.seconds = scale.of(settings.seconds, 10.0);
  const int first = scale.isShort ? 2 : 1;
  if (argc > first) settings.seconds = std::strtod(argv[first], nullptr);
  if (argc > first + 1) settings.seed = std::strtoull(argv[first + 1], nullptr, 10);
  if (argc > first + 2 || !(settings.seconds >= 1.0 && settings.seconds <= 1e6)) {
    std::fprintf(stderr,
                 "usage: bench_plugin_stress [--short] [SECONDS [SEED]]\n"
                 "       SECONDS: 1 to 1e6; default 600, with --short 10\n");
    return 2;
  }
  const carom::test::AbuseReport report = carom::test::abuse(settings);
  std::fputs(report.text().c_str(), stdout);
  return report.notFinite == 0 && report.glitches == 0 ? 0 : 1;
}
