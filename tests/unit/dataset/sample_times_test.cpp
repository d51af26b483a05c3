#include "daemon/dataset/sample_times.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

namespace weft::daemon::sample_times_test {
namespace {

// Times whose intervals are these [ms], over and over.
std::vector<std::int64_t> times(const std::vector<double>& intervals_ms, int samples) {
  std::vector<std::int64_t> out{0};
  for (int i = 1; i < samples; ++i)
    out.push_back(
        out.back() +
        std::llround(1e6 * intervals_ms[static_cast<std::size_t>(i - 1) % intervals_ms.size()]));
  return out;
}

// The same with 5 s before each of these samples.
std::vector<std::int64_t> paused(std::vector<std::int64_t> t_ns,
                                 const std::vector<std::size_t>& before) {
  for (const std::size_t at : before)
    for (std::size_t i = at; i < t_ns.size(); ++i) t_ns[i] += 5'000'000'000;
  return t_ns;
}

// Samples read in batches of so many, 100 a second.
std::vector<std::int64_t> in_batches(std::size_t batch, double within_ms, int samples) {
  std::vector<double> intervals_ms(batch, within_ms);
  intervals_ms.back() =
      10.0 * static_cast<double>(batch) - within_ms * static_cast<double>(batch - 1);
  return times(intervals_ms, samples);
}

TEST_CASE("the period of samples is that between pauses") {
  CHECK(sampled_time(times({10}, 100)).period_s() == 0.01);
  const SampledTime once = sampled_time(paused(times({10}, 100), {50}));
  CHECK(once.period_s() == 0.01);
  CHECK(once.intervals == 98);
  CHECK(sampled_time(paused(times({10}, 300), {50, 100, 250})).period_s() == 0.01);
  CHECK(sampled_time(paused(times({10}, 60), {10, 20, 50})).period_s() == 0.01);
  CHECK(sampled_time(times({10, 10, 10, 10, 20}, 101)).period_s() == 0.01);  // frames lost
}

TEST_CASE("stamps in whole milliseconds, or of samples that were read together, make no pause") {
  CHECK(sampled_time(times({8, 9, 9, 8, 9}, 101)).period_s() == Approx(0.0086));
  CHECK(sampled_time(times({0, 20}, 101)).period_s() == Approx(0.01));
  CHECK(sampled_time(times({0, 0, 30}, 91)).period_s() == Approx(0.01));
  CHECK(sampled_time(times({0, 0, 0, 0, 0, 0, 0, 80}, 81)).period_s() == Approx(0.01));
}

TEST_CASE("samples that were read in batches have the rate at which they were taken") {
  for (const std::size_t batch : {2U, 3U, 4U, 5U, 8U, 16U})
    for (const double within_ms : {0.0, 0.05, 0.2, 0.5, 2.0}) {
      CAPTURE(batch, within_ms);
      const auto t_ns = in_batches(batch, within_ms, 300);
      CHECK(sampled_time(t_ns).period_s() == Approx(0.01).epsilon(0.01));
      CHECK(may_have_period(t_ns, 0.01));
      CHECK_FALSE(may_have_period(t_ns, 0.0116));
      const auto between = paused(t_ns, {80, 96, 240});
      CHECK(sampled_time(between).period_s() == Approx(0.01).epsilon(0.01));
    }
  auto stalled = in_batches(8, 0.5, 400);
  for (std::size_t i = 160; i < 200; ++i) stalled[i] = stalled[200];  // five batches at once
  CHECK(sampled_time(stalled).period_s() == Approx(0.01).epsilon(0.01));
}

TEST_CASE("a recording may be of the rate of its mean interval, or of the one in the middle") {
  auto stalled = times({10}, 200);
  for (std::size_t i = 50; i < 90; ++i) stalled[i] = stalled[90];  // read late, all at once
  CHECK(may_have_period(stalled, 0.01));
  CHECK(may_have_period(times({8, 9, 9, 8, 9}, 101), 0.0086));
  CHECK(may_have_period(times({10}, 100), 0.0104));
  CHECK_FALSE(may_have_period(times({10}, 100), 0.0108));
  CHECK_FALSE(may_have_period(stalled, 0.0116));
  CHECK(may_have_period(times({0}, 100), 0.01));  // tells nothing
  CHECK(may_have_period({7}, 0.01));
}

TEST_CASE("the period in common is the mean one, or what lost frames leave of it") {
  const auto clean = times({10}, 400);
  const auto lossy = times({10, 10, 20, 10, 30, 10, 20}, 280);  // a mean of 16 ms
  CHECK_FALSE(sampled_time(lossy).period_s() < 0.0115);
  CHECK(common_period_s({clean, clean, lossy, lossy}) == 0.01);
  CHECK(common_period_s({clean, lossy, in_batches(8, 0.5, 400)}) == Approx(0.01).epsilon(0.01));
  CHECK(common_period_s({times({8, 9, 9, 8, 9}, 101), times({9, 8, 8, 9, 9}, 101)}) ==
        Approx(0.0086));
  CHECK(common_period_s({times({1, 2}, 101), times({2, 1}, 100)}) == Approx(0.0015).epsilon(0.01));
  const auto all_may = [](const std::vector<std::vector<std::int64_t>>& recordings) {
    return std::ranges::all_of(recordings,
                               [period_s = common_period_s(recordings)](const auto& t_ns) {
                                 return may_have_period(t_ns, period_s);
                               });
  };
  CHECK(all_may({clean, lossy}));
  CHECK(all_may({clean, times({1000 / 105.0}, 400)}));
  CHECK(all_may({clean, clean, clean, times({1000 / 105.0}, 400)}));
  CHECK_FALSE(all_may({clean, times({1000 / 116.0}, 400)}));
  CHECK_FALSE(all_may({clean, times({20}, 400)}));
  CHECK(common_period_s({}) == 0);
  CHECK(common_period_s({{5}, {}}) == 0);
}

TEST_CASE("one sample, or none, tells no period") {
  CHECK(sampled_time({}).period_s() == 0);
  CHECK(sampled_time({5}).period_s() == 0);
  CHECK(sampled_time({5, 5}).period_s() == 0);
}

}  // namespace
}  // namespace weft::daemon::sample_times_test
