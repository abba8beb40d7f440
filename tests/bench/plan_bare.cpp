// Renders Newton's cradle into a WAV file with carom::native and carom::audio alone, which is all
// that it needs, as the yardstick for `carom render` of the same scene.
// Usage: plan_bare FILE.wav

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "carom/audio/sound_file.h"
#include "carom/audio/synth.h"
#include "carom/native/sphere_stepper.h"
#include "tests/bench/bare_cradle.h"

namespace carom::bench {
namespace {

constexpr std::size_t kBlock = 4096;  // samples
constexpr double kLookahead = 0.1;    // s

Status render(const std::string& file) {
  BareCradle cradle = bareCradle();
  Result<SphereStepper> stepper = SphereStepper::create(std::move(cradle.world));
  if (!stepper) return stepper.error();
  Result<Synth> synth = Synth::create({}, cradle.listeners);
  if (!synth) return synth.error();
  for (std::size_t id = 0; id < cradle.bodies.size(); ++id)
    if (Status set = synth->setBody(static_cast<BodyId>(id), cradle.bodies[id]); !set) return set;
  Result<SoundFileWriter> writer = SoundFileWriter::create(file, {});
  if (!writer) return writer.error();
  const auto frames = static_cast<std::size_t>(std::llround(cradle.duration * 48000.0));
  std::vector<float> block(kBlock);
  for (std::size_t done = 0; done < frames; done += kBlock) {
    const std::size_t count = std::min(kBlock, frames - done);
    const double time = static_cast<double>(done + count) / 48000.0 + kLookahead;
    for (const ImpulseEvent& event : stepper->advanceTo(std::min(time, cradle.duration)))
      synth->schedule(event);
    float* const out = block.data();
    synth->render<float>({&out, 1}, count);
    const float* const in = block.data();
    if (Status written = writer->write({&in, 1}, count); !written) return written;
  }
  return writer->finish();
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: plan_bare FILE.wav\n");
    return 2;
  }
  const carom::Status done = carom::bench::render(argv[1]);
  if (!done) std::fprintf(stderr, "%s\n", done.error().message.c_str());
  return done ? 0 : 1;
}
