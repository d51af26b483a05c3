// Small campaigns on the simulated bench, through drivers, codecs and emulators in virtual time.

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>

#include "daemon/dataset/hdf5_file.hpp"
#include "daemon/recorder/recorder.hpp"
#include "daemon/run/campaign.hpp"
#include "daemon/run/simulated_bench.hpp"
#include "daemon/run/supervisor.hpp"

using namespace weft;
using namespace weft::daemon;

namespace {

const std::filesystem::path source = WEFT_SOURCE_DIR;

// A folder of its own for each test, gone afterwards.
struct Folder {
  std::filesystem::path path;
  explicit Folder(const std::string& name)
      : path(std::filesystem::temp_directory_path() / ("weft_campaign_" + name)) {
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(path);
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

// One trial of each exploration, with a slide of 6 mm a leg.
std::string short_recipe(const std::string& fabric, int seed = 1) {
  const auto phases = [](const std::string& path) {
    return R"({"phases":[{"phase":"S","duration_s":1},
      {"phase":"P","force_N":5,"force_band_N":0.25,"duration_s":2},
      {"phase":"M","force_N":5,"force_band_N":0.25,"speed_mm_s":2,"path":)" +
           path + R"(},{"phase":"E","duration_s":1}]})";
  };
  return R"({"schema_version":1,"name":"short","source":"test","seed":)" + std::to_string(seed) +
         R"(,"fabrics":[")" + fabric + R"("],"repetitions":1,"explorations":{"M1":)" +
         phases(R"([{"dx_mm":0,"dy_mm":6}])") + R"(,"M2":)" +
         phases(R"([{"dx_mm":0,"dy_mm":6},{"dx_mm":6,"dy_mm":0}])") + "}}";
}

CampaignRequest request_in(const Folder& folder, const std::string& recipe) {
  const std::filesystem::path file = folder.path / "recipe.json";
  std::ofstream(file) << recipe;
  return {file, source / "sim/rigs/bench17.json", folder.path / "out", std::nullopt};
}

CampaignSummary run(const Folder& folder, const std::string& recipe) {
  const Result<CampaignSummary> summary = run_campaign(request_in(folder, recipe), {});
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

}  // namespace

TEST_CASE("a small campaign completes and its force stays in the band while sliding") {
  for (const std::string fabric : {"pile", "denim", "nylon"}) {
    const Folder folder("complete");
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

TEST_CASE("the data set of a campaign has the phases that the recipe asked for") {
  const Folder folder("phases");
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
  const Folder folder("weight");
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
    if (trial.phase[k] == Phase::rest) weight += record.wrench.force_n(i, 2), ++resting;
    if (trial.phase[k] == Phase::press) press += record.wrench.force_n(i, 2), ++pressing;
  }
  CHECK(weight / resting == Approx(0.2 * 9.80665).margin(0.05));
  CHECK(press / pressing == Approx(5).margin(0.1));
}

TEST_CASE("the same seed gives the same data set, another seed another") {
  const Folder a("seed_a");
  const Folder b("seed_b");
  const Folder c("seed_c");
  const std::string first = run(a, short_recipe("felt", 1)).dataset_sha256;
  CHECK(run(b, short_recipe("felt", 1)).dataset_sha256 == first);
  CHECK(run(c, short_recipe("felt", 2)).dataset_sha256 != first);
}

TEST_CASE("a folder that holds a campaign is not written over") {
  const Folder folder("twice");
  run(folder, short_recipe("satin"));
  const auto size = std::filesystem::file_size(folder.path / "out/campaign.sqlite");
  const Result<CampaignSummary> again = run_campaign(request_in(folder, short_recipe("satin")), {});
  REQUIRE_FALSE(again);
  CHECK(std::filesystem::file_size(folder.path / "out/campaign.sqlite") == size);
}

TEST_CASE("a sensor unplugged in mid-slide fails the campaign and the probe is retracted") {
  const Folder folder("unplug");
  const CampaignRequest request = request_in(folder, short_recipe("wool"));
  const Result<CheckedRequest> checked = check_request(request);
  REQUIRE(checked);
  const Result<RigFile> rig = parse_rig_file(checked->rig_text);
  REQUIRE(rig);
  const Result<std::string> fabrics = read_fabrics(*rig, request.rig);
  REQUIRE(fabrics);
  Result<std::unique_ptr<SimulatedBench>> made = SimulatedBench::create(*rig, *fabrics, 1);
  REQUIRE(made);
  SimulatedBench& sim = **made;
  CampaignHeader header;
  header.info.axes = {{"x", false}, {"y", false}, {"z", false}, {"rx", true}, {"ry", true}};
  Result<Recorder> recorder = Recorder::create(folder.path / "c.sqlite", header);
  REQUIRE(recorder);
  TrialRecording recording(*recorder, checked->plan);
  std::optional<Status> up;
  sim.bench->bring_up([&](Status s) { up = s; });
  sim.loop.run_until([&] { return up.has_value(); });
  REQUIRE(up->has_value());
  std::vector<recipes::Outcome> outcomes;
  SupervisorHooks hooks;
  hooks.mount = [&](std::string_view f, std::uint64_t s, TimePoint t) {
    return sim.rig->mount(f, s, t);
  };
  hooks.trial_done = [&](const recipes::TrialDone& done, const ForceTally&) {
    outcomes.push_back(done.outcome);
  };
  Supervisor supervisor(checked->plan, sim.host_time, *sim.bench, recording, hooks);
  supervisor.start();
  sim.loop.run_until([&] {
    return supervisor.result() || supervisor.state().step == recipes::Step::sliding;
  });
  REQUIRE_FALSE(supervisor.result());
  for (std::size_t i = 0; i < rig->devices.size(); ++i)
    if (rig->devices[i].role == "wrench") sim.far_ends[i]->unplug();
  sim.loop.run_until([&] { return supervisor.result().has_value(); });
  CHECK(supervisor.result()->outcome == recipes::Outcome::failed);
  REQUIRE(supervisor.result()->error);
  CHECK(outcomes == std::vector{recipes::Outcome::failed});
  CHECK(sim.rig->truth(sim.loop.now()).contact_force_n == Approx(0).margin(1e-9));
}
