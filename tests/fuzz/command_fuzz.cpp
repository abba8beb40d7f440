#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "carom/audio/material.h"
#include "plugin/pybullet/command.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

namespace command = carom::plugin::command;

void requireTarget(const command::Target& target) {
  require(target.body >= 0 && target.link.value_or(-1) >= -1);
}

void requireWithin(const std::optional<double>& value, double most) {
  require(!value || (*value >= 0.0 && *value <= most));
}

// Properties of commands that the plugin relies on without checking them again.
struct Promises {
  void operator()(const command::PlaceListener& listener) const {
    require(listener.position.allFinite());
    require(std::abs(listener.orientation.norm() - 1.0) < 1e-6);
    require(listener.index < 64);
    require(listener.head.empty() || listener.format == carom::ListenerFormat::binaural);
    requireWithin(listener.spacing, 100.0);
    requireWithin(listener.halfAngle, 4.0);
    requireWithin(listener.pattern, 1.0);
  }
  void operator()(const command::SetMaterial& set) const {
    requireTarget(set.target);
    require(carom::findMaterial(set.name) != nullptr);
  }
  void operator()(const command::SetModes& set) const { requireTarget(set.target); }
  void operator()(const command::SetTexture& set) const {
    requireTarget(set.target);
    require(set.file.empty() || (set.size.allFinite() && (set.size.array() > 0.0).all()));
  }
  void operator()(const command::SetRoom& set) const {
    require(!set.isBox || (set.least.allFinite() && set.most.allFinite() &&
                           (set.least.array() < set.most.array()).all()));
    require(isValid(set.absorption) && set.order >= 0 && set.order <= 32);
  }
  void operator()(const command::SetLevel& set) const {
    require(!set.fullScale || (*set.fullScale > 0.0 && std::isfinite(*set.fullScale)));
  }
  void operator()(const command::SetLatency& set) const {
    require(set.seconds >= 0.0 && set.seconds <= 10.0);
  }
  void operator()(const command::Reset& reset) const {
    require(reset.time >= 0.0 && reset.time <= 1e9);
  }
  void operator()(const command::Record& record) const { require(!record.file.empty()); }
  void operator()(const command::RecordRun& record) const { require(!record.file.empty()); }
  void operator()(const command::SaveRun& save) const { require(!save.file.empty()); }
  void operator()(const command::KeepRun& keep) const {
    require(keep.seconds >= 0.0 && keep.seconds <= 86400.0);
  }
  void operator()(const command::SetGain& set) const {
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
