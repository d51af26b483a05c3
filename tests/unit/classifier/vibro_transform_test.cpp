// The transforms behind the features of sound and vibration, compared with their definitions.

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "classifier/vibro/bin_tables.hpp"
#include "classifier/vibro/level_features.hpp"
#include "classifier/vibro/real_transform.hpp"
#include "classifier/vibro/short_time.hpp"
#include "tests/unit/classifier/features_support.hpp"
#include "tests/unit/classifier/slow_features.hpp"

namespace weft::classifier::vibro::vibro_transform_test {
namespace {

using classifier::testing::noise;
using classifier::testing::slow_magnitudes;

constexpr std::size_t lanes = ShortTimeSpectrum::lanes;

// Frame f of a window by definition: centred at f hops, zeros beyond both ends, Hann.
std::vector<double> frame_of(const std::vector<double>& samples, FrameSize size, std::size_t f) {
  std::vector<double> out(size.length, 0.0);
  for (std::size_t i = 0; i < size.length; ++i) {
    const std::size_t at = f * size.hop + i, before = size.length / 2;
    const double turn =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(size.length);
    if (at >= before && at - before < samples.size())
      out[i] = samples[at - before] * (0.5 - 0.5 * std::cos(turn));
  }
  return out;
}

constexpr double rate_hz = 8000.0;

// The sums of one frame equal the sums of its bins by definition.
void check_sums(const BinSums& sums, std::size_t f, const std::vector<double>& bins,
                std::size_t length) {
  const std::vector<double> weights = chroma_weights(rate_hz, length);
  double magnitude = 0.0, moment = 0.0, most = 0.0;
  std::vector<double> power(pitch_classes, 0.0);
  for (std::size_t k = 0; k < bins.size(); ++k) {
    magnitude += bins[k];
    moment += bins[k] * rate_hz * static_cast<double>(k) / static_cast<double>(length);
    for (std::size_t c = 0; c < pitch_classes; ++c)
      power[c] += bins[k] * bins[k] * weights[c * bins.size() + k];
  }
  CHECK(sums.magnitude[f] == Approx(magnitude).epsilon(1e-13));
  CHECK(sums.moment_hz[f] == Approx(moment).epsilon(1e-13));
  CHECK(sums.loudest[f] == *std::max_element(bins.begin(), bins.end()));
  for (const double v : power) most = std::max(most, v);
  for (std::size_t c = 0; c < pitch_classes; ++c)
    CHECK(std::abs(sums.power[c][f] - power[c]) <= 2e-12 * most);
}

// The largest difference of a bin of a frame from its definition, relative to the frame's loudest
// bin; a silent frame must be exactly silent.
double worst_of(ShortTimeSpectrum& spectrum, const std::vector<double>& samples) {
  const BinTables tables(rate_hz, spectrum.size().length);
  spectrum.start(samples);
  std::vector<double> got(spectrum.bins() * lanes);
  double worst = 0.0;
  const std::size_t frames = spectrum.size().count(samples.size());
  for (std::size_t first = 0; first < frames; first += lanes) {
    const BinSums sums = spectrum.magnitudes(first, tables, true, got.data());
    for (std::size_t f = 0; f < lanes; ++f) {
      std::vector<double> own;
      for (std::size_t k = 0; k < spectrum.bins(); ++k) own.push_back(got[k * lanes + f]);
      check_sums(sums, f, own, spectrum.size().length);
      std::vector<double> want(spectrum.bins(), 0.0);
      if (first + f < frames) want = slow_magnitudes(frame_of(samples, spectrum.size(), first + f));
      const double loudest = *std::max_element(want.begin(), want.end());
      for (std::size_t k = 0; k < want.size(); ++k) {
        const double off = std::abs(got[k * lanes + f] - want[k]);
        if (loudest == 0.0) CHECK(off == 0.0);
        if (loudest > 0.0) worst = std::max(worst, off / loudest);
      }
    }
  }
  return worst;
}

TEST_CASE("Frames have the magnitudes of their definition at every length of a window") {
  for (const std::size_t n : {1U, 2U, 3U, 4U, 7U, 8U, 17U, 40U, 64U, 100U, 200U, 333U}) {
    INFO(n << " samples");
    ShortTimeSpectrum spectrum(FrameSize::of(n));
    CHECK(worst_of(spectrum, noise(n, n)) < 1e-13);
  }
}

TEST_CASE("Without pitch classes the magnitudes and the other sums are the same") {
  for (const std::size_t n : {3U, 17U, 200U}) {
    INFO(n << " samples");
    ShortTimeSpectrum spectrum(FrameSize::of(n));
    const BinTables tables(rate_hz, spectrum.size().length);
    spectrum.start(noise(n, n));
    std::vector<double> with(spectrum.bins() * lanes), without(with.size());
    const BinSums all = spectrum.magnitudes(0, tables, true, with.data());
    const BinSums some = spectrum.magnitudes(0, tables, false, without.data());
    CHECK(with == without);
    CHECK(all.magnitude == some.magnitude);
    CHECK(all.moment_hz == some.moment_hz);
    CHECK(all.loudest == some.loudest);
    CHECK(some.power[3] == PerFrame{});
  }
}

TEST_CASE("A bin contributes to the classes near its pitch, and its whole weight is kept") {
  for (const auto& [rate, length] : {std::pair{8000.0, 2048},
                                     {44100.0, 2048},
                                     {200.0, 128},
                                     {200.0, 2},
                                     {8000.0, 16},
                                     {1.0, 64}}) {
    INFO(rate << " Hz, " << length);
    const BinTables tables(rate, static_cast<std::size_t>(length));
    const auto weights = chroma_weights(rate, static_cast<std::size_t>(length));
    CHECK(tables.wide_bins <= 20);  // a semitone is 6 % of a frequency
    std::size_t next = tables.wide_bins;
    for (const ClassRun& run : tables.runs) {
      CHECK(run.first_bin == next);
      next = run.end_bin;
      CHECK(run.first_class < pitch_classes);
      for (std::size_t k = run.first_bin; k < run.end_bin; ++k)
        for (std::size_t i = 0; i < pitch_classes; ++i) {
          const std::size_t c = (run.first_class + i) % pitch_classes;
          const double weight = weights[c * tables.bins + k];
          if (i < near_classes)
            CHECK(tables.near_chroma[(k - tables.wide_bins) * near_classes + i] == weight);
          else
            CHECK(weight < 1e-13);
        }
    }
    CHECK(next == tables.bins);
  }
}

TEST_CASE("A window of another length leaves nothing of the one before") {
  ShortTimeSpectrum spectrum(FrameSize::of(100));
  CHECK(worst_of(spectrum, noise(127, 1)) < 1e-13);
  CHECK(worst_of(spectrum, noise(64, 2)) < 1e-13);
  CHECK(worst_of(spectrum, noise(100, 3)) < 1e-13);
  CHECK(worst_of(spectrum, noise(100, 4)) < 1e-13);
}

TEST_CASE("A weak frame is as exact as the strong one that shares its transform") {
  // Frame 0 and frame 8 share one transform. Frame 0 of the second window has one sample, with a
  // weight of 1e-6; in the third no sample has any weight.
  std::vector<double> weak = noise(256, 5), edge(256, 0.0), none(256, 0.0);
  ShortTimeSpectrum spectrum(FrameSize::of(64));
  for (std::size_t i = 0; i < 48; ++i) weak[i] *= 1e-12;
  for (std::size_t i = 96; i < 160; ++i) edge[i] = none[i] = weak[i];
  edge[31] = 1.0;
  none[32] = 1.0;
  for (const auto& samples : {weak, edge, none}) CHECK(worst_of(spectrum, samples) < 1e-13);
}

TEST_CASE("The sum of a whole spectrum is that of its definition") {
  for (const std::size_t n : {16U, 32U, 48U, 64U, 80U, 96U, 144U, 160U, 240U, 400U, 960U, 1200U}) {
    INFO(n << " samples");
    REQUIRE(RealTransform::fits(n));
    auto samples = noise(n, n);
    RealTransform transform(n);
    CHECK(transform.length() == n);
    const auto bins = slow_magnitudes(samples);
    const double want = std::accumulate(bins.begin() + 1, bins.end(), 0.0);
    for (double& v : samples) v += 3.0;
    CHECK(transform.sum_of_magnitudes(samples, 3.0) == Approx(want).epsilon(1e-12));
  }
  for (const std::size_t n : {0U, 1U, 8U, 15U, 17U, 200U, 112U}) CHECK(!RealTransform::fits(n));
}

TEST_CASE("Sums of a window are the same whatever is left behind whole groups") {
  for (std::size_t n = 1; n <= 40; ++n) {
    INFO(n << " samples");
    auto v = noise(n, n);
    if (n > 3) v[2] = -0.5e-10;  // too small to have a sign
    double sum = 0.0, squares = 0.0;
    std::size_t changes = 0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += v[i];
      squares += (v[i] - 0.5) * (v[i] - 0.5);
      if (i > 0) changes += (v[i] < -zero_level) != (v[i - 1] < -zero_level) ? 1 : 0;
    }
    CHECK(sum_of(v) == Approx(sum).margin(1e-14));
    CHECK(sum_of_squares(v, 0.5) == Approx(squares).epsilon(1e-14));
    CHECK(changes_of_sign(v) == changes);
    std::vector<double> away(n);
    deviations(v, 0.5, away.data());
    for (std::size_t i = 0; i < n; ++i) CHECK(away[i] == std::abs(v[i] - 0.5));
  }
  CHECK(changes_of_sign({}) == 0);
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_transform_test
