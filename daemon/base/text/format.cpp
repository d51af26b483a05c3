#include "daemon/base/text/format.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sstream>

namespace weft::daemon {
namespace {

constexpr std::size_t line_width = 80;
constexpr std::string_view replacement = "\uFFFD";

std::string_view entity(char c) {
  constexpr std::string_view special = "&<>\"'";
  constexpr std::array<std::string_view, 5> entities{"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  const std::size_t at = special.find(c);
  return at == std::string_view::npos ? std::string_view{} : entities[at];
}

bool is_control(char c) {
  const auto byte = static_cast<std::uint8_t>(c);
  return (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7F;
}

std::string unit_pair(double whole, const char* big, double rest, const char* small) {
  std::string out = fixed(whole, 0) + " " + big;
  if (rest >= 0.5) out += " " + fixed(rest, 0) + " " + small;
  return out;
}

// Mantissa in [1, 10) with two digits, and exponent.
struct Decimal {
  double mantissa;
  int exponent;
};

Decimal decimal_from_log(double natural_log) {
  const double log10 = natural_log / std::log(10.0);
  int exponent = static_cast<int>(std::floor(log10));
  double mantissa = std::round(std::pow(10.0, log10 - exponent) * 10) / 10;
  if (mantissa >= 10) {
    mantissa /= 10;
    ++exponent;
  }
  return {mantissa, exponent};
}

constexpr std::array<std::string_view, 3> kind_names{"unknown", "simulated", "real"};
constexpr std::array<std::string_view, 3> kind_texts{"ORIGIN UNKNOWN", "SIMULATED", "REAL DATA"};
static_assert(kind_names.size() == static_cast<std::size_t>(BenchKind::real) + 1);
static_assert(kind_texts.size() == static_cast<std::size_t>(BenchKind::real) + 1);

}  // namespace

std::string lower_case(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

std::string shortened(std::string_view text) {
  constexpr std::size_t enough = 40;
  return text.size() <= enough ? std::string(text) : std::string(text.substr(0, enough)) + "...";
}

std::string_view trimmed(std::string_view text, std::string_view blanks) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string escape(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const std::string_view named = entity(text.front());
    if (length == 0 || is_control(text.front()))
      out += replacement;
    else
      out += named.empty() ? text.substr(0, length) : named;
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string methods_text(const std::vector<std::pair<std::string, std::string>>& figures) {
  std::vector<std::string> methods;
  for (const auto& [name, method] : figures)
    if (std::ranges::find(methods, method) == methods.end()) methods.push_back(method);
  if (methods.size() == 1) return methods.front();
  for (std::string& method : methods) {
    std::vector<std::string> names;
    for (const auto& [name, used] : figures)
      if (used == method) names.push_back(name);
    method += " (" + joined(names) + ")";
  }
  return joined(methods, "; ");
}

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value) || std::abs(value) > 1e15) return std::string(no_value);
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  const std::string out(text.data());
  return out.find_first_not_of("-0.") == std::string::npos && out[0] == '-' ? out.substr(1) : out;
}

std::string percent(double share, int decimals) {
  const double scale = std::pow(10.0, decimals);
  const double value = std::round(share * 100 * scale) / scale;
  const bool rounded_up = value >= 100 && share < 1;
  return fixed(rounded_up ? 100 - 1 / scale : value, decimals);
}

std::string thousands(std::size_t value) {
  std::string out = std::to_string(value);
  for (std::size_t i = out.size(); i > 3; i -= 3) out.insert(i - 3, ",");
  return out;
}

std::string utc_text(std::int64_t us) {
  using namespace std::chrono;
  const sys_time<milliseconds> at{floor<milliseconds>(microseconds(us))};
  const auto day = floor<days>(at);
  const year_month_day date{day};
  const hh_mm_ss time{at - day};
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02u %02d:%02d:%02d.%03d UTC",
                static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                static_cast<unsigned>(date.day()), static_cast<int>(time.hours().count()),
                static_cast<int>(time.minutes().count()), static_cast<int>(time.seconds().count()),
                static_cast<int>(time.subseconds().count()));
  return text.data();
}

std::string duration(double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) return std::string(no_value);
  if (seconds == 0) return "0 s";
  if (seconds < 1e-3) return fixed(seconds * 1e6, seconds < 1e-4 ? 1 : 0) + " \u00B5s";
  if (seconds < 0.1) return fixed(seconds * 1e3, seconds < 1e-2 ? 2 : 1) + " ms";
  if (seconds < 120) return fixed(seconds, seconds < 10 ? 2 : 1) + " s";
  const double minutes = std::floor(std::round(seconds) / 60);
  if (minutes < 60) return unit_pair(minutes, "min", std::round(seconds) - 60 * minutes, "s");
  const double hours = std::floor(std::round(seconds / 60) / 60);
  return unit_pair(hours, "h", std::round(seconds / 60) - 60 * hours, "min");
}

