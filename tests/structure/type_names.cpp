#include "tests/structure/type_names.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <regex>

namespace carom::test {
namespace {

/// Returns the end of a literal that begins at `at` with its quotation mark.
std::size_t endOfLiteral(std::string_view text, std::size_t at) {
  const char mark = text[at];
  for (++at; at < text.size() && text[at] != mark; ++at) {
    if (text[at] == '\\') ++at;
  }
  return std::min(at + 1, text.size());
}

std::size_t endOfRawString(std::string_view text, std::size_t at) {
  const std::size_t open = text.find('(', at);
  const std::string close = ")" + std::string(text.substr(at + 2, open - at - 2)) + "\"";
  const std::size_t end = text.find(close, open);
  return end == std::string_view::npos ? text.size() : end + close.size();
}

bool isWordCharacter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Returns the text without comments, literals and preprocessor lines.
std::string code(std::string_view text) {
  std::string kept;
  bool isLineStart = true;
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view rest = text.substr(at);
    const bool isWord = at > 0 && isWordCharacter(text[at - 1]);
    if (rest.starts_with("//") || (isLineStart && rest.starts_with('#'))) {
      std::size_t end = text.find('\n', at);
      while (end != std::string_view::npos && text[end - 1] == '\\')
        end = text.find('\n', end + 1);
      at = std::min(end, text.size());
    } else if (rest.starts_with("/*")) {
      at = std::min(text.find("*/", at), text.size() - 2) + 2;
    } else if (rest.starts_with("R\"") && !isWord) {
      at = endOfRawString(text, at);
    } else if (rest.front() == '"' || (rest.front() == '\'' && !isWord)) {
      at = endOfLiteral(text, at);
    } else {
      const char c = text[at++];
      kept += c;
      if (c == '\n')
        isLineStart = true;
      else if (c != ' ')
        isLineStart = false;
    }
  }
  return kept;
}

/// The scope that a brace opens.
struct Scope {
  enum class Kind { space, type, other };
  Kind kind = Kind::other;
  std::string name;  // empty for an anonymous namespace
};

std::optional<Scope> namespaceOf(const std::string& head) {
  static const std::regex pattern(R"(^\s*(?:inline\s+)?namespace\s*([\w:]*)\s*$)");
  std::smatch parts;
  if (!std::regex_match(head, parts, pattern)) return std::nullopt;
  return Scope{Scope::Kind::space, parts[1]};
}

std::optional<Scope> typeOf(const std::string& head) {
  static const std::regex pattern(
      R"(^\s*(?:template\s*<[^{}]*>\s*)?(?:typedef\s+)?(?:class|struct|union|enum(?:\s+(?:class|struct))?)\s+)"
      R"((?:alignas\s*\([^)]*\)\s*)?([\w:]+)\s*(?:final\s*)?(?::[^;]*)?$)");
  std::smatch parts;
  if (!std::regex_match(head, parts, pattern)) return std::nullopt;
  return Scope{Scope::Kind::type, parts[1]};
}

/// Returns the scope for the text before a brace, back to the end of the previous statement.
Scope scopeOf(const std::string& head) {
  if (std::optional<Scope> space = namespaceOf(head)) return *space;
  if (std::optional<Scope> type = typeOf(head)) return *type;
  return {};
}

/// Returns the name with all scopes around it; none if no other file can name it.
std::optional<std::string> qualified(const std::vector<Scope>& scopes) {
  std::string name;
  for (const Scope& scope : scopes) {
    if (scope.kind == Scope::Kind::other || scope.name.empty()) return std::nullopt;
    name += (name.empty() ? "" : "::") + scope.name;
  }
  return name;
}

}  // namespace

void TypeNames::read(std::string_view text, const std::string& place) {
  std::vector<Scope> scopes;
  std::string head;
  for (const char c : code(text)) {
    if (c == '{') {
      scopes.push_back(scopeOf(head));
      if (scopes.back().kind == Scope::Kind::type) {
        if (const std::optional<std::string> name = qualified(scopes)) {
          std::vector<std::string>& places = places_[*name];
          if (places.empty() || places.back() != place) places.push_back(place);
        }
      }
      head.clear();
    } else if (c == '}') {
      if (!scopes.empty()) scopes.pop_back();
      head.clear();
    } else if (c == ';') {
      head.clear();
    } else {
      head += c;
      // An access label does not belong to the declaration after it.
      static const std::regex label(R"(\s*(public|private|protected):)");
      if (c == ':' && std::regex_match(head, label)) head.clear();
    }
  }
}

}  // namespace carom::test
