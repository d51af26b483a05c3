// Recorded strokes and the same strokes simulated, as data sets and in statistics.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/cloth_model.hpp"
#include "daemon/analysis/calibration/simulated_strokes.hpp"
#include "tests/unit/daemon/analysis/calibration/fit_support.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::simulated_strokes_test {
namespace {

using namespace test;

constexpr std::size_t channels = 3, samples = 400;

RecordingView waves(double size) {
  const auto of = [&](double length_mm) {
    return [=](std::size_t channel, std::size_t sample) {
      return 1000.4 + static_cast<double>(channel) + size * wave(sample, length_mm);
    };
  };
  return view_of({stroke("denim", 0, channels, samples, of(5)),
                  stroke("felt", 0, channels, samples, of(20)),
                  stroke("felt", 0, channels, samples, of(20), 2)});
}

/// One trial for each stroke, and a stopped trial before them.
Dataset recorded_like(const RecordingView& view) {
  Dataset out;
  out.info.kind = BenchKind::real;
  out.info.name = out.info.source = "campaign";
  out.info.taxel_rate_hz = rate_hz;
  out.trials.push_back({"stopped", "denim", "0", channels, {}, {}});
  out.records.emplace_back().outcome = TrialOutcome::stopped;
  for (const Stroke& one : view.strokes) {
    const std::string file = "t" + std::to_string(out.trials.size());
    out.trials.push_back({file, one.cloth, std::to_string(one.repetition), channels, {}, {}});
    TrialRecord& record = out.records.emplace_back();
    record.spec.place = {1, one.mounting, 0};
    record.spec.patch_seed = 7;
  }
  return out;
}

}  // namespace

TEST_CASE("A label's own cloth of the table is taken before all others") {
  sim::FabricLibrary library = table();
  sim::Fabric own = *library.find("denim");
  own.name = "mine.denim";
  own.height_rms_m = 3.25e-6;
  library.fabrics.push_back(own);
  const RecordingView view = view_of({stroke("Denim", 0, 1, samples, [](auto, auto) { return 1; }),
                                      stroke("felt", 0, 1, samples, [](auto, auto) { return 1; })});
  const auto model = ClothModel::make(view, with_own_cloths(library, view, "mine"));
  REQUIRE(model);
  CHECK(model->cloths()[0].fabric.height_rms_m == 3.25e-6);
  CHECK(model->cloths()[1].taken == "felt");
  const auto other = ClothModel::make(view, with_own_cloths(library, view, "yours"));
  REQUIRE(other);
  CHECK(other->cloths()[0].fabric.height_rms_m == library.find("denim")->height_rms_m);
}

TEST_CASE("A data set of strokes has the complete trials in whole counts") {
  const RecordingView view = waves(100);
  const Dataset set = stroke_dataset(recorded_like(view), view, BenchKind::simulated);
  REQUIRE(set.trials.size() == 3);
  CHECK(check(set));
  CHECK(set.info.kind == BenchKind::simulated);
  CHECK(set.trials[0].file == "t1");
  CHECK(set.trials[1].label == "felt");
  CHECK(set.trials[0].motion_samples() == samples);
  CHECK(set.trials[0].row(7)[2] == std::round(view.strokes[0].counts[2][7]));
  CHECK(set.records[0].t_ns[36] == 1'000'000'000);
  CHECK(set.records[2].spec.place.mounting == 2);
  CHECK(set.records[0].spec.patch_seed == 0);
}

TEST_CASE("Both sides in one data set share no name, group or mounting") {
  const RecordingView view = waves(100);
  const Dataset like = recorded_like(view);
  const Dataset both = both_sides(stroke_dataset(like, view, BenchKind::real),
                                  stroke_dataset(like, view, BenchKind::simulated));
  REQUIRE(both.trials.size() == 6);
  CHECK(check(both));
  CHECK(both.info.kind == BenchKind::unknown);
  CHECK(both.trials[0].group == "recorded-0");
  CHECK(both.trials[3].group == "simulated-0");
  CHECK(both.trials[3].file == "simulated-t1");
  CHECK(both.records[3].spec.place.mounting == 2);  // denim has one recorded mounting
  CHECK(both.records[5].spec.place.mounting == 4);  // felt has two
}

TEST_CASE("Statistics of both sides are of all strokes, then of each cloth's") {
  const RecordingView view = waves(100);
  const auto same = compare_strokes(view, view, 20, 1);
  for (const SidedStatistic& s : same) {
    REQUIRE(s.simulated);
    CHECK(*s.simulated == s.recorded.value);
    CHECK(s.interval.has_value() == s.strokes_of.empty());
  }
  CHECK(same.back().strokes_of == "felt");
  for (const SidedStatistic& s : compare_strokes(view, waves(200), 20, 1))
    if (s.recorded.name == "modulation")
      CHECK(*s.simulated - s.recorded.value == Approx(std::log(2)).epsilon(1e-6));
}

}  // namespace weft::daemon::calibration::simulated_strokes_test
