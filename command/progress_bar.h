#pragma once

#include <string>

namespace carom::command {

/// A line on stderr that grows with the work done, on a terminal only: in a pipe or a log it is
/// silent.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(double share);
  void clear();

 private:
  std::string label_;
  bool terminal_;
  int shown_ = -1;  // percent
};

}  // namespace carom::command
