#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "sim/plant/near.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/texture_map.hpp"
#include "tests/unit/plant/support.hpp"

namespace texture_test {

using namespace weft;
using namespace weft::sim;

namespace {

constexpr double pi = std::numbers::pi;

/// One sinusoid along x with amplitude `amplitude_m` and pitch `pitch_m`; the place of the maximum
/// is unknown.
HeightField ripple(double amplitude_m, double pitch_m) {
  Structure structure;
  structure.lines = {{.warp = 1, .weft = 0, .share = 1}};
  return HeightField({pitch_m, pitch_m, amplitude_m / std::sqrt(2.0), structure}, 4);
}

struct Extremes {
  double low = 1e300, high = 0, mean = 0;
};

/// Extremes of the response along ten pitches.
Extremes scan(TextureMap map, double pitch_m) {
  Extremes found;
  TextureMap::Cursor cursor;
  constexpr int points = 4000;
  for (int i = 0; i < points; ++i) {
    const double value = map.response(10 * pitch_m * i / points, 0.3e-3, cursor);
    found.low = std::min(found.low, value);
    found.high = std::max(found.high, value);
    found.mean += value / points;
  }
  return found;
}

double jinc(double x) {
  return 2 * std::cyl_bessel_j(1.0, x) / x;
}

}  // namespace

TEST_CASE("the fast exponential agrees with the library's to float precision") {
  double worst = 0;
  for (double x = -87; x <= 87; x += 0.00731) {
    const float f = static_cast<float>(x);
    worst = std::max(
        worst, std::abs(static_cast<double>(fast_exp(f)) / std::exp(static_cast<double>(f)) - 1));
  }
  CHECK(worst < 2e-7);
  float beyond[4] = {-1000, 1000, 0, 1};
  fast_exp<4>(beyond);
  CHECK(beyond[0] == Approx(std::exp(-87.0)));
  CHECK(std::isfinite(beyond[1]));
  CHECK(beyond[2] == 1.0F);
}

TEST_CASE("a faint ripple reaches the pad by the disc's transfer function") {
  const double lambda = 50e-6, amplitude = 0.5e-6;
  for (const double pitch : {1.0e-3, 1.25e-3, 1.81e-3, 2.5e-3, 4e-3}) {
    CAPTURE(pitch);
    const Extremes seen = scan(TextureMap(ripple(amplitude, pitch), lambda), pitch);
    const double expected = std::abs(jinc(pi * 2e-3 / pitch)) * amplitude / lambda;
    // The disc is made of square cells: the error of its transfer function is at most 0.7 % of full
    // scale.
    const double full = amplitude / lambda;
    CHECK((seen.high - seen.low) / 2 == Approx(expected).epsilon(0).margin(0.007 * full));
  }
}

TEST_CASE("a strong ripple wider than the pad shows its crests and troughs over the mean I0") {
  const double lambda = 5e-6, amplitude = 10e-6, pitch = 40e-3;
  const Extremes seen = scan(TextureMap(ripple(amplitude, pitch), lambda), pitch);
  const double mean = std::cyl_bessel_i(0.0, amplitude / lambda);
  // A disc of diameter D flattens the maximum by the second-order term of the average.
  CHECK(seen.high == Approx(std::exp(2.0) / mean).epsilon(0.01));
  CHECK(seen.low == Approx(std::exp(-2.0) / mean).epsilon(0.01));
  CHECK(seen.mean == Approx(1).epsilon(0.002));
}

TEST_CASE("the response's mean over the cloth is 1 for every structure") {
  const FabricLibrary table = test::library();
  for (const Fabric& fabric : table.fabrics) {
    CAPTURE(fabric.name);
    double mean = 0;
    int count = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      const Patch patch = test::patch_of(table, fabric.name, seed);
      TextureMap map(patch.field, patch.material.law.lambda_m);
      TextureMap::Cursor cursor;
      for (int i = 0; i < 40; ++i, ++count)
        mean += map.response(1.37e-3 * i, 0.9e-3 * i * (i % 2 == 0 ? 1 : -1), cursor);
    }
    CHECK(mean / count == Approx(1).margin(0.12));
  }
}

TEST_CASE("tiles join without a seam, on both sides of zero") {
  const Patch patch = test::patch_of(test::library(), "nylon", 5);
  TextureMap map(patch.field, patch.material.law.lambda_m);
  TextureMap::Cursor a, b;
  const double tile = TextureMap::tile_cells * TextureMap::cell_m;
  for (const double edge : {-tile, 0.0, tile, 7 * tile}) {
    const double below = map.response(edge - 1e-9, edge - 1e-9, a);
    const double above = map.response(edge + 1e-9, edge + 1e-9, b);
    CHECK(below == Approx(above).epsilon(1e-4));
  }
  CHECK(std::isfinite(map.response(1e300, -1e300, a)));
}

TEST_CASE("the map follows the field it was made from") {
  const FabricLibrary table = test::library();
  const Patch patch = test::patch_of(table, "corduroy", 11);
  const double lambda = patch.material.law.lambda_m;
  TextureMap map(patch.field, lambda);
  TextureMap::Cursor cursor;
  for (const double v : {0.1e-3, 5.2e-3}) {
    double sum = 0;
    int cells = 0;
    for (int i = -20; i <= 20; ++i)
      for (int j = -20; j <= 20; ++j)
        if (i * i + j * j <= 400) {
          const double h = test::height_at_m(patch.field, 2e-3 + i * 50e-6, v + j * 50e-6);
          sum += std::exp(h / lambda);
          ++cells;
        }
    const double expected = sum / cells / std::exp(patch.field.log_mean_response(lambda));
    CHECK(map.response(2e-3, v, cursor) == Approx(expected).epsilon(2e-5));
  }
}

TEST_CASE("single precision in the maps does no harm: a hundredth of a count, on every fabric") {
  const FabricLibrary table = test::library();
  const PadParams pad;
  const auto counts = [&](double pressure_pa) {
    return test::capacitance_under_f(pad, pressure_pa) / pad.lsb_f;
  };
  double worst = 0;
  for (const Fabric& fabric : table.fabrics) {
    const Patch patch = test::patch_of(table, fabric.name, 3);
    const double lambda_m = patch.material.law.lambda_m;
    TextureMap map(patch.field, lambda_m);
    TextureMap::Cursor cursor;
    for (int n = 0; n < 3; ++n) {
      const int column = 137 * n - 211, row = 1 + 383 * n;  // on the grid: no interpolation
      double sum = 0;
      int cells = 0;
      for (int i = -20; i <= 20; ++i)
        for (int j = -20; j <= 20; ++j)
          if (i * i + j * j <= 400) {
            sum += std::exp(test::height_at_m(patch.field, (column + i) * TextureMap::cell_m,
                                              (row + j) * TextureMap::cell_m) /
                            lambda_m);
            ++cells;
          }
      const double in_double = sum / cells / std::exp(patch.field.log_mean_response(lambda_m));
      const double in_float =
          map.response(column * TextureMap::cell_m, row * TextureMap::cell_m, cursor);
      // Under 10 N; no pad of this bench gets a higher pressure.
      worst = std::max(worst, std::abs(counts(39e3 * in_float) - counts(39e3 * in_double)));
    }
  }
  CHECK(worst > 0);  // the comparison is sensitive to the precision
  CHECK(worst < 0.01);
}

TEST_CASE("a cloth without texture is smooth") {
  TextureMap map;
  TextureMap::Cursor cursor;
  CHECK(map.response(1e-3, 2e-3, cursor) == 1);
  CHECK(map.tiles() == 0);
}

}  // namespace texture_test
