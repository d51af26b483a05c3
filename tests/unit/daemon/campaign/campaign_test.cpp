// Small campaigns on the simulated bench, through drivers, codecs and emulators in virtual time.

#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace campaign_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;

namespace {

CampaignSummary run(const TemporaryFolder& folder, const std::string& recipe,
                    const CampaignHooks& hooks = {}) {
  const Result<CampaignSummary> summary = run_campaign(request_in(folder, recipe), hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

// The taxel counts of all trials, joined: the effect of fabric and sensor.
std::vector<double> counts_of(const CampaignSummary& s) {
  const Result<Dataset> data = read_hdf5(s.dataset_file);
  REQUIRE(data);
  std::vector<double> all;
  for (const auto& trial : data->trials)
    all.insert(all.end(), trial.counts.begin(), trial.counts.end());
  return all;
}

std::vector<JournalEntry> journal_of(const std::filesystem::path& campaign,
                                     const std::string& kind) {
  const auto journal = load_journal(campaign);
  REQUIRE(journal);
  std::vector<JournalEntry> found;
  for (const JournalEntry& entry : *journal)
    if (entry.kind == kind) found.push_back(entry);
  return found;
}

}  // namespace

TEST_CASE("a small campaign completes and its force stays in the band while sliding") {
  for (const std::string fabric : {"pile", "denim", "nylon"}) {
    const TemporaryFolder folder;
    const CampaignSummary s = run(folder, short_recipe(fabric));
    INFO(fabric << ": " << (s.error ? to_string(*s.error) : std::string("no error")));
    CHECK(s.outcome == recipes::Outcome::complete);
    CHECK(s.cleanup == recipes::Cleanup::done);
    CHECK(s.rig == recipes::RigFact::safe);
    CHECK(s.trials_complete == 2);
    CHECK(s.force.in_band == s.force.samples);
    CHECK(s.force.rms_n() < 0.1);
    CHECK(s.virtual_s - s.bring_up_s == Approx(s.forecast_s).epsilon(0.05));
  }
}

TEST_CASE("what the recipe does finally is done on the bench, and changes no sample") {
  json parks = json::parse(short_recipe("denim"));
  parks["finally"]["on_success"] = {{{"do", "park"}, {"x_mm", 3}, {"y_mm", 4}},
                                    {{"do", "wait"}, {"duration_s", 50}}};
  const TemporaryFolder one, other;
  const CampaignSummary bare = run(one, short_recipe("denim")), parked = run(other, parks.dump());
  CHECK(parked.outcome == recipes::Outcome::complete);
  CHECK(parked.cleanup == recipes::Cleanup::done);
  CHECK(parked.rig == recipes::RigFact::safe);
  CHECK(parked.virtual_s > bare.virtual_s + 50);
  CHECK(counts_of(parked) == counts_of(bare));
}

TEST_CASE("the data set of a campaign has the phases that the recipe asked for") {
  const TemporaryFolder folder;
  const CampaignSummary s = run(folder, short_recipe("cotton"));
  const Result<Dataset> data = read_hdf5(s.dataset_file);
  REQUIRE(data);
  CHECK(data->info.kind == BenchKind::simulated);
  REQUIRE(data->trials.size() == 2);
  std::map<Phase, int> samples;
  for (const Phase p : data->trials[0].phase) ++samples[p];
  CHECK(samples[Phase::none] == 0);
  CHECK(samples[Phase::rest] == Approx(37).margin(1));
  CHECK(samples[Phase::press] == Approx(74).margin(1));
  CHECK(samples[Phase::end] == Approx(37).margin(1));
  // 6 mm at 2 mm/s: 3 s and 0.1 s of ramps
  CHECK(samples[Phase::motion] == Approx(3.1 * 37).margin(4));
  CHECK(data->records[0].lost_samples == 0);
}

TEST_CASE("in phase S the cloth bears the probe's weight, in phase P the set point") {
  const TemporaryFolder folder;
  const CampaignSummary s = run(folder, short_recipe("velvet"));
  const Result<Dataset> data = read_hdf5(s.dataset_file);
  REQUIRE(data);
  const auto& trial = data->trials[0];
  const TrialRecord& record = data->records[0];
  double weight = 0;
  double press = 0;
  int resting = 0;
  int pressing = 0;
  std::size_t k = 0;
  for (std::size_t i = 0; i < record.wrench.samples(); ++i) {
    while (k + 1 < record.t_ns.size() && record.t_ns[k + 1] <= record.wrench.t_ns[i]) ++k;
    // Between two phases only the wrench may have been recorded already.
    if (k + 1 < trial.phase.size() && trial.phase[k + 1] != trial.phase[k]) continue;
    if (trial.phase[k] == Phase::rest) weight += record.wrench.force_n(i, 2), ++resting;
    if (trial.phase[k] == Phase::press) press += record.wrench.force_n(i, 2), ++pressing;
  }
  CHECK(weight / resting == Approx(0.2 * 9.80665).margin(0.05));
  CHECK(press / pressing == Approx(5).margin(0.1));
}

TEST_CASE("the same seed gives the same data set, another seed other counts") {
  const TemporaryFolder a;
  const TemporaryFolder b;
  const TemporaryFolder c;
  const CampaignSummary first = run(a, short_recipe("felt", 1));
  CHECK(run(b, short_recipe("felt", 1)).dataset_sha256 == first.dataset_sha256);
  // The digest covers the patch seeds too: only the counts show that the piece is another one.
  CHECK(counts_of(run(c, short_recipe("felt", 2))) != counts_of(first));
}

TEST_CASE("a folder that holds a campaign is not written over") {
  const TemporaryFolder folder;
  run(folder, short_recipe("satin"));
  const auto size = std::filesystem::file_size(folder / "out/campaign.sqlite");
  const Result<CampaignSummary> again = run_campaign(request_in(folder, short_recipe("satin")), {});
  REQUIRE_FALSE(again);
  CHECK(std::filesystem::file_size(folder / "out/campaign.sqlite") == size);
}

TEST_CASE("a folder that holds the end of another campaign is not begun in") {
  const TemporaryFolder folder;
  const CampaignSummary s = run(folder, short_recipe("satin"));
  const auto certificate = s.campaign_file.parent_path() / certificate_file_name;
  const auto dataset = s.dataset_file;
  std::filesystem::remove(s.campaign_file);
  for (const auto& [gone, left] :
       {std::pair{certificate, dataset}, std::pair{dataset, certificate}}) {
    std::filesystem::rename(gone, gone.string() + ".aside");
    const std::string before = test::read_file(left);
    const auto refused = run_campaign(request_in(folder, short_recipe("satin")), {});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == left.string());
    CHECK(refused.error().hint.find("another folder") != std::string::npos);
    CHECK((test::read_file(left) == before));
    CHECK_FALSE(std::filesystem::exists(s.campaign_file));
    std::filesystem::rename(gone.string() + ".aside", gone);
  }
}

TEST_CASE("devices are recorded as they identified themselves, not as the rig file has them") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  test::device_of(rig, "z")["emulator"]["serial"] = 45999999;
  const auto ran = run_campaign(request_in(folder, short_recipe("denim"), rig), {});
  REQUIRE(ran);
  const Result<Dataset> data = read_hdf5(ran->dataset_file);
  REQUIRE(data);
  std::map<std::string, json> identity;
  for (const DeviceInfo& device : data->info.devices)
    identity[device.name] = json::parse(device.identity_json);
  REQUIRE(identity.size() == 7);
  const json& z = identity["stage.z"];
  CHECK(z.at("reported").at("serial") == "45999999");
  CHECK(z.at("reported").at("firmware") == "1.2.3");
  CHECK(z.at("reported").at("model") == "LTS150");
  CHECK(z.at("scale").at("counts_per_m") == 409600e3);
  CHECK(identity["ft"].at("reported").empty());
  CHECK(identity["ft"].at("scale").at("counts_per_n") == 1e6);
  CHECK(identity["taxels"].at("reported").at("taxels") == "16");
}

