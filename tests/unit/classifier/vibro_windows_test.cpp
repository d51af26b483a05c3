// Windows with a fractional number of samples, and their shared parts.

#include <catch2/catch.hpp>

#include <tuple>

#include "classifier/vibro/protocol.hpp"
#include "protocols/base/hash.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::vibro::vibro_windows_test {
namespace {

using classifier::testing::noise;

// `samples` samples of one channel.
Recording of_samples(std::size_t samples, double rate_hz) {
  Recording out;
  out.file = std::to_string(samples);
  out.label = "a";
  out.channels = {{"X", rate_hz, "1"}};
  out.samples = {noise(samples, 1)};
  return out;
}

TEST_CASE("No window holds a sample of a gap, and behind one they begin anew") {
  Recording own = of_samples(1000, 100.0);
  const auto starts = [&](std::size_t blocks) {
    std::vector<double> out;
    for (const Place& place : block_places(own, 2.0, blocks, 2.0)) out.push_back(place.start_s);
    return out;
  };
  CHECK(starts(1) == std::vector<double>{0, 2, 4, 6, 8});
  own.gaps = {{3.5, 3.5}, {7.0, 7.5}};
  CHECK(starts(1) == std::vector<double>{0, 3.5, 7.5});
  CHECK(starts(2) == std::vector<double>{0, 5, 7.5});
  const auto drawn = random_places(own, 2.0, 100000, 1);
  CHECK(drawn.size() > 200);
  for (const Place& place : drawn) {
    const std::size_t first = first_sample(place.start_s, 100.0), end = first + 200;
    CHECK((end <= 350 || first >= 350));
    CHECK((end <= 700 || first >= 750));
  }
}

TEST_CASE("Windows that are no whole number of samples stay in their part and in the recording") {
  for (const auto& [samples, rate_hz, window_s, step_s] :
       {std::tuple(std::size_t{110250}, 11025.0, 0.5, 0.25), {263, 25.0, 0.5, 0.1}}) {
    CAPTURE(samples, rate_hz);
    const Recording own = of_samples(samples, rate_hz);
    const std::size_t count = samples_in(window_s, rate_hz);
    for (const Protocol protocol : {Protocol::random, Protocol::blocks, Protocol::groups}) {
      ProtocolOptions options;
      options.protocol = protocol;
      options.window_s = window_s;
      options.step_s = step_s;
      options.per_recording = 100000;
      const auto places = places_of(options)(own);
      CHECK(places.size() > 20);
      for (const Place& a : places) {
        CHECK(window_at(own, a.start_s, window_s));
        const std::size_t first = first_sample(a.start_s, rate_hz);
        for (const Place& b : places)
          if (a.block < b.block) CHECK(first + count <= first_sample(b.start_s, rate_hz));
      }
    }
  }
}

TEST_CASE("Random windows depend on seed and file, by a hash of our own") {
  Recording own = of_samples(1000, 100.0);
  ProtocolOptions options;
  options.protocol = Protocol::random;
  options.window_s = 1.0;
  options.per_recording = 20;
  options.seed = 7;
  const auto starts_s = [](const std::vector<Place>& places) {
    std::vector<double> out;
    for (const Place& place : places) out.push_back(place.start_s);
    return out;
  };
  const auto drawn = starts_s(places_of(options)(own));
  // std::hash differs between standard libraries.
  CHECK(drawn == starts_s(random_places(own, 1.0, 20, 7 ^ seed_of("1000"))));
  own.file = "other";
  CHECK(drawn != starts_s(places_of(options)(own)));
  options.drawn_as = {{"other", "1000"}};
  CHECK(drawn == starts_s(places_of(options)(own)));
}

TEST_CASE("A leak is a share of samples: what touches in time may share one") {
  // Half a sample of 25 Hz between the times of the two, one sample between their samples.
  WindowSet windows;
  windows.window_s = 0.5;  // 13 samples
  windows.rates_hz = {25.0};
  windows.places = {{0.0, 0}, {0.5, 1}, {0.52, 1}};  // first samples 0, 13, 13
  windows.recording = {0, 0, 0};
  CHECK(measure_leak(windows, {{{1}, {0}}}).largest == 0.0);
  windows.places[1].start_s = 0.48;  // 12
  CHECK(measure_leak(windows, {{{1}, {0}}}).largest == Approx(1.0 / 13.0));
  CHECK(measure_leak(windows, {{{2, 1}, {0}}}).largest == Approx(1.0 / 13.0));
  CHECK(measure_leak(windows, {{{2}, {0}}}).windows == 0.0);
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_windows_test
