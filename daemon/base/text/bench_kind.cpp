#include "daemon/base/text/bench_kind.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 3> kind_names{"unknown", "simulated", "real"};

}  // namespace

std::string_view to_string(BenchKind kind) {
  return kind_names.at(static_cast<std::size_t>(kind));
}

std::optional<BenchKind> bench_kind_from(std::string_view word) {
  const auto* at = std::ranges::find(kind_names, word);
  if (at == kind_names.end()) return std::nullopt;
  return static_cast<BenchKind>(at - kind_names.begin());
}

std::string_view bench_text(BenchKind kind) {
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
