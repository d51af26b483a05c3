#pragma once
// Reads one JSON object with known keys. Absent keys keep their default. Unknown keys, wrong types
// and values out of range are errors with a JSON pointer. Only the first error is kept.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// Fails with `error` for a file, at the JSON pointer `where`.
tl::unexpected<Error> fail_at(std::string where, Error error);
/// The same with the code parse.
tl::unexpected<Error> parse_error(std::string where, Error error);

class FieldReader {
 public:
  /// `object` must outlive the reader; `pointer` is its place in the file ("/simulation").
  FieldReader(const nlohmann::json& object, std::string pointer);

  /// If the key is present, sets `value` to the number at `key`, times `to_si`. Bounds are in the
  /// file's unit.
  FieldReader& number(std::string_view key, double& value, double low, double high,
                      double to_si = 1);
  FieldReader& required(std::string_view key, double& value, double low, double high,
                        double to_si = 1);
  /// A whole number in the file's unit; decimals are truncated.
  template <class Whole>
  FieldReader& whole(std::string_view key, Whole& value, double low, double high) {
    auto read = static_cast<double>(value);
    number(key, read, low, high);
    value = static_cast<Whole>(read);
    return *this;
  }
  FieldReader& flag(std::string_view key, bool& value);
  FieldReader& text(std::string_view key, std::string& value);
  /// Two numbers, in the file's unit within the bounds, the first at most the second.
  FieldReader& interval(std::string_view key, double& first, double& second, double low,
                        double high, double to_si = 1);
  /// Like interval() without an order.
  FieldReader& pair(std::string_view key, double& first, double& second, double low, double high,
                    double to_si = 1);
  /// Requires numbers as [value, "estimated"] or [value, standing, id] with an id in `sources`.
  /// With the standing calibrated, bounded or not_seen the interval [low, high] follows.
  FieldReader& source_required(const nlohmann::json& sources);
  /// Marks a key that another reader reads.
  FieldReader& ignore(std::string_view key);
  /// The value at `key`, or nullptr when absent; the key counts as read.
  const nlohmann::json* child(std::string_view key);
  /// Keeps an error of the caller, unless there is one already.
  void refuse(Error error);

  /// The first error, or the error about an unknown key.
  [[nodiscard]] Status finish() const;

 private:
  void complain(std::string_view key, Error error);
  std::optional<double> finite(const nlohmann::json& value, std::string_view key, double low,
                               double high);
  const nlohmann::json* find_source(const nlohmann::json& value, std::string_view key);
  [[nodiscard]] std::string at(std::string_view key) const;

  const nlohmann::json& object_;
  std::string pointer_;
  const nlohmann::json* sources_ = nullptr;
  std::vector<std::string> known_;
  std::optional<Error> error_;
};

}  // namespace weft::sim
