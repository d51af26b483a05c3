// The section of a report about the cost of the plant's fidelity.

#include "daemon/analysis/tradeoff/sim/sim_page.hpp"

#include <catch2/catch.hpp>

namespace fidelity_section_test {

using namespace weft;
using namespace weft::daemon;

namespace {

sim::MeasuredSetting measured(double step_s, double error_n, double speed) {
  return {.setting = {sim::Level::quasistatic, sim::Integrator::midpoint, step_s},
          .contact_us_per_s = 1e6 / speed,
          .cloths = {{"denim", 1, error_n / 9, error_n / 3, error_n}}};
}

}  // namespace

TEST_CASE("the front of the table's settings and the setting in use are shown") {
  // 2 ms is both slower and worse than 1 ms.
  sim::FidelityTable table;
  table.settings = {measured(4e-3, 0.02, 4000), measured(2e-3, 0.01, 1000),
                    measured(1e-3, 0.005, 2000)};
  const auto section = fidelity_section(table, "L1 2 ms");
  REQUIRE(section);
  CHECK(render(*section).find("SIMULATED") != std::string::npos);
  CHECK(render(*section).find("L1 2 ms, this campaign") != std::string::npos);
  CHECK(render(*section).find("<th>L1 4 ms") != std::string::npos);
  const auto other = fidelity_section(table, "L1 4 ms");
  REQUIRE(other);
  CHECK(render(*other).find("L1 2 ms") == std::string::npos);  // neither used nor on the front
}

TEST_CASE("a table without a setting gives no section") {
  const auto none = fidelity_section({}, "L1 1 ms");
  REQUIRE(none);
  CHECK(none->empty());
}

}  // namespace fidelity_section_test
