#include "modal/json/json_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include <nlohmann/json.hpp>

namespace carom::modal {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxShownText = 60;   // bytes of a user's text in a message
constexpr std::size_t kMaxShownWords = 40;  // words of a list in a message
constexpr std::uint64_t kExactIntegers = std::uint64_t{1} << 53U;

/// Returns the number of bytes of the control character that the text begins with; 0: it begins
/// with none. Of Unicode's these are C0, DEL and C1, what ends a line or a paragraph, and what
/// changes the direction of writing.
std::size_t controlLength(std::string_view text) {
  const auto byte = [&](std::size_t at) {
    return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U;
  };
  if (byte(0) < 0x20U || byte(0) == 0x7fU) return 1;
  if (byte(0) == 0xc2U) return byte(1) >= 0x80U && byte(1) <= 0x9fU ? 2 : 0;
  if (byte(0) != 0xe2U) return 0;
  const unsigned last = byte(2);
  const bool isControl = byte(1) == 0x80U
                             ? (last >= 0xa8U && last <= 0xaeU) || last == 0x8eU || last == 0x8fU
                             : byte(1) == 0x81U && last >= 0xa6U && last <= 0xa9U;
  return isControl ? 3 : 0;
}
bool hasControl(std::string_view text) {
  for (std::size_t at = 0; at < text.size(); ++at)
    if (controlLength(text.substr(at)) > 0) return true;
  return false;
}
bool isContinuation(char c) {
  return (static_cast<unsigned char>(c) & 0xc0U) == 0x80U;
}

std::size_t codePoints(std::string_view text) {
  return text.size() -
         static_cast<std::size_t>(std::count_if(text.begin(), text.end(), isContinuation));
}

/// Returns at most `limit` bytes of the text, cut between two code points.
std::string shortened(std::string_view text, std::size_t limit) {
  if (text.size() <= limit) return std::string(text);
  std::size_t end = limit;
  while (end > 0 && isContinuation(text[end]))
    --end;
  return std::string(text.substr(0, end)) + "...";
}

std::string escapedKey(std::string_view key) {
  std::string escaped;
  for (const char c : shortened(key, kMaxShownText)) {
    if (c == '~') {
      escaped += "~0";
    } else if (c == '/') {
      escaped += "~1";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

const json& nullValue() {
  static const json null;
  return null;
}

/// Describes a value in a few words.
std::string described(const json& value) {
  switch (value.type()) {
    case json::value_t::object:
      return "an object";
    case json::value_t::array:
      return "an array of length " + std::to_string(value.size());
    case json::value_t::string:
      return inQuotes(value.get_ref<const std::string&>());
    case json::value_t::number_float:
      return formatNumber(value.get<double>());
    default:
      return value.dump();  // null, true, false, an integer
  }
}

/// Returns the JSON library's own sentence without its code and position, and without raw bytes
/// that are not UTF-8.
std::string syntaxMessage(std::string_view what) {
  const std::size_t start = what.find(": ");
  std::string message(start == std::string_view::npos ? what : what.substr(start + 2));
  std::replace_if(
      message.begin(), message.end(), [](char c) { return static_cast<unsigned char>(c) >= 0x80; },
      '?');
  constexpr std::size_t kMaxMessage = 300;
  if (message.size() > kMaxMessage) {  // cut in the middle: the end says what was expected
    message = message.substr(0, kMaxMessage / 2) + " ... " +
              message.substr(message.size() - kMaxMessage / 2);
  }
  return withoutControls(message);
}

/// Returns which other kind of file it is that a text is taken from by mistake; empty if unknown.
std::string_view otherFormatOf(std::string_view text) {
  if (text.starts_with("RIFF") || text.starts_with("RF64") || text.starts_with("fLaC"))
    return "a sound file";
  if (text.starts_with("caromrun")) return "a recorded run, as of carom record";
  if (text.starts_with("caromode")) return "a modal model, as of carom modes";
  return {};
}

std::string lineAndColumn(std::string_view text, std::size_t position) {
  const std::string_view before = text.substr(0, position == 0 ? 0 : position - 1);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t lineStart = before.rfind('\n');
  const std::size_t column =
      lineStart == std::string_view::npos ? before.size() + 1 : before.size() - lineStart;
  return "line " + std::to_string(line) + ", column " + std::to_string(column);
}

/// Builds the document while it is parsed, since only then duplicate keys, depth and size are seen.
class DocumentBuilder final : public nlohmann::json_sax<json> {
 public:
  DocumentBuilder(std::string_view text, const JsonLimits& limits, FirstError& error)
      : text_(text), limits_(limits), error_(error) {}

  bool null() override { return add(nullptr) != nullptr; }
  bool boolean(bool value) override { return add(value) != nullptr; }
  bool number_integer(number_integer_t value) override { return add(value) != nullptr; }
  bool number_unsigned(number_unsigned_t value) override { return add(value) != nullptr; }
  bool number_float(number_float_t value, const string_t& /*token*/) override {
    return add(value) != nullptr;
  }
  bool string(string_t& value) override { return add(std::move(value)) != nullptr; }
  bool binary(binary_t& /*value*/) override { return false; }  // does not occur in text
  bool start_object(std::size_t /*elements*/) override { return open(json::object()); }
  bool start_array(std::size_t /*elements*/) override { return open(json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Frame& frame = frames_.back();
    frame.key = std::move(name);
    if (!frame.container->contains(frame.key)) return true;
    error_.record(pointer(), "the key " + inQuotes(frame.key) +
                                 " appears twice; expected each key once in an object");
    return false;
  }

  bool parse_error(std::size_t position, const std::string& token,
                   const json::exception& exception) override {
    constexpr int kNumberOverflow = 406;
    if (exception.id == kNumberOverflow) {
      error_.record(pointer(), withoutControls(shortened(token, kMaxShownText)) +
                                   " is too large for a number; expected at most 1.8e308");
    } else {
      const std::string_view other = otherFormatOf(text_);
      error_.record(lineAndColumn(text_, std::min(position, text_.size() + 1)),
                    other.empty() ? "this is not JSON: " + syntaxMessage(exception.what())
                                  : "this is not JSON but " + std::string(other));
    }
    return false;
  }

  json take() { return std::move(root_); }

 private:
  struct Frame {
    json* container = nullptr;
    std::string key;  // latest key, if the container is an object
  };

  json* add(json value) {
    if (++values_ > limits_.maxValues) {
      error_.record({}, "the document has more than " + std::to_string(limits_.maxValues) +
                            " values; expected at most that many");
      return nullptr;
    }
    if (frames_.empty()) return &(root_ = std::move(value));
    Frame& frame = frames_.back();
    if (frame.container->is_array()) {
      frame.container->push_back(std::move(value));
      return &frame.container->back();
    }
    return &(*frame.container)[frame.key].operator=(std::move(value));
  }

  bool open(json container) {
    if (frames_.size() >= limits_.maxDepth) {
      error_.record(pointer(), "nested too deep; expected at most " +
                                   std::to_string(limits_.maxDepth) + " levels");
      return false;
    }
    json* added = add(std::move(container));
    if (added == nullptr) return false;
    frames_.push_back({added, {}});
    return true;
  }

  bool close() {
    frames_.pop_back();
    return true;
  }

  /// Returns the JSON pointer of the value that comes next.
  std::string pointer() const {
    std::string pointer;
    for (const Frame& frame : frames_) {
      const bool innermost = &frame == &frames_.back();
      pointer += '/';
      if (frame.container->is_object()) {
        pointer += escapedKey(frame.key);
      } else {
        pointer += std::to_string(frame.container->size() - (innermost ? 0 : 1));
      }
    }
    return pointer;
  }

  std::string_view text_;
  JsonLimits limits_;
  FirstError& error_;
  json root_;
  std::vector<Frame> frames_;
  std::size_t values_ = 0;
};

/// Returns the double nearest to a JSON number, except that integers above 2^53 stay above it, so
/// that rounding cannot bring them into a range that ends there.
double toDouble(const json& value) {
  if (!value.is_number_unsigned()) return value.get<double>();
  const auto integer = value.get<std::uint64_t>();
  const auto nearest = static_cast<double>(integer);
  if (integer <= kExactIntegers) return nearest;
  return std::max(nearest, static_cast<double>(kExactIntegers + 2));
}

/// Returns Levenshtein's edit distance, computed row by row.
std::size_t editDistance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t taken = 0; taken < from.size(); ++taken) {
    std::size_t diagonal = std::exchange(row[0], taken + 1);
    for (std::size_t column = 0; column < to.size(); ++column) {
      const std::size_t replaced = diagonal + (from[taken] == to[column] ? 0U : 1U);
      diagonal = row[column + 1];
      row[column + 1] = std::min({replaced, diagonal + 1, row[column] + 1});
    }
  }
  return row.back();
}

/// True if a word stands whole in a name: "oak" in "red_oak".
bool isWordOf(std::string_view name, std::string_view word) {
  for (std::size_t at = name.find(word); at != std::string_view::npos;
       at = name.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || name[at - 1] == '_') && (end == name.size() || name[end] == '_')) return true;
  }
  return false;
}

}  // namespace

