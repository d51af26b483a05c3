// Places where precision could be lost: single precision in the texture, time and position over
// long runs.

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>

#include "sim/plant/pads.hpp"
#include "sim/plant/stage.hpp"
#include "sim/plant/texture_map.hpp"
#include "tests/unit/plant/support.hpp"

namespace precision_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

TEST_CASE("texture in single precision moves no pad by a hundredth of a count") {
  const FabricLibrary table = library();
  const PadParams pads;
  double worst = 0;
  for (const Fabric& fabric : table.fabrics) {
    const Patch patch = patch_of(table, fabric.name, 3);
    const double lambda_m = patch.material.law.lambda_m;
    const double log_mean = patch.field.log_mean_response(lambda_m);
    TextureMap map(patch.field, lambda_m);
    TextureMap::Cursor cursor;
    for (const double v_m : {0.35e-3, 4.1e-3}) {
      double sum = 0;  // the same cells in double precision
      int cells = 0;
      for (int i = -20; i <= 20; ++i)
        for (int j = -20; j <= 20; ++j)
          if (i * i + j * j <= 400) {
            sum += std::exp(test::height_at_m(patch.field, 2e-3 + i * 50e-6, v_m + j * 50e-6) /
                            lambda_m);
            ++cells;
          }
      const auto counts = [&](double response) {
        const double pressure_pa = response * 5 / level_plate().face_area_m2();
        return capacitance_under_f(pads, pressure_pa) / pads.lsb_f;
      };
      const double exact = sum / cells / std::exp(log_mean);
      worst = std::max(worst, std::abs(counts(map.response(2e-3, v_m, cursor)) - counts(exact)));
    }
  }
  CHECK(worst < 0.01);
}

TEST_CASE("a million moves of 20 nm are 20 mm, and a tick counts the same after a year") {
  Stage stage({.low = 0, .high = 0.15, .start = 75e-3, .quantum = 0});
  for (int i = 0; i < 1'000'000; ++i) {  // in single precision: 22.35 mm
    const TimePoint now{Duration(std::int64_t{1'000'000} * i)};
    stage.move_to(stage.position(now) + 20e-9, {1, 1}, now);
  }
  CHECK(stage.position(stage.end()) == Approx(95e-3).margin(1e-11));
  const TimePoint later{std::chrono::hours(24 * 365)};
  stage.move_to(0.1, {4e-3, 20e-3}, later);
  const double from_m = stage.position(later);
  const double whole_s = to_seconds(stage.end() - later);
  CHECK(whole_s == Approx(5e-3 / 4e-3 + 0.2).margin(1e-8));
  CHECK(stage.position(later + Duration(1'000'000)) - from_m ==
        Approx(0.5 * 20e-3 * 1e-6).margin(1e-14));
}

}  // namespace precision_test
