// A trial's curves, reduced for a picture.

#include "daemon/service/methods/trial_curves.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

namespace trial_curves_test {

using weft::daemon::api::curves_json;
using weft::daemon::api::reduce_samples;
using weft::daemon::api::SampleRange;

namespace {

constexpr std::int64_t period_ns = 1'000'000, pause_ns = 1'000'000'000;

/// `count` samples, one a millisecond, with a pause of a second after the samples in `pauses`.
std::vector<std::int64_t> times(std::size_t count, const std::vector<std::size_t>& pauses = {}) {
  std::vector<std::int64_t> out;
  std::int64_t now = 0;
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(now);
    now += std::ranges::find(pauses, i) == pauses.end() ? period_ns : pause_ns;
  }
  return out;
}

}  // namespace

TEST_CASE("Every sample is in one point of a limited number, and a gap has an empty point") {
  for (const std::size_t points : {10U, 11U, 50U, 999U, 1200U})
    for (const std::vector<std::size_t>& pauses :
         {std::vector<std::size_t>{}, {499}, {0, 499, 998}}) {
      INFO(points << " points, " << pauses.size() << " pauses");
      const auto ranges = reduce_samples(times(1000, pauses), points);
      CHECK(ranges.size() <= points);
      CHECK(std::ranges::count(ranges, true, &SampleRange::is_gap) ==
            static_cast<std::ptrdiff_t>(pauses.size()));
      std::size_t next = 0;
      for (const SampleRange& range : ranges) {
        if (range.is_gap) continue;
        CHECK(range.first == next);
        next = range.last + 1;
      }
      CHECK(next == 1000);
    }
  CHECK(reduce_samples({}, 10).empty());
  // More gaps than points: the curve crosses the gaps.
  std::vector<std::size_t> every;
  for (std::size_t i = 0; i < 100; i += 10) every.push_back(i);
  CHECK(std::ranges::count(reduce_samples(times(100, every), 10), true, &SampleRange::is_gap) == 0);
}

TEST_CASE("A point has the least and the greatest value of its samples; a gap has null") {
  const auto t_ns = times(8, {3});
  const auto curve = curves_json(
      t_ns, 4, 0,
      {{"z_mm", [](std::size_t i) { return i % 2 == 0 ? -1.0 * static_cast<double>(i) : 7; }}});
  REQUIRE(curve["t_s"].size() == 3);
  CHECK(curve["t_s"][1].is_null());
  CHECK(curve["t_s"][2].get<double>() == Approx(1.003));
  CHECK(curve["z_mm"]["min"] == nlohmann::json({-2.0, nullptr, -6.0}));
  CHECK(curve["z_mm"]["max"] == nlohmann::json({7.0, nullptr, 7.0}));
}

}  // namespace trial_curves_test
