#include "daemon/storage/dataset/sample_times.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

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

constexpr double seconds = 6.0;
constexpr double tick_s = 0.015625;  // of Windows

using Times = std::vector<std::int64_t>;

Times in_ns(const std::vector<double>& t_s) {
  Times out;
  for (const double t : t_s) out.push_back(std::llround(1e9 * t));
  return out;
}

// Even samples that a clock of this step stamps.
Times ticked(double rate_hz, double step_s, double begin_s = 0.003) {
  std::vector<double> out;
  for (int i = 0; i < rate_hz * seconds; ++i)
    out.push_back(std::floor((begin_s + i / rate_hz) / step_s) * step_s);
  return in_ns(out);
}

// Samples of 100 Hz of which this share is lost, stamped with normal scatter.
Times lossy(double share, double scatter_s, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> lot;
  std::normal_distribution<double> late_s(0.1, std::max(scatter_s, 1e-12));
  std::vector<double> out;
  for (int i = 0; i < 100 * seconds; ++i)
    if (lot(engine) >= share) out.push_back(i / 100.0 + (scatter_s > 0 ? late_s(engine) : 0.0));
  std::ranges::sort(out);
  return in_ns(out);
}

// Samples of 100 Hz by a reader that stalls for 50 ms at this share of them, and catches up.
Times stalling(double share, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> lot;
  std::vector<double> out;
  double busy_s = 0;
  for (int i = 0; i < 100 * seconds; ++i) {
    const double due_s = i / 100.0;
    if (lot(engine) < share) busy_s = std::max(busy_s, due_s + 0.05);
    out.push_back(std::max({due_s, busy_s, out.empty() ? 0.0 : out.back() + 0.0002}));
  }
  return in_ns(out);
}

// What an adapter gives that hands over all samples each so often, read with 1 ms of scatter.
Times polled(double rate_hz, double every_s, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> scatter_s(0.0, 0.001);
  std::vector<double> out;
  double poll = -1;
  for (int i = 0; i < rate_hz * seconds; ++i) {
    const double own = std::floor(i / rate_hz / every_s);
    out.push_back(own == poll ? out.back() + 0.0001 : (own + 1) * every_s + scatter_s(engine));
    poll = own;
  }
  return in_ns(out);
}

double rate_hz(const Times& t_ns) {
  return 1 / sampled_time(t_ns).period_s();
}

bool can_be_together(const Times& a, const Times& b) {
  const double period_s = common_period_s({a, a, b, b});
  return can_have_period(a, period_s) && can_have_period(b, period_s);
}

TEST_CASE("a coarse clock does not change the rate") {
  for (const double hz : {50.0, 55.0, 60.0, 62.0, 100.0, 115.0, 120.0, 125.0, 180.0})
    for (const double begin_s : {0.0, 0.003, 0.011}) {
      CAPTURE(hz, begin_s);
      CHECK(rate_hz(ticked(hz, tick_s, begin_s)) == Approx(hz).epsilon(0.005));
    }
  for (const double hz : {300.0, 390.0, 700.0, 833.0, 900.0, 950.0, 980.0, 1000.0})
    CHECK(rate_hz(ticked(hz, 0.001)) == Approx(hz).epsilon(0.005));
  for (const double hz : {75.0, 85.0, 90.0, 95.0})
    CHECK(rate_hz(ticked(hz, 0.01)) == Approx(hz).epsilon(0.005));
  for (const double hz : {100.0, 115.0, 120.0, 125.0, 180.0, 200.0})
    CHECK(rate_hz(polled(hz, 0.016, 3)) == Approx(hz).epsilon(0.005));
}

TEST_CASE("two rates are two in coarse stamps as well") {
  CHECK_FALSE(can_be_together(ticked(300, 0.001), ticked(390, 0.001)));
  CHECK_FALSE(can_be_together(ticked(700, 0.001), ticked(1000, 0.001)));
  CHECK_FALSE(can_be_together(ticked(50, tick_s), ticked(60, tick_s)));
  CHECK_FALSE(can_be_together(ticked(75, 0.01), ticked(100, 0.01)));
  CHECK(can_be_together(ticked(60, tick_s), ticked(60, 1e-6)));
}

TEST_CASE("stalls, scatter and lost frames leave the rate") {
  for (unsigned seed = 0; seed < 8; ++seed) {
    CAPTURE(seed);
    for (const double share : {0.01, 0.02, 0.05, 0.1})
      CHECK(rate_hz(stalling(share, seed)) == Approx(100).epsilon(0.005));
    for (const double scatter_s : {0.001, 0.003, 0.006})
      CHECK(rate_hz(lossy(0, scatter_s, seed)) == Approx(100).epsilon(0.01));
    for (const double share : {0.02, 0.05, 0.1, 0.2, 0.26, 0.3, 0.4}) {
      CHECK(rate_hz(lossy(share, 0, seed)) == Approx(100).epsilon(0.005));
      CHECK(rate_hz(lossy(share, 0.0005, seed)) == Approx(100).epsilon(0.005));
    }
  }
}

