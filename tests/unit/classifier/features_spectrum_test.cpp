#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "classifier/features/fourier.hpp"
#include "classifier/features/spectrum.hpp"
#include "tests/unit/allocations.hpp"
#include "tests/unit/classifier/features_support.hpp"
#include "tests/unit/classifier/slow_features.hpp"

namespace weft::classifier::features_spectrum_test {
namespace {

using testing::noise;
using testing::slow_magnitudes;

constexpr std::size_t most = Spectrum::most_signals;

// The largest value of each of `width` signals, with a row per sample.
std::vector<double> largest_of(std::span<const double> rows, std::size_t width) {
  std::vector<double> out(width, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i)
    out[i % width] = std::max(out[i % width], std::abs(rows[i]));
  return out;
}

// Magnitudes of up to sixteen signals of one length; a row per signal.
std::vector<std::vector<double>> fast_magnitudes(const std::vector<std::vector<double>>& signals) {
  const std::size_t n = signals.front().size();
  const Spectrum spectrum(n);
  simd::AlignedDoubles rows(n * most, 0.0), scratch;
  for (std::size_t s = 0; s < signals.size(); ++s)
    for (std::size_t i = 0; i < n; ++i) rows[i * most + s] = signals[s][i];
  const simd::AlignedDoubles offset(most, 0.0);
  const double* const bins = spectrum.magnitudes<simd::Lanes>(
      rows.data(), offset.data(), largest_of(rows, most).data(), scratch);
  std::vector<std::vector<double>> out(signals.size());
  for (std::size_t s = 0; s < signals.size(); ++s)
    for (std::size_t k = 0; k < spectrum.bins(); ++k) out[s].push_back(bins[k * most + s]);
  return out;
}

TEST_CASE("The spectrum equals the definition at every length up to 40 and at primes") {
  std::vector<std::size_t> lengths = {64, 97, 101, 128, 129, 251, 256, 512};
  for (std::size_t n = 1; n <= 40; ++n) lengths.push_back(n);
  for (const std::size_t n : lengths) {
    INFO("length " << n);
    std::vector<std::vector<double>> signals;
    for (std::uint64_t s = 0; s < most; ++s) signals.push_back(noise(n, 1000 * s + n));
    const auto got = fast_magnitudes(signals);
    double worst = 0.0;
    for (std::size_t s = 0; s < signals.size(); ++s) {
      const auto want = slow_magnitudes(signals[s]);
      for (std::size_t k = 0; k <= n / 2; ++k)
        worst = std::max(worst, std::abs(got[s][k] - want[k]));
    }
    CHECK(worst < 1e-13 * static_cast<double>(n));
  }
}

TEST_CASE("Levels that are taken two at a time have the bits of one after the other") {
  constexpr std::size_t size = 256;
  std::vector<double> w;
  for (std::size_t part = size; part >= 4; part /= 4)
    for (std::size_t j = 0; j < part / 4; ++j)
      for (std::size_t power = 1; power <= 3; ++power)
        for (const double quarter : {0.0, 0.25})
          w.push_back(std::cos(
              2.0 * M_PI * (static_cast<double>(power * j) / static_cast<double>(part) + quarter)));
  const std::vector<double> start = noise(2 * size, 9);
  std::vector<double> one = start, both = start;
  const std::size_t quarter = size / 4;
  const double* const inner = w.data() + quarter * fourier::twiddles_per_butterfly;
  fourier::split<double>(one.data(), size, w.data());
  for (std::size_t q = 0; q < 4; ++q)
    fourier::split<double>(one.data() + 2 * q * quarter, quarter, inner);
  fourier::split_twice<double>(both.data(), size, w.data());
  CHECK(both == one);
  CHECK(both != start);
  for (std::size_t q = 0; q < 4; ++q)
    fourier::join<double>(one.data() + 2 * q * quarter, quarter, inner);
  fourier::join<double>(one.data(), size, w.data());
  fourier::join_twice<double>(both.data(), size, w.data());
  CHECK(both == one);
  double worst = 0.0;
  for (std::size_t i = 0; i < both.size(); ++i)
    worst = std::max(worst, std::abs(both[i] / 16.0 - start[i]));
  CHECK(worst < 1e-11);
}

TEST_CASE("A transform beyond the near cache finds three lines where they were put") {
  // prime: at least 65536 elements of 128 bytes; a power of two: 32768
  const auto n = static_cast<std::size_t>(GENERATE(30'011, 32'768));
  constexpr std::array<std::size_t, 3> bins = {1, 4'999, 15'000};
  std::vector<double> signal(n);
  for (std::size_t i = 0; i < n; ++i)
    for (const std::size_t k : bins)
      signal[i] += std::cos(2.0 * M_PI * static_cast<double>(i * k % n) / static_cast<double>(n));
  const auto got = fast_magnitudes({signal}).front();
  double worst = 0.0;
  for (std::size_t k = 0; k <= n / 2; ++k) {
    const bool line = std::find(bins.begin(), bins.end(), k) != bins.end();
    worst = std::max(worst, std::abs(got[k] - (line ? static_cast<double>(n) / 2.0 : 0.0)));
  }
  CHECK(worst < 1e-13 * static_cast<double>(n));
}

TEST_CASE("Two signals by themselves have the bits that they have among sixteen") {
  for (const std::size_t n : {1U, 5U, 9U, 11U, 13U, 16U, 17U, 32U, 101U, 640U, 2048U}) {
    INFO("length " << n);
    std::vector<std::vector<double>> signals;
    for (std::uint64_t s = 0; s < most; ++s) signals.push_back(noise(n, 1000 * s + n));
    const auto among = fast_magnitudes(signals);
    std::vector<double> rows;
    for (std::size_t i = 0; i < n; ++i)
      rows.insert(rows.end(), {signals[3][i], signals[3 + most / 2][i]});  // both share a transform
    const std::vector<double> offset(2, 0.0);
    simd::AlignedDoubles scratch;
    const Spectrum spectrum(n);
    const double* const bins = spectrum.magnitudes<double>(rows.data(), offset.data(),
                                                           largest_of(rows, 2).data(), scratch);
    bool same = true;
    for (std::size_t k = 0; k < spectrum.bins(); ++k)
      same = same && bins[2 * k] == among[3][k] && bins[2 * k + 1] == among[3 + most / 2][k];
    CHECK(same);
  }
}

TEST_CASE("Parseval: the spectrum of a prime length keeps the signal's energy") {
  const std::size_t n = 911;
  const auto a = noise(n, 1);
  const auto bins = fast_magnitudes({a}).front();
  double time = 0.0, frequency = bins[0] * bins[0];
  for (const double v : a) time += v * v;
  for (std::size_t k = 1; k < bins.size(); ++k) frequency += 2.0 * bins[k] * bins[k];
  CHECK(frequency / static_cast<double>(n) == Approx(time).epsilon(1e-13));
}

TEST_CASE(
    "A weak signal transformed beside strong ones keeps its digits, a silent one its silence") {
  const auto weak = noise(100, 2);
  std::vector<std::vector<double>> signals(most, noise(100, 3));
  for (std::size_t s = 0; s < signals.size(); ++s)
    for (double& v : signals[s]) v *= s == 7 ? 1e-300 : 1e300;
  signals[0] = weak;  // the signal eight places further, in the same transform, is at 1e300
  signals[10].assign(100, 0.0);
  const auto got = fast_magnitudes(signals);
  const auto want = slow_magnitudes(weak), tiny = slow_magnitudes(noise(100, 3));
  for (std::size_t k = 0; k < want.size(); ++k) {
    CHECK(std::abs(got[0][k] - want[k]) < 1e-12);
    CHECK(std::abs(got[7][k] * 1e300 - tiny[k]) < 1e-12);
    CHECK(std::abs(got[15][k] * 1e-300 - tiny[k]) < 1e-12);
  }
  CHECK(got[10] == std::vector<double>(51, 0.0));
}

TEST_CASE("Tables of recent lengths are kept, older ones made again with the same result") {
  SpectrumCache cache;
  const Spectrum* const first = &cache.of(50);
  for (std::size_t n = 100; n < 99 + SpectrumCache::most; ++n) CHECK(cache.of(n).length() == n);
  CHECK(&cache.of(50) == first);
  for (std::size_t n = 100; n < 100 + SpectrumCache::most; ++n) CHECK(cache.of(n).length() == n);
  const std::size_t before = allocations();
  CHECK(cache.of(50).length() == 50);
  CHECK(allocations() > before);  // made again
}

TEST_CASE("Tables of a long motion leave when the next ones would not fit beside them") {
  SpectrumCache cache;
  const Spectrum* const longest = &cache.of(1'000'000);
  const Spectrum* const small = &cache.of(60);
  CHECK(&cache.of(1'000'000) == longest);
  CHECK(&cache.of(60) == small);
  CHECK(cache.of(300'000).length() == 300'000);
  CHECK(&cache.of(60) == small);
  const std::size_t before = allocations();
  CHECK(cache.of(1'000'000).length() == 1'000'000);
  CHECK(allocations() > before);  // made again
}

}  // namespace
}  // namespace weft::classifier::features_spectrum_test
