// Sound and vibration at their extremes: a documented value or a clear error, never a NaN.

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "classifier/vibro/stream.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::vibro::vibro_extremes_test {
namespace {

using classifier::testing::noise;

ChannelFeatures figures(const std::vector<double>& samples, double rate_hz = 8000.0) {
  ChannelExtractor extractor(rate_hz);
  const auto out = extractor.figures(samples);
  REQUIRE(out);
  for (const double v : *out) REQUIRE(std::isfinite(v));
  const auto fft = extractor.mean_amplitude(samples);
  REQUIRE(fft);
  REQUIRE(std::isfinite(*fft));
  return *out;
}

double get(const ChannelFeatures& all, FrameFeature which) {
  return all[static_cast<std::size_t>(which)];
}

TEST_CASE("A silent window is all zeros but the ear's floor") {
  const auto f = figures(std::vector<double>(8000, 0.0));
  for (const FrameFeature k : {FrameFeature::mean, FrameFeature::std, FrameFeature::mad,
                               FrameFeature::rmse, FrameFeature::chroma, FrameFeature::centroid,
                               FrameFeature::bandwidth, FrameFeature::rolloff, FrameFeature::zcr})
    CHECK(get(f, k) == 0.0);
  CHECK(get(f, FrameFeature::perceptual) < -100.0);  // -100 dB, the least power, A-weighted
}

TEST_CASE("A constant has its level, no spread and no change of sign") {
  const auto f = figures(std::vector<double>(16000, -2.5));
  CHECK(get(f, FrameFeature::mean) == -2.5);
  CHECK(get(f, FrameFeature::std) == 0.0);
  CHECK(get(f, FrameFeature::mad) == 0.0);
  CHECK(get(f, FrameFeature::zcr) == 0.0);
  CHECK(get(f, FrameFeature::rmse) > 2.0);  // both ends of the window are half frames
  CHECK(get(f, FrameFeature::centroid) < 100.0);
  CHECK(ChannelExtractor(8000.0).mean_amplitude(std::vector<double>(16000, -2.5)).value() == 0.0);
}

TEST_CASE("One sample, two, three and a few have features") {
  for (std::size_t n = 1; n <= 20; ++n) {
    INFO(n << " samples");
    figures(noise(n, n));
    figures(std::vector<double>(n, 0.0));
  }
  const auto one = figures({3.0});
  CHECK(get(one, FrameFeature::mean) == 3.0);
  CHECK(get(one, FrameFeature::std) == 0.0);
  CHECK(ChannelExtractor(8000.0).mean_amplitude(std::vector{3.0}).value() == 0.0);
}

TEST_CASE("A clipped signal has finite features, with its deviation below the clip") {
  auto s = noise(16000, 1);
  for (double& v : s) v = std::clamp(10.0 * v, -1.0, 1.0);
  const auto f = figures(s);
  CHECK(get(f, FrameFeature::std) <= 1.0);
  // More than half of all samples are at the clip limit, the median is in the middle.
  CHECK(get(f, FrameFeature::mad) == Approx(1.0).epsilon(0.02));
}

TEST_CASE("A second of 44.1 kHz has features, and so have rates and levels far away") {
  const auto f = figures(noise(44100, 2), 44100.0);
  CHECK(get(f, FrameFeature::centroid) == Approx(11025.0).epsilon(0.05));  // white: the middle
  figures(noise(500, 3), 1e-3);
  figures(noise(500, 3), 1e9);
  auto s = noise(3000, 4);
  for (double& v : s) v *= 1e-200;
  figures(s);
  for (double& v : s) v = std::copysign(std::numeric_limits<double>::denorm_min(), v);
  figures(s);
}

TEST_CASE("Samples that are not finite are named; those that overflow a feature are refused") {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    auto s = noise(8000, 5);
    s[4321] = bad;
    ChannelExtractor extractor(8000.0);
    const auto refused = extractor.figures(s);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == "sample 4321");
    CHECK_FALSE(extractor.mean_amplitude(s));
    s[4321] = 0.0;
    CHECK(extractor.figures(s));
  }
  auto s = noise(8000, 6);
  for (double& v : s) v *= 1e160;
  const auto refused = ChannelExtractor(8000.0).figures(s);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::range);
  CHECK_FALSE(ChannelExtractor(8000.0).figures({}));
  CHECK_FALSE(ChannelExtractor(8000.0).mean_amplitude({}));
  CHECK_FALSE(ChannelExtractor(8000.0).figures(
      std::vector<double>(ChannelExtractor::most_samples + 1, 0.0)));
}

