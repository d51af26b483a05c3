// The tables of `weft audit`, from trials with known values, and its verdict on them.

#include "daemon/apps/weft/audit_tables.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft/audit_text.hpp"

namespace weft::daemon::cli::audit_tables_test {
namespace {

using classifier::Probe;

constexpr std::size_t pads = 2;

/// Two samples of S at 10 and 30 counts, then three of M at `left` and `right`, a second apart.
void add_trial(Dataset& set, const std::string& label, std::uint32_t place, double left,
               double right) {
  classifier::Trial trial;
  trial.file = std::to_string(set.trials.size());
  trial.label = label;
  trial.group = std::to_string(place);
  trial.taxels = pads;
  TrialRecord record;
  record.spec.index = static_cast<std::uint32_t>(set.trials.size());
  record.spec.repetition = place;
  record.spec.exploration = "M1";
  record.spec.place = {1, place, 0};
  record.lost_samples = 4;
  record.quality.force_rms_error_n = 0.5 + left;
  const auto add = [&](Phase phase, double a, double b) {
    trial.phase.push_back(phase);
    trial.counts.insert(trial.counts.end(), {a, b});
    record.t_ns.push_back((100 * record.spec.index + record.t_ns.size()) * 1000000000LL);
  };
  add(Phase::rest, 10, 20);
  add(Phase::rest, 30, 20);
  for (const double ripple : {-1.0, 0.0, 1.0}) add(Phase::motion, left + ripple, right - ripple);
  set.trials.push_back(std::move(trial));
  set.records.push_back(std::move(record));
}

ChosenTrials four_trials() {
  ChosenTrials out;
  out.dataset.info.source = "campaign";
  add_trial(out.dataset, "silk", 1, 10, 30);
  add_trial(out.dataset, "denim", 1, 20, 20);
  add_trial(out.dataset, "silk", 2, 10, 30);
  add_trial(out.dataset, "denim", 2, 24, 8);
  out.setup.taxels = pads;
  out.features = classifier::build_feature_matrix(complete_trials(out.dataset)).value();
  return out;
}

const classifier::FeatureMatrix& probe(const AuditTables& tables, const std::string& name) {
  return std::ranges::find(tables.probes, name, &Probe::name)->features;
}

std::string why_absent(const AuditTables& tables, const std::string& name) {
  for (const auto& [one, why] : tables.absent)
    if (one == name) return why;
  return {};
}

TEST_CASE("the pad pattern is the mean level of each pad over their sum") {
  const AuditTables tables = slide_tables(four_trials()).value();
  const auto& pattern = probe(tables, "pad pattern");
  REQUIRE(pattern.names.size() == 2);
  const std::vector<double> left = {0.25, 0.5, 0.25, 0.75};
  for (std::size_t r = 0; r < 4; ++r) {
    CHECK(pattern.values(r, 0) == Approx(left[r]));
    CHECK(pattern.values(r, 1) == Approx(1 - left[r]));
  }
  CHECK(pattern.labels == tables.full.labels);
}

TEST_CASE("a campaign has repetition, start and place; columns that never change are left out") {
  const AuditTables tables = slide_tables(four_trials()).value();
  const auto& order = probe(tables, "order and time");
  REQUIRE(order.names.size() == 3);
  CHECK(order.values(3, 0) == 2);
  CHECK(order.values(3, 1) == 300);
  CHECK(order.values(3, 2) == 3);
  CHECK(probe(tables, "force error").values(3, 0) == 24.5);
  CHECK(probe(tables, "force error").names.size() == 1);
  for (const char* const name : {"phase S", "durations", "lost frames"})
    CHECK(why_absent(tables, name).find("same") != std::string::npos);
}

TEST_CASE("imports have no place, and trials that overlap have no common clock") {
  ChosenTrials chosen = four_trials();
  chosen.dataset.info.source = "manifest";
  CHECK(probe(slide_tables(chosen).value(), "order and time").names.size() == 2);
  chosen.dataset.records[3].t_ns = chosen.dataset.records[0].t_ns;
  CHECK(probe(slide_tables(chosen).value(), "order and time").names.size() == 1);
}

TEST_CASE("removing the pad pattern leaves every pad the same mean and the level of all") {
  ChosenTrials chosen = four_trials();
  classifier::Trial& trial = chosen.dataset.trials[3];  // 24 and 8
  remove_pad_pattern(trial);
  CHECK(trial.row(3)[0] == Approx(16));
  CHECK(trial.row(3)[1] == Approx(16));
  CHECK(trial.row(4)[0] == Approx(16 * 25.0 / 24));
  CHECK(trial.row(4)[1] == Approx(16 * 7.0 / 8));
  CHECK(trial.row(0)[0] == Approx(10 * 16.0 / 24));
  const AuditTables tables = slide_tables(four_trials()).value();
  REQUIRE(tables.changed.size() == 3);
  const auto& level = tables.changed.front().features;
  const auto mean = std::ranges::find(level.names, "mean.M.1") - level.names.begin();
  CHECK(level.values(3, static_cast<std::size_t>(mean)) == 0);
}

TEST_CASE("a single pad has no pattern") {
  ChosenTrials chosen = four_trials();
  for (classifier::Trial& trial : chosen.dataset.trials) {
    trial.taxels = 1;
    trial.counts.resize(trial.samples());
  }
  chosen.setup.taxels = 1;
  chosen.features = classifier::build_feature_matrix(complete_trials(chosen.dataset)).value();
  const AuditTables tables = slide_tables(chosen).value();
  CHECK_FALSE(why_absent(tables, "pad pattern").empty());
  CHECK(tables.changed.size() == 1);
}

TEST_CASE("groups are a probe, but not where nearly every row has its own") {
  AuditTables tables = slide_tables(four_trials()).value();
  add_group_probe(tables);
  const auto& group = probe(tables, "group");
  CHECK(group.names.size() == 2);
  CHECK(group.values(0, 0) == 1);
  CHECK(group.values(3, 0) == 0);
  AuditTables single = slide_tables(four_trials()).value();
  single.full.groups = {"a", "b", "c", "d"};
  add_group_probe(single);
  CHECK_FALSE(why_absent(single, "group").empty());
}

TEST_CASE("a column of the data set is a probe and may be left out, a piece is no probe") {
  ChosenTrials chosen = four_trials();
  chosen.dataset.info.group_columns = {"empty", "session"};
  const char* sessions[] = {"a", "b", "b", "a"};
  for (std::size_t i = 0; i < 4; ++i)
    chosen.dataset.records[i].spec.group_values = {i == 0 ? "" : "x", sessions[i]};
  AuditTables tables = slide_tables(chosen).value();
  REQUIRE(tables.columns.size() == 3);
  CHECK(tables.columns[0].of_cloth);
  CHECK(tables.columns[1].of_cloth);
  CHECK(tables.columns[2].name == "session");
  CHECK(tables.columns[2].of_row == std::vector<std::string>{"a", "b", "b", "a"});
  const std::size_t before = tables.probes.size();
  add_column_probes(tables);
  REQUIRE(tables.probes.size() == before + 1);
  CHECK(probe(tables, "column session").values(0, 0) == 1);
  CHECK(probe(tables, "column session").values(1, 1) == 1);
  tables.full.groups = tables.columns[2].of_row;
  add_column_probes(tables);
  CHECK(tables.probes.size() == before + 1);
}

/// A report with one probe, named by statistics.
AuditReport report_of(const std::string& name, std::span<const classifier::Split> splits) {
  AuditReport out;
  out.tables = slide_tables(four_trials()).value();
  note_whole_columns(out.tables.columns, out.tables.full, splits);
  out.figures.emplace();
  out.figures->full.accuracy = 1.0;
  out.figures->verdict = classifier::AuditVerdict::confounded;
  out.figures->probes.push_back({.name = name,
                                 .columns = 2,
                                 .reached = {},
                                 .chance = 0.5,
                                 .share = 0.9,
                                 .p = 0.01,
                                 .named = true});
  return out;
}

TEST_CASE(
    "a pad pattern is a confound of mountings on both sides, undecided where they are whole") {
  const std::vector<classifier::Split> across = {{{0, 1}, {2, 3}, true}};
  const std::vector<classifier::Split> within = {{{0, 3}, {1, 2}}};
  AuditReport whole = report_of("pad pattern", across);
  REQUIRE(whole.tables.columns.size() == 2);
  CHECK(whole.tables.columns[0].whole);
  CHECK_FALSE(whole.tables.columns[1].whole);
  CHECK(audit_json(whole)["verdict"]["code"] == "cannot_tell");
  CHECK(audit_json(whole)["verdict"]["why"] == "undecided");
  whole.tables.columns[1].whole = true;
  CHECK(audit_json(whole)["verdict"]["code"] == "no_sign");
  CHECK(audit_json(whole)["verdict"]["material"] == nlohmann::json({"pad pattern"}));
  AuditReport shared = report_of("pad pattern", within);
  shared.tables.columns[0].of_row = {"1", "1", "1", "1"};
  note_whole_columns(shared.tables.columns, shared.tables.full, across);
  CHECK(audit_json(shared)["verdict"]["code"] == "confounded");
  CHECK(audit_json(shared)["verdict"]["confounds"] == nlohmann::json({"pad pattern"}));
  CHECK(audit_json(report_of("order and time", across))["verdict"]["code"] == "confounded");
  CHECK(audit_json(report_of("force error", across))["verdict"]["why"] == "undecided");
  CHECK(audit_json(report_of("level", across))["verdict"]["why"] == "undecided");
  const auto column = audit_json(report_of("column session", across))["verdict"];
  CHECK(column["confounds"] == nlohmann::json({"column session"}));
  CHECK(column["next"][0].get<std::string>().find("--group session") != std::string::npos);
}

TEST_CASE("without a split there is no verdict") {
  AuditReport report;
  report.tables = slide_tables(four_trials()).value();
  const nlohmann::json out = audit_json(report);
  CHECK(out["verdict"]["code"] == "cannot_tell");
  CHECK(out["verdict"]["why"] == "one_recording");
  CHECK(out["verdict"]["next"].size() == 1);
}

}  // namespace
}  // namespace weft::daemon::cli::audit_tables_test
