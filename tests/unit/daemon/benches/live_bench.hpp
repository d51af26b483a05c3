#pragma once
// A model for live votes from one small simulated campaign, and the recipe of the next.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "classifier/live/staged_model.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace weft::daemon::live_test {

/// Two clearly different fabrics, strokes of 16 mm at 4 mm/s.
nlohmann::json recipe_of(int repetitions);
/// Certain at 0.8, after at least one second.
const nlohmann::json& stop_early();

/// run_campaign(), which must succeed.
CampaignSummary run(const CampaignRequest& request, const CampaignHooks& hooks = {});
/// All attempts of a campaign file.
Dataset recorded(const std::filesystem::path& campaign);

using Change = std::function<void(classifier::StagedModel&)>;
/// A staged model of the trials, of exploration M1.
std::string model_text(const Dataset& dataset, const Change& change = {});

/// The recipe uses "m1.model", which was trained on a campaign in "out".
struct LiveBench {
  test::TemporaryFolder folder;
  CampaignRequest request;
  LiveBench();
  /// One repetition into "live", with this live vote.
  void query(const nlohmann::json& vote);
  /// Replaces the first model.
  void change(const Change& how);
  /// Changes bench17.
  void change_rig(const std::function<void(nlohmann::json&)>& how);
  /// The refusal of the request; the quick check gives the same if the head of the model suffices.
  std::string refusal(bool by_head = true);
};

}  // namespace weft::daemon::live_test