TEST_CASE("strokes that were recorded on contact are no batches") {
  for (const std::size_t samples : {8U, 25U, 30U})
    for (const double every_s : {1.8, 2.5}) {
      std::vector<double> t_s;
      for (int stroke = 0; stroke < 10; ++stroke)
        for (std::size_t i = 0; i < samples; ++i)
          t_s.push_back(stroke * every_s + static_cast<double>(i) / 37);
      CAPTURE(samples, every_s);
      CHECK(rate_hz(in_ns(t_s)) == Approx(37));
    }
}

TEST_CASE("a missing sample is told from a late one") {
  const auto without = [](Times t_ns, std::ptrdiff_t at, std::ptrdiff_t samples) {
    t_ns.erase(t_ns.begin() + at, t_ns.begin() + at + samples);
    return t_ns;
  };
  const Times batches = in_batches(8, 0.2, 400), scattered = lossy(0, 0.0025, 1);
  CHECK(missing_samples(times({10}, 400)) < 0.01);
  CHECK(missing_samples(batches) < 0.01);
  CHECK(missing_samples(scattered) < 0.3);
  CHECK(missing_samples(stalling(0.02, 1)) < 0.3);
  CHECK(missing_samples(without(times({10}, 400), 200, 1)) > 0.5);
  CHECK(missing_samples(without(scattered, 300, 1)) > 0.5);
  CHECK(missing_samples(without(batches, 160, 8)) > 0.5);
  CHECK(std::isinf(missing_samples(without(times({10}, 400), 200, 100))));
  for (const std::ptrdiff_t at : {3, 30, 200, 370, 396}) {
    CAPTURE(at);
    CHECK(missing_samples(without(times({10}, 400), at, 1)) > 0.9);
  }
  for (const std::ptrdiff_t batch : {3, 10, 30, 45})
    CHECK(missing_samples(without(batches, 8 * batch, 8)) > 0.9);
  for (const std::ptrdiff_t at : {30, 100, 300, 500, 570})
    CHECK(missing_samples(without(scattered, at, 1)) > 0.5);
  std::vector<double> one_in_512(511, 10.0);
  one_in_512.back() = 20;
  CHECK(missing_samples(times(one_in_512, 5000)) > 0.9);
}

TEST_CASE("late samples are not missing, wherever they are") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    for (const double scatter_s : {0.001, 0.0025, 0.005, 0.007})
      CHECK(missing_samples(lossy(0, scatter_s, seed)) < 0.5);
    for (const double share : {0.01, 0.02, 0.05})
      CHECK(missing_samples(stalling(share, seed)) < 0.5);
  }
  for (const double hz : {50.0, 55.0, 60.0, 100.0, 115.0, 120.0, 180.0}) {
    CHECK(missing_samples(ticked(hz, tick_s)) < 0.5);
    CHECK(missing_samples(polled(hz, 0.016, 3)) < 0.5);
  }
  for (const double hz : {300.0, 390.0, 400.0, 700.0, 833.0, 900.0, 950.0, 980.0})
    CHECK(missing_samples(ticked(hz, 0.001)) < 0.5);
}

TEST_CASE("the period of samples is that between pauses") {
  CHECK(sampled_time(times({10}, 100)).period_s() == 0.01);
  const SampledTime once = sampled_time(paused(times({10}, 100), {50}));
  CHECK(once.period_s() == 0.01);
  CHECK(once.intervals == 98);
  CHECK(sampled_time(paused(times({10}, 300), {50, 100, 250})).period_s() == 0.01);
  CHECK(sampled_time(paused(times({10}, 60), {10, 20, 50})).period_s() == 0.01);
  CHECK(sampled_time(times({10, 10, 20, 10, 10, 10, 10, 10, 10, 20, 20}, 101)).period_s() ==
        Approx(0.01));                                                        // frames lost
  CHECK(sampled_time(times({10, 10, 10, 10, 20}, 101)).period_s() == 0.012);  // a clock's step
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
      CHECK(can_have_period(t_ns, 0.01));
      CHECK_FALSE(can_have_period(t_ns, 0.0116));
      const auto between = paused(t_ns, {80, 96, 240});
      CHECK(sampled_time(between).period_s() == Approx(0.01).epsilon(0.01));
    }
  auto stalled = in_batches(8, 0.5, 400);
  for (std::size_t i = 160; i < 200; ++i) stalled[i] = stalled[200];  // five batches at once
  CHECK(sampled_time(stalled).period_s() == Approx(0.01).epsilon(0.01));
}

