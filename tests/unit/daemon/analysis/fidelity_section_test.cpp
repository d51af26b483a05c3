// The section of a report on what the plant's fidelity costs.

#include "daemon/analysis/tradeoff/sim/sim_page.hpp"

#include <catch2/catch.hpp>

namespace fidelity_section_test {

using namespace weft;
using namespace weft::daemon;

namespace {

sim::FidelityRow row(double step_s, double error_n, double speed, const char* scene = "fabrics17") {
  return {scene,
          {sim::Level::quasistatic, sim::Integrator::midpoint, step_s},
          error_n,
          error_n / 3,
          speed};
}

}  // namespace

TEST_CASE("the front of the table's campaign and the setting in use are told") {
  // 2 ms is both slower and worse than 1 ms.
  const sim::FidelityTable table{"weft trade sim",
                                 "a machine",
                                 "",
                                 {row(4e-3, 0.02, 4000), row(2e-3, 0.01, 1000),
                                  row(1e-3, 0.005, 2000), row(5e-4, 1e-9, 9e9, "press")}};
  const auto section = fidelity_section_html(table, "L1 2 ms");
  REQUIRE(section);
  CHECK(section->find("SIMULATED") != std::string::npos);
  CHECK(section->find("L1 2 ms, this campaign\u2019s") != std::string::npos);
  CHECK(section->find("<th>L1 4 ms") != std::string::npos);
  CHECK(section->find("L1 0.5 ms") == std::string::npos);  // of another scene
  const auto other = fidelity_section_html(table, "L1 4 ms");
  REQUIRE(other);
  CHECK(other->find("L1 2 ms") == std::string::npos);  // neither used nor on the front
}

TEST_CASE("a table without a campaign gives no section") {
  const auto none =
      fidelity_section_html({"x", "y", "", {row(1e-3, 0.1, 100, "slide")}}, "L1 1 ms");
  REQUIRE(none);
  CHECK(none->empty());
}

}  // namespace fidelity_section_test
