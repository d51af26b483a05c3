#include "daemon/campaign/bench_check.hpp"

#include <algorithm>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/loop/timed_loop.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/live_classifier.hpp"
#include "daemon/hardware/link/memory_link.hpp"
#include "daemon/hardware/rig/device.hpp"
#include "drivers/thorlabs_apt/settings.hpp"
#include "protocols/base/closest.hpp"
#include "protocols/base/time.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {
namespace {

using recipes::Diagnostic;
using recipes::Plan;
using recipes::Range;

// Limits and settings are decimal numbers converted to SI: equal ones may differ in the last bits.
constexpr double rounding = 1e-9;

/// Reports the same problem of several devices once.
void add_once(Diagnostic found, std::vector<Diagnostic>& problems) {
  const auto same = [&](const Diagnostic& reported) {
    return to_string(reported) == to_string(found);
  };
  if (std::ranges::none_of(problems, same)) problems.push_back(std::move(found));
}

/// Builds one driver with a link that has no device.
void build_driver(const DeviceEntry& entry, const std::string& place,
                  const std::shared_ptr<DriverCatalog>& drivers,
                  std::vector<Diagnostic>& problems) {
  VirtualLoop loop;
  auto [host, far_end] = MemoryLink::make_pair(loop, loop, Duration{});
  const auto device = Device::create(entry, loop, std::move(host), drivers);
  if (device) return;
  const std::string key = pointer_in(device.error().where);
  const bool no_driver = device.error().code == Errc::not_found && key.empty();
  const bool of_limit = !key.empty() && key == entry.acceleration_limit;
  const std::string pointer = of_limit ? key : place + (no_driver ? "/driver" : "/config" + key);
  add_once(diagnostic(device.error(), pointer), problems);
}

/// Limits of one axis that the plan assumes [SI], with the factor to the unit of the rig file.
struct AxisLimits {
  double speed;
  Range travel;
  double per_si;
  std::string unit;
  std::string speed_key, travel_key;
};

AxisLimits limits_of(recipes::Axis axis, const recipes::RigLimits& limits) {
  const Range& travel = limits.geometry.travel[recipes::index(axis)];
  if (recipes::is_linear(axis))
    return {limits.max_speed_mps, travel,
            1 / m_per_mm,         "mm",
            "/limits/speed_mm_s", "/limits/travel_mm/" + std::string(recipes::to_string(axis))};
  return {limits.max_tilt_speed_radps, travel, 1 / rad_per_deg, "deg", "/limits/tilt_speed_deg_s",
          "/limits/tilt_deg"};
}

std::string range_text(const Range& range, const AxisLimits& axis) {
  return fixed(range.min * axis.per_si, 2) + " to " + fixed(range.max * axis.per_si, 2) + " " +
         axis.unit;
}

/// Covers only the driver with settings known here. Other drivers refuse at run time what they
/// cannot do.
void compare_limits(const DeviceEntry& entry, recipes::Axis role, const recipes::RigLimits& limits,
                    std::vector<Diagnostic>& problems) {
  if (entry.driver != "thorlabs_apt") return;
  const auto settings = drivers::read_stage_settings(entry.config_json);
  if (!settings) return;  // reported by build_driver
  const AxisLimits axis = limits_of(role, limits);
  if (axis.speed > settings->max_speed * (1 + rounding))
    problems.push_back(
        {axis.speed_key, "speed above the limit of the driver of " + entry.name,
         "at most " + general(settings->max_speed * axis.per_si) + " " + axis.unit + "/s",
         general(axis.speed * axis.per_si) + " " + axis.unit + "/s",
         "Lower the limit, or raise the driver setting if the stage permits it"});
  const double count = 1 / settings->scale.counts_per_unit;
  const Range allowed{settings->travel_low_counts * count, settings->travel_high_counts * count};
  if (axis.travel.min < allowed.min - count || axis.travel.max > allowed.max + count)
    problems.push_back({axis.travel_key, "travel outside the range of the driver of " + entry.name,
                        "within " + range_text(allowed, axis), range_text(axis.travel, axis),
                        "Narrow the limit, or widen the driver travel if the stage permits it"});
}

/// True if only a plugin has a driver of this name.
bool is_of_plugin(const RigFile& rig, const std::string& driver) {
  const std::vector<std::string> all = rig.drivers->names(), ours = DriverCatalog().names();
  return std::ranges::find(all, driver) != all.end() &&
         std::ranges::find(ours, driver) == ours.end();
}

void check_devices(const recipes::RigLimits& limits, const RigFile& rig, PluginDrivers plugins,
                   std::vector<Diagnostic>& problems) {
  for (std::size_t i = 0; i < rig.devices.size(); ++i) {
    const DeviceEntry& entry = rig.devices[i];
    if (plugins == PluginDrivers::built || !is_of_plugin(rig, entry.driver))
      build_driver(entry, "/devices/" + std::to_string(i), rig.drivers, problems);
    for (const recipes::Axis axis : recipes::all_axes)
      if (entry.role == recipes::to_string(axis)) compare_limits(entry, axis, limits, problems);
  }
}

/// Seeds of the fabric's first trial.
sim::PatchSeeds first_seeds(const Plan& plan, std::size_t fabric) {
  const auto first = std::ranges::find(plan.trials, fabric, &recipes::TrialSpec::fabric);
  if (first == plan.trials.end()) return {};
  return {first->seeds.piece, first->seeds.mounting, first->seeds.touch};
}

void mount_fabrics(const Plan& plan, sim::Rig& bench, std::vector<Diagnostic>& problems) {
  const std::vector<std::string> table = bench.fabrics();
  const std::vector<std::string_view> known(table.begin(), table.end());
  for (std::size_t i = 0; i < plan.fabrics.size(); ++i) {
    const std::string& name = plan.fabrics[i];
    const std::string pointer = "/fabrics/" + std::to_string(i);
    if (std::ranges::find(known, name) == known.end()) {
      problems.push_back(
          {pointer, "fabric not in the fabric table of the rig", "", name,
           did_you_mean(name, known, "Known fabrics are " + recipes::one_of(known))});
    } else if (const Status on = bench.mount(name, first_seeds(plan, i), 1, TimePoint{}); !on) {
      problems.push_back(diagnostic(on.error(), pointer));
    }
  }
}

/// Does the work of check_bench() with a plan, and of check_rig() without one.
BenchProblems inspect_bench(const recipes::RigLimits& limits, const RigFile& rig,
                            const std::filesystem::path& rig_path, PluginDrivers plugins,
                            const Plan* plan) {
  constexpr std::uint64_t any_seed = 1;
  const std::uint64_t seed = plan == nullptr ? any_seed : plan->seed;
  BenchProblems found_problems;
  check_devices(limits, rig, plugins, found_problems.rig);
  if (rig.mode == BenchMode::real) return found_problems;
  const Result<std::string> fabrics = read_fabrics(rig, rig_path);
  if (!fabrics) {
    found_problems.rig.push_back(diagnostic(fabrics.error(), "/simulation/fabrics"));
    return found_problems;
  }
  const auto emulated = sim::Rig::create(rig.text, *fabrics, seed);
  if (!emulated) {
    const bool in_table = emulated.error().where.starts_with("fabrics");
    found_problems.rig.push_back(diagnostic(
        emulated.error(), in_table ? "/simulation/fabrics" : pointer_in(emulated.error().where)));
    return found_problems;
  }
  if (const Status same = same_rates(rig, limits, **emulated); !same)
    found_problems.rig.push_back(diagnostic(same.error(), same.error().where));
  if (plan != nullptr) mount_fabrics(*plan, **emulated, found_problems.recipe);
  if (!found_problems.rig.empty() || !found_problems.recipe.empty()) return found_problems;
  if (rig.mode == BenchMode::emulated) return found_problems;
  if (plugins == PluginDrivers::unread &&
      std::ranges::any_of(rig.devices,
                          [&](const DeviceEntry& d) { return is_of_plugin(rig, d.driver); }))
    return found_problems;
  // Other problems appear only in the assembled bench, for example a device without emulator.
  const auto bench = SimulatedBench::create(rig, *fabrics, seed);
  if (!bench)
    found_problems.rig.push_back(diagnostic(bench.error(), pointer_in(bench.error().where)));
  return found_problems;
}

void add(const std::filesystem::path& file, const std::vector<Diagnostic>& list,
         std::vector<FileProblem>& problems) {
  for (const Diagnostic& diagnostic : list) problems.push_back({file, diagnostic});
}

}  // namespace

