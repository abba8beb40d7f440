// debian_host PLUGIN: drives Debian's Bullet plugin of Ignition Physics, a library that holds its
// worlds within itself. A crate, a ball and a can fall onto the ground, for two seconds. Knows
// nothing of Bullet, nor of Carom; debian_host.sh compiles and runs it.

#include <chrono>
#include <cstdio>
#include <string>

#include <ignition/physics/ForwardStep.hh>
#include <ignition/physics/RequestEngine.hh>
#include <ignition/physics/sdf/ConstructWorld.hh>
#include <ignition/plugin/Loader.hh>
#include <sdf/Root.hh>
#include <sdf/World.hh>

namespace {

using Features = ignition::physics::FeatureList<ignition::physics::ForwardStep,
                                                ignition::physics::sdf::ConstructSdfWorld>;

constexpr int kSteps = 2000;  // of 1 ms, as the simulator makes them

std::string model(const std::string& name, const std::string& pose, const std::string& shape,
                  bool isStatic) {
  const std::string geometry = "<geometry>" + shape + "</geometry>";
  return "<model name='" + name + "'><static>" + (isStatic ? "true" : "false") + "</static><pose>" +
         pose +
         "</pose><link name='link'><inertial><mass>1</mass><inertia><ixx>0.004</ixx>"
         "<iyy>0.004</iyy><izz>0.004</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia>"
         "</inertial><collision name='collision'>" +
         geometry + "</collision></link></model>";
}

std::string world() {
  return "<sdf version='1.9'><world name='fall'><gravity>0 0 -9.8</gravity>" +
         model("ground", "0 0 -0.5 0 0 0", "<box><size>10 10 1</size></box>", true) +
         model("crate", "0 0 0.6 0.3 0.2 0", "<box><size>0.1 0.15 0.2</size></box>", false) +
         model("ball", "0.5 0 0.8 0 0 0", "<sphere><radius>0.1</radius></sphere>", false) +
         model("can", "-0.5 0 0.5 0.4 0 0",
               "<cylinder><radius>0.05</radius><length>0.2</length></cylinder>", false) +
         "</world></sdf>";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  ignition::plugin::Loader loader;
  loader.LoadLib(argv[1]);
  const auto plugin = loader.Instantiate("ignition::physics::bullet::Plugin");
  const auto engine = ignition::physics::RequestEngine3d<Features>::From(plugin);
  if (!engine) {
    std::fprintf(stderr, "%s has no engine that makes worlds and steps them\n", argv[1]);
    return 1;
  }
  sdf::Root root;
  for (const auto& error : root.LoadSdfString(world()))
    std::fprintf(stderr, "%s\n", error.Message().c_str());
  const auto fall = engine->ConstructWorld(*root.WorldByIndex(0));
  ignition::physics::ForwardStep::Input input;
  input.Get<std::chrono::steady_clock::duration>() = std::chrono::milliseconds(1);
  ignition::physics::ForwardStep::Output output;
  ignition::physics::ForwardStep::State state;
  for (int step = 0; step < kSteps; ++step)
    fall->Step(output, state, input);
  std::printf("%d steps\n", kSteps);
  return 0;
}
