// Builds a document from the parser's events. For speed, a key is looked up once and a pointer is
// built for findings only: every request of the socket passes through here.

#include "protocols/base/json_text.hpp"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string>

namespace weft {
namespace {

using nlohmann::json;

/// nlohmann's id of "number overflow parsing".
constexpr int number_overflow = 406;
/// A longer key is truncated in messages [bytes].
constexpr std::size_t longest_key = 64;

std::string line_and_column(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, std::min(at, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_start = before.find_last_of('\n') + 1;  // npos + 1 is 0
  return "line " + std::to_string(line) + ", column " +
         std::to_string(before.size() - line_start + 1);
}

bool is_word_char(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '+';
}

/// The run of letters and signs around `at`; if there is none, an empty view at that position.
std::string_view text_at_position(std::string_view text, std::size_t at) {
  at = std::min(at, text.size());
  std::size_t begin = at;
  while (begin > 0 && is_word_char(text[begin - 1])) --begin;
  std::size_t end = at;
  while (end < text.size() && is_word_char(text[end])) ++end;
  return text.substr(begin, end - begin);
}

bool is_non_finite_literal(std::string_view word) {
  while (!word.empty() && (word.front() == '-' || word.front() == '+')) word.remove_prefix(1);
  std::string letters(word.substr(0, 16));
  for (char& c : letters) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return letters == "nan" || letters == "inf" || letters == "infinity";
}

/// Receives the parser's events and builds the document.
class Builder final {
 public:
  Builder(std::string_view text, const JsonBounds& bounds, json& document,
          std::vector<Error>& findings)
      : text_(text), bounds_(bounds), document_(document), findings_(findings) {
    open_.reserve(8);
  }

  // Called by nlohmann::json::sax_parse().
  bool null() { return put(nullptr); }
  bool boolean(bool value) { return put(value); }
  bool number_integer(json::number_integer_t value) { return put(value); }
  bool number_unsigned(json::number_unsigned_t value) { return put(value); }
  bool number_float(json::number_float_t value, const std::string&) { return put(value); }
  bool string(std::string& value) { return put(std::move(value)); }
  static bool binary(json::binary_t&) { return false; }
  bool start_object(std::size_t) { return open(json::object()); }
  bool start_array(std::size_t) { return open(json::array()); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }

  bool key(std::string& name) {
    auto& object = open_.back()->get_ref<json::object_t&>();
    const auto [member, is_new] = object.try_emplace(std::move(name));
    slot_ = &member->second;
    if (!is_new && findings_.size() < most_findings)
      findings_.push_back({.code = Errc::invalid_argument,
                           .where = child(pointer(), member->first),
                           .what = "key given twice",
                           .expected = "every key once",
                           .hint = "Remove one of the two"});
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) {
    const std::string_view word = text_at_position(text_, position > 0 ? position - 1 : 0);
    const std::string place =
        line_and_column(text_, static_cast<std::size_t>(word.data() - text_.data()));
    Error finding{.code = Errc::parse, .where = pointer(), .expected = "a finite number"};
    if (error.id == number_overflow) {
      finding.what = "number too large at " + place;
    } else if (is_non_finite_literal(word)) {
      finding.what = "number not allowed in JSON at " + place;
      finding.got = word;
      finding.hint = "Remove the key to use its default";
    } else {
      finding.what = "invalid JSON at " + place;
      finding.expected = "";
      finding.hint = "Check for a missing or extra comma, quote or bracket there";
    }
    findings_.push_back(std::move(finding));
    return false;
  }

 private:
  /// Limit of reported duplicate keys. No person reads more, and a megabyte of text can have a
  /// hundred thousand.
  static constexpr std::size_t most_findings = 100;

  template <class Value>
  bool put(Value&& value) {
    place(json(std::forward<Value>(value)));
    return true;
  }

  json* place(json&& value) {
    if (open_.empty()) return &(document_ = std::move(value));
    if (open_.back()->is_array())
      return &open_.back()->get_ref<json::array_t&>().emplace_back(std::move(value));
    *slot_ = std::move(value);
    return slot_;
  }

  bool open(json&& container) {
    if (open_.size() >= bounds_.max_depth) {
      findings_.push_back({.code = Errc::range,
                           .where = pointer(),
                           .what = "document nested too deeply",
                           .expected = "at most " + std::to_string(bounds_.max_depth) + " levels"});
      return false;
    }
    open_.push_back(place(std::move(container)));
    return true;
  }

  bool close() {
    open_.pop_back();
    return true;
  }

  /// Pointer of the container that is being filled.
  [[nodiscard]] std::string pointer() const {
    std::string text;
    for (std::size_t i = 1; i < open_.size(); ++i) {
      const json& parent = *open_[i - 1];
      if (parent.is_array())
        text = child(text, std::to_string(parent.size() - 1));
      else
        for (const auto& [name, value] : parent.get_ref<const json::object_t&>())
          if (&value == open_[i]) text = child(text, name);
    }
    return text;
  }

  std::string_view text_;
  JsonBounds bounds_;
  json& document_;
  std::vector<Error>& findings_;
  std::vector<json*> open_;  ///< containers from the root to the one being filled
  json* slot_ = nullptr;     ///< value of the newest key
};

}  // namespace

std::string child(std::string_view parent, std::string_view key) {
  std::string pointer(parent);
  pointer += '/';
  for (const char c : key.substr(0, longest_key)) {
    if (c == '~')
      pointer += "~0";
    else if (c == '/')
      pointer += "~1";
    else
      pointer += c;
  }
  return pointer;
}

std::vector<Error> read_json(std::string_view text, const JsonBounds& bounds, json& document) {
  std::vector<Error> findings;
  if (text.size() > bounds.max_bytes) {
    findings.push_back({.code = Errc::range,
                        .what = "document too large",
                        .expected = "at most " + std::to_string(bounds.max_bytes) + " bytes",
                        .got = std::to_string(text.size()) + " bytes",
                        .hint = "Check the file; a few kilobytes are usual"});
    return findings;
  }
  // The parser treats a zero byte as the end of the text and ignores the rest.
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    findings.push_back({.code = Errc::parse,
                        .what = "zero byte at " + line_and_column(text, zero),
                        .expected = "JSON text",
                        .hint = "Save the document as UTF-8 text"});
    return findings;
  }
  Builder builder(text, bounds, document, findings);
  json::sax_parse(text, &builder);
  return findings;
}

Result<json> parse_json(std::string_view text, const JsonBounds& bounds) {
  json document;
  std::vector<Error> findings = read_json(text, bounds, document);
  if (findings.empty()) return document;
  return pass(std::move(findings.front()));
}

}  // namespace weft