Diagnostic diagnostic(const Error& error, std::string pointer) {
  return {std::move(pointer), error.what, error.expected, error.got, error.hint};
}

std::string pointer_in(const std::string& where) {
  if (where.starts_with('/')) return where;
  const std::size_t at = where.find(": /");
  return at == std::string::npos ? std::string() : where.substr(at + 2);
}

BenchProblems check_bench(const Plan& plan, const RigFile& rig,
                          const std::filesystem::path& rig_path, PluginDrivers plugins) {
  return inspect_bench(plan.limits, rig, rig_path, plugins, &plan);
}

std::vector<Diagnostic> check_rig(const OpenedRig& rig, const std::filesystem::path& rig_path,
                                  PluginDrivers plugins) {
  return inspect_bench(rig.limits, rig.file, rig_path, plugins, nullptr).rig;
}

Status check_rig_file(const std::filesystem::path& path) {
  const auto rig = open_rig(path, {});
  if (!rig) return pass(rig.error());
  const auto problems = check_rig(*rig, path, PluginDrivers::unread);
  if (problems.empty()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = path.string(),
               .what = recipes::to_string(problems.front()),
               .hint = "Run `weft check` to see all problems"});
}

Result<OpenedRig> open_rig(const std::filesystem::path& path, const PluginSettings& plugins) {
  const Result<std::string> text = read_text_file(path);
  if (!text) return pass(text.error());
  const Result<recipes::RigLimits> limits = recipes::parse_rig_limits(*text);
  if (!limits) return pass(limits.error(), path.string());
  Result<RigFile> file = parse_rig_file(*text);
  if (!file) return pass(file.error(), path.string());
  use_plugins(*file, path, plugins);
  return OpenedRig{std::move(*file), *limits};
}

