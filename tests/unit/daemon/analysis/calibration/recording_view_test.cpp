// Data of data sets that a view accepts, and its refusals.

#include <array>
#include <catch2/catch.hpp>
#include <set>

#include "daemon/analysis/calibration/recording_view.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::recording_view_test {
namespace {

constexpr std::size_t channels = 4;
constexpr double rate_hz = 40;

double noisy(std::size_t trial, std::size_t channel, std::size_t sample) {
  return 1000 + 100 * static_cast<double>(channel) + 10 * test::draw(trial, channel, sample);
}

/// Phases as letters; 0.025 s from sample to sample.
void add_trial(Dataset& set, const std::string& label, const std::string& phases,
               std::size_t taxels = channels) {
  classifier::Trial trial;
  TrialRecord record;
  const std::size_t number = set.trials.size();
  trial.file = "t" + std::to_string(number);
  trial.label = record.spec.label = label;
  trial.taxels = taxels;
  for (const char letter : phases) {
    const std::size_t i = trial.phase.size();
    trial.phase.push_back(*phase_from_char(letter));
    for (std::size_t c = 0; c < taxels; ++c) trial.counts.push_back(noisy(number, c, i));
    record.t_ns.push_back(static_cast<std::int64_t>(i) * 25'000'000);
  }
  record.spec.place = {1, 1, 1};
  set.trials.push_back(std::move(trial));
  set.records.push_back(std::move(record));
}

const std::string slide = std::string(40, 'S') + std::string(200, 'M');

Dataset campaign(std::size_t trials = 2) {
  Dataset out;
  out.info.source = "campaign";
  out.info.taxel_rate_hz = rate_hz;
  for (std::size_t i = 0; i < trials; ++i) {
    add_trial(out, "denim", slide);
    out.records[i].spec.exploration = "M1";
    out.records[i].spec.repetition = static_cast<std::uint32_t>(i + 1);
  }
  return out;
}

Result<RecordingView> viewed(const Dataset& set, std::optional<double> speed_mps = 0.01) {
  return make_recording_view(std::span(&set, 1), {speed_mps});
}

Error refused(const Dataset& set, std::optional<double> speed_mps = 0.01) {
  const auto view = viewed(set, speed_mps);
  REQUIRE_FALSE(view);
  return view.error();
}

/// Changes a channel in phase M of all trials.
void set_channel(Dataset& set, std::size_t channel,
                 const std::function<double(double value, std::size_t sample)>& change) {
  for (classifier::Trial& trial : set.trials)
    for (std::size_t i = 0; i < trial.samples(); ++i) {
      double& value = trial.counts[i * trial.taxels + channel];
      value = change(value, i);
    }
}

double limited(double value, std::size_t i) {
  return i % 20 < 8 ? 65535 : value;  // constant sections of eight samples
}

}  // namespace

TEST_CASE("A stroke is phase M without its ends, above the median of phase S") {
  Dataset set = campaign();
  set_channel(set, 1, [](double value, std::size_t i) { return value + (i < 40 ? 0 : 500); });
  const auto view = viewed(set);
  REQUIRE(view);
  REQUIRE(view->strokes.size() == 2);
  const Stroke& stroke = view->strokes[1];
  CHECK(stroke.cloth == "denim");
  CHECK(stroke.conditions == "M1");
  CHECK(stroke.repetition == 2);
  CHECK(stroke.mounting == 1);
  CHECK(stroke.cell == view->strokes[0].cell);
  CHECK(stroke.rate_hz == rate_hz);
  CHECK(stroke.samples() == 160);
  CHECK(stroke.level[1] == Approx(500).margin(5));
  CHECK(stroke.level[0] == Approx(0).margin(5));
  CHECK(stroke.counts[2][0] - stroke.counts[2][1] == Approx(noisy(1, 2, 60) - noisy(1, 2, 61)));
  CHECK(std::isnan(stroke.force_n));
  CHECK(view->recorded == std::vector<std::size_t>{0, 1, 2, 3});
  CHECK(view->remarks.empty());
}

TEST_CASE("A stroke that is hardly longer than its ends loses an eighth") {
  Dataset set = campaign(0);
  add_trial(set, "denim", "S" + std::string(32, 'M'));
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->strokes[0].samples() == 24);
}

