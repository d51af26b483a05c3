// With cover, common mode, temperature, wear and remounting enabled, two campaigns have one digest.
// One that is killed within a mounting resumes to the same data. SIMULATED.

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/benches/resumed_campaign.hpp"

namespace mechanisms_determinism_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  return json::parse(in);
}

/// Each is strong enough to show in these few trials.
json mechanisms() {
  return {{"pads",
           {{"common_mode", 0.02},
            {"common_mode_time_s", 1},
            {"temperature_K", 3},
            {"temperature_time_s", 60},
            {"gain_per_K", 0.004}}},
          {"cover_um", 60}};
}

/// Trials of one fabric; mounted again after `remount_every`, 0: never.
CampaignRequest request_for(const TemporaryFolder& folder, int touches, int remount_every,
                            const json& simulation, double wear_most) {
  json recipe = json::parse(test::tiny_recipe(touches));
  recipe["fabrics"] = {"denim"};
  if (remount_every > 0) recipe["repetition"] = {{"remount_every", remount_every}};
  json cloths = read_json(test::source / "sim/fabrics.json");
  cloths["parameters"]["wear_most"] = {wear_most, "estimated"};
  cloths["parameters"]["wear_scale_Pa_m"] = {100, "estimated"};
  std::ofstream(folder / "fabrics.json") << cloths;
  json rig = test::bench17_near_home();
  rig["simulation"]["fabrics"] = (folder / "fabrics.json").string();
  rig["simulation"].merge_patch(simulation);
  CampaignRequest request = test::request_in(folder, recipe.dump(), rig);
  request.error_check = false;
  return request;
}

std::vector<double> last_counts(const CampaignRequest& request) {
  return test::loaded(test::run(request).campaign_file).trials.back().counts;
}

}  // namespace

TEST_CASE("two campaigns with every mechanism have one digest, and each mechanism is in it") {
  const TemporaryFolder a, b;
  const CampaignRequest request = request_for(a, 3, 2, mechanisms(), 0.5);
  const CampaignSummary first = test::run(request);
  CHECK(test::run(request_for(b, 3, 2, mechanisms(), 0.5)).dataset_sha256 == first.dataset_sha256);
  const auto counts = test::loaded(first.campaign_file).trials.back().counts;
  const auto differs = [&](int remount_every, const char* off, double wear_most) {
    json simulation = mechanisms();
    if (*off != '\0') simulation[json::json_pointer(off)] = 0;
    const TemporaryFolder folder;
    return last_counts(request_for(folder, 3, remount_every, simulation, wear_most)) != counts;
  };
  CHECK(differs(2, "/pads/common_mode", 0.5));
  CHECK(differs(2, "/pads/temperature_K", 0.5));
  CHECK(differs(2, "/cover_um", 0.5));
  CHECK(differs(0, "", 0.5));
  CHECK_FALSE(differs(2, "", 0.5));
}

TEST_CASE("a kill in touch 7 of a mounting changes nothing, whatever the touches before left") {
  const TemporaryFolder whole;
  const CampaignRequest untouched = request_for(whole, 8, 0, mechanisms(), 0.5);
  test::run(untouched);
  const Dataset expected = test::loaded(untouched.out / "campaign.sqlite");
  REQUIRE(expected.trials.size() == 8);
  {  // without wear the seventh trial differs
    const TemporaryFolder folder;
    const CampaignRequest fresh = request_for(folder, 8, 0, mechanisms(), 0);
    test::run(fresh);
    const Dataset unworn = test::loaded(fresh.out / "campaign.sqlite");
    CHECK(unworn.trials[6].counts != expected.trials[6].counts);
  }
  for (const std::uint64_t write : {1U, 4U}) {
    INFO("write " << write);
    const TemporaryFolder folder;
    const CampaignRequest request = request_for(folder, 8, 0, mechanisms(), 0.5);
    REQUIRE(test::killed_at(request, {write, false, 6}) == true);
    const std::size_t saved = test::loaded(request.out / "campaign.sqlite").trials.size();
    CHECK((saved == 6 || saved == 7));
    test::resumed(request);
    CHECK(test::difference(expected, test::loaded(request.out / "campaign.sqlite")) == "");
    test::check_holds(request.out);
  }
}

}  // namespace mechanisms_determinism_test
