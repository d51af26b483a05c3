// Campaigns beside each other: rows by the novelty of a test trial, with the accuracy of a choice.

#include <nlohmann/json.hpp>

#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace beside_test {

using namespace weft::daemon;

namespace {

EvaluateOptions with_best() {
  return {.repeats = 3, .threads = 1, .best_splits = 2};
}

Dataset placed(std::uint32_t pieces) {
  Dataset set = report_test::small_campaign();
  for (TrialRecord& record : set.records)
    record.spec.place = {record.spec.repetition % pieces + 1, 1, 1};
  return set;
}

}  // namespace

TEST_CASE("a choice by cross-validation is in every row, over fewer splits than the rest") {
  const Dataset set = placed(1);
  std::vector<std::string> steps;
  std::size_t expected = 0;
  const auto results =
      evaluate_campaign(set, with_best(), {}, [&](const EvaluationProgress& progress) {
        steps.push_back(progress.what);
        expected = progress.steps;
      });
  if (!results) FAIL(to_string(results.error()));
  CHECK(steps.size() == expected);
  REQUIRE((*results)[0].best);
  CHECK((*results)[0].best->scores.splits.size() == 2);
  CHECK((*results)[0].best->scores.accuracy == 1.0);
  CHECK((*results)[0].best->permuted_accuracy < 0.9);
  CHECK((*results)[0].find(weft::classifier::Reduction::pvalue)->splits.size() == 3);

  // A new piece is tested by leaving each piece out: there are two splits.
  const auto pieces = evaluate_beside(placed(2), with_best());
  if (!pieces) FAIL(to_string(pieces.error()));
  REQUIRE(pieces->results[0].best);
  CHECK(pieces->results[0].best->scores.confusion.total() == set.trials.size());

  const std::vector<CampaignBeside> beside = {*pieces};
  const CampaignSummary run = report_test::make_summary(set);
  ReportInput input{run, set, *results, "test machine", "abc123"};
  input.beside = &beside;
  const auto json = nlohmann::json::parse(report_test::report_json(input));
  CHECK(json.at("results").at("M1").at("best").at("splits") == 2);
  const auto& row = json.at("beside")[0].at("results").at("M1").at("best");
  CHECK(row.at("ci95").size() == 2);
  CHECK(row.at("permuted_accuracy").is_number());
  CHECK(report_test::count_of(report_test::report_html(input), ">best [%]</th>") == 1);
  CHECK(report_test::count_of(summary_text(input), "\n      best ") == 2);
}

TEST_CASE("without rows beside it nothing is chosen, which takes long") {
  const auto& campaign = report_test::campaign();
  CHECK_FALSE(campaign.results[0].best);
  const auto json = nlohmann::json::parse(report_test::report_json(campaign.input()));
  CHECK_FALSE(json.at("results").at("M1").contains("best"));
}

}  // namespace beside_test
