#include "recipes/schema/diagnostic.hpp"

#include <utility>

#include "protocols/base/result.hpp"

namespace weft::recipes {
namespace {

constexpr std::size_t most_problems = 200;
constexpr std::size_t longest_quote = 64;

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
  if (list_.size() < most_problems)
    list_.push_back(std::move(diagnostic));
  else
    ++left_out_;
}

std::vector<Diagnostic> Problems::take() {
  if (left_out_ > 0)
    list_.push_back({"", std::to_string(left_out_) + " more problems, not listed", "", "",
                     "Correct the listed ones, then check again"});
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

std::string one_of(const std::vector<std::string_view>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace weft::recipes
