#pragma once
// Reads one JSON object whose keys are all known: absent keys keep their default, unknown keys,
// wrong types and values out of range are errors with a JSON pointer. The first error is kept.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// The failure `error` of a file at `where`, a JSON pointer.
tl::unexpected<Error> fail_at(std::string where, Error error);
/// The same with the code parse.
tl::unexpected<Error> parse_error(std::string where, Error error);

class FieldReader {
 public:
  /// `object` must outlive the reader; `pointer` is its place in the file ("/simulation").
  FieldReader(const nlohmann::json& object, std::string pointer);

  /// Sets `value` to the number at `key`, times `to_si`, when it is there. Bounds are in the file's
  /// unit.
  FieldReader& number(std::string_view key, double& value, double low, double high,
                      double to_si = 1);
  FieldReader& required(std::string_view key, double& value, double low, double high,
                        double to_si = 1);
  /// A whole number in the file's unit: decimals are cut off.
  template <class Whole>
  FieldReader& whole(std::string_view key, Whole& value, double low, double high) {
    auto read = static_cast<double>(value);
    number(key, read, low, high);
    value = static_cast<Whole>(read);
    return *this;
  }
  FieldReader& flag(std::string_view key, bool& value);
  FieldReader& text(std::string_view key, std::string& value);
  /// Two numbers, in the file's unit within the bounds, the first not above the second.
  FieldReader& interval(std::string_view key, double& first, double& second, double low,
                        double high, double to_si = 1);
  /// Like interval() without an order.
  FieldReader& pair(std::string_view key, double& first, double& second, double low, double high,
                    double to_si = 1);
  /// Numbers are [value, "estimated"] or [value, standing, id] with an id in `sources` and, where
  /// the standing is calibrated, bounded or not_seen, the interval [low, high] behind it.
  FieldReader& source_required(const nlohmann::json& sources);
  /// A key that somebody else reads.
  FieldReader& ignore(std::string_view key);
  /// The value at `key`, or nullptr when absent; counts as read.
  const nlohmann::json* child(std::string_view key);
  /// Keeps an error found by the caller, unless there is one already.
  void refuse(Error error);

  /// The first error, or the complaint about a key that nobody asked for.
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
