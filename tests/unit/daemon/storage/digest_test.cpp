#include <catch2/catch.hpp>
#include <functional>
#include <limits>
#include <set>

#include "tests/unit/daemon/storage/support.hpp"

namespace digest_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

Dataset small_set() {
  const TemporaryFolder folder;
  REQUIRE(record_campaign(folder / "c.weft", 2, 20));
  return *load_campaign(folder / "c.weft");
}

}  // namespace

TEST_CASE("the digest differs when any one thing of the content does") {
  const std::vector<std::function<void(Dataset&)>> changes{
      [](Dataset& d) { d.trials[1].counts[30] += 1; },
      [](Dataset& d) { d.trials[1].counts[30] += 0.5; },
      [](Dataset& d) { d.trials[0].phase[3] = Phase::end; },
      [](Dataset& d) { d.trials[0].label = "Denin"; },
      [](Dataset& d) { d.trials[0].group = "r9"; },
      [](Dataset& d) { std::swap(d.trials[0].label, d.trials[0].group); },
      [](Dataset& d) { d.records[0].t_ns[5] += 1; },
      [](Dataset& d) { d.records[0].device_us[5] += 1; },
      [](Dataset& d) { d.records[0].device_us.clear(); },
      [](Dataset& d) { d.records[0].outcome = TrialOutcome::failed; },
      [](Dataset& d) { d.records[0].spec.exploration = "M2"; },
      [](Dataset& d) { d.records[0].spec.patch_seed += 1; },
      [](Dataset& d) { d.records[0].quality.force_rms_error_n.reset(); },
      [](Dataset& d) { d.records[1].wrench.quanta[7] += 1; },
      [](Dataset& d) { d.records[1].stages.t_ns[7] += 1; },
      [](Dataset& d) { d.info.kind = BenchKind::real; },
      [](Dataset& d) { d.info.axes[0].name = "y"; },
      [](Dataset& d) {
        std::swap(d.trials[0], d.trials[1]), std::swap(d.records[0], d.records[1]);
      },
      [](Dataset& d) { d.trials.pop_back(), d.records.pop_back(); },
  };
  const Dataset original = small_set();
  std::set<std::string> digests{dataset_sha256(original)};
  for (const auto& change : changes) {
    Dataset changed = original;
    change(changed);
    digests.insert(dataset_sha256(changed));
  }
  CHECK(digests.size() == changes.size() + 1);
}

TEST_CASE("the digest does not depend on where, when and by which version a set was made") {
  Dataset dataset = small_set();
  const std::string before = dataset_sha256(dataset);
  dataset.info.software_version = "9.9";
  dataset.info.name = "renamed";
  dataset.info.seed = 1;
  CHECK(dataset_sha256(dataset) == before);
}

TEST_CASE("a data set that breaks a promise is refused by name") {
  const std::vector<std::pair<std::string, std::function<void(Dataset&)>>> breaks{
      {"no trials", [](Dataset& d) { d.trials.clear(), d.records.clear(); }},
      {"no record", [](Dataset& d) { d.records.pop_back(); }},
      {"same name", [](Dataset& d) { d.trials[1].file = d.trials[0].file; }},
      {"no label", [](Dataset& d) { d.trials[1].label.clear(); }},
      {"NaN", [](Dataset& d) { d.trials[1].counts[4] = std::numeric_limits<double>::quiet_NaN(); }},
      {"infinite",
       [](Dataset& d) { d.trials[1].counts[4] = std::numeric_limits<double>::infinity(); }},
      {"counts", [](Dataset& d) { d.trials[1].counts.pop_back(); }},
      {"no samples", [](Dataset& d) { d.trials[1].counts.clear(), d.trials[1].phase.clear(); }},
      {"times", [](Dataset& d) { d.records[1].t_ns.push_back(0); }},
      {"clocks", [](Dataset& d) { d.records[1].device_us.push_back(0); }},
      {"wrench", [](Dataset& d) { d.records[1].wrench.quanta.pop_back(); }},
      {"stages", [](Dataset& d) { d.info.axes.pop_back(); }},
      {"phase", [](Dataset& d) { d.trials[1].phase[0] = static_cast<Phase>('x'); }},
      {"quality", [](Dataset& d) { d.records[1].quality.force_rms_error_n = std::nan(""); }},
  };
  const Dataset original = small_set();
  REQUIRE(check(original));
  for (const auto& [name, change] : breaks) {
    INFO(name);
    Dataset broken = original;
    change(broken);
    CHECK_FALSE(check(broken));
  }
}

TEST_CASE("trials are chosen by exploration, and only complete ones") {
  Dataset dataset = small_set();
  dataset.records[1].spec.exploration = "M2";
  REQUIRE(complete_trials(dataset, "M2").size() == 1);
  CHECK(complete_trials(dataset, "M2")[0].file == dataset.trials[1].file);
  CHECK(complete_trials(dataset, "M3").empty());
  CHECK(complete_trials(dataset).size() == dataset.trials.size());
  CHECK(list_explorations(dataset) == std::vector<std::string>{"M1", "M2"});
  dataset.records[1].outcome = TrialOutcome::failed;
  CHECK(complete_trials(dataset, "M2").empty());
  CHECK(complete_trials(dataset).size() == dataset.trials.size() - 1);
  CHECK(list_explorations(dataset) == std::vector<std::string>{"M1"});
}

TEST_CASE("the words for bench kinds and outcomes go both ways") {
  for (const BenchKind kind : {BenchKind::unknown, BenchKind::simulated, BenchKind::real})
    CHECK(bench_kind_from(to_string(kind)) == kind);
  for (const TrialOutcome outcome :
       {TrialOutcome::complete, TrialOutcome::stopped, TrialOutcome::aborted, TrialOutcome::failed,
        TrialOutcome::interrupted, TrialOutcome::ended_early})
    CHECK(trial_outcome_from(to_string(outcome)) == outcome);
  CHECK_FALSE(bench_kind_from("Simulated").has_value());
  CHECK_FALSE(trial_outcome_from("").has_value());
}

}  // namespace digest_test
