// The reference for a run's force.

#include "sim/plant/fidelity/reference.hpp"

#include <catch2/catch.hpp>

namespace reference_test {

using namespace weft::sim;

namespace {

constexpr double us = 1e-6;

FidelitySetting l2(Integrator integrator, double step_s) {
  return {Level::dynamic, integrator, step_s};
}

void check_is(const Reference& reference, Integrator integrator, double step_s) {
  CHECK(reference.setting().level == Level::dynamic);
  CHECK(reference.integrator == integrator);
  CHECK(reference.step_s == Approx(step_s));
}

}  // namespace

TEST_CASE("a reference is of level L2, by another integrator and at least an order finer") {
  for (const FidelitySetting& coarse :
       {FidelitySetting{.level = Level::algebraic}, FidelitySetting{.level = Level::quasistatic},
        l2(Integrator::tr_bdf2, 1000 * us), FidelitySetting{Level::modal, Integrator::midpoint}}) {
    check_is(first_reference(coarse), Integrator::tr_bdf2, 50 * us);
    check_is(second_reference(first_reference(coarse)), Integrator::midpoint, 25 * us);
  }
  const Reference fine = first_reference(l2(Integrator::midpoint, 96 * us));
  CHECK(fine.step_s == Approx(24 * us));
  CHECK(first_reference(l2(Integrator::midpoint, 96 * us), 3).step_s == Approx(3 * us));
}

TEST_CASE("a quick reference is coarser than the fine one only where the run is") {
  CHECK(quick_reference({.level = Level::quasistatic}).step_s == Approx(200 * us));
  const FidelitySetting fine = l2(Integrator::adaptive, 192 * us);
  CHECK(quick_reference(fine).step_s == Approx(48 * us));
  CHECK(quick_reference(fine).step_s == first_reference(fine).step_s);
}

}  // namespace reference_test
