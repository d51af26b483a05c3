#include "tests/unit/daemon/benches/promise_bench.hpp"

#include <nlohmann/json.hpp>
#include <tuple>

#include "daemon/base/file/sha256.hpp"

namespace weft::daemon::test {

sim::FidelityTable empty_table() {
  sim::FidelityTable table;
  table.rules = recipes::engine_rules;
  table.fabrics_sha256 = sha256_hex(read_file(source / "sim/fabrics.json"));
  table.conditions.press_s = {1, 10};
  table.conditions.scenes = table.conditions.seeds = table.conditions.trials = 1;
  table.conditions.force_n = {0.2, 10};
  table.conditions.speed_mps = {0.5e-3, 4e-3};
  table.conditions.seat_speed_mps = {1e-4, 1e-3};
  table.conditions.mount_stiffness_n_m = {1e4, 5e4};
  table.conditions.slack_m = {0.6e-3, 3e-3};
  return table;
}

nlohmann::json rig_with_table(const TemporaryFolder& folder, double scale, int rules,
                              const std::string& fabrics_sha256) {
  sim::FidelityTable table = empty_table();
  table.rules = rules;
  if (!fabrics_sha256.empty()) table.fabrics_sha256 = fabrics_sha256;
  table.host_cost.emulators_us_per_s = 500;
  table.host_cost.probe_us = 50;
  using sim::Integrator, sim::Level;
  for (const auto& [setting, error_n, contact_us] :
       {std::tuple{sim::FidelitySetting{Level::quasistatic, Integrator::midpoint, 3072e-6}, 200e-3,
                   25.0},
        {sim::FidelitySetting{Level::dynamic, Integrator::tr_bdf2, 1024e-6}, 4e-3, 200.0},
        {sim::FidelitySetting{Level::dynamic, Integrator::midpoint, 96e-6}, 0.1e-3, 2000.0}})
    table.settings.push_back(
        {.setting = setting,
         .contact_us_per_s = contact_us,
         .cloths = {{"denim", 1, scale * error_n / 9, scale * error_n / 5, scale * error_n}},
         .margin = {1, 1},
         .any_q99 = scale * error_n,
         .any_max = 10 * scale * error_n,
         .any_margin = {1, 1}});
  write_file(folder / "table.json", sim::to_json(table));
  nlohmann::json rig = bench17();
  rig["simulation"]["fidelity"] = (folder / "table.json").string();
  return rig;
}

CampaignRequest denim_request(const TemporaryFolder& folder, double scale) {
  CampaignRequest request =
      request_in(folder, short_recipe("denim"), rig_with_table(folder, scale));
  request.fidelity.probe_us = 50;
  return request;
}

}  // namespace weft::daemon::test
