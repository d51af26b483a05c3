#include "daemon/storage/dataset/counts.hpp"

#include <bit>

namespace weft::daemon {

std::optional<std::vector<std::uint16_t>> as_u16(std::span<const double> counts) {
  std::vector<std::uint16_t> whole;
  whole.reserve(counts.size());
  for (const double count : counts) {
    if (!(count >= 0.0 && count <= 65535.0)) return std::nullopt;
    const auto rounded = static_cast<std::uint16_t>(count);
    // By bits, because -0.0 equals 0 and would not come back.
    if (std::bit_cast<std::uint64_t>(static_cast<double>(rounded)) !=
        std::bit_cast<std::uint64_t>(count))
      return std::nullopt;
    whole.push_back(rounded);
  }
  return whole;
}

}  // namespace weft::daemon
