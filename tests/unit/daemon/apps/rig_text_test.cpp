// Messages of weft run and weft align about a bench that was not left as intended. SIMULATED.

#include "daemon/apps/weft/bench_options.hpp"

#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace rig_text_test {

using namespace weft;
using namespace weft::daemon;
using recipes::Cleanup;
using recipes::RigFact;
using weft::daemon::test::TemporaryFolder;

namespace {

/// Output of a run with a device that has a fault from this time on.
std::string text_of_run(const std::string& device, const std::string& fault, double start_s) {
  const TemporaryFolder folder;
  nlohmann::json rig = test::bench17();
  rig["simulation"]["faults"] = {{{"device", device}, {"fault", fault}, {"start_s", start_s}}};
  const CampaignRequest request = test::request_in(folder, test::short_recipe("denim"), rig);
  const std::string recipe = request.recipe.string(), rig_path = request.rig.string(),
                    out_path = request.out.string();
  std::ostringstream out, err;
  cli::Console console{out, err};
  const char* arguments[] = {"weft",           "run",   recipe.c_str(),   "--rig",
                             rig_path.c_str(), "--out", out_path.c_str(), "--no-evaluate"};
  CHECK(cli::run(8, arguments, console) == cli::exit_failure);
  return out.str() + err.str();
}

constexpr double first_trial_s = 70;  // during the first trial, after homing

}  // namespace

TEST_CASE("there is no text if the probe is up, and a hint otherwise") {
  CHECK(cli::format_rig(Cleanup::done, RigFact::safe).empty());
  CHECK(cli::format_rig(Cleanup::skipped, RigFact::safe).empty());  // a resume without remaining
                                                                    // trials
  CHECK_THAT(cli::format_rig(Cleanup::failed, RigFact::unknown),
             Catch::Contains("not lifted") && Catch::Contains("rig is unknown") &&
                 Catch::Contains("Inspect"));
  CHECK_THAT(cli::format_rig(Cleanup::skipped, RigFact::holding),
             Catch::Contains("not lifted") && Catch::Contains("Inspect"));
  CHECK_THAT(cli::format_rig(Cleanup::partial, RigFact::safe),
             Catch::Contains("is up") && !Catch::Contains("Inspect"));
  CHECK_THAT(cli::format_rig(Cleanup::partial, RigFact::unknown),
             Catch::Contains("unknown") && Catch::Contains("Inspect"));
}

TEST_CASE("a run reports a probe that it did not lift, and only that") {
  const std::string lost = text_of_run("stage.z", "over_temperature", first_trial_s);
  CHECK_THAT(lost, Catch::Contains("not lifted"));
  const std::string lifted = text_of_run("ft", "silent", first_trial_s);
  CHECK_THAT(lifted, !Catch::Contains("not lifted"));
}

TEST_CASE("a run counts its trials from 1 in all texts") {
  const std::string reported = text_of_run("ft", "noise", 0);  // it never comes to rest
  INFO(reported);
  CHECK_THAT(reported, Catch::Contains("trial 1 (denim M1 #1)"));
  CHECK_THAT(reported, Catch::Contains("trial 1 (denim, M1, repetition 1): biasing"));
}

}  // namespace rig_text_test
