// Statistics of views with a known answer, and of views that lack necessary data.

#include <catch2/catch.hpp>
#include <set>

#include "daemon/analysis/calibration/statistics.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::statistics_test {

using test::draw;
using test::stroke;
using test::view_of;
using test::wave;

namespace {

constexpr std::size_t window = 200;  // samples

/// The value on its natural scale; NaN fails every check.
double shown(const StatisticSet& set, const std::string& name, const std::string& cloth = {}) {
  const Statistic* found = find(set.statistics, name, cloth);
  return found == nullptr ? std::nan("") : found->shown;
}

bool has(const StatisticSet& set, const std::string& name) {
  return std::ranges::any_of(set.statistics, [&](const Statistic& s) { return s.name == name; });
}

bool has_remark_on(const StatisticSet& set, const std::string& name) {
  return std::ranges::any_of(set.remarks,
                             [&](const std::string& r) { return r.starts_with(name + " "); });
}

/// A wave of 5 mm with these amplitudes, relative to a level of 100.
Stroke rippled(const std::string& cloth, double amplitude, std::uint32_t repetition = 0) {
  return stroke(cloth, repetition, 16, 6 * window,
                [&](std::size_t, std::size_t i) { return 100 + 100 * amplitude * wave(i, 5); });
}

}  // namespace

TEST_CASE("Scales are left as they were entered, and have no infinity") {
  for (const Scale scale : {Scale::natural, Scale::log, Scale::fisher_z, Scale::logit}) {
    CHECK(from_scale(to_scale(0.3, scale), scale) == Approx(0.3));
    CHECK(std::isfinite(to_scale(0, scale)));
    CHECK(std::isfinite(to_scale(1, scale)));
  }
}

TEST_CASE("Modulation is the relative sd of a wave; its spread is that between cloths") {
  const StatisticSet set = compute_statistics(
      view_of({rippled("denim", 0.04), rippled("silk", 0.01), rippled("wool", 0.02)}));
  CHECK(shown(set, "modulation", "denim") == Approx(0.04 / std::sqrt(2.0)).epsilon(0.01));
  CHECK(shown(set, "modulation_stroke", "silk") == Approx(0.01 / std::sqrt(2.0)).epsilon(0.01));
  CHECK(shown(set, "modulation_median") == Approx(0.02 / std::sqrt(2.0)).epsilon(0.01));
  CHECK(shown(set, "modulation_between") == Approx(std::log(2)).epsilon(0.01));
  CHECK(shown(set, "modulation_within") < 1e-6);
  CHECK(shown(set, "band_0.1", "wool") == Approx(0.02 / std::sqrt(2.0)).epsilon(0.01));
  CHECK(shown(set, "peak", "wool") == Approx(std::sqrt(0.1 * 0.3)));
}

TEST_CASE("Spread within cells is that of their windows") {
  // alternating amplitudes of 2 and 4 %
  const StatisticSet set =
      compute_statistics(view_of({stroke("denim", 0, 1, 8 * window, [](std::size_t, std::size_t i) {
        return 100 + (i / window % 2 == 0 ? 2 : 4) * wave(i, 5);
      })}));
  CHECK(shown(set, "modulation_within") ==
        Approx(std::log(2) / 2 * std::sqrt(8 / 7.0)).epsilon(0.02));
}

TEST_CASE("The noise law of a simulated array is found") {
  std::vector<Stroke> strokes;
  for (std::uint32_t r = 0; r < 8; ++r)
    strokes.push_back(stroke("denim", r, 16, 6 * window, [&](std::size_t c, std::size_t i) {
      const double level = 50 + 20 * static_cast<double>(c);
      return level + std::sqrt(1 + 0.02 * level) * draw(r, c, i);
    }));
  const StatisticSet set = compute_statistics(view_of(strokes));
  CHECK(shown(set, "noise_s0") == Approx(1).margin(0.25));
  CHECK(shown(set, "noise_k1") + 200 * shown(set, "noise_k2") == Approx(0.02).epsilon(0.1));
  CHECK(shown(set, "noise") == Approx(std::sqrt(1 + 0.02 * 200)).epsilon(0.03));
}

