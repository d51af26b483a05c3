#include "recipes/schema/diagnostic.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "protocols/base/result.hpp"

namespace weft::recipes {
namespace {

constexpr std::size_t most_problems = 200;
constexpr std::size_t longest_quote = 64;

char upper(char c) {
  return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
}
char lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

/// Optimal string alignment distance, letter case ignored (Damerau 1964 without overlapping swaps).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  const auto same = [&](std::size_t i, std::size_t j) {
    return lower(a[i - 1]) == lower(b[j - 1]);
  };
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = d[i - 1][j - 1] + (same(i, j) ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replaced});
      if (i > 1 && j > 1 && same(i, j - 1) && same(i - 1, j))
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string to_string(const Diagnostic& diagnostic) {
  return to_string(Error{.code = Errc::invalid_argument,
                         .where = diagnostic.pointer,
                         .what = diagnostic.message,
                         .expected = diagnostic.expected,
                         .got = diagnostic.got,
                         .hint = diagnostic.hint});
}

void Problems::add(Diagnostic diagnostic) {
  if (!diagnostic.hint.empty()) diagnostic.hint[0] = upper(diagnostic.hint[0]);
  if (list_.size() < most_problems)
    list_.push_back(std::move(diagnostic));
  else
    ++left_out_;
}

std::vector<Diagnostic> Problems::take() {
  if (left_out_ > 0)
    list_.push_back({"", "and " + std::to_string(left_out_) + " more problems like these", "", "",
                     "mend the first ones and check again"});
  left_out_ = 0;
  return std::exchange(list_, {});
}

std::string child(std::string_view parent, std::size_t index) {
  return child(parent, std::to_string(index));
}

std::string clipped(std::string_view text) {
  if (text.size() <= longest_quote) return std::string(text);
  return std::string(text.substr(0, longest_quote)) + "...";
}

std::string_view closest(std::string_view word, const std::vector<std::string_view>& candidates) {
  const std::string_view start = word.substr(0, longest_quote);
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, start.size() / 3) + 1;
  for (const std::string_view candidate : candidates) {
    const std::size_t distance = edit_distance(start, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string one_of(const std::vector<std::string_view>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace weft::recipes
