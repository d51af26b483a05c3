#pragma once
// Text for readers: names of enumerators and bench kinds, UTF-8 and HTML, numbers, durations and
// dates. Never prints "nan" or "inf".

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace weft::daemon {

/// The enumerator with the name `word` in `names`; nothing for any other word.
template <class Enum, std::size_t count>
std::optional<Enum> enum_named(const std::array<std::string_view, count>& names,
                               std::string_view word) {
  const auto* at = std::ranges::find(names, word);
  if (at == names.end()) return std::nullopt;
  return static_cast<Enum>(at - names.begin());
}

/// Source of the samples. Stored as a word in every file and part of the data set's digest. A
/// simulated set can therefore never pass as a real one. An emulated bench is `simulated` too: its
/// physics is the plant's.
enum class BenchKind : std::uint8_t { unknown, simulated, real };
std::string_view to_string(BenchKind kind);
std::optional<BenchKind> bench_kind_from(std::string_view word);

/// "SIMULATED", "REAL DATA" or "ORIGIN UNKNOWN".
std::string_view bench_text(BenchKind kind);

/// An unusual finding that is no failure.
struct Warning {
  std::string code;  ///< for programs: "repeated_samples"
  std::string text;  ///< for people: a sentence, with its place
  friend bool operator==(const Warning&, const Warning&) = default;
};

// Checks and repairs text of unknown origin: UTF-8 (RFC 3629).

/// Bytes of the UTF-8 sequence at the start of `text`, which must not be empty; 0 if it is invalid.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);
/// `text` with U+FFFD in place of each byte that is not UTF-8.
std::string as_utf8(std::string_view text);

/// Shown in place of a value that does not exist.
inline constexpr std::string_view no_value = "\u2013";

/// & < > " ' as entities; control characters and invalid UTF-8 bytes as U+FFFD. The result is
/// well-formed in HTML and XML, whatever the source.
std::string escape(std::string_view text);

/// `text` without blanks at both ends; empty if there is nothing else.
std::string_view trimmed(std::string_view text, std::string_view blanks = " \t");

/// Changes ASCII letters only.
std::string lower_case(std::string_view text);
/// Shortened for messages, whatever the text contains: enough for a person to recognise it.
std::string shortened(std::string_view text);

/// "a, b, c".
template <class Words>
std::string joined(const Words& words, std::string_view between = ", ") {
  std::string out;
  for (const auto& word : words) (out.empty() ? out : out += between) += word;
  return out;
}

/// Computation methods of several values (name, method): the method alone if all agree, otherwise
/// "Student t (M1 pvalue, M1 pca); Wilson (M1 all)".
std::string methods_text(const std::vector<std::pair<std::string, std::string>>& figures);

/// `value` with `decimals` places; no_value if not finite.
std::string fixed(double value, int decimals);
/// Share as percent: 0.98765 and 1 place give "98.8". Never rounds a smaller share up to 100.
std::string percent(double share, int decimals = 1);
/// 12,345.
std::string thousands(std::size_t value);
/// "17 ms", "0.57 s", "4 min 10 s", "6 h 12 min".
std::string duration(double seconds);

/// "150 \u00B5s", "2 ms", "0.5 s": for the ticks of an axis.
std::string tick_text(double seconds);
/// "2026-11-26 06:29:25.123 UTC" from microseconds since 1970-01-01 UTC.
std::string utc_text(std::int64_t us);
/// Shortest text for an SVG attribute: two decimals, no trailing zeros. 0 if not finite.
std::string coordinate(double value);
/// A p-value for HTML, from its natural logarithm, because p-values underflow a double: "1.2 &#215;
/// 10<sup>&#8722;9</sup>"; a plain number from 1e-3 on.
std::string p_value_html(double natural_log);
/// Three significant digits at most, never as a power: "1013", "12.1", "0.01"; no_value if not
/// finite.
std::string significant(double value);
/// Up to four digits: "0.05", "1e-05", "2048".
std::string general(double value);
/// A power of two as "2<sup>&#8722;11</sup>", others as general().
std::string power_of_two_html(double value);
/// Wraps text for a terminal of 80 columns at blanks: every line starts with `indent` and ends with
/// a newline.
std::string wrapped(const std::string& text, const std::string& indent);

}  // namespace weft::daemon
