#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "lab/batch/batch_spec.h"
#include "lab/batch/sample_values.h"

namespace {

using namespace carom::lab;

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires the same values twice, within what the batch says.
void draw(const BatchSpec& spec, std::uint64_t index) {
  const auto values = drawValues(spec, index, 1);
  if (!values) {
    require(!values.error().message.empty());
    return;
  }
  require(*drawValues(spec, index, 1) == *values);
  require(values->size() == spec.parameters.size());
  for (std::size_t at = 0; at < values->size(); ++at) {
    const BatchParameter& parameter = spec.parameters[at];
    const nlohmann::json& value = (*values)[at].second;
    const bool isDrawn = parameter.kind == ParameterKind::uniform ||
                         parameter.kind == ParameterKind::logUniform ||
                         parameter.kind == ParameterKind::normal;
    if (!isDrawn) continue;
    const auto number = value.get<double>();
    require(std::isfinite(number) && number >= parameter.low && number <= parameter.high);
  }
  (void)isRejected(spec, *values);
  (void)splitOf(spec, index, *values);
  const auto scene = applied(spec, *values, spec.branches.front(),
                             nlohmann::json{{"bodies", {{{"radius", 1}}}}, {"duration", 1}});
  require(scene || !scene.error().message.empty());
}

}  // namespace

/// Requires that any bytes as a batch file give either samples that keep to it or an error with its
/// place.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  // In a folder with files, which patterns may be like.
  const std::string name = CAROM_SOURCE_DIR "/tests/fuzz/corpus/mesh/fuzz.json";
  const auto spec = parseBatch(text, name);
  if (!spec) {
    require(std::string_view(spec.error().message).starts_with(name + ": "));
    return 0;
  }
  require(!spec->branches.empty() && spec->count > 0);
  for (const std::uint64_t index : {std::uint64_t{0}, spec->count - 1, ~std::uint64_t{0}})
    draw(*spec, index);
  return 0;
}