TEST_CASE("Noise is that of the finest strokes: in coarse ones it is texture") {
  const test::Signal rough = [](std::size_t c, std::size_t i) {
    return 100 + static_cast<double>(c) + 0.5 * draw(1, c, i);
  };
  Stroke coarse = stroke("denim", 1, 4, 6 * window, [](std::size_t c, std::size_t i) {
    return 100 + static_cast<double>(c) + 20 * draw(2, c, i);
  });
  coarse.speed_mps *= 10;
  const StatisticSet set =
      compute_statistics(view_of({stroke("denim", 0, 4, 6 * window, rough), coarse}));
  CHECK(shown(set, "noise") == Approx(0.5).epsilon(0.1));
}

TEST_CASE("Correlations are those of common and own parts of a signal") {
  const StatisticSet set = compute_statistics(
      view_of({stroke("denim", 0, 16, 40 * window, [](std::size_t c, std::size_t i) {
        return 100 + draw(1, 99, i) + 2 * draw(1, c, i);
      })}));
  CHECK(shown(set, "neighbours") == Approx(0.2).margin(0.02));
  CHECK(shown(set, "far") == Approx(0.2).margin(0.03));
  CHECK(shown(set, "common_share") == Approx((1 + 4 / 16.0) / 5).margin(0.02));
}

TEST_CASE("Neighbours are correlated where only neighbours share a part") {
  // rows share a signal: 12 of 24 pairs of neighbours do; two of the four far pairs
  const StatisticSet set = compute_statistics(
      view_of({stroke("denim", 0, 16, 20 * window,
                      [](std::size_t c, std::size_t i) { return 100 + draw(1, c / 4, i); })}));
  CHECK(shown(set, "neighbours") == Approx(0.5).margin(0.03));
  CHECK(shown(set, "far") == Approx(0.5).margin(0.05));
}

TEST_CASE("Channels that are left out leave their neighbours' places as they were") {
  RecordingView view = view_of({stroke(
      "denim", 0, 2, 20 * window, [](std::size_t, std::size_t i) { return 100 + draw(1, 0, i); })});
  view.recorded_channels = 16;
  view.recorded = {0, 15};  // opposite corners: neither neighbours nor on one side
  const StatisticSet apart = compute_statistics(view);
  view.recorded = {0, 1};
  CHECK(shown(apart, "neighbours") == 0);
  CHECK(shown(compute_statistics(view), "neighbours") == Approx(1));
}

TEST_CASE("Drift is the rise over the stroke, jumps the share of steps") {
  const StatisticSet set =
      compute_statistics(view_of({stroke("denim", 0, 3, 1001, [](std::size_t c, std::size_t i) {
        return 195 + 0.01 * static_cast<double>(i) + 0.1 * draw(1, c, i) + (i % 100 == 50 ? 30 : 0);
      })}));
  CHECK(shown(set, "drift", "denim") == Approx(0.05).epsilon(0.05));
  CHECK(shown(set, "jumps", "denim") == Approx(0.02).epsilon(0.05));
}

TEST_CASE("Repetitions of a path are alike but for their shift, other cloths are not") {
  const auto shifted = [](const std::string& cloth, std::uint32_t repetition, std::size_t shift,
                          std::uint64_t texture) {
    return stroke(cloth, repetition, 4, 6 * window, [=](std::size_t c, std::size_t i) {
      return 100 + 3 * draw(texture, c, i + shift) + draw(texture + 10 + repetition, c, i);
    });
  };
  const StatisticSet set =
      compute_statistics(view_of({shifted("denim", 0, 0, 1), shifted("denim", 1, 2, 1),
                                  shifted("silk", 0, 3, 2), shifted("silk", 1, 0, 2)}));
  CHECK(shown(set, "repetition") == Approx(0.9).margin(0.02));
  // shifts of +2 and -3 samples
  CHECK(shown(set, "repetition_lag") == Approx(5 / std::sqrt(2.0) * test::pitch_mm));
  CHECK(shown(set, "control") < 0.1);
}

TEST_CASE("A pattern that only another mounting changes is a mounting's") {
  std::vector<Stroke> strokes;
  for (std::uint32_t mounting = 1; mounting <= 12; ++mounting)
    for (std::uint32_t r = 0; r < 2; ++r)
      strokes.push_back(stroke(
          "denim", r, 16, 2 * window,
          [=](std::size_t c, std::size_t) { return 100 * std::exp(0.04 * draw(7, c, mounting)); },
          mounting));
  const StatisticSet set = compute_statistics(view_of(strokes));
  CHECK(shown(set, "pattern_mounting") == Approx(0.04 * std::sqrt(15 / 16.0)).epsilon(0.15));
  CHECK(shown(set, "pattern_patch") < 1e-6);
  CHECK(shown(set, "pattern_path") < 1e-6);
  CHECK(find(set.statistics, "pattern_path")->value == Approx(std::log(1e-5)));
}

