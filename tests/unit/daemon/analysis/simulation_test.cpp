// A campaign's choice of fidelity, its record of it, and the measured error.

#include "daemon/campaign/simulation.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "daemon/analysis/report/report.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/campaign/strict_run.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "tests/unit/daemon/benches/promise_bench.hpp"

namespace simulation_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::denim_request;
using test::request_in;
using test::rig_with_table;
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

}  // namespace

TEST_CASE(
    "a campaign is simulated at the level of its scene, and records level, reason and error") {
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

TEST_CASE("an accuracy chooses from the rig file's table, and the run reports that it was kept") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder);
  request.fidelity.accuracy_n = 0.5;
  const CampaignSummary s = ran(request);
  CHECK(s.simulation.setting == "L1 3.072 ms");
  REQUIRE(s.simulation.promise);
  const SimulationPromise& promise = *s.simulation.promise;
  CHECK(promise.promised_n == Approx(0.2));
  CHECK(promise.is_checked);
  CHECK(promise.pairs == 2);
  CHECK(promise.checked_pairs == 2);
  CHECK(promise.is_resolved);
  CHECK(promise.held);
  CHECK(promise.measured_n == s.simulation.errors.front().worst.force_max_n);
  CHECK(promise.uncertainty_n <= 0.2 * 0.5);
  CHECK(promise.fabric == "denim");
  CHECK(std::string("SPME").find(promise.phase) != std::string::npos);
  CHECK(promise.at_s > 0);
  CHECK(s.simulation.errors.front().trials == 2);
  CHECK_FALSE(is_promise_missed(s.simulation));
  const auto certificate = read_certificate(request.out);
  REQUIRE(certificate);
  REQUIRE(*certificate);
  REQUIRE((*certificate)->simulation);
  CHECK((*certificate)->simulation->promise == promise);
  CHECK((*certificate)->simulation->setting == s.simulation.setting);
}

TEST_CASE("a promise that is missed is a fact of the summary, the journal and the certificate") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder, 1e-6);  // the table promises too much
  request.fidelity.accuracy_n = 1e-5;
  const CampaignSummary s = ran(request);
  CHECK(s.trials_complete == 2);
  CHECK(s.outcome == recipes::Outcome::complete);
  CHECK(s.simulation.setting == "L1 3.072 ms");
  REQUIRE(is_promise_missed(s.simulation));
  const SimulationPromise& promise = *s.simulation.promise;
  CHECK(promise.measured_n > 1e-5);
  CHECK(promise.next_setting == "L2 tr_bdf2 1.024 ms");
  CHECK(promise.next_promise_n == Approx(4e-9));
  CHECK(promise_lines(s.simulation).front().rfind("MISSED: requested 0.01 mN, measured ", 0) == 0);
  const auto journal = load_journal(s.campaign_file);
  REQUIRE(journal);
  CHECK(std::ranges::count(*journal, "promise_missed", &JournalEntry::kind) == 1);
  const auto certificate = read_certificate(request.out);
  REQUIRE(certificate);
  REQUIRE((*certificate)->simulation);
  CHECK_FALSE((*certificate)->simulation->promise->held);
}

TEST_CASE("a strict accuracy runs the next settings, and keeps what was missed aside") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder, 1e-6);
  request.fidelity.accuracy_n = 1e-5;
  request.fidelity.strict = true;
  const auto s = run_until_held(request, {});
  if (!s) FAIL(to_string(s.error()));
  // three settings, none of which reaches 10 uN: the last one stays
  CHECK(s->simulation.setting == "L2 midpoint 0.096 ms");
  CHECK(is_promise_missed(s->simulation));
  CHECK(s->simulation.promise->next_setting.empty());
  CHECK(std::filesystem::exists(request.out / dataset_file_name));
  for (const auto& [name, setting] :
       {std::pair{"aside-1", "L1 3.072 ms"}, {"aside-2", "L2 tr_bdf2 1.024 ms"}}) {
    const auto certificate = read_certificate(request.out / name);
    REQUIRE(certificate);
    REQUIRE(*certificate);
    CHECK((*certificate)->simulation->setting == setting);
    CHECK_FALSE((*certificate)->simulation->promise->held);
    CHECK(std::filesystem::exists(request.out / name / campaign_file_name));
  }
  CHECK_FALSE(std::filesystem::exists(request.out / "aside-3"));
  CHECK(s->simulation.aside == std::vector<std::string>{(request.out / "aside-1").string(),
                                                        (request.out / "aside-2").string()});
}

