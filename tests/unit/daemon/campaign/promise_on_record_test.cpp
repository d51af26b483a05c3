// A campaign with an accuracy whose process ends before its error check: what the run says of it,
// and that it can be gone on with. SIMULATED.

#include <atomic>
#include <catch2/catch.hpp>
#include <stdexcept>

#include "daemon/campaign/promise_text.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/promise_bench.hpp"

namespace promise_on_record_test {

using namespace weft;
using namespace weft::daemon;
using test::denim_request;
using test::TemporaryFolder;

namespace {

CampaignSummary ran(const CampaignRequest& request, const CampaignHooks& hooks = {}) {
  const auto summary = run_campaign(request, hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

/// Two trials of the same, asked for 0.5 N.
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

}  // namespace

TEST_CASE("a resume that ends while the past is played again does not say what the record said") {
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

}  // namespace promise_on_record_test
