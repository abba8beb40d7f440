#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace carom::test {

/// The places where classes, structs, unions and enumerations that other files could name are
/// defined, by their qualified names. Types of functions and of anonymous namespaces are left out,
/// and so are declarations, specialisations of templates and the products of macros.
///
/// This is a scanner of braces, not a compiler: it reads code that is formatted like this
/// repository's.
class TypeNames {
 public:
  /// Reads a file; `place` stands for it.
  void read(std::string_view text, const std::string& place);

  const std::map<std::string, std::vector<std::string>>& places() const { return places_; }

 private:
  std::map<std::string, std::vector<std::string>> places_;
};

}  // namespace carom::test
