#include "daemon/hardware/rig/bench.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace wrench_total_test {

using weft::WrenchSample;
using weft::daemon::WrenchTotal;

TEST_CASE("The mean of a cycle's readings is that of each component, however they were added up") {
  WrenchTotal first, second;
  first.add(WrenchSample{{1, 2, 3}, {0.1, 0.2, 0.3}});
  second.add(WrenchSample{{2, 4, 6}, {0.2, 0.4, 0.6}});
  second.add(WrenchSample{{6, 0, 0}, {0.6, 0, 0}});
  first.add(second);
  CHECK(first.readings == 3);
  const WrenchSample mean = first.mean();
  CHECK(mean.force_n == std::array<double, 3>{3, 2, 3});
  CHECK(mean.torque_nm[0] == Approx(0.3));
  CHECK(mean.torque_nm[1] == Approx(0.2));
}

TEST_CASE("No reading has no mean") {
  CHECK(std::isnan(WrenchTotal().mean().force_n[2]));
}

}  // namespace wrench_total_test