std::string withoutControls(std::string_view text) {
  std::string made;
  while (!text.empty()) {
    const std::size_t control = controlLength(text);
    made += control > 0 ? '?' : text.front();
    text.remove_prefix(std::max<std::size_t>(1, control));
  }
  return made;
}

void FirstError::record(std::string_view place, std::string_view what) {
  if (reason_) return;
  reason_.emplace();
  if (!place.empty()) reason_->append(withoutControls(std::string(place))).append(": ");
  reason_->append(what);
}

std::optional<json> parseJson(std::string_view text, FirstError& error, const JsonLimits& limits) {
  if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) {
    error.record({}, "the document is empty; expected a JSON object");
    return std::nullopt;
  }
  // The parser would take it for the end.
  if (const std::size_t at = text.find('\0'); at != std::string_view::npos) {
    error.record({}, "this is not JSON: byte " + std::to_string(at + 1) +
                         " is the character NUL; expected a JSON object");
    return std::nullopt;
  }
  DocumentBuilder builder(text, limits, error);
  if (!json::sax_parse(text.begin(), text.end(), &builder)) return std::nullopt;
  return builder.take();
}

bool NumberRange::contains(double value) const {
  if (!(value >= min && value <= max)) return false;  // so NaN is refused, too
  if (aboveMin && value == min) return false;
  if (belowMax && value == max) return false;
  return !whole || value == std::floor(value);
}

