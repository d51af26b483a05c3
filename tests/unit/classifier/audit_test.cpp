#include "classifier/evaluate/audit.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "tests/unit/classifier/audit_data.hpp"

namespace weft::classifier::audit_test {
namespace {

using testing::made_up_campaign;
using testing::MadeUpCampaign;
using testing::Planted;

AuditFigures audit_of(const MadeUpCampaign& campaign, const AuditOptions& options = {}) {
  const auto splits = split_in_parts(campaign.full, true, 3);
  return audit(campaign.full, campaign.probes, splits, options).value();
}

const ProbeFigure& figure(const AuditFigures& figures, const std::string& name) {
  return *std::ranges::find(figures.probes, name, &ProbeFigure::name);
}

TEST_CASE("Parts keep groups whole, test every row once and leave untrained labels out") {
  FeatureMatrix rows = testing::gaussian_classes(3, 5, 2, 1.0, 1);
  std::multiset<std::size_t> tested;
  const auto splits = split_in_parts(rows, true, 3);
  REQUIRE(splits.size() == 3);
  for (const Split& split : splits) {
    CHECK(split.whole_group);
    tested.insert(split.test.begin(), split.test.end());
  }
  CHECK(groups_on_both_sides(splits, rows.groups).empty());
  CHECK(tested.size() == rows.size());
  CHECK(std::set(tested.begin(), tested.end()).size() == rows.size());
  rows.labels[0] = "alone";
  for (const Split& split : split_in_parts(rows, true, 3))
    CHECK(std::ranges::find(split.test, 0U) == split.test.end());
}

TEST_CASE("Parts of recordings keep windows of one recording together") {
  FeatureMatrix rows = testing::gaussian_classes(2, 12, 2, 1.0, 1);
  for (std::size_t r = 0; r < rows.size(); ++r)
    rows.files[r] = window_name(std::to_string(r / 3) + ".csv", r % 3);
  const auto splits = split_in_parts(rows, false, 2);
  REQUIRE(splits.size() == 2);
  CHECK(splits[0].test.size() == 12);
  for (const Split& split : splits) {
    std::set<std::size_t> trained;
    for (const std::size_t r : split.train) trained.insert(r / 3);
    for (const std::size_t r : split.test) CHECK_FALSE(trained.contains(r / 3));
  }
}

TEST_CASE("One recording of each label leaves nothing to split") {
  FeatureMatrix rows = testing::gaussian_classes(3, 4, 2, 1.0, 1);
  for (std::size_t r = 0; r < rows.size(); ++r) rows.files[r] = window_name(rows.labels[r], r % 4);
  CHECK(split_in_parts(rows, false, 5).empty());
}

TEST_CASE("Labels are permuted within groups, a label's rows of a group together") {
  const MadeUpCampaign campaign = made_up_campaign(1, {});
  const auto splits = split_in_parts(campaign.full, true, 3);
  const auto units = make_permutation_units(campaign.full, splits).value();
  CHECK(units.of_groups);
  CHECK(units.label.size() == 24);
  CHECK(units.blocks.size() == 6);
  CHECK(units.log_arrangements() == Approx(6 * std::log(24.0)));
  RandomEngine engine(1);
  const auto labels = permute_labels(units, engine);
  CHECK(labels != campaign.full.labels);
  std::map<std::pair<std::string, std::string>, std::set<std::string>> given;
  for (std::size_t r = 0; r < labels.size(); ++r)
    given[{campaign.full.groups[r], campaign.full.labels[r]}].insert(labels[r]);
  std::map<std::string, std::set<std::string>> in_group;
  for (const auto& [unit, one] : given) {
    REQUIRE(one.size() == 1);
    in_group[unit.first].insert(*one.begin());
  }
  for (const auto& [group, all] : in_group) CHECK(all.size() == 4);
}

TEST_CASE("Groups of one label each exchange labels among all groups") {
  FeatureMatrix rows = testing::gaussian_classes(2, 4, 2, 1.0, 1);
  for (std::size_t r = 0; r < rows.size(); ++r) rows.groups[r] = std::to_string(r / 2);
  const auto units = make_permutation_units(rows, split_in_parts(rows, true, 2)).value();
  CHECK(units.blocks.size() == 1);
  CHECK(units.label.size() == 4);
  CHECK(units.log_arrangements() == Approx(std::log(6.0)));
}

TEST_CASE("Splits across groups permute recordings; one with two labels is refused") {
  FeatureMatrix rows = testing::gaussian_classes(2, 4, 2, 1.0, 1);
  rows.groups.assign(rows.size(), "one day");
  const auto splits = split_in_parts(rows, false, 2);
  const auto units = make_permutation_units(rows, splits).value();
  CHECK_FALSE(units.of_groups);
  CHECK(units.label.size() == 8);
  rows.files[4] = rows.files[3];
  const auto refused = make_permutation_units(rows, splits);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_argument);
}

TEST_CASE("A planted pad pattern is named with its share, and nothing else is") {
  const AuditFigures figures = audit_of(made_up_campaign(7, {"pad pattern"}));
  CHECK(figures.verdict == AuditVerdict::confounded);
  CHECK(figures.why == CannotTell::none);
  for (const ProbeFigure& one : figures.probes) {
    CHECK(one.named == (one.name == "pad pattern"));
    CHECK(one.chance == Approx(0.25).margin(0.05));
  }
  const ProbeFigure& pattern = figure(figures, "pad pattern");
  CHECK(pattern.share > 0.9);
  CHECK(pattern.p == Approx(0.01));  // 2 of 200
  CHECK(pattern.columns == 16);
  CHECK(figures.units == 24);
  CHECK(figures.permutations == 199);
}

TEST_CASE("A clean campaign gives no warning, and its accuracy is kept") {
  const AuditFigures figures = audit_of(made_up_campaign(8, {}));
  CHECK(figures.verdict == AuditVerdict::no_sign);
  CHECK(figures.full.accuracy > 0.7);
  for (const ProbeFigure& one : figures.probes) CHECK_FALSE(one.named);
}

TEST_CASE("Shuffled labels name nothing, planted or not") {
  MadeUpCampaign campaign = made_up_campaign(9, {"pad pattern"});
  const auto units =
      make_permutation_units(campaign.full, split_in_parts(campaign.full, true, 3)).value();
  RandomEngine engine(3);
  campaign.full.labels = permute_labels(units, engine);
  for (Probe& probe : campaign.probes) probe.features.labels = campaign.full.labels;
  const AuditFigures figures = audit_of(campaign);
  CHECK(figures.verdict == AuditVerdict::cannot_tell);
  CHECK(figures.why == CannotTell::full_at_chance);
  for (const ProbeFigure& one : figures.probes) CHECK_FALSE(one.named);
}

TEST_CASE("Too few units to permute give no verdict, whatever the probe reaches") {
  MadeUpCampaign campaign = made_up_campaign(10, {"pad pattern", 9.0});
  for (std::size_t r = 0; r < campaign.full.size(); ++r)
    campaign.full.groups[r] = campaign.full.labels[r] < "cloth c" ? "0" : "1";
  std::vector<std::size_t> rows;  // two labels in two groups: 2! permutations in each
  for (std::size_t r = 0; r < 24; ++r) rows.push_back(r);
  for (std::size_t r = 0; r < 24; ++r) campaign.full.groups[r] = std::to_string(r % 2);
  campaign.full = select_rows(campaign.full, rows);
  Probe probe = campaign.probes.front();
  probe.features = select_rows(probe.features, rows);
  campaign.probes = {probe};
  const AuditFigures figures =
      audit(campaign.full, campaign.probes, split_in_parts(campaign.full, true, 2)).value();
  CHECK(figures.verdict == AuditVerdict::cannot_tell);
  CHECK(figures.why == CannotTell::too_few_units);
}

TEST_CASE("An audit without a probe gives no verdict; one of other rows is refused") {
  MadeUpCampaign campaign = made_up_campaign(11, {});
  const auto splits = split_in_parts(campaign.full, true, 3);
  CHECK(audit(campaign.full, {}, splits).value().why == CannotTell::no_probe);
  campaign.probes.front().features.labels.pop_back();
  const auto refused = audit(campaign.full, campaign.probes, splits);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_argument);
}