TEST_CASE("a bench that does not come up leaves no campaign file behind") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  test::device_of(rig, "z")["emulator"]["model"] = "LTS300";
  const auto ran = run_campaign(request_in(folder, short_recipe("denim"), rig), {});
  REQUIRE_FALSE(ran);
  CHECK(to_string(ran.error()).find("stage.z") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "out/campaign.sqlite"));
  // The same folder can be used after the rig is corrected.
  CHECK(run(folder, short_recipe("denim")).trials_complete == 2);
}

TEST_CASE("a driver's warning while the bench comes up reaches the listener and the journal") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  // The plate's own weight, before the bias, exceeds such a rating.
  test::device_of(rig, "wrench")["config"]["rated_force_n"] = {1, 1, 1};
  std::vector<DeviceLogEntry> received;
  CampaignHooks hooks;
  hooks.device_log = [&](const DeviceLogEntry& line) { received.push_back(line); };
  const auto ran = run_campaign(request_in(folder, short_recipe("denim"), rig), hooks);
  REQUIRE(ran);
  REQUIRE_FALSE(received.empty());
  CHECK(received[0].device == "ft");
  CHECK(received[0].level == LogLevel::warning);
  CHECK(to_seconds(received[0].time) < ran->bring_up_s);
  const auto lines = journal_of(ran->campaign_file, "device_log");
  REQUIRE(lines.size() == received.size());
  CHECK(lines[0].time == received[0].time);
  CHECK(json::parse(lines[0].payload_json) ==
        json{{"device", "ft"}, {"level", "warning"}, {"text", received[0].text}});
}