std::string NumberRange::describe() const {
  std::string text = whole ? "a whole number " : "a number ";
  text += aboveMin ? "above " : "from ";
  text += formatNumber(min) + (aboveMin ? " up to " : " to ");
  text += (belowMax ? "below " : "") + formatNumber(max);
  if (!unit.empty()) text.append(" (").append(unit).append(")");
  return text;
}

bool TextRange::contains(std::string_view text) const {
  const std::size_t length = codePoints(text);
  if (length < minLength || length > maxLength) return false;
  return multiline || !hasControl(text);
}

std::string TextRange::describe() const {
  return "a string of " + std::to_string(minLength) + " to " + std::to_string(maxLength) +
         " characters" + (multiline ? "" : " on one line");
}

bool JsonNode::isObject() const {
  return value_->is_object();
}
bool JsonNode::isArray() const {
  return value_->is_array();
}
bool JsonNode::isString() const {
  return value_->is_string();
}
bool JsonNode::isNumber() const {
  return value_->is_number();
}
bool JsonNode::isBoolean() const {
  return value_->is_boolean();
}

void JsonNode::failAs(std::string_view noun, std::string_view expected) const {
  if (failed()) return;
  fail(described(*value_).append(" is not ").append(noun).append("; expected ").append(expected));
}

bool JsonNode::expectObject(std::string_view noun,
                            std::initializer_list<std::string_view> keys) const {
  if (!value_->is_object()) {
    failAs(noun, "an object");
    return false;
  }
  for (const auto& [key, member] : value_->items()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    error_->record(childPointer(key), "unknown key " + inQuotes(key) + suggestion(key, keys) +
                                          "; expected one of " + quotedList(keys));
    return false;
  }
  return true;
}

std::vector<JsonNode> JsonNode::elements(std::string_view noun, std::size_t min,
                                         std::size_t max) const {
  std::vector<JsonNode> nodes;
  if (!value_->is_array() || value_->size() < min || value_->size() > max) {
    failAs(noun, "an array of length " + std::to_string(min) +
                     (min == max ? std::string() : " to " + std::to_string(max)));
    return nodes;
  }
  nodes.reserve(value_->size());
  for (const json& element : *value_) {
    nodes.emplace_back(element, childPointer(std::to_string(nodes.size())), *error_);
  }
  return nodes;
}

std::vector<std::pair<std::string, JsonNode>> JsonNode::members() const {
  std::vector<std::pair<std::string, JsonNode>> nodes;
  for (const auto& [key, member] : value_->items()) {
    nodes.emplace_back(key, JsonNode(member, childPointer(key), *error_));
  }
  return nodes;
}