std::string coordinate(double value) {
  if (!std::isfinite(value)) return "0";
  std::string out = fixed(value, 2);
  if (out == no_value) return "0";
  while (out.back() == '0') out.pop_back();
  if (out.back() == '.') out.pop_back();
  return out;
}

std::string p_value_html(double natural_log) {
  if (!std::isfinite(natural_log)) return std::string(no_value);
  if (natural_log >= std::log(1e-3)) return fixed(std::exp(natural_log), 4);
  const Decimal d = decimal_from_log(natural_log);
  return fixed(d.mantissa, 1) + "&#8239;&#215;&#8239;10<sup>&#8722;" + std::to_string(-d.exponent) +
         "</sup>";
}

std::string significant(double value) {
  if (value == 0 || !std::isfinite(value)) return fixed(value, 0);
  const int power = static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-9));
  constexpr int most_decimals = 9;
  std::string out = fixed(value, std::clamp(2 - power, 0, most_decimals));
  if (out.find('.') != std::string::npos) {
    out.erase(out.find_last_not_of('0') + 1);
    if (out.back() == '.') out.pop_back();
  }
  return out;
}

std::string general(double value) {
  if (!std::isfinite(value)) return std::string(no_value);
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::string power_of_two_html(double value) {
  int exponent = 0;
  if (!std::isfinite(value) || std::frexp(value, &exponent) != 0.5) return general(value);
  const std::string sign = exponent < 1 ? "&#8722;" : "";
  return "2<sup>" + sign + std::to_string(std::abs(exponent - 1)) + "</sup>";
}

std::string wrapped(const std::string& text, const std::string& indent) {
  std::string out;
  std::string line = indent;
  std::istringstream words(text);
  for (std::string word; words >> word; line += word) {
    if (line.size() + 1 + word.size() > line_width) {
      out += line + "\n";
      line = indent;
    }
    if (line != indent) line += ' ';
  }
  return out + line + "\n";
}

std::string tick_text(double seconds) {
  if (seconds < 0.9999e-3) return general(seconds * 1e6) + " \u00B5s";
  if (seconds < 0.09999) return general(seconds * 1e3) + " ms";
  return general(seconds) + " s";
}

std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0) != 0x80) return 0;
  const bool overlong = (lead == 0xE0 && byte(1) < 0xA0) || (lead == 0xF0 && byte(1) < 0x90);
  const bool outside = (lead == 0xED && byte(1) > 0x9F) || (lead == 0xF4 && byte(1) > 0x8F);
  return overlong || outside ? 0 : length;
}

std::string as_utf8(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    out += length == 0 ? replacement : text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string_view to_string(BenchKind kind) {
  return kind_names.at(static_cast<std::size_t>(kind));
}

std::optional<BenchKind> bench_kind_from(std::string_view word) {
  return enum_named<BenchKind>(kind_names, word);
}

std::string_view bench_text(BenchKind kind) {
  return kind_texts.at(static_cast<std::size_t>(kind));
}

}  // namespace weft::daemon
