#include "audio/radiation/mode_transfer.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "audio/radiation/multipole.h"

namespace carom::audio {
namespace {

/// Transfer of the constant model at 1 m: by the volume of a surface that moves outwards everywhere
/// by the same, with the kinetic energy of the mode.
double constantTransfer(const ModalModel& model, const Medium& medium) {
  return medium.density * surfaceArea(model.surface) /
         (4.0 * std::numbers::pi * std::sqrt(model.mass));
}

bool isMonopole(const Mode& mode, ModalRadiation radiation) {
  return radiation == ModalRadiation::monopole || mode.radiation.multipoles.empty();
}

int highestOrder(const ModalModel& model, std::size_t modes) {
  int order = 0;
  for (std::size_t mode = 0; mode < modes; ++mode)
    order = std::max(order, multipoleOrder(model.modes[mode].radiation));
  return std::min(order, kHighestMultipole);
}

}  // namespace

void modeTransfers(const ModalModel& model, ModalRadiation radiation, const Medium& medium,
                   const Vec3& point, std::span<std::complex<double>> transfers) {
  assert(transfers.size() <= model.modes.size());
  const double distance = point.norm();
  if (radiation == ModalRadiation::constant) {
    std::ranges::fill(transfers, constantTransfer(model, medium) / distance);
    return;
  }
  const DirectionHarmonics direction(point, highestOrder(model, transfers.size()));
  const double denser = medium.density / model.medium.density;
  for (std::size_t index = 0; index < transfers.size(); ++index) {
    const Mode& mode = model.modes[index];
    const double waveNumber = 2.0 * std::numbers::pi * mode.frequency / model.medium.speedOfSound;
    transfers[index] =
        isMonopole(mode, radiation)
            ? monopoleTransfer(mode.radiation, medium.density, distance)
            : denser * multipoleTransfer(mode.radiation, direction, waveNumber, distance);
  }
}

void meanTransfers(const ModalModel& model, ModalRadiation radiation, const Medium& medium,
                   std::span<std::complex<double>> transfers) {
  assert(transfers.size() <= model.modes.size());
  if (radiation == ModalRadiation::constant) {
    std::ranges::fill(transfers, constantTransfer(model, medium));
    return;
  }
  const double denser = medium.density / model.medium.density;
  for (std::size_t index = 0; index < transfers.size(); ++index) {
    const Mode& mode = model.modes[index];
    transfers[index] = isMonopole(mode, radiation)
                           ? std::abs(monopoleTransfer(mode.radiation, medium.density, 1.0))
                           : denser * meanTransfer(mode.radiation);
  }
}

}  // namespace carom::audio
