// A handover from vibration on made-up strokes: the trained models and their description.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/handover/train.hpp"

namespace weft::daemon::train_vibration_test {
namespace {

namespace vibro = classifier::vibro;

// Noise on a slow sound and an axis, three strokes of each material; with `tell` its level depends
// on the material.
RecordingSet slides(bool tell) {
  RecordingSet out{"made up", "campaign", BenchKind::simulated, {}};
  std::uint64_t state = 1;
  const auto noise = [&] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 33U) / 2147483648.0 - 0.5;
  };
  for (int group = 1; group <= 3; ++group)
    for (int m = 0; m < 3; ++m) {
      vibro::Recording r{"t" + std::to_string(3 * group + m),
                         "material" + std::to_string(m),
                         std::to_string(group),
                         {},
                         {}};
      for (const auto& [name, rate] : {std::pair("S", 1000.0), {"X", 200.0}}) {
        r.channels.push_back({name, rate, "1"});
        r.samples.emplace_back();
        for (int i = 0; i < static_cast<int>(rate * 6); ++i)
          r.samples.back().push_back((tell ? 1.0 + m : 1.0) * noise());
      }
      out.recordings.push_back(std::move(r));
    }
  return out;
}

const recipes::Handover wanted{"best", 3, 60, recipes::HandoverSource::vibration};

Result<VibrationTrainingResult> training_result_of(const RecordingSet& set,
                                                   const recipes::Handover& how = wanted) {
  std::size_t reported = 0;
  auto out = train_vibration(set, how, {}, {}, [&](const std::string&) { ++reported; });
  CHECK(reported == vibration_steps(how));
  return out;
}

TEST_CASE("Materials that sound differently are told apart on slides left out, equal ones not") {
  const auto reported = training_result_of(slides(true));
  REQUIRE(reported);
  const HandoverEvaluation line =
      make_evaluation("V1", "handover/V1.html", slides(true), *reported);
  CHECK(line.recordings == 9);
  CHECK(line.materials == 3);
  CHECK(line.windows.ci95_low > 1.0 / 3.0);
  CHECK(line.slides.share == 1.0);
  CHECK(line.slides.ci95_low > 1.0 / 3.0);
  CHECK(reported->best.groups == 3);
  CHECK(reported->best.result.chosen.size() == 3);
  CHECK(reported->tradeoff.points.empty());

  const auto blind = training_result_of(slides(false));
  REQUIRE(blind);
  CHECK(blind->best.result.accuracy_ci95.low < 1.0 / 3.0);
}

TEST_CASE("Every learner is shown under the paper's protocol and on whole slides") {
  recipes::Handover every = wanted;
  every.learner = "every";
  const RecordingSet set = slides(true);
  const auto training_result = training_result_of(set, every);
  REQUIRE(training_result);
  std::set<std::string> seen;
  for (const VibroPoint& p : training_result->tradeoff.points)
    seen.insert(std::string(vibro::to_string(p.protocol)) + " " + std::to_string(p.window_s) + " " +
                std::string(classifier::to_string(p.learner)));
  std::size_t available = 0;
  for (const classifier::Learner one : vibro::window_learners())
    available += classifier::is_available(one) ? 1 : 0;
  CHECK(seen.size() == 2 * 2 * available);
  CHECK(training_result->tradeoff.random_leak.median > 0.5);
  CHECK(training_result->tradeoff.honest_leak.largest == 0.0);
  const auto json = vibration_json(set, *training_result);
  CHECK(json["bench"] == "simulated");
  CHECK(json["points"].size() == seen.size());
  CHECK(json["best"]["confusion"].size() == 9);
  const auto document = vibration_document("V1", set, *training_result);
  REQUIRE(document);
  const std::string page = render(*document);
  for (const char* words : {"SIMULATED", "Accuracy of sound and vibration", "F-score against time",
                            "Table 2", "whole recordings", "random windows"})
    CHECK(page.find(words) != std::string::npos);
}

TEST_CASE("A handover from vibration stops on request, and needs slides for its windows") {
  int requested = 0;
  const auto stopped = train_vibration(
      slides(true), wanted, {}, [&] { return ++requested > 2; }, [](const auto&) {});
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().code == Errc::wrong_state);
  RecordingSet brief = slides(true);
  for (auto& r : brief.recordings)
    for (auto& samples : r.samples) samples.resize(samples.size() / 6);
  CHECK_FALSE(training_result_of(brief));
}

}  // namespace
}  // namespace weft::daemon::train_vibration_test
