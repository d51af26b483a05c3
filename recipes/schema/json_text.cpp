// JSON text to a document, with line and column of errors; declared in object_reader.hpp.

#include "recipes/schema/object_reader.hpp"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string>

namespace weft::recipes {
namespace {

using nlohmann::json;

/// nlohmann's id of "number overflow parsing".
constexpr int number_overflow = 406;

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

/// The run of letters and signs around `at`; empty, but at its place, when there is none.
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
class Builder final : public nlohmann::json_sax<json> {
 public:
  Builder(std::string_view text, const JsonBounds& bounds, json& document, Problems& problems)
      : text_(text), bounds_(bounds), document_(document), problems_(problems) {}

  bool null() override { return put(nullptr); }
  bool boolean(bool value) override { return put(value); }
  bool number_integer(number_integer_t value) override { return put(value); }
  bool number_unsigned(number_unsigned_t value) override { return put(value); }
  bool number_float(number_float_t value, const string_t&) override { return put(value); }
  bool string(string_t& value) override { return put(std::move(value)); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(json::object()); }
  bool start_array(std::size_t) override { return open(json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    key_ = std::move(name);
    if (open_.back()->contains(key_))
      problems_.add({child(pointer(), key_), "the key is given twice", "every key once", "",
                     "remove one of the two"});
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    const std::string_view word = text_at_position(text_, position > 0 ? position - 1 : 0);
    const std::string place =
        line_and_column(text_, static_cast<std::size_t>(word.data() - text_.data()));
    if (error.id == number_overflow)
      problems_.add(
          {pointer(), "the number at " + place + " is too large", "a finite number", "", ""});
    else if (is_non_finite_literal(word))
      problems_.add({pointer(), "JSON has no such number, at " + place, "a finite number",
                     std::string(word), "leave the key out to get its default"});
    else
      problems_.add({pointer(), "the text is not JSON from " + place + " on", "", "",
                     "look for a missing or extra comma, quote or bracket there"});
    return false;
  }

 private:
  bool put(json value) {
    place(std::move(value));
    return true;
  }

  json* place(json value) {
    if (open_.empty()) return &(document_ = std::move(value));
    if (open_.back()->is_array()) return &open_.back()->emplace_back(std::move(value));
    json& slot = (*open_.back())[key_];
    slot = std::move(value);
    return &slot;
  }

  bool open(json container) {
    if (open_.size() >= bounds_.max_depth) {
      problems_.add({pointer(), "the document is nested too deeply",
                     "at most " + std::to_string(bounds_.max_depth) + " levels", "", ""});
      return false;
    }
    keys_.push_back(key_);
    open_.push_back(place(std::move(container)));
    return true;
  }

  bool close() {
    open_.pop_back();
    keys_.pop_back();
    return true;
  }

  /// Of the container that is being filled.
  [[nodiscard]] std::string pointer() const {
    std::string text;
    for (std::size_t i = 1; i < open_.size(); ++i)
      text =
          open_[i - 1]->is_array() ? child(text, open_[i - 1]->size() - 1) : child(text, keys_[i]);
    return text;
  }

  std::string_view text_;
  JsonBounds bounds_;
  json& document_;
  Problems& problems_;
  std::vector<json*> open_;        ///< containers from the root to the one being filled
  std::vector<std::string> keys_;  ///< under which each of them was opened
  std::string key_;
};

}  // namespace

bool parse_json(std::string_view text, const JsonBounds& bounds, json& document,
                Problems& problems) {
  if (text.size() > bounds.max_bytes) {
    problems.add({"", "the document is too large",
                  "at most " + std::to_string(bounds.max_bytes) + " bytes",
                  std::to_string(text.size()) + " bytes", "it should be a few kilobytes"});
    return false;
  }
  // The parser takes it for the end of the text, and what stands behind it for nothing.
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    problems.add({"", "a zero byte at " + line_and_column(text, zero) + ": not a text file",
                  "JSON text", "", "save it as UTF-8"});
    return false;
  }
  Builder builder(text, bounds, document, problems);
  return json::sax_parse(text, &builder) && problems.empty();
}

}  // namespace weft::recipes
