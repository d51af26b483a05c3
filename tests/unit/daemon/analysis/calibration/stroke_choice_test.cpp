// The number of simulated recordings, for any rate and number of fabrics.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::stroke_choice_test {
namespace {

constexpr std::size_t channels = 2;

/// Sample i reads 1000 + i.
Stroke counting(const std::string& cloth, std::uint32_t repetition, std::size_t samples,
                double speed_mps, double rate_hz) {
  Stroke out = test::stroke(cloth, repetition, channels, samples, [](std::size_t, std::size_t i) {
    return 1000 + static_cast<double>(i);
  });
  out.speed_mps = speed_mps;
  out.rate_hz = rate_hz;
  return out;
}

RecordingView many(std::size_t cloths, std::size_t samples, double speed_mps, double rate_hz) {
  std::vector<Stroke> strokes;
  for (std::size_t c = 0; c < cloths; ++c)
    for (std::uint32_t repetition = 0; repetition < 4; ++repetition)
      strokes.push_back(
          counting("cloth" + std::to_string(c), repetition, samples, speed_mps, rate_hz));
  return test::view_of(std::move(strokes));
}

std::size_t samples_of(const RecordingView& view) {
  std::size_t out = 0;
  for (const Stroke& stroke : view.strokes) out += stroke.samples();
  return out;
}

}  // namespace

TEST_CASE("Every k-th sample of dense strokes is used, up to 0.2 mm apart") {
  const RecordingView slow =
      thin_dense_strokes(test::view_of({counting("denim", 0, 925, 0.002, 37)}));
  const Stroke& stroke = slow.strokes.front();
  CHECK(stroke.samples() == 309);  // 0.054 mm: every third
  CHECK(stroke.pitch_mm() == Approx(0.2).margin(0.05));
  CHECK(stroke.rate_hz == Approx(37.0 / 3));
  CHECK(stroke.counts[1][2] == 1006);
  CHECK(stroke.level[1] == Approx(1000 + 462));
  CHECK(slow.remarks.size() == 1);
  const RecordingView fast =
      thin_dense_strokes(test::view_of({counting("denim", 0, 5000, 0.01, 1000)}));
  CHECK(fast.strokes.front().samples() == 250);
}

TEST_CASE("Strokes of 0.28 mm and more are taken whole") {
  for (const double speed_mps : {0.01, 0.12, 0.15}) {
    const RecordingView view = many(2, 178, speed_mps, 35.7);
    const RecordingView thinned = thin_dense_strokes(view);
    CHECK(thinned.remarks.empty());
    CHECK(thinned.strokes[0].counts == view.strokes[0].counts);
    CHECK(thinned.strokes[0].rate_hz == 35.7);
  }
}

TEST_CASE("Strokes of the same conditions keep one pitch, and a stroke its least samples") {
  const RecordingView pair = thin_dense_strokes(test::view_of(
      {counting("denim", 0, 400, 0.00401, 40), counting("denim", 1, 400, 0.00399, 40)}));
  CHECK(pair.strokes[0].rate_hz == pair.strokes[1].rate_hz);
  const RecordingView brief =
      thin_dense_strokes(test::view_of({counting("denim", 0, 40, 0.001, 1000)}));
  CHECK(brief.strokes[0].samples() == 20);
}

TEST_CASE("The choice is bounded in samples, not only in length") {
  constexpr std::size_t windows = 12, window_samples = 200;
  // 0.11 mm: too coarse for thinning, 455 samples in 50 mm
  CHECK(samples_of(choose_strokes(many(2, 1000, 0.00407, 37), windows)) <=
        windows * window_samples);
  CHECK(choose_strokes(many(2, 178, 0.01, 35.7), windows).strokes.size() == 4);  // pairs
  CHECK(choose_strokes(many(2, 714, 0.01, 35.7), windows).strokes.size() == 3);  // 4 windows each
}

TEST_CASE("One stroke of each of many cloths is within the bound as well") {
  constexpr std::size_t windows = 12, window_samples = 200, cloths = 8;
  const RecordingView cut = cut_long_strokes(many(cloths, 1500, 0.00407, 37), windows);
  const RecordingView chosen = choose_strokes(cut, windows);
  CHECK(chosen.strokes.size() >= cloths);
  CHECK(samples_of(chosen) <= windows * window_samples);
  CHECK(cut_long_strokes(many(7, 714, 0.01, 35.7), 144).strokes[0].samples() == 714);
}

}  // namespace weft::daemon::calibration::stroke_choice_test
