// Whether an accuracy may come from the mountings, and the accuracy without levels.

#include "daemon/analysis/report/confounding.hpp"

#include <nlohmann/json.hpp>

#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace confounding_test {

using namespace weft::daemon;
using weft::classifier::Reduction;
using weft::classifier::Split;

namespace {

constexpr const char* sentence = "label and mounting are confounded";

// Three fabrics with the same texture, which differ only in the level of their taxels.
Dataset levels_alone() {
  Dataset set = report_test::small_campaign(0);
  std::mt19937 engine(7);
  for (std::uint32_t repetition = 1; repetition <= 6; ++repetition)
    for (const char* fabric : {"knitwear1", "wool", "pile"})
      report_test::add_trial(set, fabric, {60, 3}, repetition, engine);
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    set.records[i].spec.place = {.piece = 1, .mounting = 1, .patch = 1};
    for (double& count : set.trials[i].counts) count += 100 * static_cast<double>(i % 3);
  }
  return set;
}

// Trials 1 to 3 of each fabric in one mounting, 4 to 6 in the next.
Dataset two_mountings() {
  Dataset set = levels_alone();
  for (TrialRecord& record : set.records)
    record.spec.place.mounting = record.spec.repetition > 3 ? 2 : 1;
  return set;
}

std::vector<std::string> files_of(const Dataset& set) {
  std::vector<std::string> out;
  for (const auto& trial : set.trials) out.push_back(trial.file);
  return out;
}

}  // namespace

TEST_CASE("a mounting in both parts of a split confounds it with its label") {
  const Dataset set = two_mountings();
  const std::vector<std::string> files = files_of(set);
  // Three fabrics a repetition: rows 0 to 8 belong to the first mounting of each.
  const std::vector<Split> apart = {{{0, 1, 2, 3, 4, 5, 6, 7, 8}, {9, 10, 11, 17}}};
  const std::vector<Split> shared = {{{0, 1, 2, 9}, {3, 10}}};
  CHECK_FALSE(shares_mountings(set, files, apart));
  CHECK(shares_mountings(set, files, shared));
  // The same number with another label is another mounting.
  CHECK_FALSE(shares_mountings(set, files, std::vector<Split>{{{0, 9}, {1, 2}}}));
}

TEST_CASE("windows have their trial's mounting, and an unknown mounting is ignored") {
  Dataset set = levels_alone();
  std::vector<std::string> files = files_of(set);
  for (std::string& file : files) file += "#w1";
  const std::vector<Split> splits = {{{0, 1}, {3, 4}}};
  CHECK(shares_mountings(set, files, splits));
  set.records[5].spec.place.mounting = 0;
  CHECK_FALSE(shares_mountings(set, files, splits));
}

TEST_CASE("fabrics that differ in level only are not separated without it") {
  const Dataset set = levels_alone();
  const auto results = report_test::results_of(set);
  CHECK(results[0].confounded);
  REQUIRE(find(results[0].level_removed, Reduction::all) != nullptr);
  CHECK(results[0].find(Reduction::all)->accuracy == 1.0);
  CHECK(find(results[0].level_removed, Reduction::all)->accuracy < 0.75);

  const CampaignSummary run = report_test::make_summary(set);
  const ReportInput input{run, set, results, "test machine", "abc123"};
  const auto json = nlohmann::json::parse(report_test::report_json(input)).at("results").at("M1");
  CHECK(json.at("confounded") == "mounting");
  CHECK(json.at("level_removed").at("pvalue").at("splits") == 2);
  CHECK(report_test::count_of(report_test::report_html(input), sentence) == 1);
  CHECK(report_test::count_of(summary_text(input), sentence) == 1);
}

TEST_CASE("cross-validated mountings are not confounded, and cost no second training") {
  const auto beside = evaluate_beside(two_mountings(), {.repeats = 2, .threads = 1});
  REQUIRE(beside);
  CHECK_FALSE(beside->results[0].confounded);
  CHECK(beside->results[0].level_removed.empty());
}

TEST_CASE("a data set without known mountings gives no statement") {
  const auto& campaign = report_test::campaign();
  CHECK_FALSE(campaign.results[0].confounded);
  CHECK(report_test::count_of(report_test::report_html(campaign.input()), sentence) == 0);
  const auto json = nlohmann::json::parse(report_test::report_json(campaign.input()));
  CHECK(json.at("results").at("M1").at("confounded").is_null());
}

}  // namespace confounding_test
