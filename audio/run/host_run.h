#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/audio/surface_mesh.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

// A host's run has more than portions: its bodies, as the host has told of them, and the settings
// that stay while it goes on. A scene's run has the scene's text instead.

/// The form of a body for pictures, in the body's frame.
struct BodyForm {
  enum class Kind : std::uint8_t { unknown, sphere, plane, box, mesh };
  Kind kind = Kind::unknown;
  /// m: of a box half its extents, of a sphere its radius in x. A plane's unit normal, to its free
  /// side.
  Vec3 size = Vec3::Zero();
  double offset = 0.0;  ///< m, of a plane, along its normal
  std::shared_ptr<const SurfaceMesh> mesh = nullptr;
};

/// A body of a host's run, from some moment on.
struct HostBody {
  BodyId id = 0;  ///< in the run: bodies are numbered from 0
  std::string name;
  SoundBody sound;
  BodyForm form;
};

/// The settings with which a host heard its run, and where its listeners were.
struct HostWorld {
  SynthSettings synth;
  std::vector<Listener> listeners;  ///< without heads of their own: those are not in the file
  /// The path of each listener in order of time, with all times above 0; empty if it stays.
  std::vector<std::vector<ListenerPose>> paths;
  bool hasOwnHeads = false;  ///< the host's binaural listeners had other heads than the default
  double begin = 0.0;        ///< s, by which the times of all portions are too large
  double duration = 0.0;     ///< s, > 0
  std::uint32_t bodies = 0;
};

/// Encodes bodies as records, each with its size before it (4 bytes). What several share (models,
/// radiators, meshes) is a record of its own, once as long as it is there. [one thread]
class HostEncoder {
 public:
  /// Adds the record of a body, behind those of what it shares and has not been encoded before.
  /// Refuses a model that cannot be encoded.
  Status add(const HostBody& body, std::vector<std::byte>& bytes);

 private:
  std::uint32_t numberOf(const std::shared_ptr<const void>& object) const;
  template <class Object, class Encode>
  std::uint32_t place(const std::shared_ptr<const Object>& object, const Encode& encode);

  struct Known {
    std::weak_ptr<const void> object;
    bool isOwned = false;      // by anybody: it may go
    std::uint32_t number = 0;  // from 1 on
  };
  std::map<const void*, Known> known_;
  std::uint32_t count_ = 0;
  std::vector<std::vector<std::byte>> records_;  // of the body in hand
};

/// Decodes what HostEncoder has encoded, in the same order. Never throws for bad input but for lack
/// of memory. [one thread]
class HostDecoder {
 public:
  /// Takes records; returns the bodies among them. An error, the second half of a sentence, is that
  /// of bytes which no host has written, or of a body that Synth::setBody refuses.
  Result<std::vector<HostBody>> take(std::span<const std::byte> bytes);

 private:
  Result<std::optional<HostBody>> takeRecord(std::span<const std::byte> bytes);
  template <class Object>
  bool find(std::uint32_t number, std::shared_ptr<const Object>& object) const;
  Result<std::optional<HostBody>> bodyOf(std::span<const std::byte> bytes) const;

  using Shared =
      std::variant<std::shared_ptr<const RigidRadiator>, std::shared_ptr<const RigidRecoil>,
                   std::shared_ptr<const ModalModel>, std::shared_ptr<const SurfaceTexture>,
                   std::shared_ptr<const TextureCoordinates>, std::shared_ptr<const SurfaceMesh>>;
  std::vector<Shared> shared_;  // by number - 1
};

/// Poses of a listener that are in parts of their own: of a path that is too long for the world's.
struct PathPiece {
  std::uint32_t listener = 0;
  std::vector<ListenerPose> poses;
};
/// Most poses of all paths of a run, and of one piece.
inline constexpr std::size_t kMostPathPoses = std::size_t{1} << 24U;
inline constexpr std::size_t kMostPiecePoses = std::size_t{1} << 20U;

std::vector<std::byte> encodedPath(const PathPiece& piece);
/// An error is the second half of a sentence. [any thread]
Result<PathPiece> decodedPath(std::span<const std::byte> bytes);

/// Takes long paths out of a world, as pieces in their order. [any thread]
std::vector<PathPiece> takeLongPaths(HostWorld& world);
/// Puts the pieces back, before what the world has of those paths. Refuses pieces that make no path
/// of a listener of the world, with the second half of a sentence. [any thread]
Status putBack(const std::vector<PathPiece>& pieces, HostWorld& world);

std::vector<std::byte> encodedWorld(const HostWorld& world);
/// An error is the second half of a sentence. Numbers are looked at by whoever uses them, but for
/// times, counts and poses. [any thread]
Result<HostWorld> decodedWorld(std::span<const std::byte> bytes);

}  // namespace carom::audio