bool JsonNode::has(std::string_view key) const {
  return value_->is_object() && value_->contains(key);
}

std::optional<JsonNode> JsonNode::find(std::string_view key) const {
  if (!value_->is_object()) return std::nullopt;
  const auto member = value_->find(key);
  if (member == value_->end()) return std::nullopt;
  return JsonNode(*member, childPointer(key), *error_);
}

std::optional<JsonNode> JsonNode::require(std::string_view key, std::string_view expected) const {
  std::optional<JsonNode> member = find(key);
  if (!member && !failed()) {
    error_->record(childPointer(key), std::string("missing; expected ").append(expected));
  }
  return member;
}

bool JsonNode::boolean() const {
  if (value_->is_boolean()) return value_->get<bool>();
  failAs("a boolean", "true or false");
  return false;
}

double JsonNode::number(const NumberRange& range) const {
  const double value = value_->is_number() ? toDouble(*value_) : std::nan("");
  if (range.contains(value)) return value;
  if (!failed()) failAs(range.noun, range.describe());
  return range.min;
}

Vec3 JsonNode::vector(const NumberRange& component) const {
  if (!value_->is_array() || value_->size() != 3) {
    if (!failed()) failAs("a vector", "[x, y, z], each " + component.describe());
    return Vec3::Zero();
  }
  const std::vector<JsonNode> xyz = elements("a vector", 3, 3);
  return {xyz[0].number(component), xyz[1].number(component), xyz[2].number(component)};
}

std::string JsonNode::text(const TextRange& range) const {
  if (value_->is_string()) {
    const auto& text = value_->get_ref<const std::string&>();
    if (range.contains(text)) return text;
  }
  failAs(range.noun, range.describe());
  return {};
}

Interval JsonNode::interval(const NumberRange& range) const {
  if (value_->is_number()) {
    const double value = number(range);
    return {value, value};
  }
  if (!value_->is_array() || value_->size() != 2) {
    if (!failed()) failAs(range.noun, range.describe() + ", or [min, max] of such");
    return {range.min, range.min};
  }
  const std::vector<JsonNode> ends = elements("a range", 2, 2);
  const Interval interval{ends[0].number(range), ends[1].number(range)};
  if (interval.min > interval.max) {
    fail("the minimum " + formatNumber(interval.min) + " is above the maximum " +
         formatNumber(interval.max) + "; expected [min, max]");
  }
  return interval;
}

std::size_t JsonNode::choice(std::string_view noun,
                             std::initializer_list<std::string_view> words) const {
  const std::string_view word =
      value_->is_string() ? std::string_view(value_->get_ref<const std::string&>()) : "";
  const auto* const found = std::find(words.begin(), words.end(), word);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  failAs(noun, "one of " + quotedList(words) + suggestion(word, words));
  return 0;
}

bool JsonNode::boolean(std::string_view key, bool absent) const {
  const std::optional<JsonNode> member = find(key);
  return member ? member->boolean() : absent;
}

double JsonNode::number(std::string_view key, const NumberRange& range) const {
  if (!find(key)) {
    require(key, range.describe());
    return range.min;
  }
  return find(key)->number(range);
}

double JsonNode::number(std::string_view key, const NumberRange& range, double absent) const {
  const std::optional<JsonNode> member = find(key);
  return member ? member->number(range) : absent;
}

Vec3 JsonNode::vector(std::string_view key, const NumberRange& component) const {
  if (!find(key)) {
    require(key, "[x, y, z], each " + component.describe());
    return Vec3::Zero();
  }
  return find(key)->vector(component);
}

Vec3 JsonNode::vector(std::string_view key, const NumberRange& component,
                      const Vec3& absent) const {
  const std::optional<JsonNode> member = find(key);
  return member ? member->vector(component) : absent;
}

std::string JsonNode::text(std::string_view key, const TextRange& range,
                           std::string_view absent) const {
  const std::optional<JsonNode> member = find(key);
  return member ? member->text(range) : std::string(absent);
}

JsonNode JsonNode::member(std::string_view key) const {
  if (!value_->is_object() && !value_->is_null()) fail("must be an object");
  const std::optional<JsonNode> found = find(key);
  return found ? *found : JsonNode(nullValue(), childPointer(key), *error_);
}