TEST_CASE("Cells of one mounting are places of it: new patches are no new mountings") {
  std::vector<Stroke> strokes;
  for (std::uint32_t patch = 1; patch <= 20; ++patch) {
    strokes.push_back(stroke("denim", patch, 16, window, [=](std::size_t c, std::size_t) {
      return 100 * std::exp(0.02 * draw(7, c, patch));
    }));
    strokes.back().cell += std::to_string(patch);
  }
  const StatisticSet set = compute_statistics(view_of(strokes));
  CHECK(shown(set, "pattern_patch") == Approx(0.02 * std::sqrt(15 / 16.0)).epsilon(0.15));
  CHECK_FALSE(has(set, "pattern_mounting"));
}

TEST_CASE("Level spread is that of the channels' logarithms") {
  const StatisticSet set =
      compute_statistics(view_of({stroke("denim", 0, 2, 100, [](std::size_t c, std::size_t i) {
        return (c == 0 ? 100 : 200) + draw(1, c, i) * 1e-3;
      })}));
  CHECK(shown(set, "level_spread") == Approx(std::log(2) / std::sqrt(2.0)).epsilon(0.01));
}

TEST_CASE("One stroke is answered with what remains, and each gap has its sentence") {
  const StatisticSet set = compute_statistics(view_of({rippled("denim", 0.02)}));
  CHECK(has(set, "modulation"));
  CHECK(has(set, "drift"));
  for (const char* name : {"modulation_between", "repetition", "repetition_lag", "control",
                           "pattern_path", "pattern_mounting"}) {
    INFO(name);
    CHECK_FALSE(has(set, name));
    CHECK(has_remark_on(set, name));
  }
}

TEST_CASE("One channel is answered without what compares channels") {
  const StatisticSet set = compute_statistics(
      view_of({stroke("denim", 0, 1, 6 * window,
                      [](std::size_t, std::size_t i) { return 100 + draw(1, 0, i); }),
               stroke("denim", 1, 1, 6 * window,
                      [](std::size_t, std::size_t i) { return 100 + draw(1, 0, i); })}));
  for (const char* name : {"level_spread", "pattern_path", "neighbours", "far", "common_share"}) {
    INFO(name);
    CHECK_FALSE(has(set, name));
    CHECK(has_remark_on(set, name));
  }
  CHECK(has(set, "modulation"));
  CHECK(shown(set, "repetition") == Approx(1));
}

TEST_CASE("For all signals every value is finite and every name is present once") {
  const std::vector<test::Signal> hostile{
      [](std::size_t, std::size_t) { return 0.0; }, [](std::size_t, std::size_t) { return 1e12; },
      [](std::size_t c, std::size_t i) { return -5 + draw(1, c, i); },
      [](std::size_t, std::size_t i) { return i == 7 ? 1e9 : 1.0; },
      [](std::size_t c, std::size_t i) { return c == 0 ? 1e-9 : 1e-9 * draw(1, c, i); }};
  for (const test::Signal& signal : hostile)
    for (const std::size_t samples : {std::size_t{16}, 3 * window}) {
      const StatisticSet set = compute_statistics(
          view_of({stroke("denim", 0, 4, samples, signal), stroke("denim", 1, 4, samples, signal),
                   stroke("silk", 0, 4, samples, signal)}));
      std::set<std::pair<std::string, std::string>> names;
      for (const Statistic& s : set.statistics) {
        INFO(s.name << " of '" << s.cloth << "'");
        CHECK(std::isfinite(s.value));
        CHECK(std::isfinite(s.shown));
        CHECK(names.insert({s.name, s.cloth}).second);
      }
    }
}

TEST_CASE("A stroke without level leaves nothing but remarks") {
  const StatisticSet set = compute_statistics(
      view_of({stroke("denim", 0, 4, 100, [](std::size_t, std::size_t) { return 0.0; })}));
  CHECK(set.statistics.empty());
  CHECK(has_remark_on(set, "modulation"));
}

}  // namespace weft::daemon::calibration::statistics_test
