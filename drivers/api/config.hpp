#pragma once
// Strict reader of a driver's configuration. Unknown keys, wrong types and values out of range are
// errors, each with its own sentence.

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft {

struct NumberRange {
  double low;
  double high;
};

/// Reads one flat JSON object. Each reader returns `fallback` if the key is missing or wrong.
/// finish(), called last, returns the first problem.
class ConfigReader {
 public:
  explicit ConfigReader(std::string_view json);
  ~ConfigReader();
  ConfigReader(const ConfigReader&) = delete;
  ConfigReader& operator=(const ConfigReader&) = delete;

  double number(std::string_view key, double fallback, NumberRange range);
  std::int64_t integer(std::string_view key, std::int64_t fallback, NumberRange range);
  bool flag(std::string_view key, bool fallback);
  std::string choice(std::string_view key, std::string_view fallback,
                     const std::vector<std::string_view>& choices);
  /// A text of at most `longest` bytes.
  std::string text(std::string_view key, std::string_view fallback, std::size_t longest = 64);
  /// An array of the same length as `fallback`, each number within `range`.
  std::vector<double> numbers(std::string_view key, std::vector<double> fallback,
                              NumberRange range);

  /// Adds a problem that only the caller can detect, at "/key".
  void refuse(std::string_view key, std::string message, std::string expected = {},
              std::string got = {});

  /// Returns the first problem. Unknown keys come last, with a suggested name. Errors: parse (not a
  /// JSON object), invalid_argument (key or type), range.
  Status finish();

 private:
  struct Document;
  /// The value of `key`, or nullptr if it is missing. Marks `key` as known.
  const nlohmann::json* find(std::string_view key);
  void note(Errc code, std::string_view key, std::string message, std::string expected,
            std::string got);

  std::unique_ptr<Document> document_;
  std::vector<std::string> known_;
  std::optional<Error> problem_;
};

/// The candidate with the smallest edit distance; empty if none is near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace weft