TEST_CASE(
    "of a flood of warnings before there is a journal, the first are kept and the rest counted") {
  test::TrialBench bench(short_recipe("denim"));
  std::size_t received = 0;
  DeviceLog log(*bench.sim.bench, bench.sim.loop, [&](const DeviceLogEntry&) { ++received; });
  Device& taxels = *bench.sim.bench->devices().back();
  taxels.log(LogLevel::info, "not worth a line");
  for (std::size_t i = 0; i < DeviceLog::most_stored + 44; ++i)
    taxels.log(LogLevel::warning, "line " + std::to_string(i));
  log.journal_to(&*bench.recording);
  taxels.log(LogLevel::error, "caf\xE9");
  REQUIRE(bench.recorder->finish());
  CHECK(received == DeviceLog::most_stored + 45);
  const auto lines = journal_of(bench.folder / "c.sqlite", "device_log");
  REQUIRE(lines.size() == DeviceLog::most_stored + 1);
  CHECK(json::parse(lines[0].payload_json).at("text") == "line 0");
  CHECK(json::parse(lines.back().payload_json).at("level") == "error");
  const auto cut = journal_of(bench.folder / "c.sqlite", "device_log_cut");
  REQUIRE(cut.size() == 1);
  CHECK(cut[0].payload_json == R"({"lines":44})");
}

TEST_CASE("what the folder must have free covers what the campaign writes") {
  const TemporaryFolder folder;
  const CampaignSummary s = run(folder, short_recipe("denim"));
  const auto written =
      std::filesystem::file_size(s.campaign_file) + std::filesystem::file_size(s.dataset_file);
  const Result<CheckedRequest> checked =
      check_request({folder / "recipe.json", folder / "rig.json", {}, std::nullopt});
  REQUIRE(checked);
  CHECK(disk_forecast(checked->plan) >= written);
  CHECK(disk_forecast(checked->plan) < 100'000'000);
}

