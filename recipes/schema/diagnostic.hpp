#pragma once
// Findings about a text that a person wrote. All are collected, each with its place and a hint.

#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/json_text.hpp"

namespace weft::recipes {

/// One finding.
struct Diagnostic {
  std::string pointer;  ///< RFC 6901, "" for the whole document
  std::string message;
  std::string expected;
  std::string got;
  std::string hint;
};

/// "/explorations/M1: message: got (expected X). Hint."
std::string to_string(const Diagnostic& diagnostic);

/// Collects findings. After a few hundred it only counts them, because no person reads more.
class Problems {
 public:
  /// Adds a finding; its hint is printed as written.
  void add(Diagnostic diagnostic);
  [[nodiscard]] bool empty() const { return list_.empty(); }
  /// The findings in order; if some were left out, the last one gives their number.
  [[nodiscard]] std::vector<Diagnostic> take();

 private:
  std::vector<Diagnostic> list_;
  std::size_t left_out_ = 0;
};

/// JSON pointer of a member or of an element.
using weft::child;
std::string child(std::string_view parent, std::size_t index);

/// Text from outside, cut to a length fit for a message.
std::string clipped(std::string_view text);

/// "a", "b" or "c".
std::string one_of(const std::vector<std::string_view>& words);

}  // namespace weft::recipes
