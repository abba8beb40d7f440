#pragma once

#include <chrono>
#include <string>

namespace carom::command {

/// A line on stderr that grows with the work done, on a terminal; in a pipe or a log one line every
/// 30 s, so that short runs are silent there.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Shows a share of the work, from 0 to 1, and a few words after it.
  void show(double share, const std::string& note = {});
  void clear();

 private:
  void showLine(int percent, const std::string& note);

  std::string label_;
  bool terminal_;
  int shown_ = -1;  // percent
  std::string note_;
  std::chrono::steady_clock::time_point lineAt_ = std::chrono::steady_clock::now();
};

}  // namespace carom::command
