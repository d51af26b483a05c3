// How a campaign comes to its fidelity, what it writes down about it, and the error that it finds.

#include "daemon/campaign/simulation.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace simulation_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;

namespace {

CampaignSummary ran(const CampaignRequest& request) {
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

json recorded_rig(const CampaignSummary& summary) {
  const auto data = load_campaign(summary.campaign_file);
  REQUIRE(data);
  return json::parse(data->info.rig_json);
}

/// bench17 with a table of three settings, which is for this test alone.
json rig_with_table(const TemporaryFolder& folder) {
  json rows = json::array();
  for (const char* scene : {"press", "slide", "fabrics17"})
    for (const auto& [level, integrator, step_us, error_n, speed] :
         {std::tuple{"L1", "none", 3072, 20e-3, 40000},
          {"L2", "tr_bdf2", 1024, 4e-3, 5000},
          {"L2", "midpoint", 96, 0.1e-3, 500}})
      rows.push_back({{"scene", scene},
                      {"level", level},
                      {"integrator", integrator},
                      {"step_us", step_us},
                      {"error_max_n", error_n},
                      {"error_rms_n", error_n / 5},
                      {"times_real_time", speed}});
  std::ofstream(folder / "table.json")
      << json{{"schema_version", 1}, {"bench", "simulated"}, {"rows", rows}};
  json rig = test::bench17();
  rig["simulation"]["fidelity"] = (folder / "table.json").string();
  return rig;
}

}  // namespace

TEST_CASE("a campaign is simulated at the level of its scene, and says which, why and the error") {
  const TemporaryFolder folder;
  const CampaignSummary s = ran(request_in(folder, short_recipe("denim")));
  CHECK(s.level == "L1");
  CHECK(s.simulation.setting == "L1 3.072 ms");
  CHECK(s.simulation.because ==
        "the scene needs a wrench, taxel counts, relaxation and a regulated force");
  REQUIRE(s.simulation.errors.size() == 1);
  const SimulationError& model = s.simulation.errors[0];
  CHECK(model.worst.reference == "L2 tr_bdf2 0.2 ms");
  CHECK(model.trials == 2);  // one of each exploration
  CHECK(model.worst_fabric == "denim");
  CHECK(model.worst.force_rms_n > 0.5e-3);
  CHECK(model.worst.force_rms_n < 40e-3);
  CHECK(model.worst.force_max_n < 60e-3);  // without touch-down and lift-off
  CHECK(model.worst.anywhere_max_n > model.worst.force_max_n);
  const json rig = recorded_rig(s);
  CHECK(rig["simulation"]["level"] == "L1");
  CHECK(rig["simulation"]["chosen"]["because"] == s.simulation.because);
  const auto journal = load_journal(s.campaign_file);
  REQUIRE(journal);
  const auto entry = std::find_if(journal->begin(), journal->end(),
                                  [](const JournalEntry& e) { return e.kind == "simulation"; });
  REQUIRE(entry != journal->end());
  const json reported = json::parse(entry->payload_json);
  CHECK(reported["errors"][0]["force_rms_n"] == model.worst.force_rms_n);
  const std::string line = sentence(s.simulation);
  CHECK(line.rfind("Simulated at level L1 3.072 ms because the scene needs a wrench", 0) == 0);
  CHECK(line.find("; error against L2 tr_bdf2 0.2 ms: max ") != std::string::npos);
}

TEST_CASE("looking for the error changes nothing, and a recorded rig makes the same data again") {
  const TemporaryFolder with, without, again;
  const CampaignSummary first = ran(request_in(with, short_recipe("silk")));
  CampaignRequest unchecked = request_in(without, short_recipe("silk"));
  unchecked.error_check = false;
  const CampaignSummary second = ran(unchecked);
  CHECK(second.dataset_sha256 == first.dataset_sha256);
  CHECK(second.simulation.errors.empty());
  const CampaignSummary third = ran(request_in(again, short_recipe("silk"), recorded_rig(first)));
  CHECK(third.dataset_sha256 == first.dataset_sha256);
  CHECK(third.simulation.because == first.simulation.because);
  CHECK(recorded_rig(third) == recorded_rig(first));
}

TEST_CASE("an accuracy and a budget choose from the table that the rig file names") {
  const TemporaryFolder folder;
  CampaignRequest request = request_in(folder, short_recipe("denim"), rig_with_table(folder));
  request.error_check = false;
  request.fidelity.accuracy_n = 5e-3;
  const CampaignSummary s = ran(request);
  CHECK(s.level == "L2");
  CHECK(s.simulation.setting == "L2 tr_bdf2 1.024 ms");
  CHECK(s.simulation.because.find("the fastest setting within 5 mN (measured 4 mN at worst") !=
        std::string::npos);
  const json chosen = recorded_rig(s)["simulation"];
  CHECK(chosen["dynamics"]["integrator"] == "tr_bdf2");
  CHECK(chosen["step_us"].get<double>() == Approx(1024));
  request.out = folder / "second";
  request.fidelity = {1e-3, 1000};
  const auto refused = run_campaign(request, {});
  REQUIRE_FALSE(refused);
  const std::string reply = to_string(refused.error());
  CHECK(reply.find("/simulation/level") != std::string::npos);
  CHECK(reply.find("L2 tr_bdf2 1.024 ms (4 mN, 5e+03 times real time) or L2 midpoint 0.096 ms") !=
        std::string::npos);
  CHECK_FALSE(std::filesystem::exists(request.out));
}

TEST_CASE("a table that is not there is asked for only by who needs it") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  rig["simulation"]["fidelity"] = (folder / "none.json").string();
  CampaignRequest request = request_in(folder, short_recipe("denim"), rig);
  request.fidelity.times_real_time = 1000;
  const auto refused = run_campaign(request, {});
  REQUIRE_FALSE(refused);
  CHECK(to_string(refused.error()).find("/simulation/fidelity") != std::string::npos);
  rig["simulation"].erase("fidelity");
  request = request_in(folder, short_recipe("denim"), rig);
  request.error_check = false;
  CHECK(ran(request).trials_complete == 2);
}

