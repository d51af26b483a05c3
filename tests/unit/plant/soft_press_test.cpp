// Level L2 on the bare press of docs/reference/plant.md, Integrators, compared with the prototype's
// errors with the same method.

#include "tests/bench/soft_press.hpp"
#include "tests/unit/plant/support.hpp"

namespace soft_press_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;
using bench::SoftPress;

TEST_CASE(
    "on a bare press the error of level L2 is no more than the prototype's at the same step") {
  for (const char* name : {"denim", "felt", "cotton"}) {
    const MaterialSwitches only_relaxation{true, false, false, false, false, false};
    const SoftPress press(patch_of(library(), name, 1, only_relaxation).material);
    const auto error = [&, truth = press.forces_n(press.dynamic(2e-6, Integrator::midpoint))](
                           const auto& contact) {
      REQUIRE(truth.back() > 4);
      return SoftPress::error(press.forces_n(contact), truth);
    };
    CAPTURE(name);
    CHECK(error(press.dynamic(1e-3, Integrator::midpoint)) < SoftPress::notes_1ms_error);
    CHECK(error(press.dynamic(1e-4, Integrator::midpoint)) < SoftPress::notes_100us_error);
    CHECK(error(press.dynamic(DynamicsParams{}.step_s, Integrator::adaptive)) <
          SoftPress::notes_1ms_error);
    // The error of massless contact comes from damping: it must equal the prototype's.
    if (std::string(name) == "denim")
      CHECK(error(press.quasistatic()) == Approx(SoftPress::notes_l1_error).epsilon(0.05));
  }
}

}  // namespace soft_press_test
