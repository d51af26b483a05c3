#pragma once
// Text for readers: names of enumerators and bench kinds, UTF-8 and HTML, numbers, durations and
// dates. Nothing here ever prints "nan" or "inf".

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

/// The enumerator whose name stands at its place in `names`; nothing for any other word.
template <class Enum, std::size_t count>
std::optional<Enum> enum_named(const std::array<std::string_view, count>& names,
                               std::string_view word) {
  const auto* at = std::ranges::find(names, word);
  if (at == names.end()) return std::nullopt;
  return static_cast<Enum>(at - names.begin());
}

/// Where the samples come from. Stored as a word in every file and part of the data set's digest,
/// so that a simulated set can never be passed off as a real one. The emulated bench is `simulated`
/// too: its physics is the plant's.
enum class BenchKind : std::uint8_t { unknown, simulated, real };
std::string_view to_string(BenchKind kind);
std::optional<BenchKind> bench_kind_from(std::string_view word);

/// "SIMULATED", "REAL DATA" or "ORIGIN UNKNOWN".
std::string_view bench_text(BenchKind kind);

/// Something odd that is no failure.
struct Warning {
  std::string code;  ///< for programs: "repeated_samples"
  std::string text;  ///< for people: a sentence, with its place
  friend bool operator==(const Warning&, const Warning&) = default;
};

// Text from outside: is it UTF-8 (RFC 3629)?

/// Bytes of the UTF-8 sequence at the start of `text`, which is not empty; 0 when it is not one.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);
/// With U+FFFD in place of each byte that is not UTF-8.
std::string as_utf8(std::string_view text);

/// Shown in place of a value that does not exist.
inline constexpr std::string_view no_value = "\u2013";

/// & < > " ' as entities; control characters and bytes that are not UTF-8 as U+FFFD, so that the
/// result is well-formed in HTML and XML wherever it came from.
std::string escape(std::string_view text);

/// Without blanks at both ends; empty where there is nothing else.
std::string_view trimmed(std::string_view text, std::string_view blanks = " \t");

/// ASCII letters alone; others stay.
std::string lower_case(std::string_view text);
/// For messages: what a person needs to recognise it, whatever somebody put into a file.
std::string shortened(std::string_view text);

/// "a, b, c".
template <class Words>
std::string joined(const Words& words, std::string_view between = ", ") {
  std::string out;
  for (const auto& word : words) (out.empty() ? out : out += between) += word;
  return out;
}

/// How each of several figures, (name, method), was computed: the method alone where all agree,
/// else "Student t (M1 pvalue, M1 pca); Wilson (M1 all)".
std::string methods_text(const std::vector<std::pair<std::string, std::string>>& figures);

/// With `decimals` places; no_value when not finite.
std::string fixed(double value, int decimals);
/// Share as percent: 0.98765 and 1 place give "98.8". Never rounds up to 100 what is less.
std::string percent(double share, int decimals = 1);
/// 12,345.
std::string thousands(std::size_t value);
/// "17 ms", "0.57 s", "4 min 10 s", "6 h 12 min".
std::string duration(double seconds);

/// "150 \u00B5s", "2 ms", "0.5 s": for the ticks of an axis.
std::string tick_text(double seconds);
/// "2026-11-26 06:29:25.123 UTC", of microseconds since 1970-01-01 UTC.
std::string utc_text(std::int64_t us);
/// Shortest text that an SVG attribute needs: two decimals, no trailing zeros. 0 when not finite.
std::string coordinate(double value);
/// For HTML, from the natural logarithm because p-values underflow a double:
/// "1.2 &#215; 10<sup>&#8722;9</sup>"; from 1e-3 on a plain number.
std::string p_value_html(double natural_log);
/// Three significant digits at most, never as a power: "1013", "12.1", "0.01"; no_value when not
/// finite.
std::string significant(double value);
/// Up to four digits: "0.05", "1e-05", "2048".
std::string general(double value);
/// A power of two as "2<sup>&#8722;11</sup>", others as general().
std::string power_of_two_html(double value);
/// For a terminal of 80 columns: broken at blanks, every line starts with `indent` and ends with a
/// newline.
std::string wrapped(const std::string& text, const std::string& indent);

}  // namespace weft::daemon