std::vector<JsonNode> JsonNode::elements() const {
  std::vector<JsonNode> nodes;
  if (!value_->is_array() && !value_->is_null()) fail("must be an array");
  if (!value_->is_array()) return nodes;
  nodes.reserve(value_->size());
  for (const json& element : *value_)
    nodes.emplace_back(element, childPointer(std::to_string(nodes.size())), *error_);
  return nodes;
}

JsonNode JsonNode::element(const JsonNode& reference, std::string_view kind) const {
  const std::size_t index = reference.index();
  const std::size_t size = value_->is_array() ? value_->size() : 0;
  if (index >= size)
    reference.fail("is " + std::string(kind) + ' ' + std::to_string(index) + ", and there are " +
                   std::to_string(size));
  return {index < size ? (*value_)[index] : nullValue(), childPointer(std::to_string(index)),
          *error_};
}

double JsonNode::number() const {
  if (value_->is_number()) return value_->get<double>();
  fail("must be a number");
  return 0.0;
}

std::size_t JsonNode::index() const {
  if (value_->is_number_unsigned()) return value_->get<std::size_t>();
  fail("must be an integer from 0");
  return 0;
}

std::string JsonNode::text() const {
  if (value_->is_string()) return value_->get<std::string>();
  fail("must be a string");
  return {};
}

bool JsonNode::isTrue(std::string_view key) const {
  return has(key) && *find(key)->value_ == true;
}

double JsonNode::number(std::string_view key, double absent) const {
  return optionalNumber(key).value_or(absent);
}

std::optional<double> JsonNode::optionalNumber(std::string_view key) const {
  if (const std::optional<JsonNode> member = find(key)) return member->number();
  return std::nullopt;
}

std::size_t JsonNode::index(std::string_view key, std::size_t absent) const {
  return optionalIndex(key).value_or(absent);
}

std::optional<std::size_t> JsonNode::optionalIndex(std::string_view key) const {
  if (const std::optional<JsonNode> member = find(key)) return member->index();
  return std::nullopt;
}

std::string JsonNode::text(std::string_view key) const {
  const std::optional<JsonNode> member = find(key);
  return member ? member->text() : std::string();
}

void JsonNode::numbers(std::string_view key, std::span<double> values) const {
  const std::optional<JsonNode> array = find(key);
  if (!array) return;
  const std::vector<JsonNode> elements = array->elements();
  if (elements.size() != values.size())
    return array->fail("must be an array of " + std::to_string(values.size()) + " numbers");
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = elements[at].number();
}

std::string JsonNode::childPointer(std::string_view key) const {
  return pointer_ + '/' + escapedKey(key);
}

std::string quotedList(const std::vector<std::string_view>& words) {
  std::string list;
  for (std::size_t word = 0; word < words.size(); ++word) {
    if (word > 0) list += ", ";
    if (word == kMaxShownWords) return list + "...";
    list += inQuotes(words[word]);
  }
  return list;
}

std::string suggestion(std::string_view word, const std::vector<std::string_view>& words) {
  if (word.empty() || word.size() > kMaxShownText) return {};
  std::string_view nearest;
  std::size_t least = 1 + word.size() / 3;  // words at a greater distance are no misspellings
  for (const std::string_view candidate : words) {
    if (candidate.size() > kMaxShownText) continue;
    const std::size_t distance = isWordOf(candidate, word) ? 0 : editDistance(word, candidate);
    if (distance > least || (distance == least && !nearest.empty())) continue;
    least = distance;
    nearest = candidate;
  }
  return nearest.empty() ? std::string() : " (did you mean " + inQuotes(nearest) + "?)";
}

std::string inQuotes(std::string_view text) {
  return '"' + withoutControls(shortened(text, kMaxShownText)) + '"';
}

std::string formatNumber(double value) {
  std::array<char, 32> buffer{};
  char* const first = buffer.data();
  char* const last = first + buffer.size();
  const bool shortInteger = value == std::floor(value) && std::abs(value) < 1e6;
  char* const end = shortInteger ? std::to_chars(first, last, value, std::chars_format::fixed).ptr
                                 : std::to_chars(first, last, value).ptr;
  std::string text(first, end);
  const std::size_t exponent = text.find('e');
  if (exponent == std::string::npos) return text;
  std::size_t digits = exponent + 2;  // behind the sign
  while (digits + 1 < text.size() && text[digits] == '0')
    text.erase(digits, 1);
  if (text[exponent + 1] == '+') text.erase(exponent + 1, 1);
  return text;
}

}  // namespace carom::modal
