#include "recipes/schema/object_reader.hpp"

#include "protocols/base/closest.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace weft::recipes {
namespace {

using nlohmann::json;

constexpr double largest_exact_integer = 9007199254740992.0;  // 2^53

bool contains(const std::vector<std::string_view>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::vector<std::string_view> keys_of(const Quantity& quantity) {
  std::vector<std::string_view> keys;
  for (const Spelling& spelling : quantity.spellings) keys.push_back(spelling.key);
  return keys;
}

bool whole(const json& value) {
  if (value.is_number_integer()) return true;
  if (!value.is_number_float()) return false;
  const double number = value.get<double>();
  return number == std::floor(number) && std::abs(number) <= largest_exact_integer;
}

bool is_unit_name(std::string_view word) {
  static const std::vector<std::string_view> words{
      "N",  "n",  "kN", "mN",  "gf",   "kgf",  "m",  "mm",  "cm",  "um",  "km",  "in",
      "s",  "ms", "us", "min", "h",    "mps",  "g",  "kg",  "Hz",  "hz",  "deg", "rad",
      "s2", "Nm", "nm", "nmm", "mmps", "cmps", "Pa", "kPa", "mm2", "mps2"};
  return contains(words, word);
}

/// Whether `key` is the stem alone or the stem and a unit: "speed", "speed_cm_s". "force_band_N" is
/// not a spelling of "force".
bool is_wrong_unit_of(std::string_view stem, std::string_view key) {
  if (!key.starts_with(stem)) return false;
  std::string_view rest = key.substr(stem.size());
  while (!rest.empty()) {
    if (rest.front() != '_') return false;
    rest.remove_prefix(1);
    const std::string_view word = rest.substr(0, rest.find('_'));
    if (!is_unit_name(word)) return false;
    rest.remove_prefix(word.size());
  }
  return true;
}

std::string in_unit(double si, const Spelling& spelling) {
  return json(si * spelling.per_si).dump();
}

}  // namespace

std::string range_text(const Bounds& bounds, const Spelling& spelling) {
  constexpr double huge = std::numeric_limits<double>::max();
  std::string text = bounds.max == huge
                         ? "at least " + in_unit(bounds.min, spelling)
                         : in_unit(bounds.min, spelling) + " to " + in_unit(bounds.max, spelling);
  if (!bounds.why.empty()) (text += ", ") += bounds.why;
  return text;
}

bool parse_json(std::string_view text, const JsonBounds& bounds, json& document,
                Problems& problems) {
  const std::vector<Error> findings = read_json(text, bounds, document);
  for (const Error& one : findings)
    problems.add({one.where, one.what, one.expected, one.got, one.hint});
  return findings.empty();
}

bool is_name(std::string_view text, std::size_t most) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.';
  };
  return !text.empty() && text.size() <= most && text.front() != '.' && text.front() != '-' &&
         std::all_of(text.begin(), text.end(), allowed);
}

std::string brief(const json& value) {
  if (value.is_object()) return "an object";
  if (value.is_array()) return "an array";
  return clipped(value.dump());
}

ObjectReader::ObjectReader(const json& value, std::string pointer, Problems& problems)
    : pointer_(std::move(pointer)), problems_(problems) {
  if (value.is_object())
    object_ = &value;
  else
    wrong_type(pointer_, "an object", value);
}

std::optional<double> ObjectReader::quantity(const Quantity& quantity, const Bounds& bounds,
                                             Need need) {
  const Spelling* spelling = spelling_used(quantity, need);
  if (spelling == nullptr) return std::nullopt;
  return number(object_->at(std::string(spelling->key)), at(spelling->key), *spelling, bounds);
}

std::optional<std::int64_t> ObjectReader::integer(std::string_view key, std::int64_t min,
                                                  std::int64_t max, Need need) {
  const json* value = find(key, need);
  if (value == nullptr) return std::nullopt;
  if (!whole(*value)) {
    wrong_type(at(key), "a whole number", *value);
    return std::nullopt;
  }
  const bool too_large = value->is_number_unsigned() &&
                         value->get<std::uint64_t>() > static_cast<std::uint64_t>(INT64_MAX);
  const std::int64_t number = too_large ? INT64_MAX : value->get<std::int64_t>();
  if (!too_large && number >= min && number <= max) return number;
  problems_.add({at(key), "number out of range", std::to_string(min) + " to " + std::to_string(max),
                 brief(*value), ""});
  return std::nullopt;
}

std::optional<bool> ObjectReader::flag(std::string_view key, Need need) {
  const json* value = find(key, need);
  if (value == nullptr) return std::nullopt;
  if (value->is_boolean()) return value->get<bool>();
  wrong_type(at(key), "true or false", *value);
  return std::nullopt;
}

std::optional<std::string> ObjectReader::text(std::string_view key, Need need) {
  const json* value = find(key, need);
  if (value == nullptr) return std::nullopt;
  if (value->is_string()) return value->get<std::string>();
  wrong_type(at(key), "a text", *value);
  return std::nullopt;
}

std::optional<std::string> ObjectReader::name(std::string_view key, Need need) {
  std::optional<std::string> value = text(key, need);
  if (!value || is_name(*value)) return value;
  problems_.add(
      {at(key), "name not usable in file names", std::string(name_rule), clipped(*value), ""});
  return std::nullopt;
}

std::optional<std::size_t> ObjectReader::choice(std::string_view key,
                                                const std::vector<std::string_view>& words,
                                                Need need) {
  const std::optional<std::string> value = text(key, need);
  if (!value) return std::nullopt;
  const auto found = std::find(words.begin(), words.end(), *value);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  problems_.add(
      {at(key), "word unknown", one_of(words), clipped(*value), did_you_mean(*value, words)});
  return std::nullopt;
}

