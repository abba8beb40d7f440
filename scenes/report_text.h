#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "scenes/compare.h"
#include "scenes/render.h"
#include "scenes/scene.h"

namespace carom {

/// What the commands print: text for people, JSON with stable keys for programs (docs/cli.md).

std::string infoText(const Scene& scene);
nlohmann::ordered_json infoJson(const Scene& scene);

std::string renderText(const RenderReport& report);
nlohmann::ordered_json renderJson(const RenderReport& report);

std::string compareText(const Scene& scene, const CompareReport& report);
nlohmann::ordered_json compareJson(const Scene& scene, const CompareReport& report);

}  // namespace carom