TEST_CASE("samples that a slow reader takes all at once have the rate at which they were taken") {
  for (const std::size_t batch : {60U, 100U, 500U})
    for (const double within_ms : {0.0, 0.01, 0.2}) {
      CAPTURE(batch, within_ms);
      const auto t_ns = in_batches(batch, within_ms, 3000);
      CHECK(sampled_time(t_ns).period_s() == Approx(0.01).epsilon(0.01));
      CHECK(can_have_period(t_ns, 0.01));
      CHECK_FALSE(can_have_period(t_ns, 0.0116));
      if (batch == 500) continue;  // 5 s are no pause to it
      const auto between = paused(t_ns, {600, 1500});
      CHECK(sampled_time(between).period_s() == Approx(0.01).epsilon(0.01));
    }
}

TEST_CASE("times of a slow reader or of a fast sensor, which do not tell which, tell no rate") {
  const auto know_nothing = [](const Times& t_ns) {
    return common_period_s({t_ns}) == 0 && can_have_period(t_ns, 0.01);
  };
  CHECK(know_nothing(in_batches(100, 1.0, 1000)));  // 1 kHz for 0.1 s in each second, or 100 Hz
  CHECK(know_nothing(in_batches(8, 4.0, 400)));
  CHECK(know_nothing(in_batches(100, 0.2, 150)));  // too few
  CHECK(know_nothing(in_batches(100, 0.2, 100)));
  CHECK(know_nothing(in_batches(100, 0.01, 100)));
  std::vector<double> strokes_ms(2400, 0.125);  // 8 kHz for 0.3 s in each second, or 2400 Hz
  strokes_ms.back() = 700;
  CHECK(know_nothing(times(strokes_ms, 24000)));
  std::vector<double> uneven_ms;  // of batches of one rate their wait is as long
  for (int stroke = 0; stroke < 10; ++stroke) {
    uneven_ms.insert(uneven_ms.end(), 99, 0.2);
    uneven_ms.push_back(600 + 150 * (stroke % 4));
  }
  CHECK(know_nothing(times(uneven_ms, 1000)));
}

TEST_CASE("64 bits need not hold what lies between two times") {
  constexpr std::int64_t far = 9'000'000'000'000'000'000;
  CHECK(sampled_time({-far, 0, far}).period_s() == Approx(9e9));
  CHECK(sampled_time({-far, far}).period_s() == Approx(1.8e10));
}

TEST_CASE("few stamps lengthen a period where a frame is lost and do not shorten one") {
  CHECK_FALSE(can_be_together(times({10}, 25), times({1000.0 / 120}, 25)));
  CHECK_FALSE(can_be_together(times({10}, 9), times({1000.0 / 150}, 9)));
  auto lost = times({10}, 25);
  for (std::size_t i = 12; i < lost.size(); ++i) lost[i] += 10'000'000;
  CHECK(can_be_together(times({10}, 25), lost));
}

TEST_CASE("a recording may be of the rate that its times tell, whatever came late") {
  auto stalled = times({10}, 200);
  for (std::size_t i = 50; i < 90; ++i) stalled[i] = stalled[90];  // read late, all at once
  CHECK(can_have_period(stalled, 0.01));
  CHECK(can_have_period(times({8, 9, 9, 8, 9}, 101), 0.0086));
  CHECK(can_have_period(times({10}, 100), 0.0104));
  CHECK_FALSE(can_have_period(times({10}, 100), 0.0108));
  CHECK_FALSE(can_have_period(stalled, 0.0116));
  CHECK(can_have_period(times({0}, 100), 0.01));  // tells nothing
  CHECK(can_have_period({7}, 0.01));
}

TEST_CASE("the period in common is the mean one, lost frames counted") {
  const auto clean = times({10}, 400);
  const auto lossy = times({10, 10, 20, 10, 30, 10, 20}, 280);  // a mean of 16 ms
  CHECK(sampled_time(lossy).period_s() == Approx(0.01));
  CHECK(common_period_s({clean, clean, lossy, lossy}) == 0.01);
  CHECK(common_period_s({clean, lossy, in_batches(8, 0.5, 400)}) == Approx(0.01).epsilon(0.01));
  CHECK(common_period_s({times({8, 9, 9, 8, 9}, 101), times({9, 8, 8, 9, 9}, 101)}) ==
        Approx(0.0086));
  CHECK(common_period_s({times({1, 2}, 101), times({2, 1}, 100)}) == Approx(0.0015).epsilon(0.01));
  const auto all_can = [](const std::vector<std::vector<std::int64_t>>& recordings) {
    return std::ranges::all_of(recordings,
                               [period_s = common_period_s(recordings)](const auto& t_ns) {
                                 return can_have_period(t_ns, period_s);
                               });
  };
  CHECK(all_can({clean, lossy}));
  CHECK(all_can({clean, times({1000 / 105.0}, 400)}));
  CHECK(all_can({clean, clean, clean, times({1000 / 105.0}, 400)}));
  CHECK_FALSE(all_can({clean, times({1000 / 116.0}, 400)}));
  CHECK_FALSE(all_can({clean, times({20}, 400)}));
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
