#pragma once
// The word for where samples come from, stored with every data set and shown on every page.

#include <cstdint>
#include <optional>
#include <string_view>

namespace weft::daemon {

/// Where the samples come from. Stored as a word in every file and part of the data set's digest,
/// so that a simulated set can never be passed off as a real one. The emulated bench is `simulated`
/// too: its physics is the plant's.
enum class BenchKind : std::uint8_t { unknown, simulated, real };
std::string_view to_string(BenchKind kind);
std::optional<BenchKind> bench_kind_from(std::string_view word);

/// "SIMULATED", "REAL DATA" or "ORIGIN UNKNOWN".
std::string_view bench_text(BenchKind kind);

}  // namespace weft::daemon