TEST_CASE("where a strict run's next attempt fails, its error names what was set aside") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder, 1e-6);
  request.fidelity.accuracy_n = 1e-5;
  request.fidelity.strict = true;
  CampaignHooks hooks;  // the rig file vanishes after the first attempt
  hooks.kept_trials = [&](const auto&, const auto&) { std::filesystem::remove(request.rig); };
  const auto failed = run_until_held(request, hooks);
  REQUIRE_FALSE(failed);
  CHECK(failed.error().hint.find((request.out / "aside-1").string()) != std::string::npos);
  CHECK(std::filesystem::exists(request.out / "aside-1" / campaign_file_name));
}

TEST_CASE("a budget that was not achieved is missed, in the certificate too") {
  const auto is_held = [](double achieved) {
    const json written = SimulationBudget{1000, 1500, achieved};
    return written.contains("held") ? std::optional(written["held"].get<bool>()) : std::nullopt;
  };
  CHECK(is_held(0) == std::nullopt);  // unknown
  CHECK(is_held(930) == false);
  CHECK(is_held(1430) == true);
  SimulationNote note{"L1 3.072 ms", "L1", "the scene needs taxel counts", {}};
  CHECK(format_whole_run(note, 60, 1).empty());
  note.budget = SimulationBudget{1000, 1500, 930, 1200};
  const std::string whole = format_whole_run(note, 1100, 1);
  CHECK(whole.find("forecast 1200x, achieved 1100x") != std::string::npos);
  CHECK(whole.find("missed") == std::string::npos);
  CHECK(format_whole_run(note, 990, 1).find("missed") != std::string::npos);
  CHECK(promise_lines(note) ==
        std::vector<std::string>{"requested 1000x, forecast 1500x, achieved 930x: missed"});
}

TEST_CASE("a budget is forecast before the run and achieved after it") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder);
  request.fidelity.times_real_time = 1;
  const CampaignSummary s = ran(request);
  CHECK(s.simulation.setting == "L2 midpoint 0.096 ms");  // costs 2500 us for a bench second
  REQUIRE(s.simulation.budget);
  CHECK(s.simulation.budget->requested == 1);
  CHECK(s.simulation.budget->forecast == Approx(400).epsilon(0.01));
  CHECK(s.simulation.budget->achieved > 0);
  CHECK_FALSE(is_promise_missed(s.simulation));
  const auto certificate = read_certificate(request.out);
  REQUIRE(certificate);
  CHECK((*certificate)->simulation->budget == s.simulation.budget);
}

TEST_CASE("what cannot be had is refused before anything is recorded") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder);
  const auto refused = [&request] {
    const auto run = run_campaign(request, {});
    REQUIRE_FALSE(run);
    CHECK_FALSE(std::filesystem::exists(request.out));
    return run.error();
  };
  request.fidelity.times_real_time = 100'000;
  CHECK(refused().code == Errc::unsupported);
  CHECK(refused().got.find("1905x (L1 3.072 ms); emulators 95 %") != std::string::npos);
  request.fidelity.times_real_time.reset();
  request.fidelity.accuracy_n = 1e-6;
  CHECK(refused().got.find("L2 midpoint 0.096 ms (promises 0.1 mN") != std::string::npos);
  request.fidelity.accuracy_n = 1;
  request.error_check = false;
  CHECK(refused().code == Errc::invalid_argument);
}

TEST_CASE("a promise is held only where every pair of fabric and exploration was checked") {
  SimulationNote note{"L1 3.072 ms", "L1", "the scene needs taxel counts", {}};
  note.promise = SimulationPromise{.requested_n = 0.1, .pairs = 2};
  evaluate_promise(note);
  CHECK(note.promise->has_run);
  CHECK_FALSE(note.promise->is_checked);
  CHECK(is_promise_missed(note));
  note.errors.resize(1);
  note.errors.front().pairs = {{"denim", "M1"}, {"denim", "M2"}};
  evaluate_promise(note);  // trials without a sample
  CHECK_FALSE(note.promise->is_checked);
  CHECK_FALSE(note.promise->held);
  note.errors.front().worst.samples = 10;
  note.errors.front().worst.force_max_n = 0.05;
  evaluate_promise(note);
  CHECK(note.promise->held);
  note.errors.front().pairs.erase({"denim", "M2"});
  evaluate_promise(note);
  CHECK(note.promise->checked_pairs == 1);
  CHECK_FALSE(note.promise->held);
  CHECK_FALSE(is_measured_miss(*note.promise));
  note.errors.front().worst.force_max_n = HUGE_VAL;
  evaluate_promise(note);
  CHECK(is_measured_miss(*note.promise));
  const auto back = simulation_note_from(to_json(note));
  if (!back) FAIL(to_string(back.error()));
  CHECK(back->promise == note.promise);  // infinity survives JSON
  CHECK(back->errors.front().worst.force_max_n == HUGE_VAL);
  note.errors.front().worst.is_resolved = false;
  evaluate_promise(note);
  CHECK_FALSE(note.promise->held);
  CHECK_FALSE(is_measured_miss(*note.promise));
}

