#pragma once
// Counts are doubles in memory because some sources scale them; on disk they are 16 bit where
// exact.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace weft::daemon {

/// The same values as 16-bit counts, or nothing when one of them is not a whole number from 0 to
/// 65535.
std::optional<std::vector<std::uint16_t>> as_u16(std::span<const double> counts);

}  // namespace weft::daemon
