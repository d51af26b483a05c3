#include "daemon/storage/imprints/number_lines.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace weft::daemon {
namespace {

constexpr std::string_view gaps = " \t\r";

std::string_view without_gaps(std::string_view text) {
  const std::size_t first = text.find_first_not_of(gaps);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(gaps) - first + 1);
}

}  // namespace

bool NumberLines::next() {
  while (at_ < text_.size()) {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    broken_off_ = end == text_.size();
    const std::string_view line = without_gaps(text_.substr(at_, end - at_));
    at_ = end + 1;
    ++line_;
    if (line.empty() || line.front() == '#') continue;
    split(line);
    return true;
  }
  return false;
}

Status NumberLines::check_end() const {
  if (!broken_off_) return {};
  return fail({.code = Errc::parse,
               .where = where(),
               .what = "the last line has no line break: the file may be cut short",
               .expected = "a line break at the end",
               .hint = "Add a newline if the file is whole"});
}

void NumberLines::split(std::string_view line) {
  fields_.clear();
  const bool commas = line.find(',') != std::string_view::npos;
  while (!line.empty()) {
    const std::size_t end =
        std::min(commas ? line.find(',') : line.find_first_of(gaps), line.size());
    fields_.push_back(without_gaps(line.substr(0, end)));
    if (commas && end + 1 == line.size()) fields_.emplace_back();  // a comma at the end
    line = end < line.size() ? line.substr(end + 1) : std::string_view{};
    if (!commas) line = without_gaps(line);
  }
}

std::optional<double> NumberLines::value(std::size_t at) const {
  if (at >= fields_.size()) return std::nullopt;
  const std::string_view text = fields_[at];
  double out = 0.0;
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error != std::errc() || stopped != text.data() + text.size() || !std::isfinite(out))
    return std::nullopt;
  return out;
}

bool NumberLines::is_number(std::size_t at) const {
  return value(at).has_value();
}

Result<double> NumberLines::number(std::size_t at) const {
  if (const auto out = value(at)) return *out;
  return fail({.code = Errc::parse,
               .where = where(),
               .what = "no finite number in field " + std::to_string(at + 1),
               .expected = "a finite number",
               .got = at < fields_.size() ? "'" + std::string(fields_[at].substr(0, 40)) + "'"
                                          : "nothing"});
}

}  // namespace weft::daemon