TEST_CASE(
    "a campaign that is asked to stop aborts the trial, retracts and keeps what is complete") {
  const TemporaryFolder folder;
  std::atomic<bool> stop{false};
  CampaignHooks hooks;
  hooks.progress = [&](const TrialProgress&) { stop = true; };
  hooks.stop = &stop;
  const CampaignSummary s = run(folder, short_recipe("denim"), hooks);
  CHECK(s.outcome == recipes::Outcome::aborted);
  CHECK(s.cleanup == recipes::Cleanup::done);
  CHECK(s.rig == recipes::RigFact::safe);
  CHECK(s.trials_complete == 1);
  CHECK_FALSE(s.dataset_sha256.empty());
  const Result<Dataset> all = load_campaign(s.campaign_file, {.all_outcomes = true});
  REQUIRE(all);
  REQUIRE(all->records.size() == 2);
  CHECK(all->records[0].outcome == TrialOutcome::complete);
  CHECK(all->records[1].outcome == TrialOutcome::aborted);
  CHECK(journal_of(s.campaign_file, "stop_requested").size() == 1);
}

TEST_CASE("a campaign that is asked to stop while homing ends without a campaign file") {
  const TemporaryFolder folder;
  const std::atomic<bool> stop{true};
  CampaignHooks hooks;
  hooks.stop = &stop;
  const auto ran = run_campaign(request_in(folder, short_recipe("denim")), hooks);
  REQUIRE_FALSE(ran);
  CHECK(ran.error().code == Errc::wrong_state);
  CHECK(ran.error().where.ends_with("bench"));
  CHECK_FALSE(std::filesystem::exists(folder / "out/campaign.sqlite"));
}

TEST_CASE(
    "the recorded rates follow from the rig: stages from the scan cycle, sensors from the "
    "drivers") {
  const TemporaryFolder folder;
  json rig = test::bench17();
  rig["control"]["cycle_hz"] = 50;
  for (const char* part : {"config", "emulator"})
    test::device_of(rig, "wrench")[part]["rate_hz"] = 200;
  const auto ran = run_campaign(request_in(folder, short_recipe("denim"), rig), {});
  REQUIRE(ran);
  REQUIRE(ran->trials_complete == 2);
  const Result<Dataset> data = read_hdf5(ran->dataset_file);
  REQUIRE(data);
  CHECK(data->info.stage_rate_hz == 10);
  CHECK(data->info.wrench_rate_hz == 200);
  CHECK(data->info.taxel_rate_hz == 37);
  const auto measured_hz = [](const std::vector<std::int64_t>& t_ns) {
    std::vector<std::int64_t> steps;
    for (std::size_t i = 1; i < t_ns.size(); ++i) steps.push_back(t_ns[i] - t_ns[i - 1]);
    std::nth_element(steps.begin(), steps.begin() + static_cast<long>(steps.size() / 2),
                     steps.end());
    return 1e9 / static_cast<double>(steps[steps.size() / 2]);
  };
  CHECK(measured_hz(data->records[0].stages.t_ns) == Approx(10));
  CHECK(measured_hz(data->records[0].wrench.t_ns) == Approx(200));
}

TEST_CASE("a repetition that a pause cuts, to be taken again, does not count as done") {
  const TemporaryFolder folder;
  RunOrders orders;
  std::vector<std::size_t> counted;
  bool cut = false;
  CampaignHooks hooks;
  hooks.orders = &orders;
  hooks.moment = [&](const RunStatusUpdate& moment) {
    if (moment.trial == 1 && moment.step == recipes::Step::sliding && !std::exchange(cut, true))
      orders.give({Order::pause_now, "test"});
  };
  hooks.progress = [&](const TrialProgress& line) {
    counted.push_back(line.done);
    if (line.outcome != recipes::Outcome::stopped) return;
    CHECK(line.wall_left_s > 0);  // for the rest of the campaign
    orders.give({Order::resume, "test"});
  };
  const auto summary = run_campaign(request_in(folder, short_recipe("denim")), hooks);
  REQUIRE(summary);
  REQUIRE(cut);
  REQUIRE(counted.size() == summary->trials_planned + 1);
  CHECK(counted[0] == 1);
  CHECK(counted[1] == 1);
  CHECK(counted.back() == summary->trials_planned);
}

}  // namespace campaign_test