const json* ObjectReader::array(std::string_view key, Need need) {
  return typed(key, need, true);
}

const json* ObjectReader::object(std::string_view key, Need need) {
  return typed(key, need, false);
}

std::optional<ObjectReader> ObjectReader::section(std::string_view key) {
  const json* value = object(key, Need::optional);
  if (value == nullptr) return std::nullopt;
  return ObjectReader(*value, at(key), problems_);
}

std::optional<std::pair<double, double>> ObjectReader::pair(const Quantity& quantity,
                                                            const Bounds& bounds, Need need) {
  const Spelling* spelling = spelling_used(quantity, need);
  if (spelling == nullptr) return std::nullopt;
  const json& value = object_->at(std::string(spelling->key));
  if (!value.is_array() || value.size() != 2) {
    wrong_type(at(spelling->key), "an array of two numbers", value);
    return std::nullopt;
  }
  const auto first = number(value[0], child(at(spelling->key), 0), *spelling, bounds);
  const auto second = number(value[1], child(at(spelling->key), 1), *spelling, bounds);
  if (!first || !second) return std::nullopt;
  return std::pair{*first, *second};
}

void ObjectReader::leave(std::string_view key) {
  known_.push_back(key);
}

void ObjectReader::explain(std::string_view key, std::string message) {
  if (!has(key)) return;
  reported_.emplace_back(key);
  problems_.add({at(key), std::move(message), "", "", "Remove the key"});
}

void ObjectReader::finish() {
  if (object_ == nullptr) return;
  for (const auto& [key, value] : object_->items())
    if (!contains(known_, key) &&
        std::find(reported_.begin(), reported_.end(), key) == reported_.end())
      report_unknown(key);
}

bool ObjectReader::has(std::string_view key) const {
  return object_ != nullptr && object_->contains(std::string(key));
}

bool ObjectReader::is_false(std::string_view key) const {
  return has(key) && object_->at(std::string(key)) == false;
}

std::string ObjectReader::at(const Quantity& quantity) const {
  for (const Spelling& spelling : quantity.spellings)
    if (has(spelling.key)) return at(spelling.key);
  return at(quantity.spellings.front().key);
}

const json* ObjectReader::find(std::string_view key, Need need) {
  known_.push_back(key);
  if (object_ == nullptr) return nullptr;
  const auto found = object_->find(std::string(key));
  if (found != object_->end()) return &*found;
  if (need == Need::required)
    problems_.add({pointer_, "key " + std::string(key) + " missing", std::string(key), "", ""});
  return nullptr;
}

const json* ObjectReader::typed(std::string_view key, Need need, bool array) {
  const json* value = find(key, need);
  if (value == nullptr) return nullptr;
  if (array ? value->is_array() : value->is_object()) return value;
  wrong_type(at(key), array ? "an array" : "an object", *value);
  return nullptr;
}

/// The one spelling that the text uses; null if none or several. Adds a finding where one is due.
const Spelling* ObjectReader::spelling_used(const Quantity& quantity, Need need) {
  const Spelling* used = nullptr;
  std::size_t count = 0;
  for (const Spelling& spelling : quantity.spellings) {
    known_.push_back(spelling.key);
    if (!has(spelling.key)) continue;
    used = &spelling;
    ++count;
  }
  const bool wrong_unit = report_wrong_units(quantity);
  if (count > 1)
    problems_.add({pointer_, "quantity given in two units", one_of(keys_of(quantity)), "",
                   "Keep one of them"});
  else if (count == 0 && need == Need::required && !wrong_unit && object_ != nullptr)
    problems_.add({pointer_, "key " + std::string(quantity.spellings.front().key) + " missing",
                   one_of(keys_of(quantity)), "", ""});
  return count == 1 ? used : nullptr;
}

/// Reports "speed" or "speed_cm_s" in the place of "speed_mm_s". True if any was found.
bool ObjectReader::report_wrong_units(const Quantity& quantity) {
  if (object_ == nullptr) return false;
  bool any = false;
  const std::vector<std::string_view> accepted = keys_of(quantity);
  for (const auto& [key, value] : object_->items()) {
    if (contains(accepted, key) || !is_wrong_unit_of(quantity.stem, key)) continue;
    any = true;
    reported_.push_back(key);
    problems_.add({at(key), "unit of the key not accepted", one_of(accepted), key,
                   "Did you mean " + std::string(accepted.front()) + "?"});
  }
  return any;
}

std::optional<double> ObjectReader::number(const json& value, const std::string& place,
                                           const Spelling& spelling, const Bounds& bounds) {
  if (!value.is_number()) {
    wrong_type(place, "a number", value);
    return std::nullopt;
  }
  const double si = value.get<double>() / spelling.per_si;
  if (std::isfinite(si) && si >= bounds.min && si <= bounds.max) return si;
  problems_.add({place, "number out of range", range_text(bounds, spelling), brief(value), ""});
  return std::nullopt;
}

void ObjectReader::wrong_type(std::string place, std::string expected, const json& got) {
  problems_.add(
      {std::move(place), "value has the wrong type", std::move(expected), brief(got), ""});
}

void ObjectReader::report_unknown(const std::string& key) {
  problems_.add({at(key), "key unknown", "", "",
                 did_you_mean(key, known_, "Known keys are " + one_of(known_))});
}

}  // namespace weft::recipes
