// The features of sound and vibration for known signals, and their sets and windows.

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <numbers>

#include "classifier/vibro/bin_tables.hpp"
#include "classifier/vibro/extract.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::vibro::vibro_features_test {
namespace {

using classifier::testing::noise;

constexpr std::array all_families = {Family::smmrp, Family::smmrp10, Family::fft, Family::smmrpfft,
                                     Family::all,   Family::bands,   Family::wide};

std::vector<double> sine(double hz, double rate_hz, std::size_t samples, double amplitude = 1.0) {
  std::vector<double> out;
  for (std::size_t i = 0; i < samples; ++i)
    out.push_back(amplitude *
                  std::sin(2.0 * std::numbers::pi * hz * static_cast<double>(i) / rate_hz));
  return out;
}

double figure(const std::vector<double>& samples, double rate_hz, FrameFeature which) {
  const auto all = ChannelExtractor(rate_hz).figures(samples);
  REQUIRE(all);
  return (*all)[static_cast<std::size_t>(which)];
}

TEST_CASE("The moments of a sine are those of a sine") {
  const auto s = sine(100.0, 8000.0, 8000, 2.0);
  CHECK(std::abs(figure(s, 8000.0, FrameFeature::mean)) < 1e-14);
  CHECK(figure(s, 8000.0, FrameFeature::std) == Approx(2.0 / std::numbers::sqrt2).epsilon(1e-12));
  // Half of a sine's values lie within 1/sqrt(2) of its amplitude.
  CHECK(figure(s, 8000.0, FrameFeature::mad) == Approx(2.0 / std::numbers::sqrt2).epsilon(0.01));
  // No crossings beyond the ends, where the edge frames lie with up to half of their length.
  CHECK(figure(s, 8000.0, FrameFeature::zcr) == Approx(200.0 / 8000.0).epsilon(0.1));
}

TEST_CASE("Centroid and roll-off are at the line, bandwidth is the window's, whatever the level") {
  for (const double amplitude : {1e-3, 1.0, 1e6}) {
    const auto s = sine(1000.0, 8000.0, 16000, amplitude);
    // Edge frames, which are half zeros, spread the line.
    CHECK(figure(s, 8000.0, FrameFeature::centroid) == Approx(1000.0).margin(60.0));
    CHECK(figure(s, 8000.0, FrameFeature::rolloff) == Approx(1000.0).margin(60.0));
    CHECK(figure(s, 8000.0, FrameFeature::bandwidth) < 200.0);
  }
  const auto low = sine(500.0, 8000.0, 16000), high = sine(3000.0, 8000.0, 16000);
  CHECK(figure(high, 8000.0, FrameFeature::centroid) >
        figure(low, 8000.0, FrameFeature::centroid) + 2000.0);
}

TEST_CASE("The mean amplitude of a sine is its amplitude over the number of bins") {
  for (const std::size_t n : {800U, 811U, 1024U}) {  // round, prime, a power of two
    const double hz = 40.0 * 8000.0 / static_cast<double>(n);
    const auto s = sine(hz, 8000.0, n, 3.0);
    const auto got = ChannelExtractor(8000.0).mean_amplitude(s);
    REQUIRE(got);
    CHECK(*got == Approx(3.0 / static_cast<double>(n / 2)).epsilon(1e-9));
  }
}

TEST_CASE("A louder signal is louder to the ear by its decibels") {
  auto s = noise(8000, 5);
  const double before = figure(s, 8000.0, FrameFeature::perceptual);
  for (double& v : s) v *= 10.0;
  CHECK(figure(s, 8000.0, FrameFeature::perceptual) == Approx(before + 20.0).epsilon(1e-10));
}

TEST_CASE("The A of every octave belongs to pitch class A alone, most of it") {
  constexpr std::size_t length = 2048, bins = length / 2 + 1, a = 9;
  const auto weights = chroma_weights(2048.0 * 11.0, length);  // bins of 11 Hz: 440 Hz is bin 40
  for (const std::size_t bin : {40U, 80U, 160U}) {
    for (std::size_t c = 0; c < pitch_classes; ++c)
      if (c != a) CHECK(weights[c * bins + bin] < weights[a * bins + bin]);
  }
}

TEST_CASE("A-weighting is 0 dB at 1 kHz and falls to both sides") {
  const auto db = a_weighting_db(8000.0, 8000);  // a bin per Hz
  CHECK(db[1000] == Approx(0.0).margin(0.01));
  CHECK(db[100] == Approx(-19.1).margin(0.1));  // IEC 61672-1, table 3
  CHECK(db[0] == -80.0);
}

TEST_CASE("The median is the middle of the sorted values, or between both middle ones") {
  MedianFinder finder;
  for (const std::size_t n : {1U, 2U, 3U, 24U, 25U, 31U, 64U, 65U, 1000U, 1001U, 8000U}) {
    for (std::uint64_t seed = 0; seed < 7; ++seed) {
      auto v = noise(n, seed);
      if (seed == 1)  // few different values
        for (double& x : v) x = std::nearbyint(x);
      if (seed == 2) v.back() = 1e300;  // all others are near one bound
      if (seed == 4)                    // of all sizes, so that no pivot halves them
        for (double& x : v) x = std::exp(600.0 * x);
      if (seed == 5)  // two in three are equal
        for (double& x : v) x = std::max(x, 0.1);
      if (seed == 6)
        for (double& x : v) x = x < 0.0 ? -1e308 : 1e308;
      const double got = finder.median(v);
      std::sort(v.begin(), v.end());
      CHECK(got == 0.5 * v[(n - 1) / 2] + 0.5 * v[n / 2]);
    }
  }
  CHECK(finder.median({}) == 0.0);
}

const std::vector<Channel> four = {
    {"S", 8000.0, "1"}, {"X", 200.0, "count"}, {"Y", 200.0, "count"}, {"Z", 200.0, "count"}};

TEST_CASE("Sets have the paper's columns, with names and units") {
  const auto names = [](const std::vector<Column>& columns) {
    std::vector<std::string> out;
    for (const Column& c : columns) out.push_back(c.name);
    return out;
  };
  CHECK(names(columns_of(four, {Family::smmrp, Combine::mean})) ==
        std::vector<std::string>{"MEAN", "STD", "MAD", "RMSE", "PERCEPTUAL"});
  CHECK(columns_of(four, {Family::smmrp10, Combine::mean}).size() == 10);
  CHECK(columns_of(four, {Family::smmrpfft, Combine::mean}).size() == 9);
  CHECK(columns_of(four, {Family::all, Combine::concat}).size() == 44);
  CHECK(columns_of(four, {Family::bands, Combine::mean}).size() == 32);
  CHECK(columns_of(four, {Family::wide, Combine::concat}).size() == 44 + 4 * 32);
  CHECK(names(columns_of(four, {Family::fft, Combine::concat})) ==
        std::vector<std::string>{"FFT.S", "FFT.X", "FFT.Y", "FFT.Z"});
  const auto mixed = columns_of(four, {Family::smmrp, Combine::mean});
  CHECK(mixed.front().unit == "mixed");
  CHECK(mixed.back().unit == "dB");
  CHECK(columns_of(four, {Family::smmrp, Combine::concat})[5].name == "MEAN.X");
  CHECK(columns_of(four, {Family::smmrp, Combine::concat})[5].unit == "count");
  for (const Family f : all_families) CHECK(family_from(to_string(f)).value() == f);
  CHECK_FALSE(family_from("smmrp"));
  CHECK_FALSE(combine_from("sum"));
}

Recording recording(std::uint64_t seed, double seconds = 4.0) {
  Recording out;
  out.file = std::to_string(seed).append(".wav");
  out.label = "texture";
  out.channels = four;
  for (std::size_t c = 0; c < four.size(); ++c)
    out.samples.push_back(noise(samples_in(seconds, four[c].rate_hz), 10 * seed + c));
  return out;
}

TEST_CASE("A column of the mean is the mean of the columns side by side") {
  const Recording r = recording(3);
  const auto window = window_at(r, 1.0, 1.0).value();
  auto mean = WindowExtractor::make(four, {Family::all, Combine::mean}).value();
  auto concat = WindowExtractor::make(four, {Family::all, Combine::concat}).value();
  const auto a = mean.features(window).value();
  const auto b = concat.features(window).value();
  for (std::size_t k = 0; k < figure_count; ++k) {
    const double sum = b[k] + b[k + 10] + b[k + 20] + b[k + 30];
    CHECK(a[k] == Approx(sum / 4.0).epsilon(1e-12));
  }
  for (std::size_t c = 0; c < 4; ++c) CHECK(a[10 + c] == b[40 + c]);
}

TEST_CASE("Smaller sets are columns of the largest one, bit for bit") {
  const auto window_of = recording(4);
  const auto window = window_at(window_of, 0.5, 2.0).value();
  auto all = WindowExtractor::make(four, {Family::wide, Combine::concat}).value();
  const auto want = all.features(window).value();
  for (const Family family : all_families) {
    auto own = WindowExtractor::make(four, {family, Combine::concat}).value();
    const auto got = own.features(window).value();
    for (std::size_t k = 0; k < got.size(); ++k) {
      const auto at =
          std::find_if(all.columns().begin(), all.columns().end(),
                       [&](const Column& c) { return c.name == own.columns()[k].name; });
      REQUIRE(at != all.columns().end());
      CHECK(got[k] == want[static_cast<std::size_t>(at - all.columns().begin())]);
    }
  }
}

TEST_CASE("Windows of blocks share no sample with those of another block; random ones do") {
  const auto blocks = block_places(recording(1, 15.0), 2.0, 5, 0.25);
  REQUIRE(blocks.size() == 25);
  for (const Place& a : blocks)
    for (const Place& b : blocks)
      if (a.block != b.block) CHECK(std::abs(a.start_s - b.start_s) >= 2.0 - 1e-9);
  CHECK(blocks.back().start_s == Approx(13.0));

  const auto random = random_places(recording(1, 20.0), 2.0, 100, 7);
  REQUIRE(random.size() == 100);
  CHECK(random.front().start_s == random_places(recording(2, 20.0), 2.0, 100, 7).front().start_s);
  const std::span<const Place> places(random);
  // docs/reference/machine-learning.md, Overlap of random windows: 96.5 % of a test window.
  CHECK(random_places(recording(1, 1.0), 2.0, 10, 1).empty());
  CHECK(random_places(recording(1, 2.0), 2.0, 10, 1).size() == 1);
}

TEST_CASE("A set of windows is the same on any number of threads, and names what it refuses") {
  std::vector<Recording> recordings = {recording(1), recording(2)};
  recordings[1].label = "other";
  recordings[1].group = "b";
  const auto places = [](const Recording& r) { return block_places(r, 1.0, 2, 0.5); };
  const auto one = cut_and_extract(recordings, 1.0, places, {Family::all, Combine::mean}, 1);
  const auto two = cut_and_extract(recordings, 1.0, places, {Family::all, Combine::mean}, 2);
  REQUIRE(one);
  REQUIRE(two);
  CHECK(one->matrix.values.data() == two->matrix.values.data());
  REQUIRE(one->matrix.size() == 12);
  CHECK(one->matrix.files[7] == "2.wav#w1");
  CHECK(one->matrix.labels[7] == "other");
  CHECK(one->matrix.groups[7] == "b");
  CHECK(one->recording[7] == 1);
  CHECK(check(one->matrix));

  recordings[1].samples[2][150] = std::nan("");
  const auto refused = cut_and_extract(recordings, 1.0, places, {});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where == "2.wav#w0: Y: sample 150");
  recordings[1].channels.pop_back();
  CHECK_FALSE(cut_and_extract(recordings, 1.0, places, {}));
}

TEST_CASE("Bands divide the spectrum, and a line lies in its own band") {
  for (const std::size_t bins : {2U, 3U, 9U, 17U, 33U, 65U, 1025U}) {
    const auto edges = band_edges(bins);
    for (std::size_t b = 0; b < band_count; ++b) CHECK(edges[b] <= edges[b + 1]);
    CHECK(edges.back() == bins);
  }
  std::vector<double> line(8000);
  for (std::size_t i = 0; i < line.size(); ++i)
    line[i] = std::sin(2.0 * std::numbers::pi * 1000.0 * static_cast<double>(i) / 8000.0);
  BandFeatures bands{};
  REQUIRE(ChannelExtractor(8000.0).figures(line, false, &bands));
  const auto loudest = static_cast<std::size_t>(
      std::max_element(bands.begin(), bands.begin() + band_count) - bands.begin());
  const auto edges = band_edges(1025);
  CHECK((edges[loudest] <= 256 && 256 < edges[loudest + 1]));  // 1000 Hz is bin 256
  REQUIRE(ChannelExtractor(8000.0).figures(std::vector<double>(8000, 0.0), false, &bands));
  CHECK(bands[0] == -100.0);
  CHECK(bands[band_count] == 0.0);
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_features_test
