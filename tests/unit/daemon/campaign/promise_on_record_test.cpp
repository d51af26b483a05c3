// The process of a campaign with an accuracy ends before the error check: the statements of the
// run, and its resumption. SIMULATED.

#include <atomic>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/campaign/campaign_file.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/promise_bench.hpp"

namespace promise_on_record_test {

using namespace weft;
using namespace weft::daemon;
using test::TemporaryFolder;

namespace {

CampaignSummary ran(const CampaignRequest& request, const CampaignHooks& hooks = {}) {
  const auto summary = run_campaign(request, hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

/// Two trials of the same fabric and exploration, with a requested accuracy of 0.5 N.
CampaignRequest one_pair_request(const TemporaryFolder& folder) {
  const std::string denim = test::changed(test::tiny_recipe(2), R"("denim","satin")", R"("denim")");
  const std::string press = R"("force_band_N":0.25,"duration_s":)";
  CampaignRequest request = test::request_in(
      folder, test::changed(denim, press + "0.2", press + "1"), test::rig_with_table(folder));
  request.fidelity.probe_us = 50;
  request.fidelity.accuracy_n = 0.5;
  return request;
}

/// Runs to the end of the first trial.
CampaignSummary stopped_after_one(const CampaignRequest& request) {
  CampaignHooks hooks;
  std::atomic<bool> stop = false;
  hooks.stop = &stop;
  hooks.progress = [&](const TrialProgress& line) { stop = line.done == 1; };
  return ran(request, hooks);
}

/// The campaign's process dies at the first write after the requested accuracy is recorded.
std::optional<CampaignHistory> killed_before_first_trial(const CampaignRequest& request) {
  for (std::uint64_t write = 1; write < 60; ++write) {
    std::filesystem::remove_all(request.out);
    REQUIRE(test::killed_at(request, {write}) == true);
    const auto history = load_history(request.out / campaign_file_name);
    if (!history || !simulation_on_record(request.out / campaign_file_name).has_request()) continue;
    return history->attempts.empty() ? std::optional(*history) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

TEST_CASE("a resume that ends during the replay does not repeat the recorded promise") {
  const TemporaryFolder folder;
  CampaignRequest request = one_pair_request(folder);
  const CampaignSummary first = stopped_after_one(request);
  REQUIRE(first.simulation.promise);
  CHECK(first.simulation.promise->held);
  request.resume = true;
  CampaignHooks hooks;
  std::atomic<bool> stop = false;
  hooks.stop = &stop;
  hooks.moment = [&stop](const RunStatusUpdate&) { stop = true; };
  const CampaignSummary second = ran(request, hooks);
  REQUIRE(second.dataset_error);
  CHECK(second.dataset_error->code == Errc::wrong_state);
  REQUIRE(second.simulation.promise);
  CHECK(second.simulation.promise->has_run);
  CHECK_FALSE(second.simulation.promise->is_checked);
  CHECK(second.simulation.promise->checked_pairs == 0);
  CHECK(is_promise_missed(second.simulation));
}

TEST_CASE("a campaign killed before its first trial is resumed with its request") {
  const bool says_again = GENERATE(true, false);
  CAPTURE(says_again);
  const TemporaryFolder folder;
  CampaignRequest request = one_pair_request(folder);
  const auto history = killed_before_first_trial(request);
  REQUIRE(history);
  std::filesystem::remove(folder / "table.json");
  request.resume = true;
  request.fidelity.probe_us = 75;  // another process measures another speed
  if (!says_again) request.fidelity.accuracy_n.reset();
  const CampaignSummary s = ran(request);
  CHECK(s.trials_complete == 2);
  CHECK(s.simulation.setting == "L1 3.072 ms");
  REQUIRE(s.simulation.promise);
  CHECK(s.simulation.promise->requested_n == 0.5);
  CHECK(s.simulation.promise->held);
  const auto data = load_campaign(s.campaign_file);
  REQUIRE(data);
  CHECK(data->info.rig_json == history->info.rig_json);
  CHECK(data->info.rig_sha256 == history->info.rig_sha256);
}

}  // namespace promise_on_record_test