TEST_CASE(
    "an error that is known to be too large is reported, even if another trial is undecided") {
  const auto error_of = [](const std::string& exploration, double force_n, bool is_resolved) {
    SimulationError out;
    out.worst.force_max_n = force_n;
    out.worst.uncertainty_n = is_resolved ? 1e-3 : 0.5;
    out.worst.samples = 10;
    out.worst.is_doubled = true;
    out.worst.is_resolved = is_resolved;
    out.worst_fabric = "nylon";
    out.worst_exploration = exploration;
    out.trials = 1;
    out.pairs = {{"nylon", exploration}};
    if (is_resolved) out.resolved = out.largest();
    return out;
  };
  const SimulationError known = error_of("M1", 0.2, true), open = error_of("M2", 0.3, false);
  SimulationNote note{"L1 3.072 ms", "L1", "the scene needs taxel counts", {}};
  note.promise = SimulationPromise{.requested_n = 0.1, .pairs = 2};
  for (const auto& [first, second] : {std::pair{known, open}, {open, known}}) {
    note.errors.assign(1, {});
    merge(first, note.errors.front());
    merge(second, note.errors.front());
    const auto back = simulation_note_from(to_json(note));
    if (!back) FAIL(to_string(back.error()));
    for (SimulationNote each : {note, *back}) {
      evaluate_promise(each);
      CHECK(is_measured_miss(*each.promise));
      CHECK_FALSE(each.promise->held);
      CHECK(each.promise->measured_n == 0.2);
      CHECK(each.promise->exploration == "M1");
      CHECK_FALSE(each.errors.front().worst.is_resolved);
      each.promise->requested_n = 0.25;  // the known one meets this; the open one decides
      evaluate_promise(each);
      CHECK_FALSE(is_measured_miss(*each.promise));
      CHECK_FALSE(each.promise->held);
      CHECK(each.promise->measured_n == 0.3);
      CHECK(each.promise->exploration == "M2");
    }
  }
}

TEST_CASE("errors of an earlier process count for a campaign that goes on") {
  const recipes::Plan plan;
  SimulationError before;
  before.worst.force_max_n = 0.05;
  before.pairs = {{"denim", "M1"}};
  const auto all = ErrorCheck(nullptr, plan, 0.1).errors({before});
  REQUIRE(all.size() == 1);
  CHECK(all.front().pairs == before.pairs);
  CHECK(all.front().worst.force_max_n == 0.05);
  CHECK(ErrorCheck(nullptr, plan, 0.1).errors().empty());
}

TEST_CASE("a campaign that was killed during its error check is certified as not checked") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder);
  request.fidelity.accuracy_n = 0.5;
  CampaignHooks killed;  // after the check, before its result is written
  killed.kept_trials = [](const auto&, const auto&) { throw std::runtime_error("killed"); };
  CHECK_THROWS_AS(run_campaign(request, killed), std::runtime_error);
  request.resume = true;
  request.fidelity.accuracy_n.reset();
  const CampaignSummary s = ran(request);
  CHECK(s.trials_complete == 2);
  CHECK(is_promise_missed(s.simulation));
  const auto certificate = read_certificate(request.out);
  REQUIRE(certificate);
  REQUIRE((*certificate)->simulation);
  REQUIRE((*certificate)->simulation->promise);
  const SimulationPromise& promise = *(*certificate)->simulation->promise;
  CHECK(promise.requested_n == 0.5);
  CHECK(promise.promised_n == Approx(0.2));
  CHECK_FALSE(promise.is_checked);
  CHECK(promise.checked_pairs == 0);
  CHECK(promise.pairs == 2);
  CHECK_FALSE(promise.held);
}

