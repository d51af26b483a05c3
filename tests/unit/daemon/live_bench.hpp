#pragma once
// A model for live votes from one small simulated campaign, beside the recipe of the next.

#include <catch2/catch.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "classifier/live/staged_model.hpp"
#include "tests/unit/daemon/trial_bench.hpp"

namespace weft::daemon::live_test {

using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

/// Two cloths that anybody tells apart, slides of 16 mm at 4 mm/s.
inline json recipe_of(int repetitions) {
  return json::parse(R"({"schema_version":1,"name":"live","source":"test","seed":3,
    "fabrics":["pile","nylon"],"repetitions":)" +
                     std::to_string(repetitions) + R"(,"explorations":{"M1":{"phases":[
      {"phase":"S","duration_s":0.5},{"phase":"P","force_N":5,"duration_s":0.5},
      {"phase":"M","speed_mm_s":4,"path":[{"dx_mm":0,"dy_mm":16}]},
      {"phase":"E","duration_s":0.5}]}}})");
}

inline CampaignSummary run(const CampaignRequest& request, const CampaignHooks& hooks = {}) {
  const Result<CampaignSummary> summary = run_campaign(request, hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

inline Dataset recorded(const std::filesystem::path& campaign) {
  auto all = load_campaign(campaign, {.all_outcomes = true, .streams = false, .transfers = false});
  REQUIRE(all);
  return *std::move(all);
}

using Change = std::function<void(classifier::StagedModel&)>;

inline std::string model_text(const Dataset& dataset, const Change& change = {}) {
  classifier::StagedOptions options;
  options.learner = classifier::Learner::lda;
  options.exploration = "M1";
  options.provenance.bench = "simulated";
  auto model = classifier::train_staged(dataset.trials, dataset.info.taxel_rate_hz, options);
  if (!model) FAIL(to_string(model.error()));
  if (change) change(*model);
  std::ostringstream out;
  REQUIRE(classifier::save_staged(*model, out));
  return out.str();
}

/// A model from one campaign, beside the recipe of the next.
struct LiveBench {
  TemporaryFolder folder;
  CampaignRequest request;
  LiveBench() {
    request = request_in(folder, recipe_of(4).dump());
    request.error_check = false;
    const CampaignSummary first = run(request);
    test::write_file(folder / "m1.model", model_text(recorded(first.campaign_file)));
  }
  void ask(const json& vote) {
    json recipe = recipe_of(1);
    recipe["explorations"]["M1"]["live_vote"] = vote;
    test::write_file(request.recipe, recipe.dump());
    request.out = folder / "live";
  }
  /// Another model in the place of the first.
  void change(const Change& how) {
    const Dataset first = recorded(folder / "out" / "campaign.sqlite");
    test::write_file(folder / "m1.model", model_text(first, how));
  }
  void change_rig(const std::function<void(json&)>& how) {
    json rig = test::bench17();
    how(rig);
    test::write_file(request.rig, rig.dump());
  }
  /// What is said of the request; the quick look says the same where the head alone tells it.
  std::string refusal(bool by_head = true) {
    const auto whole = check_request(request), quick = check_quickly(request);
    if (whole.has_value()) {
      CHECK(quick.has_value());
      return "none";
    }
    CHECK(quick.has_value() == !by_head);
    if (!quick) CHECK(to_string(quick.error()) == to_string(whole.error()));
    return to_string(whole.error());
  }
};

inline const json stop_early{{"model", "m1.model"},
                             {"stop_early", {{"sure_probability", 0.8}, {"least_slide_s", 1}}}};

}  // namespace weft::daemon::live_test
