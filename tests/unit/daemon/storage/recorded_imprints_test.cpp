// Imprints in the recorded scans of a run.

#include <catch2/catch.hpp>

#include "daemon/storage/dataset/trial_csv.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::test::recorded_imprints_test {
namespace {

constexpr const char* identity =
    R"({"reported": {"rows": "2", "cols": "3", "serial": "5"}, "scale": {}})";

/// A trial with the given phases as letters; scan k has 10 k, 10 k + 1 and so on.
void add_trial(Dataset& dataset, const std::string& object, const std::string& phases,
               TrialOutcome outcome = TrialOutcome::complete) {
  classifier::Trial trial;
  trial.file = object + std::to_string(dataset.trials.size());
  trial.label = object;
  trial.taxels = 6;
  for (std::size_t k = 0; k < phases.size(); ++k) {
    trial.phase.push_back(*phase_from_char(phases[k]));
    for (std::size_t i = 0; i < 6; ++i) trial.counts.push_back(static_cast<double>(10 * k + i));
  }
  TrialRecord record;
  record.spec.exploration = "light";
  record.spec.label = object;
  record.outcome = outcome;
  record.t_ns.assign(phases.size(), 0);
  REQUIRE(append(dataset, std::move(trial), std::move(record)));
}

Dataset scans(const std::string& device_identity = identity) {
  Dataset dataset;
  dataset.info.devices = {{"ft", "ati_netft", "{}"}, {"imprint", "any", device_identity}};
  add_trial(dataset, "RASP1", "SSPPE");
  return dataset;
}

}  // namespace

TEST_CASE("a trial's imprint is its last scan of phase P, in the shape of the array") {
  Dataset dataset = scans();
  add_trial(dataset, "KNIT2", "SPE");
  add_trial(dataset, "KNIT2", "SP", TrialOutcome::aborted);
  REQUIRE(holds_scans(dataset));
  CHECK(holds_imprints(dataset));
  const auto imprints = extract_imprints(dataset);
  REQUIRE(imprints);
  REQUIRE(imprints->size() == 2);
  const auto& rasp = imprints->front();
  CHECK(rasp.image.rows() == 2);
  CHECK(rasp.image.cols() == 3);
  const auto& pixels = rasp.image.data();
  CHECK(std::vector<double>(pixels.begin(), pixels.end()) ==
        std::vector<double>{30, 31, 32, 33, 34, 35});
  CHECK(rasp.label == "RASP1");  // without a recipe there are no classes
  CHECK(rasp.object == "RASP1");
  CHECK(imprints->back().file == "KNIT21");
}

TEST_CASE("a press that was never scanned is named") {
  Dataset dataset = scans();
  add_trial(dataset, "KNIT3", "SSE");
  const auto imprints = extract_imprints(dataset);
  REQUIRE_FALSE(imprints);
  CHECK(imprints.error().code == Errc::invalid_argument);
  CHECK(imprints.error().where.find("KNIT31") != std::string::npos);
}

TEST_CASE("without a device that reports rows and columns there are no scans") {
  for (const char* other :
       {"{}", "", "[]", R"({"reported": {"taxels": "6"}})", R"({"reported": {"rows": "2"}})",
        R"({"reported": {"rows": "2", "cols": "4"}})", R"({"reported": {"rows": 2, "cols": 3}})",
        R"({"reported": {"rows": "-2", "cols": "-3"}})",
        R"({"reported": {"rows": "99999999999", "cols": "3"}})"}) {
    INFO(other);
    CHECK_FALSE(holds_scans(scans(other)));
    CHECK_FALSE(holds_imprints(scans(other)));
  }
  CHECK_FALSE(holds_scans(Dataset{}));
}

}  // namespace weft::daemon::test::recorded_imprints_test
