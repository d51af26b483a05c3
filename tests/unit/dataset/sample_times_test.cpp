#include "daemon/dataset/sample_times.hpp"

#include <catch2/catch.hpp>

namespace weft::daemon::sample_times_test {
namespace {

// Times whose intervals are these [ms], over and over.
std::vector<std::int64_t> times(const std::vector<std::int64_t>& intervals_ms, int samples) {
  std::vector<std::int64_t> out{0};
  for (int i = 1; i < samples; ++i)
    out.push_back(out.back() +
                  1'000'000 * intervals_ms[static_cast<std::size_t>(i - 1) % intervals_ms.size()]);
  return out;
}

TEST_CASE("the period of samples is that between pauses") {
  auto t_ns = times({10}, 100);
  CHECK(sampled_time(t_ns).period_s() == 0.01);
  for (std::size_t i = 50; i < t_ns.size(); ++i) t_ns[i] += 5'000'000'000;
  CHECK(sampled_time(t_ns).period_s() == 0.01);
  CHECK(sampled_time(t_ns).intervals == 98);
  CHECK(sampled_time(times({10, 10, 10, 10, 20}, 101)).period_s() == 0.01);  // frames lost
}

TEST_CASE("stamps in whole milliseconds, or of samples that were read together, make no pause") {
  CHECK(sampled_time(times({8, 9, 9, 8, 9}, 101)).period_s() == Approx(0.0086));
  CHECK(sampled_time(times({0, 20}, 101)).period_s() == Approx(0.01));
  CHECK(sampled_time(times({0, 0, 30}, 91)).period_s() == Approx(0.01));
  CHECK(sampled_time(times({0, 0, 0, 0, 0, 0, 0, 80}, 81)).period_s() == Approx(0.01));
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

TEST_CASE("one sample, or none, tells no period") {
  CHECK(sampled_time({}).period_s() == 0);
  CHECK(sampled_time({5}).period_s() == 0);
  CHECK(sampled_time({5, 5}).period_s() == 0);
}

}  // namespace
}  // namespace weft::daemon::sample_times_test
