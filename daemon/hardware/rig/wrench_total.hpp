#pragma once
// Sum of the readings of a force/torque sensor that came between two scan cycles: a sensor is often
// faster than the cycle, and noise falls with the root of what is averaged. Each cycle begins anew,
// so that nothing bad outlives it.

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/api/sample.hpp"

namespace weft::daemon {

struct WrenchTotal {
  std::uint64_t readings = 0;
  std::array<double, 3> force_n{};    ///< [N], as in WrenchSample
  std::array<double, 3> torque_nm{};  ///< [N m]

  void add(const WrenchSample& reading) { add({1, reading.force_n, reading.torque_nm}); }
  void add(const WrenchTotal& more) {
    readings += more.readings;
    for (std::size_t i = 0; i < 3; ++i) {
      force_n[i] += more.force_n[i];
      torque_nm[i] += more.torque_nm[i];
    }
  }
  /// Not a number where there are no readings.
  [[nodiscard]] WrenchSample mean() const {
    WrenchSample mean;
    const auto n = static_cast<double>(readings);
    for (std::size_t i = 0; i < 3; ++i) {
      mean.force_n[i] = force_n[i] / n;
      mean.torque_nm[i] = torque_nm[i] / n;
    }
    return mean;
  }
};

}  // namespace weft::daemon