TEST_CASE("Channels without a rate, without a name of their own or not at all are refused") {
  CHECK_FALSE(WindowExtractor::make({}, {}));
  CHECK_FALSE(WindowExtractor::make({{"S", 0.0, ""}}, {}));
  CHECK_FALSE(WindowExtractor::make({{"S", std::nan(""), ""}}, {}));
  CHECK_FALSE(WindowExtractor::make({{"X", 200.0, ""}, {"X", 200.0, ""}}, {}));
  auto one = WindowExtractor::make({{"X", 200.0, ""}}, {}).value();
  CHECK_FALSE(one.features({}));
  Recording r;
  r.channels = {{"X", 200.0, ""}};
  r.samples = {noise(200, 1)};
  CHECK(window_at(r, 0.0, 1.0));
  CHECK_FALSE(window_at(r, 0.1, 1.0));
  CHECK_FALSE(window_at(r, 0.0, 0.0));
  CHECK_FALSE(window_at(Recording{}, 0.0, 1.0));
}

// Two channels, with samples in odd pieces at unequal rates.
std::vector<std::vector<double>> streamed(const Recording& r, FeatureChoice choice,
                                          WindowStream::Timing timing, std::uint64_t seed) {
  auto stream = WindowStream::make(r.channels, choice, timing).value();
  RandomEngine engine(seed);
  std::vector<std::size_t> at(r.channels.size(), 0);
  std::vector<std::vector<double>> out;
  while (at != std::vector{r.samples[0].size(), r.samples[1].size()}) {
    const std::size_t c = random_below(engine, at.size());
    const std::size_t piece =
        std::min(random_below(engine, c == 0 ? 1700 : 61), r.samples[c].size() - at[c]);
    REQUIRE(stream.add(c, std::span(r.samples[c]).subspan(at[c], piece)));
    at[c] += piece;
    for (;;) {
      const auto next = stream.next();
      REQUIRE(next);
      if (!*next) break;
      out.emplace_back((*next)->begin(), (*next)->end());
    }
  }
  CHECK(stream.taken() == out.size());
  return out;
}

TEST_CASE("Features while samples come in have the bits of those of the whole recording") {
  Recording r;
  r.file = "r";
  r.channels = {{"S", 8000.0, "1"}, {"X", 200.0, "count"}};
  r.samples = {noise(8000 * 5 + 3, 1), noise(200 * 5 + 7, 2)};
  const FeatureChoice choice{Family::all, Combine::concat};
  for (const WindowStream::Timing timing :
       {WindowStream::Timing{1.0, 1.0}, {2.0, 0.35}, {0.5, 1.25}}) {
    const auto live = streamed(r, choice, timing, 9);
    auto batch = WindowExtractor::make(r.channels, choice).value();
    std::size_t windows = 0;
    for (;; ++windows) {
      const auto window =
          window_at(r, static_cast<double>(windows) * timing.step_s, timing.window_s);
      if (!window) break;
      const auto row = batch.features(*window).value();
      REQUIRE(windows < live.size());
      CHECK(live[windows] == std::vector<double>(row.begin(), row.end()));
    }
    CHECK(live.size() == windows);
  }
}

TEST_CASE("A stream refuses what it cannot take and goes on as before") {
  auto stream =
      WindowStream::make({{"X", 200.0, "1"}}, {Family::smmrp, Combine::mean}, {1.0, 1.0}).value();
  const std::vector<double> good = noise(150, 3), bad = {1.0, std::nan("")};
  REQUIRE(stream.add(0, good));
  const auto refused = stream.add(0, bad);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == "X: sample 151");
  CHECK_FALSE(stream.add(1, good));
  REQUIRE(stream.add(0, good));
  CHECK(stream.next().value().has_value());
  CHECK_FALSE(stream.next().value().has_value());
  CHECK_FALSE(WindowStream::make({{"X", 200.0, "1"}}, {}, {1.0, 0.0}));
  CHECK_FALSE(WindowStream::make({{"X", 200.0, "1"}}, {}, {0.001, 1.0}));
  CHECK_FALSE(WindowStream::make({{"X", 200.0, "1"}}, {}, {std::nan(""), 1.0}));
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_extremes_test
