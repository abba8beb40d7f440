#pragma once

#include <string>
#include <vector>

namespace carom::bench {

/// One row: what the bridge said of many runs of a case, beside what it ought to have said.
struct AccuracyRow {
  std::string name;
  double step = 0.0;  ///< s
  /// us, rms and max; infinite: no bar.
  double barRms = 0.0;
  double barMax = 0.0;
  double barImpulse = 0.0;  ///< fraction; infinite: no bar

  int runs = 0;
  int impacts = 0;  ///< of the reference
  int matched = 0;
  int missed = 0;
  int spurious = 0;           ///< and duplicates
  int needless = 0;           ///< pushes of Bullet between bodies that would not have touched
  double pathError = 0.0;     ///< m, of the law of motion that the reference goes by
  bool unsupported = false;   ///< the bridge met shapes that it does not know
  double squares = 0.0;       ///< us^2, of the time errors
  double timeError = 0.0;     ///< us, greatest
  double impulseError = 0.0;  ///< fraction, greatest
  std::string worst;          ///< which run has the greatest time error
  std::string firstMiss;

  void addMatch(double microseconds, double impulse, const std::string& run);
  double rms() const;
  bool holds() const;
};

void printHeader();
void printRow(const AccuracyRow& row);
/// One in which nothing may be heard: of `events`, the bar is none. `speed`, m/s, is the greatest
/// of a body's surface in Bullet, which ought to be 0.
void printRestRow(const std::string& name, double step, int events, double speed, bool supported);
/// One whose impulses must balance: the greatest imbalance, a fraction, against its bar.
void printBalanceRow(const std::string& name, double step, int runs, int collisions,
                     double imbalance, double bar, bool supported);
/// To the error stream: the runs to look at.
void printWorst(const AccuracyRow& row);

}  // namespace carom::bench
