#pragma once

#include <string>
#include <vector>

namespace carom::bench {

/// One row: the bridge's collisions in many runs of a case, compared with the reference.
struct AccuracyRow {
  std::string name;
  double step = 0.0;  ///< s
  /// Bars in us, rms and max; infinite: no bar.
  double barRms = 0.0;
  double barMax = 0.0;
  double barImpulse = 0.0;  ///< fraction; infinite: no bar

  int runs = 0;
  int impacts = 0;  ///< impacts of the reference
  int matched = 0;
  int missed = 0;
  int spurious = 0;           ///< collisions without a counterpart, duplicates included
  int needless = 0;           ///< pushes by Bullet between bodies that would not have touched
  double pathError = 0.0;     ///< m, error of the law of motion that the reference assumes
  bool unsupported = false;   ///< the bridge met shapes that it does not know
  double squares = 0.0;       ///< us^2, sum over the time errors
  double timeError = 0.0;     ///< us, greatest time error
  double impulseError = 0.0;  ///< fraction, greatest error of an impulse
  std::string worst;          ///< the run with the greatest time error
  std::string firstMiss;

  void addMatch(double microseconds, double impulse, const std::string& run);
  double rms() const;
  bool holds() const;
};

void printHeader();
void printRow(const AccuracyRow& row);
/// Prints the row of a case in which nothing may be heard: the bar is 0 events. `speed` (m/s) is
/// the greatest of a body's surface in Bullet and ought to be 0.
void printRestRow(const std::string& name, double step, int events, double speed, bool supported);
/// Prints the row of a case whose impulses must balance: the greatest imbalance, a fraction, and
/// its bar.
void printBalanceRow(const std::string& name, double step, int runs, int collisions,
                     double imbalance, double bar, bool supported);
/// Prints the worst run and the first miss to the error stream.
void printWorst(const AccuracyRow& row);

}  // namespace carom::bench
