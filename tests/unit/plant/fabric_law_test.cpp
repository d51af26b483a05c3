#include "sim/plant/fabric_law.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "tests/unit/plant/support.hpp"

namespace fabric_law_test {

using namespace weft;
using namespace weft::sim;

namespace {

/// LC and WC of a law by integration of its curve, like the KES instrument.
KesCompression measure(const FabricLaw& law) {
  const double full_m = law.lambda_m * std::log1p(kes_peak_pressure_pa / law.pressure_pa);
  constexpr int steps = 20000;  // Simpson
  double work = 0;
  for (int i = 0; i <= steps; ++i) {
    const double pressure = law.pressure_pa * std::expm1(full_m * i / steps / law.lambda_m);
    work += pressure * (i == 0 || i == steps ? 1 : i % 2 == 1 ? 4 : 2);
  }
  work *= full_m / steps / 3;
  const double triangle = 0.5 * full_m * kes_peak_pressure_pa;
  return {work / triangle, work, (1 - law.hysteresis) / (1 + law.hysteresis)};
}

}  // namespace

TEST_CASE("a law made from KES figures gives those figures back when it is pressed") {
  for (const Fabric& fabric : test::library().fabrics) {
    CAPTURE(fabric.name);
    const auto law = law_from_kes(fabric.kes);
    REQUIRE(law.has_value());
    const KesCompression measured = measure(*law);
    CHECK(measured.linearity == Approx(fabric.kes.linearity).epsilon(1e-9));
    CHECK(measured.work_j_m2 == Approx(fabric.kes.work_j_m2).epsilon(1e-9));
    CHECK(measured.resilience == Approx(fabric.kes.resilience).epsilon(1e-12));
  }
}

TEST_CASE("denim's law is the one of the reference table") {
  const auto law = law_from_kes({0.29, 0.30 * kes_work_j_m2, 0.33});
  REQUIRE(law.has_value());
  CHECK(law->lambda_m == Approx(60.4e-6).epsilon(2e-3));
  CHECK(law->pressure_pa == Approx(5).epsilon(0.1));  // the table prints one digit
}

TEST_CASE("figures that no cloth has are refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -0.3, 1.0, 1.5, nan, inf}) {
    CHECK_FALSE(law_from_kes({bad, 0.3, 0.5}).has_value());
    CHECK_FALSE(law_from_kes({0.3, bad == 1.0 || bad == 1.5 ? -bad : bad, 0.5}).has_value());
    CHECK_FALSE(law_from_kes({0.3, 0.3, bad == 1.0 ? 1.01 : bad}).has_value());
  }
}

}  // namespace fabric_law_test
