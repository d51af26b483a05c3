// Nested random effects of known size.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/variance_components.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::variance_components_test {
namespace {

/// Fixed groups far apart; groups of one to three places of one to three observations.
std::vector<NestedValue> unbalanced(double outer, double inner, double within) {
  std::vector<NestedValue> out;
  for (std::size_t fixed = 0; fixed < 20; ++fixed)
    for (std::size_t mounting = 0; mounting < 2 + fixed % 4; ++mounting)
      for (std::size_t place = 0; place < 1 + (fixed + mounting) % 3; ++place)
        for (std::size_t i = 0; i < 1 + (place + mounting) % 3; ++i) {
          NestedValue& one = out.emplace_back(NestedValue{{fixed, mounting, place}, {}});
          const std::size_t at = (fixed * 10 + mounting) * 10 + place;
          for (std::size_t c = 0; c < 16; ++c)
            one.values.push_back(100 * static_cast<double>(fixed) +
                                 outer * test::draw(1, c, at / 10) + inner * test::draw(2, c, at) +
                                 within * test::draw(3, c, 10 * at + i));
        }
  return out;
}

}  // namespace

TEST_CASE("Spreads of three levels are told apart in unequal groups") {
  const NestedSpread found = nested_spread(unbalanced(0.04, 0.012, 0.005));
  CHECK(*found.outer == Approx(0.04).epsilon(0.1));
  CHECK(*found.inner == Approx(0.012).epsilon(0.1));
  CHECK(*found.within == Approx(0.005).epsilon(0.1));
}

TEST_CASE("A level without spread has none, whatever the finer ones have") {
  const NestedSpread found = nested_spread(unbalanced(0, 0, 0.01));
  CHECK(*found.outer < 0.003);
  CHECK(*found.inner < 0.003);
  CHECK(*found.within == Approx(0.01).epsilon(0.1));
}

TEST_CASE("Balanced groups give the analysis of variance's answer") {
  // means 1 and 5, each of {mean - 1, mean + 1}
  const std::vector<NestedValue> four{
      {{0, 0, 0}, {0}}, {{0, 0, 0}, {2}}, {{0, 0, 1}, {4}}, {{0, 0, 1}, {6}}};
  const NestedSpread found = nested_spread(four);
  CHECK(*found.within == Approx(std::sqrt(2.0)));
  CHECK(*found.inner == Approx(std::sqrt(7.0)));  // 8 between means, less 2/2
  CHECK_FALSE(found.outer);
}

TEST_CASE("Spreads that no group shows are absent") {
  const NestedSpread one = nested_spread({{{0, 0, 0}, {1}}});
  CHECK_FALSE(one.outer);
  CHECK_FALSE(one.inner);
  CHECK_FALSE(one.within);
  const NestedSpread places = nested_spread({{{0, 0, 0}, {1}}, {{0, 0, 1}, {3}}});
  CHECK_FALSE(places.within);
  CHECK(*places.inner == Approx(std::sqrt(2.0)));
  CHECK_FALSE(nested_spread({}).within);
}

}  // namespace weft::daemon::calibration::variance_components_test
