#include "daemon/base/text/bench_kind.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 3> kind_words{"unknown", "simulated", "real"};

}  // namespace

std::string_view to_string(BenchKind kind) {
  return kind_words.at(static_cast<std::size_t>(kind));
}

std::optional<BenchKind> bench_kind_from(std::string_view word) {
  const auto* at = std::ranges::find(kind_words, word);
  if (at == kind_words.end()) return std::nullopt;
  return static_cast<BenchKind>(at - kind_words.begin());
}

std::string_view bench_words(BenchKind kind) {
  switch (kind) {
    case BenchKind::simulated:
      return "SIMULATED";
    case BenchKind::real:
      return "REAL DATA";
    case BenchKind::unknown:
      return "ORIGIN UNKNOWN";
  }
  return "ORIGIN UNKNOWN";
}

}  // namespace weft::daemon
