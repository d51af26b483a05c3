#include "sim/plant/field_reader.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace weft::sim {

namespace {

std::string short_dump(const nlohmann::json& value) {
  std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  if (text.size() > 40) text = text.substr(0, 37) + "...";
  return text;
}

std::string plain(double value) {
  return nlohmann::json(value).dump();
}

}  // namespace

tl::unexpected<Error> fail_at(std::string where, Error error) {
  error.where = std::move(where);
  return fail(std::move(error));
}

tl::unexpected<Error> parse_error(std::string where, Error error) {
  error.code = Errc::parse;
  return fail_at(std::move(where), std::move(error));
}

FieldReader::FieldReader(const nlohmann::json& object, std::string pointer)
    : object_(object), pointer_(std::move(pointer)) {
  if (!object_.is_object())
    refuse(parse_error(pointer_, {.what = "value has the wrong type",
                                  .expected = "an object",
                                  .got = short_dump(object_)})
               .value());
}

std::string FieldReader::at(std::string_view key) const {
  return pointer_ + "/" + std::string(key);
}

void FieldReader::refuse(Error error) {
  if (!error_) error_ = std::move(error);
}

void FieldReader::complain(std::string_view key, Error error) {
  refuse(parse_error(at(key), std::move(error)).value());
}

const nlohmann::json* FieldReader::child(std::string_view key) {
  known_.emplace_back(key);
  if (!object_.is_object()) return nullptr;
  const auto found = object_.find(known_.back());
  return found == object_.end() ? nullptr : &*found;
}

FieldReader& FieldReader::ignore(std::string_view key) {
  child(key);
  return *this;
}

FieldReader& FieldReader::source_required(const nlohmann::json& sources) {
  sources_ = &sources;
  return *this;
}

/// The bare number of a value with its standing, or nullptr after an error.
const nlohmann::json* FieldReader::find_source(const nlohmann::json& value, std::string_view key) {
  if (sources_ == nullptr) return &value;
  const bool estimated = value.is_array() && value.size() == 2 && value[1] == "estimated";
  const bool named =
      value.is_array() && value.size() >= 3 && value[2].is_string() && sources_->contains(value[2]);
  const bool sourced = named && value.size() == 3 && value[1] == "sourced";
  const bool fitted = named && value.size() == 4 && value[3].is_array() && value[3].size() == 2 &&
                      (value[1] == "calibrated" || value[1] == "bounded" || value[1] == "not_seen");
  if (estimated || sourced || fitted) return &value[0];
  complain(key, {.what = "number without a valid standing",
                 .expected = "[value, \"estimated\"], [value, \"sourced\", a key of /sources] or "
                             "[value, \"calibrated\", a key of /calibrations, [low, high]]",
                 .got = short_dump(value)});
  return nullptr;
}

std::optional<double> FieldReader::finite(const nlohmann::json& value, std::string_view key,
                                          double low, double high) {
  const double number = value.is_number() ? value.get<double>() : NAN;
  if (number >= low && number <= high) return number;
  refuse({.code = value.is_number() ? Errc::range : Errc::parse,
          .where = at(key),
          .what = value.is_number() ? "number out of range" : "value has the wrong type",
          .expected = plain(low) + " to " + plain(high),
          .got = short_dump(value)});
  return std::nullopt;
}

FieldReader& FieldReader::number(std::string_view key, double& value, double low, double high,
                                 double to_si) {
  const nlohmann::json* found = child(key);
  if (found != nullptr) found = find_source(*found, key);
  if (found == nullptr) return *this;
  if (const auto read = finite(*found, key, low, high)) value = *read * to_si;
  return *this;
}

FieldReader& FieldReader::required(std::string_view key, double& value, double low, double high,
                                   double to_si) {
  if (object_.is_object() && !object_.contains(std::string(key)))
    complain(key, {.what = "key missing", .expected = plain(low) + " to " + plain(high)});
  return number(key, value, low, high, to_si);
}

FieldReader& FieldReader::flag(std::string_view key, bool& value) {
  const nlohmann::json* found = child(key);
  if (found == nullptr) return *this;
  if (found->is_boolean())
    value = found->get<bool>();
  else
    complain(key, {.what = "value has the wrong type",
                   .expected = "true or false",
                   .got = short_dump(*found)});
  return *this;
}

FieldReader& FieldReader::text(std::string_view key, std::string& value) {
  const nlohmann::json* found = child(key);
  if (found == nullptr) return *this;
  if (found->is_string())
    value = found->get<std::string>();
  else
    complain(key,
             {.what = "value has the wrong type", .expected = "a text", .got = short_dump(*found)});
  return *this;
}

FieldReader& FieldReader::pair(std::string_view key, double& first, double& second, double low,
                               double high, double to_si) {
  const nlohmann::json* found = child(key);
  if (found != nullptr) found = find_source(*found, key);
  if (found == nullptr) return *this;
  if (!found->is_array() || found->size() != 2) {
    complain(key,
             {.what = "value has the wrong type", .expected = "[a, b]", .got = short_dump(*found)});
    return *this;
  }
  const auto a = finite((*found)[0], key, low, high);
  const auto b = finite((*found)[1], key, low, high);
  if (a && b) {
    first = *a * to_si;
    second = *b * to_si;
  }
  return *this;
}

FieldReader& FieldReader::interval(std::string_view key, double& first, double& second, double low,
                                   double high, double to_si) {
  pair(key, first, second, low, high, to_si);
  if (first > second)
    refuse({.code = Errc::range,
            .where = at(key),
            .what = "interval ends before it begins",
            .expected = "low <= high",
            .got = plain(first / to_si) + " to " + plain(second / to_si)});
  return *this;
}

Status FieldReader::finish() const {
  if (error_) return tl::unexpected<Error>(*error_);
  for (const auto& [key, value] : object_.items())
    if (std::find(known_.begin(), known_.end(), key) == known_.end())
      return parse_error(at(key), {.what = "key unknown"});
  return {};
}

}  // namespace weft::sim