TEST_CASE("a resumed campaign keeps setting, request and promise of its record") {
  const TemporaryFolder folder;
  CampaignRequest request = denim_request(folder);
  request.fidelity.accuracy_n = 5e-3;
  const CampaignSummary first = ran(request);
  CHECK(first.simulation.setting == "L2 tr_bdf2 1.024 ms");
  request.resume = true;
  request.accept_whole = true;
  std::filesystem::remove(folder / "table.json");
  for (const auto& requested_n : {std::optional(5e-3), std::optional<double>()}) {
    request.fidelity.accuracy_n = requested_n;
    const auto settled = settled_request(request);
    if (!settled) FAIL(to_string(settled.error()));
    CHECK(settled->simulation.setting == first.simulation.setting);
    CHECK(settled->simulation.because == first.simulation.because);
    CHECK(settled->simulation.promise == first.simulation.promise);
    CHECK(json::parse(settled->checked.rig_text) == recorded_rig(first));
  }
  const auto refused = [&request] {
    const auto settled = settled_request(request);
    REQUIRE_FALSE(settled);
    return settled.error().code;
  };
  request.fidelity.accuracy_n = 6e-3;
  CHECK(refused() == Errc::wrong_state);
  request.fidelity.accuracy_n.reset();
  request.fidelity.times_real_time = 1;
  CHECK(refused() == Errc::wrong_state);
  request.fidelity.times_real_time.reset();
  request.error_check = false;  // an error check for the recorded accuracy is still required
  CHECK(refused() == Errc::invalid_argument);
}

TEST_CASE(
    "a table of other rules is refused, and of another cloth table its rows are passed over") {
  const TemporaryFolder folder;
  const auto settled = [&](const json& rig) {
    CampaignRequest request = request_in(folder, short_recipe("denim"), rig);
    request.fidelity.probe_us = 50;
    request.fidelity.accuracy_n = 100;
    return settled_request(request);
  };
  const auto old = settled(rig_with_table(folder, 1, recipes::engine_rules - 1));
  REQUIRE_FALSE(old);
  CHECK(old.error().code == Errc::unsupported);
  const auto known = settled(rig_with_table(folder));
  if (!known) FAIL(to_string(known.error()));
  CHECK(known->simulation.promise->promised_n == Approx(0.2));
  const auto other = settled(rig_with_table(folder, 1, recipes::engine_rules, "another"));
  if (!other) FAIL(to_string(other.error()));
  CHECK(other->simulation.promise->promised_n != Approx(0.2));
  // and the text states it
  CHECK(other->simulation.because.size() > known->simulation.because.size());
}

TEST_CASE("a table that is not there is asked for only by who needs it") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  rig["simulation"]["fidelity"] = (folder / "none.json").string();
  CampaignRequest request = request_in(folder, short_recipe("denim"), rig);
  request.fidelity.times_real_time = 1;
  const auto refused = run_campaign(request, {});
  REQUIRE_FALSE(refused);
  CHECK(to_string(refused.error()).find("/simulation/fidelity") != std::string::npos);
  rig["simulation"].erase("fidelity");
  request = request_in(folder, short_recipe("denim"), rig);
  request.error_check = false;
  CHECK(ran(request).trials_complete == 2);
}

TEST_CASE("a campaign at level L0 holds its set point exactly, and reports the error of that") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  rig["simulation"]["level"] = "L0";
  CHECK_FALSE(run_campaign(request_in(folder, short_recipe("denim"), rig), {}));
  rig["simulation"]["traits"] = {"mean_level"};
  const CampaignSummary s = ran(request_in(folder, short_recipe("denim"), rig));
  CHECK(s.trials_complete == 2);
  CHECK_FALSE(s.simulation.because.empty());
  CHECK(recorded_rig(s)["simulation"]["set_point_n"] == 5);
  CHECK(s.force.rms_n() < 0.02);  // the sensor's noise and quantum
  REQUIRE(s.simulation.errors.size() == 1);
  CHECK(s.simulation.errors[0].worst.force_max_n > 0.5);
}

TEST_CASE("the text for a terminal fits it, and is empty for a real bench") {
  CHECK(simulation_text({}).empty());
  CHECK(sentence({}).empty());
  SimulationNote note{"L1 3.072 ms", "L1", "the scene needs taxel counts", {}};
  CHECK(sentence(note).find(note.setting) != std::string::npos);
  CHECK(sentence(note).find(note.because) != std::string::npos);
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
  CHECK(error_lines(note)[0].find("(1 trial replayed, worst on silk)") != std::string::npos);
}

TEST_CASE("The simulation note of a run reads back complete") {
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
