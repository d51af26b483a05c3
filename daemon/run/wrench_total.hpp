#pragma once
// Sums over the readings of a force/torque sensor, so that whoever looks now and then loses none: a
// sensor is often faster than the scan cycle, and noise falls with the root of what is averaged.

#include <array>
#include <cstdint>

#include "drivers/api/sample.hpp"

namespace weft::daemon {

/// Only ever grows. Doubles hold a day of 7000 readings a second to 1e-7 N.
struct WrenchTotal {
  std::uint64_t readings = 0;
  std::array<double, 3> force_n{};    ///< [N], as in WrenchSample
  std::array<double, 3> torque_nm{};  ///< [N m]

  void add(const WrenchSample& reading) {
    ++readings;
    for (std::size_t i = 0; i < 3; ++i) {
      force_n[i] += reading.force_n[i];
      torque_nm[i] += reading.torque_nm[i];
    }
  }
  /// Mean of what came after `before`, an earlier total; zero where nothing came.
  [[nodiscard]] WrenchSample mean_since(const WrenchTotal& before) const {
    WrenchSample mean;
    if (readings == before.readings) return mean;
    const auto n = static_cast<double>(readings - before.readings);
    for (std::size_t i = 0; i < 3; ++i) {
      mean.force_n[i] = (force_n[i] - before.force_n[i]) / n;
      mean.torque_nm[i] = (torque_nm[i] - before.torque_nm[i]) / n;
    }
    return mean;
  }
};

}  // namespace weft::daemon
