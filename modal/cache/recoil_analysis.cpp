#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "carom/audio/panel_radiator.h"
#include "carom/modal/mesh_analysis.h"
#include "modal/cache/model_claim.h"
#include "modal/cache/model_key.h"
#include "modal/radiation/recoil_fit.h"
#include "modal/radiation/recoil_samples.h"

namespace carom {

using namespace modal;

namespace {

/// Raised whenever a recoil gets other numbers than before.
constexpr std::uint64_t kRecoilVersion = 2;

Result<RigidRecoil> recoilOf(const SurfaceMesh& surface, ModelCache* cache, std::size_t threads,
                             const Progress& progress) {
  ModelKey key;
  key.add("recoil").add(kRecoilVersion).add(surface);
  if (cache != nullptr)
    if (std::optional<RigidRecoil> known = cache->findRecoil(key)) return *std::move(known);
  const ModelClaim claim(cache == nullptr ? std::filesystem::path() : cache->folder(), key,
                         progress);
  if (claim.isCancelled()) return Error{kCancelled};
  if (cache != nullptr)
    if (std::optional<RigidRecoil> known = cache->findRecoil(key)) return *std::move(known);
  const Result<RigidRadiator> low = panelRadiator(surface);
  if (!low) return low.error();
  const Result<RecoilSamples> samples = sampleRecoil(surface, {.threads = threads}, progress);
  if (!samples) return samples.error();
  RigidRecoil recoil = fitRecoil(*samples, *low);
  if (cache != nullptr) (void)cache->storeRecoil(key, recoil);
  return recoil;
}

}  // namespace

Result<RigidRecoil> analyseRecoil(const SurfaceMesh& surface, ModelCache* cache,
                                  const Progress& progress) {
  return recoilOf(surface, cache, 0, progress);
}

RecoilSolver recoilSolver(std::filesystem::path cacheFolder) {
  const auto cache = std::make_shared<ModelCache>(std::move(cacheFolder));
  return [cache](const SurfaceMesh& surface, const std::function<bool()>& goesOn) {
    // A host plays meanwhile: its processors are its own.
    return recoilOf(surface, cache.get(), 1, [&](std::string_view, double) { return goesOn(); });
  };
}

}  // namespace carom