Result<BenchPreflight> preflight_bench(const CampaignRequest& request, const recipes::Plan& plan,
                                       const RigFile& rig, PluginDrivers plugins) {
  const auto chosen = choose_fidelity(request, plan, rig);
  // If the fidelity is refused, the rig file as it is may have other problems, which are reported
  // instead.
  Result<RigFile> settled = parse_rig_file(chosen ? chosen->rig_text : rig.text);
  if (!settled) return pass(settled.error(), request.rig.string());
  settled->drivers = rig.drivers;
  BenchPreflight out{chosen ? chosen->note : SimulationNote{},
                     check_bench(plan, *settled, request.rig, plugins)};
  if (!chosen && out.found_problems.rig.empty())
    out.found_problems.rig.push_back(diagnostic(chosen.error(), pointer_in(chosen.error().where)));
  return out;
}

Result<Preflight> preflight(const CampaignRequest& request, PluginDrivers plugins) {
  const auto opened = open_rig(request.rig, request.plugins);
  if (!opened) return pass(opened.error());
  Result<std::string> text = load_recipe_text(request);
  if (!text) return pass(text.error());
  recipes::CheckReport checked =
      recipes::check_recipe(*text, opened->limits, request.seed, request.parameters_json);
  Preflight out{std::move(checked.recipe_json),
                std::move(checked.plan),
                {},
                {},
                std::move(checked.warnings),
                std::move(*text),
                std::move(checked.parameters_json)};
  add(request.recipe, checked.problems, out.problems);
  if (!out.plan) return out;
  if (const auto models = load_live_models(*out.plan, request.recipe.parent_path()); !models)
    add(request.recipe, {diagnostic(models.error(), pointer_in(models.error().where))},
        out.problems);
  auto bench = preflight_bench(request, *out.plan, opened->file, plugins);
  if (!bench) return pass(bench.error());
  out.simulation = std::move(bench->simulation);
  add(request.recipe, bench->found_problems.recipe, out.problems);
  add(request.rig, bench->found_problems.rig, out.problems);
  return out;
}

}  // namespace weft::daemon
