#include "modal/cache/recoil_file.h"

#include <algorithm>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "audio/io/byte_file.h"
#include "modal/cache/sha256.h"

namespace carom::modal {

using namespace audio;

namespace {

constexpr std::uint64_t kMagic = 0x316C696F63655243;  // "CRecoil1", little-endian

struct RecoilHeader {
  std::uint64_t magic = kMagic;
  double radius = 0.0;
  std::uint64_t poles = 0;
  std::uint64_t terms = 0;
};

template <class T>
void append(std::span<const T> items, std::vector<std::byte>& bytes) {
  const auto raw = std::as_bytes(items);
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}

/// Moves the first bytes to `items`. Requires that there are so many.
template <class T>
void take(std::span<const std::byte>& bytes, std::span<T> items) {
  if (items.empty()) return;
  std::memcpy(items.data(), bytes.data(), items.size_bytes());
  bytes = bytes.subspan(items.size_bytes());
}

Sha256::Digest digestOf(std::span<const std::byte> bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.finish();
}

}  // namespace

std::optional<RigidRecoil> readRecoil(const std::filesystem::path& file) {
  const Result<std::vector<std::byte>> bytes = readBytes(file);
  constexpr std::size_t kDigest = sizeof(Sha256::Digest);
  if (!bytes || bytes->size() < kDigest) return std::nullopt;
  std::span<const std::byte> left = std::span(*bytes).first(bytes->size() - kDigest);
  const Sha256::Digest digest = digestOf(left);
  if (!std::equal(digest.begin(), digest.end(), bytes->end() - kDigest)) return std::nullopt;
  RecoilHeader header;
  if (left.size() < sizeof(header)) return std::nullopt;
  take(left, std::span(&header, 1));
  if (header.magic != kMagic) return std::nullopt;
  if (header.poles > RigidRecoil::kMostPoles || header.terms > left.size()) return std::nullopt;
  constexpr std::size_t kResidue = sizeof(std::complex<float>);
  const std::uint64_t expected =
      header.poles * sizeof(std::complex<double>) +
      header.terms * (sizeof(RigidRecoil::Term) + header.poles * kResidue);
  if (left.size() != expected) return std::nullopt;
  const auto poles = static_cast<std::size_t>(header.poles);
  const auto terms = static_cast<std::size_t>(header.terms);
  RigidRecoil recoil;
  recoil.radius = header.radius;
  recoil.poles.resize(poles);
  recoil.terms.resize(terms);
  recoil.residues.resize(terms * poles);
  take(left, std::span(recoil.poles));
  take(left, std::span(recoil.terms));
  take(left, std::span(recoil.residues));
  if (!validate(recoil)) return std::nullopt;
  return recoil;
}

Status writeRecoil(const std::filesystem::path& file, const RigidRecoil& recoil) {
  std::vector<std::byte> bytes;
  const RecoilHeader header{.magic = kMagic,
                            .radius = recoil.radius,
                            .poles = recoil.poles.size(),
                            .terms = recoil.terms.size()};
  append(std::span(&header, 1), bytes);
  append(std::span(recoil.poles), bytes);
  append(std::span(recoil.terms), bytes);
  append(std::span(recoil.residues), bytes);
  const Sha256::Digest digest = digestOf(bytes);
  bytes.insert(bytes.end(), digest.begin(), digest.end());
  return writeBytes(file, bytes);
}

}  // namespace carom::modal
