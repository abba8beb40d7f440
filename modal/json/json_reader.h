#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "carom/audio/result.h"
#include "carom/audio/vector.h"

namespace carom::modal {

/// Keeps the first error of a document and ignores those that follow from it.
class FirstError {
 public:
  /// `document` is a file name; it begins the message.
  explicit FirstError(std::string_view document) : document_(document) {}

  explicit operator bool() const { return reason_.has_value(); }

  /// `place` is a JSON pointer, or a line and column, or empty for the document as a whole.
  void record(std::string_view place, std::string_view what);

  /// Returns the place and the reason, without the document's name; there must be an error.
  const std::string& reason() const { return *reason_; }
  /// Returns the error; there must be one.
  Error error() const { return Error{document_ + ": " + *reason_}; }

 private:
  std::string document_;
  std::optional<std::string> reason_;
};

/// Limits of one JSON document, so that a bad one costs bounded time and memory.
struct JsonLimits {
  std::size_t maxDepth = 32;          ///< containers inside each other
  std::size_t maxValues = 2'000'000;  ///< values of any kind
};

/// Strict JSON (RFC 8259): UTF-8, no comments, no duplicate keys, no number that overflows.
/// Never throws; nullopt means that `error` holds the reason. [any thread]
std::optional<nlohmann::json> parseJson(std::string_view text, FirstError& error,
                                        const JsonLimits& limits = {});

/// The range of numbers that a field accepts, and its description for messages.
struct NumberRange {
  std::string_view noun;  ///< with its article: "a radius"
  double min = 0.0;
  double max = 0.0;
  std::string_view unit{};  ///< "metres"; empty for a pure number
  bool aboveMin = false;    ///< min itself is refused
  bool belowMax = false;    ///< max itself is refused
  bool whole = false;       ///< integers only (1e3 and 1000.0 are integers)

  bool contains(double value) const;
  std::string describe() const;  ///< "a number from 1e-6 to 10000 (metres)"
};

/// The range of texts that a field accepts.
struct TextRange {
  std::string_view noun;
  std::size_t minLength = 0;  ///< Unicode code points
  std::size_t maxLength = 0;  ///< Unicode code points
  bool multiline = false;     ///< control characters (line breaks, tabs) may occur

  bool contains(std::string_view text) const;
  std::string describe() const;
};

struct Interval {
  double min = 0.0;
  double max = 0.0;
};

/// One value of a document with its place. Every read either returns a value that is accepted, or
/// records an error at that place and returns a harmless default; so a reader is a plain list of
/// fields, and asks once at the end if all of them went well.
///
/// Reads with a range are for documents of our own: their errors name the quantity and what is
/// accepted. Reads without one are for documents of others, glTF, whose values are checked
/// elsewhere: their errors say which JSON type a value must have. [any thread]
class JsonNode {
 public:
  /// Borrows `value` and `error`, which must outlive the node.
  JsonNode(const nlohmann::json& value, std::string pointer, FirstError& error)
      : value_(&value), pointer_(std::move(pointer)), error_(&error) {}

  bool failed() const { return static_cast<bool>(*error_); }
  void fail(std::string_view what) const { error_->record(pointer_, what); }
  /// fail("VALUE is not NOUN; expected EXPECTED")
  void failAs(std::string_view noun, std::string_view expected) const;

  const std::string& pointer() const { return pointer_; }
  bool isObject() const;
  bool isArray() const;
  bool isString() const;
  bool isNumber() const;
  bool isBoolean() const;

  /// True if this is an object with no key but the known ones; otherwise records an error.
  bool expectObject(std::string_view noun, std::initializer_list<std::string_view> keys) const;
  /// Returns the elements; records an error and returns none if this is no array or the count is
  /// out of range.
  std::vector<JsonNode> elements(std::string_view noun, std::size_t min, std::size_t max) const;
  /// Returns the members with their keys, in the order of the keys; only for an object.
  std::vector<std::pair<std::string, JsonNode>> members() const;

  bool has(std::string_view key) const;
  std::optional<JsonNode> find(std::string_view key) const;
  /// Returns the member as `find` does; its absence is an error.
  std::optional<JsonNode> require(std::string_view key, std::string_view expected) const;

  bool boolean() const;
  double number(const NumberRange& range) const;
  Vec3 vector(const NumberRange& component) const;
  std::string text(const TextRange& range) const;
  /// Reads a number, which is both ends of the interval, or [min, max].
  Interval interval(const NumberRange& range) const;
  /// Returns the index of the word that this is.
  std::size_t choice(std::string_view noun, std::initializer_list<std::string_view> words) const;

  /// Read a member of this object: a required one, or one whose value is `absent` if it is missing.
  bool boolean(std::string_view key, bool absent) const;
  double number(std::string_view key, const NumberRange& range) const;
  double number(std::string_view key, const NumberRange& range, double absent) const;
  Vec3 vector(std::string_view key, const NumberRange& component) const;
  Vec3 vector(std::string_view key, const NumberRange& component, const Vec3& absent) const;
  std::string text(std::string_view key, const TextRange& range, std::string_view absent) const;

  /// Returns the member of this object; if it is absent, a null with its place, whose reads record
  /// errors there.
  JsonNode member(std::string_view key) const;
  /// Returns the elements of an array, which may be absent, but not be anything else.
  std::vector<JsonNode> elements() const;
  /// Returns the element of this array whose index `reference` holds; `kind` is what messages call
  /// such elements.
  JsonNode element(const JsonNode& reference, std::string_view kind) const;

  double number() const;
  std::size_t index() const;  ///< an integer from 0
  std::string text() const;

  /// Read a member of this object; `absent` or nothing is returned if it is missing.
  bool isTrue(std::string_view key) const;
  double number(std::string_view key, double absent) const;
  std::optional<double> optionalNumber(std::string_view key) const;
  std::size_t index(std::string_view key, std::size_t absent) const;
  std::optional<std::size_t> optionalIndex(std::string_view key) const;
  std::string text(std::string_view key) const;  ///< empty if missing
  /// Reads as many numbers as `values` holds into it; it stays as it is if the member is missing.
  void numbers(std::string_view key, std::span<double> values) const;

 private:
  std::string childPointer(std::string_view key) const;

  const nlohmann::json* value_;
  std::string pointer_;
  FirstError* error_;
};

/// Returns `words` as "a", "b", "c"; a long list is cut.
std::string quotedList(const std::vector<std::string_view>& words);

/// Returns ` (did you mean "NEAREST"?)`, or an empty string when no word is near. The nearest is a
/// name that has the word as one of its parts, as "red_oak" has "oak", or else the one with the
/// fewest letters to change.
std::string suggestion(std::string_view word, const std::vector<std::string_view>& words);

/// Returns the text with each control character replaced by '?': C0, DEL and C1, what ends a line
/// or a paragraph, and what changes the direction of writing. A terminal may obey them.
std::string withoutControls(std::string_view text);

/// Returns the text in quotation marks, cut when long, with control characters replaced.
std::string inQuotes(std::string_view text);

/// Returns the shortest text that reads back as the same number: 0.05, 1e-6, 1e4.
std::string formatNumber(double value);

}  // namespace carom::modal
