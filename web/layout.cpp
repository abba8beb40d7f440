// The module tells a page where in memory the fields of the C API's structs lie.

#include <string>

#include "web/layout_table.h"

namespace carom::web {
namespace {

/// Returns "name":
std::string key(const std::string& name) {
  return "\"" + name + "\":";
}

std::string fieldsOf(const std::string& structName) {
  std::string text;
  for (const PlacedField& field : kFields) {
    if (structName != field.structName) continue;
    text += (text.empty() ? "" : ",") + key(field.name) + "[" + std::to_string(field.offset) +
            ",\"" + field.kind + "\"," + std::to_string(field.count) + "]";
  }
  return text;
}

/// Returns the tables as JSON, whose form docs/web.md describes.
std::string layout() {
  std::string constants;
  for (const NamedConstant& constant : kConstants)
    constants +=
        (constants.empty() ? "" : ",") + key(constant.name) + std::to_string(constant.value);
  std::string structs;
  for (const PlacedStruct& each : kStructs)
    structs += (structs.empty() ? "" : ",") + key(each.name) + "{" + key("size") +
               std::to_string(each.size) + "," + key("fields") + "{" + fieldsOf(each.name) + "}}";
  return "{" + key("constants") + "{" + constants + "}," + key("structs") + "{" + structs + "}}";
}

}  // namespace
}  // namespace carom::web

/// Returns the text, which ends with a zero and stays where it is.
extern "C" const char* carom_layout() {
  static const std::string text = carom::web::layout();
  return text.c_str();
}
