#pragma once
// Typed reading of one JSON object. Every finding is collected with its pointer. finish() reports
// the keys that no call has asked for.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/json_text.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

/// Calls weft::read_json() and adds its findings to `problems`. True when there was none.
bool parse_json(std::string_view text, const JsonBounds& bounds, nlohmann::json& document,
                Problems& problems);

/// One accepted spelling of a quantity: the key with its unit, and the number of such units in one
/// SI unit. Dividing by it (not multiplying by 1e-3) makes 0.7 mm the same double as 0.0007 m.
struct Spelling {
  std::string_view key;
  double per_si = 1;
};

/// The accepted keys of one quantity: "speed_mm_s" or "speed_mps", but not both.
struct Quantity {
  std::string_view
      stem;  ///< "speed": a key that starts with it but ends otherwise has a wrong unit
  std::vector<Spelling> spellings;
};

/// Bounds in SI units, both included.
struct Bounds {
  double min = -std::numeric_limits<double>::max();
  double max = std::numeric_limits<double>::max();
  std::string_view why;  ///< "the rig's limit"; appended to the message when a bound is exceeded
};

enum class Need { required, optional };

class ObjectReader {
 public:
  /// Reports a value that is not an object. Every later call then finds nothing and reports
  /// nothing.
  ObjectReader(const nlohmann::json& value, std::string pointer, Problems& problems);

  /// The value in SI units.
  std::optional<double> quantity(const Quantity& quantity, const Bounds& bounds,
                                 Need need = Need::required);
  /// Stores the value in `target`; without a value `target` does not change.
  void set(double& target, const Quantity& quantity, const Bounds& bounds,
           Need need = Need::optional) {
    target = this->quantity(quantity, bounds, need).value_or(target);
  }
  std::optional<std::int64_t> integer(std::string_view key, std::int64_t min, std::int64_t max,
                                      Need need = Need::required);
  std::optional<bool> flag(std::string_view key, Need need = Need::required);
  std::optional<std::string> text(std::string_view key, Need need = Need::required);
  /// A name that is_name() accepts.
  std::optional<std::string> name(std::string_view key, Need need = Need::required);
  /// The index of the word in `words`.
  std::optional<std::size_t> choice(std::string_view key,
                                    const std::vector<std::string_view>& words,
                                    Need need = Need::required);
  /// The member of any type; null when absent (a finding when it is required).
  const nlohmann::json* array(std::string_view key, Need need = Need::required);
  const nlohmann::json* object(std::string_view key, Need need = Need::required);
  /// A reader of an optional member that is an object; nullopt when it is absent.
  std::optional<ObjectReader> section(std::string_view key);
  /// Two numbers of one unit, as in "travel_mm": [0, 150]; each within bounds.
  std::optional<std::pair<double, double>> pair(const Quantity& quantity, const Bounds& bounds,
                                                Need need = Need::required);
  /// Marks a key that another reader reads.
  void leave(std::string_view key);
  /// Reports a key that a person might expect to be valid here; `message` is the reason.
  void explain(std::string_view key, std::string message);

  /// Reports every key that no call has asked for.
  void finish();

  [[nodiscard]] const std::string& pointer() const { return pointer_; }
  [[nodiscard]] std::string at(std::string_view key) const { return child(pointer_, key); }
  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] bool is_false(std::string_view key) const;
  /// The pointer of the spelling that the text uses, or of the first one.
  [[nodiscard]] std::string at(const Quantity& quantity) const;

 private:
  const nlohmann::json* find(std::string_view key, Need need);
  const nlohmann::json* typed(std::string_view key, Need need, bool array);
  const Spelling* spelling_used(const Quantity& quantity, Need need);
  bool report_wrong_units(const Quantity& quantity);
  std::optional<double> number(const nlohmann::json& value, const std::string& place,
                               const Spelling& spelling, const Bounds& bounds);
  void wrong_type(std::string place, std::string expected, const nlohmann::json& got);
  void report_unknown(const std::string& key);

  const nlohmann::json* object_ = nullptr;  ///< null when the value is not an object
  std::string pointer_;
  Problems& problems_;
  std::vector<std::string_view> known_;  ///< keys that a call has asked for
  std::vector<std::string> reported_;    ///< keys that already have a finding
};

/// The rule of is_name(), for "expected".
inline constexpr std::string_view name_rule =
    "1 to 64 letters, digits, '_', '-' or '.', the first a letter, a digit or '_'";
/// Whether `text` can be used as the name of a file and as an argument of a command. It must not be
/// a path, a hidden file or an option.
bool is_name(std::string_view text, std::size_t most = 64);

/// "0.5 to 10, the rig's limit": bounds in the unit of the spelling, for "expected".
std::string range_text(const Bounds& bounds, const Spelling& spelling);

/// A short form of any value, for "got".
std::string brief(const nlohmann::json& value);

}  // namespace weft::recipes
