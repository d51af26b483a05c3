#include "classifier/base/line_io.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "protocols/base/bytes.hpp"

namespace weft::classifier {
namespace {

template <class Number>
void append(std::string& out, Number value) {
  std::array<char, 32> digits{};  // the longest double needs 24
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  out.append(digits.data(), end);
}

std::string shortest(double value) {
  std::string out;
  append(out, value);
  return out;
}

template <class Number>
void append_line(std::string& out, std::string_view keyword, std::span<const Number> values) {
  out += keyword;
  for (const Number value : values) {
    out += ' ';
    append(out, value);
  }
  out += '\n';
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\\\";
    } else if (c == '\n') {
      out += "\\n";
    } else {
      out += c;
    }
  }
  return out;
}

std::string unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\' || i + 1 == text.size()) {
      out += text[i];
    } else {
      ++i;
      out += text[i] == 'n' ? '\n' : text[i];
    }
  }
  return out;
}

}  // namespace

void LineWriter::text(std::string_view keyword, std::string_view text) {
  out_ += keyword;
  out_ += ' ';
  out_ += escaped(text);
  out_ += '\n';
}

void LineWriter::numbers(std::string_view keyword, std::span<const double> values) {
  append_line(out_, keyword, values);
}

void LineWriter::counts(std::string_view keyword, std::span<const std::size_t> values) {
  append_line(out_, keyword, values);
}

void LineReader::refuse(std::string message, std::string expected, std::string got) {
  if (!ok()) return;
  status_ = fail({.code = Errc::corrupt,
                  .where = "line " + std::to_string(line_),
                  .what = std::move(message),
                  .expected = std::move(expected),
                  .got = std::move(got)});
}

std::string_view LineReader::values_of(std::string_view keyword) {
  if (!ok()) return {};
  ++line_;
  const std::size_t end = rest_.find('\n');
  const std::string_view line = rest_.substr(0, end);
  const std::size_t gap = std::min(line.find(' '), line.size());
  if (end == std::string_view::npos || line.substr(0, gap) != keyword) {
    refuse("unexpected line", std::string(keyword), std::string(line.substr(0, 40)));
    return {};
  }
  rest_.remove_prefix(end + 1);
  return line.substr(std::min(gap + 1, line.size()));
}

template <class Number>
std::vector<Number> LineReader::list(std::string_view keyword, std::size_t count) {
  std::string_view values = values_of(keyword);
  std::vector<Number> out;
  while (!values.empty()) {
    const std::string_view word = values.substr(0, values.find(' '));
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size()) {
      refuse("value is not a number", "numbers after " + std::string(keyword),
             std::string(word.substr(0, 40)));
      return {};
    }
    out.push_back(value);
    values.remove_prefix(std::min(word.size() + 1, values.size()));
  }
  if (out.size() != count) {
    refuse("wrong number of values for " + std::string(keyword), std::to_string(count),
           std::to_string(out.size()));
    return {};
  }
  return out;
}

std::string LineReader::text(std::string_view keyword) {
  return unescaped(values_of(keyword));
}

std::vector<double> LineReader::numbers(std::string_view keyword, std::size_t count,
                                        bool infinite) {
  std::vector<double> out = list<double>(keyword, count);
  const auto bad = std::find_if_not(out.begin(), out.end(), [infinite](double v) {
    return infinite ? !std::isnan(v) : std::isfinite(v);
  });
  if (bad == out.end()) return out;
  refuse("value is not finite", "finite numbers after " + std::string(keyword), shortest(*bad));
  return {};
}

double LineReader::number(std::string_view keyword) {
  const std::vector<double> out = numbers(keyword, 1);
  return out.empty() ? 0.0 : out.front();
}

std::vector<double> LineReader::positives(std::string_view keyword, std::size_t count) {
  std::vector<double> out = numbers(keyword, count);
  const auto bad = std::find_if_not(out.begin(), out.end(), [](double v) { return v > 0.0; });
  if (bad != out.end())
    refuse(std::string(keyword) + " is not positive", "above 0", shortest(*bad));
  return out;
}

double LineReader::positive(std::string_view keyword) {
  const std::vector<double> out = positives(keyword, 1);
  return out.empty() ? 0.0 : out.front();
}

double LineReader::not_negative(std::string_view keyword) {
  const double out = number(keyword);
  if (out < 0.0) refuse(std::string(keyword) + " is negative", "0 or more", shortest(out));
  return out;
}

std::vector<std::size_t> LineReader::counts(std::string_view keyword, std::size_t count) {
  return list<std::size_t>(keyword, count);
}

std::size_t LineReader::count(std::string_view keyword, std::size_t least, std::size_t most) {
  const std::vector<std::size_t> out = counts(keyword, 1);
  if (out.empty()) return 0;
  if (out.front() >= least && out.front() <= most) return out.front();
  refuse(std::string(keyword) + " out of range",
         std::to_string(least) + " to " + std::to_string(most), std::to_string(out.front()));
  return 0;
}

void LineReader::within(std::span<const std::size_t> positions, std::size_t size,
                        std::string_view what) {
  const auto beyond =
      std::find_if(positions.begin(), positions.end(), [=](std::size_t p) { return p >= size; });
  if (beyond != positions.end())
    refuse(std::string(what) + " number out of range", "less than " + std::to_string(size),
           std::to_string(*beyond));
}

void LineReader::finish() {
  if (!rest_.empty())
    refuse("text after the last line", "end of file", std::string(rest_.substr(0, 40)));
}

std::string checksum_line(std::string_view keyword, std::string_view before,
                          std::string_view more) {
  std::uint32_t crc = 0;
  for (const std::string_view part : {before, more})
    crc = crc32({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()}, crc);
  std::array<char, 8> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + 8, crc, 16).ptr;
  const std::string hex(digits.data(), end);
  return std::string(keyword) + std::string(8 - hex.size(), '0') + hex + "\n";
}

std::string with_checksum(std::string_view header, std::string_view body) {
  const std::string whole = std::string(header) + "\n" + std::string(body);
  return whole + checksum_line(checksum_keyword, whole);
}

Result<std::string_view> check_checksum(std::string_view text) {
  constexpr std::size_t line_bytes = checksum_keyword.size() + 8 + 1;
  const std::string_view trailer =
      text.substr(text.size() < line_bytes ? 0 : text.size() - line_bytes);
  const std::string_view before = text.substr(0, text.size() - trailer.size());
  if (!before.ends_with('\n') || !trailer.starts_with(checksum_keyword) || trailer.back() != '\n')
    return fail({.code = Errc::corrupt,
                 .what = "model file incomplete",
                 .expected = "a checksum on the last line"});
  if (trailer == checksum_line(checksum_keyword, before)) return before;
  return fail({.code = Errc::corrupt, .what = "model file altered: wrong checksum"});
}

Status check_line_ends(std::string_view beginning) {
  if (!beginning.substr(0, beginning.find('\n')).ends_with('\r')) return {};
  return fail(
      {.code = Errc::corrupt,
       .what = "line ends of the model file changed",
       .expected = "line feed",
       .got = "carriage return and line feed",
       .hint = "Copy the model file again in binary mode (scp, git with -text, ftp binary)"});
}

}  // namespace weft::classifier