TEST_CASE("a campaign at level L0 holds its set point exactly, and says what that costs") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  rig["simulation"]["level"] = "L0";
  CHECK_FALSE(run_campaign(request_in(folder, short_recipe("denim"), rig), {}));
  rig["simulation"]["traits"] = {"mean_level"};
  const CampaignSummary s = ran(request_in(folder, short_recipe("denim"), rig));
  CHECK(s.trials_complete == 2);
  CHECK(s.simulation.because == "the rig file names it");
  CHECK(recorded_rig(s)["simulation"]["set_point_n"] == 5);
  CHECK(s.force.rms_n() < 0.02);  // the sensor's noise and quantum
  REQUIRE(s.simulation.errors.size() == 1);
  CHECK(s.simulation.errors[0].worst.force_max_n > 0.5);
}

TEST_CASE("the words for a terminal fit it, and nothing is said of a real bench") {
  CHECK(simulation_text({}).empty());
  CHECK(sentence({}).empty());
  SimulationNote note{"L1 3.072 ms", "L1", "the scene needs taxel counts", {}};
  CHECK(sentence(note) == "Simulated at level L1 3.072 ms because the scene needs taxel counts");
  note.errors = {{{.setting = "L1 3.072 ms",
                   .reference = "L2 midpoint 0.2 ms",
                   .samples = 10,
                   .force_max_n = 12.34e-3,
                   .force_rms_n = 1e-3},
                  "silk",
                  1}};
  std::istringstream lines(simulation_text(note));
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) CHECK(line.size() <= 80);
  CHECK(count >= 3);
  CHECK(sentence(note).find("max 12.3 mN, rms 1 mN") != std::string::npos);
  CHECK(error_lines(note)[0].find("(1 trial played again, worst on silk)") != std::string::npos);
}

TEST_CASE("What a run says of its simulation is read back whole") {
  SimulationNote note{"L2 midpoint 0.384 ms", "L2", "the scene needs stick-slip", {}};
  SimulationError error;
  error.worst = {"L2 midpoint 0.384 ms",
                 "L2 midpoint 0.096 ms",
                 1200,
                 1e-3,
                 2e-4,
                 3e-3,
                 4e-4,
                 false,
                 5,
                 0.6,
                 7e-3,
                 8e-3,
                 9e-4};
  error.worst_fabric = "pile";
  error.trials = 4;
  note.errors.push_back(error);
  const auto back = simulation_note_from(to_json(note));
  REQUIRE(back);
  CHECK(to_json(*back) == to_json(note));
  CHECK(back->level == "L2");
  CHECK_FALSE(back->errors.front().worst.pads);
  CHECK_FALSE(simulation_note_from("{}"));
  CHECK_FALSE(simulation_note_from("no"));
}

}  // namespace simulation_test
