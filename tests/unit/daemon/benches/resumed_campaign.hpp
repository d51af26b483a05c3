#pragma once
// A stopped or killed campaign that is resumed, and its invariants. SIMULATED.

#include <atomic>
#include <catch2/catch.hpp>
#include <map>

#include "daemon/campaign/resume.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace weft::daemon::test {

inline CampaignRequest request_for(const TemporaryFolder& folder, int repetitions = 2) {
  CampaignRequest request = request_in(folder, tiny_recipe(repetitions));
  request.error_check = false;
  return request;
}

inline CampaignSummary run(const CampaignRequest& request, const CampaignHooks& hooks = {}) {
  const auto summary = run_campaign(request, hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

inline CampaignSummary stopped_after_two(const CampaignRequest& request) {
  CampaignHooks hooks;
  std::atomic<bool> stop = false;
  hooks.stop = &stop;
  hooks.progress = [&](const TrialProgress& line) { stop = line.done == 2; };
  return run(request, hooks);
}

inline CampaignSummary resumed(CampaignRequest request) {
  request.resume = true;
  return run(request);
}

inline Dataset loaded(const std::filesystem::path& file, bool all = false) {
  auto dataset = load_campaign(file, {.all_outcomes = all});
  if (!dataset) FAIL(to_string(dataset.error()));
  return std::move(*dataset);
}

inline const Dataset& undisturbed(int repetitions) {
  static std::map<int, Dataset> known;
  if (!known.contains(repetitions)) {
    const TemporaryFolder folder;
    known.emplace(repetitions, loaded(run(request_for(folder, repetitions)).campaign_file));
  }
  return known.at(repetitions);
}

inline void check_holds(const std::filesystem::path& path) {
  const auto report = verify(path);
  REQUIRE(report);
  for (const VerifyProblem& diagnosis : report->found_problems)
    UNSCOPED_INFO(diagnosis.where + ": " + diagnosis.what);
  CHECK(report->holds());
}

/// Checks a campaign that was resumed to its end.
inline void check_whole(const std::filesystem::path& out, int kills, int repetitions = 2) {
  const Dataset& untouched = undisturbed(repetitions);
  check_holds(out);
  CHECK(verify(out)->certified);
  const Dataset all = loaded(out / "campaign.sqlite", true);
  std::map<std::uint32_t, int> complete, cut_short;
  for (const TrialRecord& record : all.records)
    ++(record.outcome == TrialOutcome::complete ? complete : cut_short)[record.spec.index];
  CHECK(complete.size() == untouched.trials.size());
  for (const auto& [index, times] : complete) CHECK(times == 1);
  int repeated = 0;
  for (const auto& [index, times] : cut_short) repeated += times;
  CHECK(repeated <= kills);
  CHECK(difference(untouched, loaded(out / "campaign.sqlite")) == "");
  const auto exported = read_hdf5(out / "dataset.h5");
  REQUIRE(exported);
  CHECK(difference(untouched, *exported) == "");
}

}  // namespace weft::daemon::test
