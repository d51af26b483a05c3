// Intervals with the stated coverage.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/bootstrap.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::bootstrap_test {
namespace {

/// Cells of one repetition, with log-normal modulations about 2 %.
RecordingView drawn_cells(std::uint64_t seed, std::uint32_t cells) {
  std::vector<Stroke> strokes;
  for (std::uint32_t k = 1; k <= cells; ++k) {
    const double amplitude = 2 * std::exp(0.3 * test::draw(seed, 0, k));
    strokes.push_back(test::stroke(
        "denim", 0, 1, 200,
        [&](std::size_t, std::size_t i) { return 100 + amplitude * test::wave(i, 5); }, k));
  }
  return test::view_of(std::move(strokes));
}

const BootstrapStatistic& named(const BootstrapSet& set, const std::string& name) {
  for (const BootstrapStatistic& s : set.statistics)
    if (s.statistic.name == name) return s;
  FAIL("no statistic " << name);
  return set.statistics.front();
}

}  // namespace

TEST_CASE("The interval of a modulation holds the true one in 90 to 98 of 100 campaigns") {
  const double truth = to_scale(0.02 / std::sqrt(2.0), Scale::log);
  std::size_t held = 0;
  constexpr std::size_t campaigns = 100;
  for (std::uint64_t seed = 0; seed < campaigns; ++seed) {
    const BootstrapSet set = bootstrap_statistics(drawn_cells(seed, 40), 200, seed);
    const BootstrapStatistic& modulation = named(set, "modulation");
    held += modulation.low <= truth && truth <= modulation.high ? 1U : 0U;
  }
  CHECK(held >= 90);
  CHECK(held <= 98);
}

TEST_CASE("The standard error of a median of n cells is sd sqrt(pi / 2n)") {
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    sum += named(bootstrap_statistics(drawn_cells(seed, 60), 200, 1), "modulation").standard_error;
  CHECK(sum / 10 == Approx(0.3 * std::sqrt(std::numbers::pi / 120)).epsilon(0.25));
}

TEST_CASE("The same seed gives the same numbers, another others") {
  const RecordingView view = drawn_cells(1, 12);
  const auto error = [&](std::uint64_t seed) {
    return named(bootstrap_statistics(view, 50, seed), "modulation").standard_error;
  };
  CHECK(error(3) == error(3));
  CHECK(error(3) != error(4));
}

TEST_CASE("Cells are drawn within their cloth: every draw has every cloth") {
  RecordingView view = drawn_cells(1, 5);
  view.strokes[0].cloth = "silk";
  const BootstrapSet set = bootstrap_statistics(view, 40, 1);
  std::size_t cloths = 0;
  for (const BootstrapStatistic& s : set.statistics)
    if (s.statistic.name == "modulation") {
      CHECK(s.draws == 40);
      ++cloths;
    }
  CHECK(cloths == 2);
}

TEST_CASE("Repetitions vary too: a cell's pairs are not always drawn") {
  std::vector<Stroke> strokes;
  for (std::uint32_t r = 0; r < 2; ++r)
    strokes.push_back(test::stroke("denim", r, 2, 400, [&](std::size_t c, std::size_t i) {
      return 100 + test::draw(1, c, i) + test::draw(10 + r, c, i);
    }));
  const BootstrapSet set = bootstrap_statistics(test::view_of(std::move(strokes)), 200, 1);
  const BootstrapStatistic& repetition = named(set, "repetition");
  CHECK(repetition.draws > 60);  // one of two draws has both
  CHECK(repetition.draws < 140);
  CHECK(repetition.standard_error == Approx(0).margin(1e-12));  // one pair has one correlation
}

TEST_CASE("One stroke, or no draws: the value has no error") {
  for (const std::size_t draws : {std::size_t{0}, std::size_t{20}}) {
    const BootstrapSet set = bootstrap_statistics(drawn_cells(1, 1), draws, 1);
    const BootstrapStatistic& modulation = named(set, "modulation");
    CHECK(modulation.standard_error == Approx(0).margin(1e-12));
    CHECK(modulation.low == Approx(modulation.statistic.value));
    CHECK(modulation.high == Approx(modulation.statistic.value));
    CHECK(modulation.draws == draws);
    CHECK_FALSE(set.remarks.empty());
  }
}

}  // namespace weft::daemon::calibration::bootstrap_test
