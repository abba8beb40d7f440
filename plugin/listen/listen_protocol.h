#pragma once

#include <filesystem>
#include <string>

namespace carom::listen {

// The agreement of `carom listen`, the preloaded library and the libraries with the sound. The
// command hands its options over as environment variables, since nothing else reaches a program
// that knows nothing of it, and reads from a folder what became of them. No public interface: all
// sides are of one build.

/// Name of the WAV file for the first world: see fileOfWorld.
inline constexpr const char* kFileVariable = "CAROM_LISTEN_FILE";
/// Folder of the command's own. The first process that steps a world makes kProcessFile in it, and
/// is the one that is heard; it appends to kReportFile. A process in whose environment it is not
/// set is left alone.
inline constexpr const char* kFolderVariable = "CAROM_LISTEN_FOLDER";
/// "1": the world is played on the default device as well.
inline constexpr const char* kPlayVariable = "CAROM_LISTEN_PLAY";
/// Pa; not set: chosen at the end of each recording.
inline constexpr const char* kFullScaleVariable = "CAROM_LISTEN_FULL_SCALE";
/// "x y z qx qy qz qw", m and a unit quaternion; not set: the automatic listener.
inline constexpr const char* kListenerVariable = "CAROM_LISTEN_LISTENER";
/// m, length of the world's unit; not set: 1.
inline constexpr const char* kUnitsVariable = "CAROM_LISTEN_UNITS";

inline constexpr const char* kProcessFile = "process";

/// Lines of text, each written at once, so that those of a killed program can be read. A world
/// without a line `end` has a recording that is not complete:
///
///     begin WORLD PRECISION       the recording of world 1, 2, ... has begun; float or double
///     end WORLD EVENTS PEAK       it is complete; PEAK in Pa
///     message SENTENCE            that the user is to be told
inline constexpr const char* kReportFile = "report";

/// Worlds of one process that are heard; those beyond are not, and a message says so.
inline constexpr int kMostWorlds = 16;

/// Returns the name of a world's file, counted from 1: `sound.wav`, `sound-2.wav` and so on.
inline std::filesystem::path fileOfWorld(const std::filesystem::path& first, int world) {
  if (world == 1) return first;
  std::filesystem::path file = first;
  file.replace_filename(first.stem().string() + "-" + std::to_string(world) +
                        first.extension().string());
  return file;
}

// The libraries with the sound, one for each precision of Bullet, beside the preloaded one, and
// their functions.
inline constexpr const char* kFloatLibrary = "libcarom_listen_float.so";
inline constexpr const char* kDoubleLibrary = "libcarom_listen_double.so";

/// Is called with a btDiscreteDynamicsWorld before each step; attaches a sound before the first.
inline constexpr const char* kBeforeStep = "carom_listen_before_step";
/// Is called after each step that kBeforeStep was called for.
inline constexpr const char* kAfterStep = "carom_listen_after_step";
/// Is called before a world is destroyed, which may never have been stepped: completes its file.
inline constexpr const char* kWorldEnds = "carom_listen_world_ends";
using WorldFunction = void (*)(void* world);

}  // namespace carom::listen