TEST_CASE("Without phase S counts are above the unloaded level, with a remark") {
  Dataset set = campaign(0);
  add_trial(set, "denim", std::string(100, 'M'));
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->strokes[0].level[0] == Approx(1000).margin(5));
  CHECK_FALSE(view->strokes[0].has_rest);
  CHECK(view->remarks.size() == 1);
}

TEST_CASE("The force is the mean of Fz during the stroke") {
  Dataset set = campaign();
  WrenchStream& wrench = set.records[0].wrench;
  for (int i = 0; i < 240; ++i) {
    wrench.t_ns.push_back(i * 25'000'000LL);
    const double force_n = i < 60 ? 2 : i % 2 == 0 ? 4 : 6;
    const std::array<double, 6> row{0, 0, force_n, 0, 0, 0};
    for (const double v : row)
      wrench.quanta.push_back(static_cast<std::int32_t>(v * force_quanta_per_n));
  }
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->strokes[0].force_n == Approx(5));
  CHECK(view->strokes[0].rest_force_n == Approx(2));
  CHECK(std::isnan(view->strokes[1].force_n));
  CHECK(std::isnan(view->strokes[1].rest_force_n));
  CHECK(view->remarks.empty());
}

TEST_CASE("A wrench that shows no load is ignored, with a remark") {
  Dataset set = campaign();
  WrenchStream& wrench = set.records[0].wrench;
  for (int i = 0; i < 240; ++i) {
    wrench.t_ns.push_back(i * 25'000'000LL);
    for (const int n : {0, 0, -3, 0, 0, 0})
      wrench.quanta.push_back(static_cast<std::int32_t>(n * force_quanta_per_n));
  }
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(std::isnan(view->strokes[0].force_n));
  CHECK(std::isnan(view->strokes[0].rest_force_n));
  CHECK(view->remarks.size() == 1);
}

TEST_CASE("Speed: as stated, of the sweep, of the stages, of the name, in this order") {
  Dataset set = campaign(1);
  const auto speed = [&](std::optional<double> stated) {
    const auto view = viewed(set, stated);
    REQUIRE(view);
    return view->strokes[0].speed_mps;
  };
  set.trials[0].file = "Denim_F120_V-10mmps_0.csv";
  CHECK(speed({}) == Approx(0.01));
  set.info.axes = {{"z", false}, {"x", false}, {"y", false}, {"rx", true}};
  StageStream& stages = set.records[0].stages;
  for (int i = 0; i < 120; ++i) {
    stages.t_ns.push_back(i * 50'000'000LL);
    // 2 mm/s along x and 1.5 mm/s along y, back and forth along y
    const int y_um = (i / 20 % 2 == 0 ? i % 20 : 20 - i % 20) * 75;
    for (const int um : {7 * i, 100 * i, y_um, 1}) stages.quanta.push_back(um * 1000);
  }
  CHECK(speed({}) == Approx(0.0025));
  set.info.factors = {"force_n", "speed_mps"};
  set.records[0].spec.factors = {3, 0.004};
  CHECK(speed({}) == 0.004);
  CHECK(speed(0.02) == 0.02);
}

TEST_CASE("An unknown speed is refused with the option that states it") {
  const Error error = refused(campaign(), std::nullopt);
  CHECK(error.code == Errc::invalid_argument);
  CHECK(error.hint.find("--speed-mm-s") != std::string::npos);
  CHECK(refused(campaign(), 0.0).code == Errc::invalid_argument);
  CHECK(refused(campaign(), std::nan("")).code == Errc::invalid_argument);
  CHECK(refused(campaign(), INFINITY).code == Errc::invalid_argument);
}

TEST_CASE("Constant channels are left out; where all are, nothing can be calibrated") {
  Dataset set = campaign();
  const auto constant = [](double, std::size_t) { return 7.0; };
  set_channel(set, 2, constant);
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->channels == 3);
  CHECK(view->recorded == std::vector<std::size_t>{0, 1, 3});
  CHECK(view->recorded_channels == 4);
  CHECK(view->remarks.size() == 1);
  for (const std::size_t c : {0U, 1U, 3U}) set_channel(set, c, constant);
  const Error error = refused(set);
  CHECK(error.code == Errc::measurement);
  CHECK(error.what.find("1 to 4") != std::string::npos);
}

TEST_CASE("Clipped channels are left out; more than half of them are refused") {
  Dataset set = campaign();
  set_channel(set, 0, limited);
  set_channel(set, 3, [](double value, std::size_t i) { return i % 30 < 5 ? 0 : value; });
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->recorded == std::vector<std::size_t>{1, 2});
  set_channel(set, 1, limited);
  CHECK(refused(set).code == Errc::measurement);
}

