#include "daemon/storage/dataset/sample_times.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace weft::daemon::sample_times_test {
namespace {

// Times with these intervals [ms], repeated.
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

// Samples read in batches of `batch`, 100 a second.
std::vector<std::int64_t> in_batches(std::size_t batch, double within_ms, int samples) {
  std::vector<double> intervals_ms(batch, within_ms);
  intervals_ms.back() =
      10.0 * static_cast<double>(batch) - within_ms * static_cast<double>(batch - 1);
  return times(intervals_ms, samples);
}

TEST_CASE("a pause is where no sample was taken, not where an adapter held samples back") {
  const auto even = times({20.0}, 200);
  CHECK(samples_after_pause(even).empty());
  CHECK(samples_after_pause({}).empty());
  CHECK(samples_after_pause(paused(even, {70, 130})) == std::vector<std::size_t>{70, 130});
  auto lost = even;  // 14 samples between two that follow each other, 0.3 s
  lost.erase(lost.begin() + 70, lost.begin() + 84);
  CHECK(samples_after_pause(lost) == std::vector<std::size_t>{70});
  auto one_lost = even;
  one_lost.erase(one_lost.begin() + 70);
  CHECK(samples_after_pause(one_lost).empty());
  auto held_back = even;  // for 0.3 s, and then all at once
  for (std::size_t i = 70; i < 84; ++i)
    held_back[i] = held_back[84] + static_cast<std::int64_t>(i) - 84;
  CHECK(samples_after_pause(held_back).empty());
  CHECK(samples_after_pause(in_batches(10, 0.1, 500)).empty());
}

constexpr double seconds = 6.0;
constexpr double tick_s = 0.015625;  // tick of Windows

using Times = std::vector<std::int64_t>;

Times in_ns(const std::vector<double>& t_s) {
  Times out;
  for (const double t : t_s) out.push_back(std::llround(1e9 * t));
  return out;
}

// Even samples with time stamps of a clock with this step.
Times ticked(double rate_hz, double step_s, double begin_s = 0.003) {
  std::vector<double> out;
  for (int i = 0; i < rate_hz * seconds; ++i)
    out.push_back(std::floor((begin_s + i / rate_hz) / step_s) * step_s);
  return in_ns(out);
}

// Samples of 100 Hz of which this share is lost, with normal scatter of the stamps.
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

// Samples of 100 Hz by a reader that stalls for 50 ms at this share of them, and then catches up.
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

double rate_hz(const Times& t_ns) {
  return 1 / sampled_time(t_ns).period_s();
}

// Such times are refused if a rate is needed, and are not compared with any.
bool know_nothing(const Times& t_ns) {
  return sampled_time(t_ns).intervals == 0 && common_period_s({t_ns}) == 0 &&
         can_have_period(t_ns, 0.01);
}

bool can_be_together(const Times& a, const Times& b) {
  const double period_s = common_period_s({a, a, b, b});
  return can_have_period(a, period_s) && can_have_period(b, period_s);
}

TEST_CASE("regular samples have their rate, to the step of their stamps") {
  CHECK(sampled_time(times({10}, 100)).period_s() == 0.01);
  CHECK(sampled_time(times({8, 9, 9, 8, 9}, 101)).period_s() == Approx(0.0086));
  CHECK(sampled_time(times({27, 28, 28, 29, 28}, 101)).period_s() == Approx(0.028));
  CHECK(sampled_time(times({10, 10.05, 9.95}, 301)).period_s() == Approx(0.01));
  for (const double hz : {37.0, 55.0, 100.0, 180.0, 300.0, 390.0})
    CHECK(rate_hz(ticked(hz, 0.001)) == Approx(hz).epsilon(0.005));
}

TEST_CASE("two rates are two in coarse stamps as well") {
  CHECK_FALSE(can_be_together(ticked(300, 0.001), ticked(390, 0.001)));
  CHECK_FALSE(can_be_together(ticked(50, 0.001), ticked(60, 0.001)));
  CHECK(can_be_together(ticked(60, 0.001), ticked(60, 1e-6)));
}

TEST_CASE("the step of a clock that is as long as half a period hides the rate") {
  for (const double hz : {50.0, 55.0, 100.0, 115.0, 120.0, 125.0, 180.0}) {
    CAPTURE(hz);
    CHECK(know_nothing(ticked(hz, tick_s)));
  }
  for (const double hz : {700.0, 833.0, 900.0, 950.0}) CHECK(know_nothing(ticked(hz, 0.001)));
  for (const double hz : {75.0, 85.0, 90.0, 95.0}) CHECK(know_nothing(ticked(hz, 0.01)));
  CHECK(know_nothing(times({10, 10, 10, 10, 20}, 101)));
}

TEST_CASE("one interval in a hundred may be another: a lost or a late sample") {
  for (unsigned seed = 0; seed < 8; ++seed) {
    CAPTURE(seed);
    CHECK(rate_hz(lossy(0, 0, seed)) == Approx(100));
    CHECK(know_nothing(lossy(0.1, 0, seed)));
    CHECK(know_nothing(lossy(0, 0.003, seed)));
    CHECK(know_nothing(stalling(0.05, seed)));
  }
  auto lost = times({10}, 25);
  for (std::size_t i = 12; i < lost.size(); ++i) lost[i] += 10'000'000;
  CHECK(rate_hz(lost) == Approx(100));
  for (std::size_t i = 20; i < lost.size(); ++i) lost[i] += 10'000'000;
  CHECK(know_nothing(lost));
  std::vector<double> one_in_128(127, 10.0);
  one_in_128.back() = 20;
  CHECK(rate_hz(times(one_in_128, 5000)) == Approx(100));
}

TEST_CASE("the period of samples is that between pauses") {
  const SampledTime once = sampled_time(paused(times({10}, 100), {50}));
  CHECK(once.period_s() == 0.01);
  CHECK(once.intervals == 98);
  CHECK(sampled_time(paused(times({10}, 300), {50, 100, 250})).period_s() == 0.01);
  CHECK(sampled_time(paused(times({10}, 60), {10, 20, 50})).period_s() == 0.01);
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

TEST_CASE("samples that were read in batches give no rate") {
  for (const std::size_t batch : {2U, 3U, 4U, 5U, 8U, 16U, 60U, 100U, 500U})
    for (const double within_ms : {0.0, 0.01, 0.05, 0.2}) {
      CAPTURE(batch, within_ms);
      CHECK(know_nothing(in_batches(batch, within_ms, 3000)));
      CHECK(know_nothing(paused(in_batches(batch, within_ms, 3000), {600, 1500})));
    }
  CHECK(know_nothing(in_batches(100, 1.0, 1000)));  // 1 kHz for 0.1 s in each second, or 100 Hz
  CHECK(know_nothing(in_batches(8, 4.0, 400)));
  CHECK(know_nothing(in_batches(100, 0.2, 150)));
  CHECK(know_nothing(times({0, 0, 0, 0, 0, 0, 0, 80}, 81)));
  std::vector<double> strokes_ms(2400, 0.125);  // 8 kHz for 0.3 s in each second, or 2400 Hz
  strokes_ms.back() = 700;
  CHECK(know_nothing(times(strokes_ms, 24000)));
}

TEST_CASE("64 bits need not hold what lies between two times") {
  constexpr std::int64_t far = 9'000'000'000'000'000'000;
  CHECK(sampled_time({-far, 0, far}).period_s() == Approx(9e9));
  CHECK(sampled_time({-far, far}).period_s() == Approx(1.8e10));
}

TEST_CASE("different rates are distinguished with few samples") {
  CHECK_FALSE(can_be_together(times({10}, 25), times({1000.0 / 120}, 25)));
  CHECK_FALSE(can_be_together(times({10}, 9), times({1000.0 / 150}, 9)));
  auto lost = times({10}, 25);
  for (std::size_t i = 12; i < lost.size(); ++i) lost[i] += 10'000'000;
  CHECK(can_be_together(times({10}, 25), lost));
}

TEST_CASE("a recording may have the rate of its times, or any rate if they give none") {
  CHECK(can_have_period(times({8, 9, 9, 8, 9}, 101), 0.0086));
  CHECK(can_have_period(times({10}, 100), 0.0104));
  CHECK_FALSE(can_have_period(times({10}, 100), 0.0108));
  CHECK_FALSE(can_have_period(times({10}, 100), 0.0116));
  CHECK(can_have_period(times({0}, 100), 0.01));
  CHECK(can_have_period({7}, 0.01));
}

TEST_CASE("the period in common is the mean one") {
  const auto clean = times({10}, 400);
  CHECK(common_period_s({clean, clean, lossy(0.3, 0, 1)}) == 0.01);  // which has no rate
  CHECK(common_period_s({times({8, 9, 9, 8, 9}, 101), times({9, 8, 8, 9, 9}, 101)}) ==
        Approx(0.0086));
  CHECK(common_period_s({times({1, 2}, 101), times({2, 1}, 100)}) == Approx(0.0015).epsilon(0.01));
  const auto all_can = [](const std::vector<std::vector<std::int64_t>>& recordings) {
    return std::ranges::all_of(recordings,
                               [period_s = common_period_s(recordings)](const auto& t_ns) {
                                 return can_have_period(t_ns, period_s);
                               });
  };
  CHECK(all_can({clean, lossy(0.3, 0, 1)}));
  CHECK(all_can({clean, times({1000 / 105.0}, 400)}));
  CHECK(all_can({clean, clean, clean, times({1000 / 105.0}, 400)}));
  CHECK_FALSE(all_can({clean, times({1000 / 116.0}, 400)}));
  CHECK_FALSE(all_can({clean, times({20}, 400)}));
  CHECK(common_period_s({}) == 0);
  CHECK(common_period_s({{5}, {}}) == 0);
}

TEST_CASE("one sample, or none, gives no period") {
  CHECK(sampled_time({}).period_s() == 0);
  CHECK(sampled_time({5}).period_s() == 0);
  CHECK(sampled_time({5, 5}).period_s() == 0);
}

}  // namespace
}  // namespace weft::daemon::sample_times_test
