#include "drivers/api/config.hpp"
#include "protocols/base/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

namespace weft {
namespace {

std::string range_text(NumberRange range) {
  return nlohmann::json(range.low).dump() + " to " + nlohmann::json(range.high).dump();
}

// Levenshtein distance, computed row by row.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({change, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

struct ConfigReader::Document {
  nlohmann::json object;
};

ConfigReader::ConfigReader(std::string_view json) : document_(std::make_unique<Document>()) {
  Result<nlohmann::json> parsed = parse_json(json);
  if (parsed && parsed->is_object()) {
    document_->object = std::move(*parsed);
    return;
  }
  document_->object = nlohmann::json::object();
  problem_ = {.code = Errc::parse,
              .what = "configuration is not a JSON object",
              .expected = "{\"key\": value, ...}"};
  if (!parsed) problem_ = parsed.error();
}

ConfigReader::~ConfigReader() = default;

const nlohmann::json* ConfigReader::find(std::string_view key) {
  known_.emplace_back(key);
  const auto at = document_->object.find(key);
  return at == document_->object.end() ? nullptr : &*at;
}

void ConfigReader::note(Errc code, std::string_view key, std::string message, std::string expected,
                        std::string got) {
  if (problem_) return;
  problem_ = {.code = code,
              .where = "/" + std::string(key),
              .what = std::move(message),
              .expected = std::move(expected),
              .got = std::move(got)};
}

void ConfigReader::refuse(std::string_view key, std::string message, std::string expected,
                          std::string got) {
  note(Errc::range, key, std::move(message), std::move(expected), std::move(got));
}

double ConfigReader::number(std::string_view key, double fallback, NumberRange range) {
  const nlohmann::json* value = find(key);
  if (value == nullptr) return fallback;
  if (!value->is_number()) {
    note(Errc::invalid_argument, key, "value has the wrong type", "a number, " + range_text(range),
         value->type_name());
    return fallback;
  }
  const double x = value->get<double>();
  if (x >= range.low && x <= range.high) return x;
  refuse(key, "value out of range", range_text(range), value->dump());
  return fallback;
}

std::int64_t ConfigReader::integer(std::string_view key, std::int64_t fallback, NumberRange range) {
  const double x = number(key, static_cast<double>(fallback), range);
  if (x != std::floor(x))
    refuse(key, "value not a whole number", range_text(range), std::to_string(x));
  return static_cast<std::int64_t>(x);
}

bool ConfigReader::flag(std::string_view key, bool fallback) {
  const nlohmann::json* value = find(key);
  if (value == nullptr) return fallback;
  if (value->is_boolean()) return value->get<bool>();
  note(Errc::invalid_argument, key, "value has the wrong type", "true or false",
       value->type_name());
  return fallback;
}

std::string ConfigReader::choice(std::string_view key, std::string_view fallback,
                                 const std::vector<std::string_view>& choices) {
  const nlohmann::json* value = find(key);
  if (value == nullptr) return std::string(fallback);
  if (value->is_string()) {
    const auto& text = value->get_ref<const std::string&>();
    if (std::find(choices.begin(), choices.end(), text) != choices.end()) return text;
  }
  std::string expected;
  for (const std::string_view c : choices)
    expected += (expected.empty() ? "" : ", ") + std::string(c);
  note(Errc::invalid_argument, key, "value not one of the choices", expected,
       value->is_string() ? value->get<std::string>() : value->type_name());
  return std::string(fallback);
}

std::string ConfigReader::text(std::string_view key, std::string_view fallback,
                               std::size_t longest) {
  const nlohmann::json* value = find(key);
  if (value == nullptr) return std::string(fallback);
  if (value->is_string() && value->get_ref<const std::string&>().size() <= longest)
    return value->get<std::string>();
  note(Errc::invalid_argument, key, "value has the wrong type or length",
       "a text of at most " + std::to_string(longest) + " bytes", value->type_name());
  return std::string(fallback);
}

std::vector<double> ConfigReader::numbers(std::string_view key, std::vector<double> fallback,
                                          NumberRange range) {
  const nlohmann::json* value = find(key);
  if (value == nullptr) return fallback;
  const std::string expected =
      std::to_string(fallback.size()) + " numbers, each " + range_text(range);
  if (!value->is_array() || value->size() != fallback.size()) {
    note(Errc::invalid_argument, key, "list missing or of the wrong length", expected,
         value->is_array() ? std::to_string(value->size()) + " entries" : value->type_name());
    return fallback;
  }
  std::vector<double> out;
  for (const nlohmann::json& entry : *value) {
    if (!entry.is_number() || entry < range.low || entry > range.high) {
      refuse(key, "entry of the list out of range", expected,
             entry.is_number() ? entry.dump() : entry.type_name());
      return fallback;
    }
    out.push_back(entry.get<double>());
  }
  return out;
}

Status ConfigReader::finish() {
  if (problem_) return pass(*problem_);
  for (const auto& [key, value] : document_->object.items()) {
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    const std::string near = nearest_name(key, known_);
    return fail({.code = Errc::invalid_argument,
                 .where = "/" + key,
                 .what = "key unknown",
                 .hint = near.empty() ? std::string() : "Did you mean " + near + "?"});
  }
  return {};
}

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, name.size() / 2);
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance > best_distance || (distance == best_distance && !best.empty())) continue;
    best = candidate;
    best_distance = distance;
  }
  return best;
}

}  // namespace weft
