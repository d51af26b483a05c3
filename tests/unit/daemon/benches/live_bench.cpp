#include "tests/unit/daemon/benches/live_bench.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

namespace weft::daemon::live_test {

using nlohmann::json;
using test::request_in;

json recipe_of(int repetitions) {
  return json::parse(R"({"schema_version":1,"name":"live","source":"test","seed":3,
    "fabrics":["pile","nylon"],"repetitions":)" +
                     std::to_string(repetitions) + R"(,"explorations":{"M1":{"phases":[
      {"phase":"S","duration_s":0.5},{"phase":"P","force_N":5,"duration_s":0.5},
      {"phase":"M","speed_mm_s":4,"path":[{"dx_mm":0,"dy_mm":16}]},
      {"phase":"E","duration_s":0.5}]}}})");
}

CampaignSummary run(const CampaignRequest& request, const CampaignHooks& hooks) {
  const Result<CampaignSummary> summary = run_campaign(request, hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

Dataset recorded(const std::filesystem::path& campaign) {
  auto all = load_campaign(campaign, {.all_outcomes = true});
  REQUIRE(all);
  return *std::move(all);
}

std::string model_text(const Dataset& dataset, const Change& change) {
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

const json& stop_early() {
  static const json vote{{"model", "m1.model"},
                         {"stop_early", {{"sure_probability", 0.8}, {"least_slide_s", 1}}}};
  return vote;
}

LiveBench::LiveBench() {
  request = request_in(folder, recipe_of(4).dump());
  request.error_check = false;
  const CampaignSummary first = run(request);
  test::write_file(folder / "m1.model", model_text(recorded(first.campaign_file)));
}

void LiveBench::query(const json& vote) {
  json recipe = recipe_of(1);
  recipe["explorations"]["M1"]["live_vote"] = vote;
  test::write_file(request.recipe, recipe.dump());
  request.out = folder / "live";
}

void LiveBench::change(const Change& how) {
  const Dataset first = recorded(folder / "out" / "campaign.sqlite");
  test::write_file(folder / "m1.model", model_text(first, how));
}

void LiveBench::change_rig(const std::function<void(json&)>& how) {
  json rig = test::bench17();
  how(rig);
  test::write_file(request.rig, rig.dump());
}

std::string LiveBench::refusal(bool by_head) {
  const auto whole = check_request(request), quick = check_quickly(request);
  if (whole.has_value()) {
    CHECK(quick.has_value());
    return "none";
  }
  CHECK(quick.has_value() == !by_head);
  if (!quick) CHECK(to_string(quick.error()) == to_string(whole.error()));
  return to_string(whole.error());
}

}  // namespace weft::daemon::live_test
