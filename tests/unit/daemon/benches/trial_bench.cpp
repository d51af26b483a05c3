#include "tests/unit/daemon/benches/trial_bench.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon::test {

using nlohmann::json;

std::string short_recipe(const std::string& fabric, int seed) {
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

std::string changed(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::string with_keys(const std::string& keys, const std::string& fabric) {
  return changed(short_recipe(fabric), "\"repetitions\":1", "\"repetitions\":1," + keys);
}

json bench17() {
  json rig = json::parse(read_file(source / "sim/rigs/bench17.json"));
  rig["simulation"]["fabrics"] = (source / "sim/fabrics.json").string();
  return rig;
}

json bench17_near_home() {
  json rig = bench17();
  rig["plate"]["surface_z_mm"] = 16;
  rig["plate"]["size_mm"] = {34, 34};
  for (json& device : rig["devices"])
    if (device["role"] == "x" || device["role"] == "y" || device["role"] == "z")
      device["emulator"]["start_mm"] = 4;
  return rig;
}

json& device_of(json& rig, const std::string& role) {
  for (json& device : rig["devices"])
    if (device["role"] == role) return device;
  FAIL("no device with role " + role);
  return rig;
}

CampaignRequest request_in(const TemporaryFolder& folder, const std::string& recipe) {
  return request_in(folder, recipe, bench17_near_home());
}

CampaignRequest request_in(const TemporaryFolder& folder, const std::string& recipe,
                           const json& rig) {
  write_file(folder / "recipe.json", recipe);
  write_file(folder / "rig.json", rig.dump(2));
  return {folder / "recipe.json", folder / "rig.json", folder / "out", std::nullopt};
}

TrialBench::TrialBench(const std::string& recipe) : TrialBench(recipe, bench17()) {}

TrialBench::TrialBench(const std::string& recipe, const json& rig_json)
    : checked(check_request(request_in(folder, recipe, rig_json)).value()) {
  const RigFile rig = parse_rig_file(checked.rig_text).value();
  const std::string fabrics = read_fabrics(rig, folder / "rig.json").value();
  sim.rig = std::move(sim::Rig::create(rig.text, fabrics, 1).value());
  sim.bench = std::move(Bench::create(rig, sim.host_time, [this](const DeviceEntry& entry) {
                          return link(entry);
                        }).value());
  CampaignHeader header;
  header.info.axes = {{"x", false}, {"y", false}, {"z", false}, {"rx", true}, {"ry", true}};
  header.taxels = checked.plan.limits.taxels;
  recorder.emplace(std::move(Recorder::create(folder / "c.sqlite", header).value()));
  recording.emplace(*recorder, checked.plan);
  std::optional<Status> up;
  sim.bench->bring_up([&](Status s) { up = std::move(s); });
  sim.loop.run_until([&] { return up.has_value(); });
  REQUIRE(up->has_value());
}

SupervisorHooks TrialBench::hooks() {
  SupervisorHooks hooks;
  hooks.mount = [this](const recipes::MountFabric& order, const MountDone& done) {
    done(sim.rig->mount(order.fabric, order.seeds.touch, sim.loop.now()));
  };
  hooks.trial_done = [this](const recipes::TrialDone& done, const ForceTally&) {
    outcomes.push_back(done.outcome);
    trial_error = done.error;
  };
  return hooks;
}

Result<std::unique_ptr<Link>> TrialBench::link(const DeviceEntry& entry) {
  auto [host, device] =
      MemoryLink::make_pair(sim.host_time, sim.rig_time, std::chrono::milliseconds(1));
  if (Status ok = sim.rig->attach(entry.name, *device, sim.rig_time); !ok) return pass(ok.error());
  far_end[entry.role] = device.get();
  sim.far_ends.push_back(std::move(device));
  return std::unique_ptr<Link>(std::make_unique<SpyLink>(std::move(host), written[entry.role]));
}

}  // namespace weft::daemon::test