TEST_CASE("A glitch beyond the limit does not hide it") {
  Dataset set = campaign();
  set_channel(set, 0,
              [](double value, std::size_t i) { return i == 120 ? 1e5 : limited(value, i); });
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->recorded == std::vector<std::size_t>{1, 2, 3});
}

TEST_CASE("An extreme value that is met now and then is no limit") {
  Dataset set = campaign();
  set_channel(set, 0, [](double value, std::size_t i) { return i % 20 < 3 ? 2000 : value; });
  // whole counts with little noise: the ends of the range occur often
  set_channel(set, 1, [](double value, std::size_t) { return std::round(value / 10); });
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->channels == 4);
}

TEST_CASE("Trials without or with too little of phase M are refused by name") {
  Dataset set = campaign();
  add_trial(set, "denim", std::string(100, 'P'));
  CHECK(refused(set).code == Errc::invalid_argument);
  CHECK(refused(set).where == "t2");
  set.records[2].outcome = TrialOutcome::aborted;  // a trial that is not complete is ignored
  CHECK(viewed(set));
  add_trial(set, "denim", std::string(18, 'M'));
  CHECK(refused(set).where == "t3");
  CHECK(refused(set).got == "14");
}

TEST_CASE("No trials, no rate, other numbers of channels are refused") {
  CHECK(refused(campaign(0)).code == Errc::invalid_argument);
  Dataset slow = campaign();
  slow.info.taxel_rate_hz = 0;
  CHECK(refused(slow).code == Errc::invalid_argument);
  Dataset mixed = campaign();
  add_trial(mixed, "denim", slide, 3);
  CHECK(refused(mixed).code == Errc::invalid_argument);
  CHECK(refused(mixed).expected == "4");
  CHECK(refused(mixed).got == "3");
}

TEST_CASE("Pieces and files have mountings of their own, patches cells") {
  Dataset set = campaign(4);
  set.records[1].spec.place = {1, 2, 1};
  set.records[2].spec.place = {2, 1, 1};
  set.records[3].spec.place = {1, 1, 2};
  const std::vector<Dataset> both{set, campaign(1)};
  const auto view = make_recording_view(both, {0.01});
  REQUIRE(view);
  std::vector<std::uint32_t> mountings;
  std::set<std::string> cells;
  for (const Stroke& stroke : view->strokes) {
    mountings.push_back(stroke.mounting);
    cells.insert(stroke.cell);
  }
  CHECK(mountings == std::vector<std::uint32_t>{1, 2, 3, 1, 4});
  CHECK(cells.size() == 5);
}

TEST_CASE("Imported strokes count their repetitions, with a remark on unknown mountings") {
  Dataset set = campaign(3);
  set.info.source = "manifest";
  for (TrialRecord& record : set.records) {
    record.spec.place = {};
    record.spec.repetition = 0;
  }
  const auto view = viewed(set);
  REQUIRE(view);
  CHECK(view->strokes[2].repetition == 2);
  CHECK(view->strokes[2].cell == view->strokes[0].cell);
  CHECK(view->remarks.size() == 2);  // no remark about places either
  set.trials[2].file = "denim_V-20mmps_0.csv";
  const auto other = viewed(set);
  REQUIRE(other);
  CHECK(other->strokes[2].cell != other->strokes[0].cell);
  CHECK(other->strokes[2].repetition == 0);
}

TEST_CASE("Direction and speed in a name are conditions, the grip is the mounting's") {
  Dataset set = campaign(3);
  set.info.source = "fabricslide";
  for (TrialRecord& record : set.records) record.spec.exploration.clear();
  set.trials[0].file = "Denim_F120_V-10mmps_0.csv";
  set.trials[1].file = "Denim_F120_V10mmps_0.csv";
  set.trials[2].file = "Denim_F150_V10mmps_1.csv";
  set.records[2].spec.place.mounting = 2;
  const auto view = viewed(set, std::nullopt);
  REQUIRE(view);
  CHECK(view->strokes[0].conditions == "V-10");
  CHECK(view->strokes[1].conditions == "V10");
  CHECK(view->strokes[2].conditions == "V10");
  CHECK(view->strokes[2].cell != view->strokes[1].cell);
  CHECK(view->strokes[0].speed_mps == Approx(0.01));
}

}  // namespace weft::daemon::calibration::recording_view_test