TEST_CASE("The figures of an audit do not depend on the number of threads") {
  const MadeUpCampaign campaign = made_up_campaign(12, {"durations", 1.5});
  const AuditFigures one =
      audit_of(campaign, {.permutations = 49, .tree_permutations = 9, .threads = 1});
  const AuditFigures two =
      audit_of(campaign, {.permutations = 49, .tree_permutations = 9, .threads = 2});
  for (std::size_t k = 0; k < one.probes.size(); ++k) {
    CHECK(one.probes[k].reached.accuracy == two.probes[k].reached.accuracy);
    CHECK(one.probes[k].p == two.probes[k].p);
    CHECK(one.probes[k].chance == two.probes[k].chance);
  }
}

// A few of the seeds that `script/bench audit` counts by the hundred.
TEST_CASE("Planted confounds are found and clean campaigns are not accused, over seeds") {
  std::size_t found = 0, accused = 0;
  constexpr std::size_t seeds = 8;
  for (std::size_t seed = 0; seed < seeds; ++seed) {
    const char* const probe = seed % 2 == 0 ? "pad pattern" : "order and time";
    const AuditFigures planted = audit_of(made_up_campaign(100 + seed, {probe, 2.0}));
    found += planted.verdict == AuditVerdict::confounded && figure(planted, probe).named ? 1U : 0U;
    accused +=
        audit_of(made_up_campaign(200 + seed, {})).verdict == AuditVerdict::confounded ? 1U : 0U;
  }
  CHECK(found >= seeds - 1);
  CHECK(accused == 0);
}

}  // namespace
}  // namespace weft::classifier::audit_test
