#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "carom/audio/material.h"
#include "plugin/pybullet/command.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

// Properties of commands that the plugin relies on without checking them again.
struct Promises {
  void operator()(const carom::plugin::command::PlaceListener& listener) const {
    require(listener.position.allFinite());
    require(std::abs(listener.orientation.norm() - 1.0) < 1e-6);
  }
  void operator()(const carom::plugin::command::SetMaterial& set) const {
    require(set.body >= 0);
    require(carom::findMaterial(set.name) != nullptr);
  }
  void operator()(const carom::plugin::command::Record& record) const {
    require(!record.file.empty());
  }
  void operator()(const carom::plugin::command::SetGain& set) const {
    require(set.gain >= 0.0 && set.gain <= 1000.0);
  }
  template <class Other>
  void operator()(const Other&) const {}
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const carom::Result<carom::plugin::Command> command = carom::plugin::parseCommand(text);
  if (command)
    std::visit(Promises{}, *command);
  else
    require(!command.error().message.empty());
  return 0;
}
