#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lab/fit/tap_fit.h"
#include "lab/fit/tap_model.h"
#include "lab/fit/tap_recording.h"
#include <nlohmann/json_fwd.hpp>

#include "carom/audio/result.h"

namespace carom::lab {

/// Everything that `carom fit` has to tell of one object.
struct FitOutcome {
  std::string name;                ///< of the object, for its files
  std::vector<std::string> files;  ///< of the taps
  std::vector<TapSegment> taps;
  TapModes found;
  std::optional<TapFit> fit;      ///< with a mesh
  std::optional<TapModel> alone;  ///< without one
  std::string builtIn;            ///< built-in material that it began with; empty: another
  bool isDensityKnown = true;     ///< if false, it is the start's, and only E / density is known
  bool isThicknessFree = false;
};

/// The answer as JSON: `accepted`, `reason`, `material`, `scale`, `thickness_m`, `modes`,
/// `unexplained` and what docs/fit.md names besides.
nlohmann::ordered_json fitJson(const FitOutcome& outcome);

/// The same as text.
std::string fitText(const FitOutcome& outcome);

/// The material as a file that scenes and `--material` read.
std::string materialText(const FitOutcome& outcome);

/// The table of modes, measured beside computed, RFC 4180.
std::string modesCsv(const FitOutcome& outcome);

/// The tap as it rings by the fit, 1.0 for full scale: the modes that were found, each with its
/// level in the tap, and with the frequency and the decay that the fitted material gives it
/// (`byMaterial`), or those measured. Sums of sines from the onset on, as loud as the tap in the
/// mean.
std::vector<double> resynthesised(const FitOutcome& outcome, bool byMaterial);

/// The spectrum of the loudest tap with the computed modes as lines, as a PNG file.
std::string spectrumPicture(const FitOutcome& outcome);

/// The files that writeFit may write.
inline constexpr std::array kFitFiles = {"material.json", "model.carom_modes", "modes.csv",
                                         "spectrum.png",  "tap.wav",           "fitted.wav",
                                         "measured.wav",  "index.html"};

/// Writes a folder: kFitFiles, of which index.html plays the sounds. The files get their names when
/// all are whole; if one cannot be written, none does. The folder is made if it is not there.
/// [blocks on the disk]
Status writeFit(const std::filesystem::path& folder, const FitOutcome& outcome);

}  // namespace carom::lab
