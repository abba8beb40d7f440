#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace carom::test {

/// Where each class, struct, union and enumeration is defined that other files could name too, by
/// its qualified name. Types of functions and of anonymous namespaces are left out, and so are
/// declarations, specialisations of templates and what macros make.
///
/// A scanner of braces, not a compiler: it reads what this repository is formatted like.
class TypeNames {
 public:
  /// Reads a file; `place` stands for it.
  void read(std::string_view text, const std::string& place);

  const std::map<std::string, std::vector<std::string>>& places() const { return places_; }

 private:
  std::map<std::string, std::vector<std::string>> places_;
};

}  // namespace carom::test
