// Checks and settles the request of a campaign before anything moves.

#include <algorithm>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/campaign_file.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "protocols/base/closest.hpp"

namespace weft::daemon {
namespace {

/// A single problem keeps its parts; several become a list.
Error refusal(const std::filesystem::path& file, const std::vector<recipes::Diagnostic>& problems) {
  if (problems.size() == 1) {
    const recipes::Diagnostic& only = problems.front();
    return Error{.code = Errc::invalid_argument,
                 .where = only.pointer,
                 .what = only.message,
                 .expected = only.expected,
                 .got = only.got,
                 .hint = only.hint}
        .in(file.string());
  }
  std::string text = std::to_string(problems.size()) + " problems:";
  for (const recipes::Diagnostic& problem : problems) text += "\n  " + recipes::to_string(problem);
  return {.code = Errc::invalid_argument, .where = file.string(), .what = std::move(text)};
}

/// The rig file, with the measured plate tilt if one is named.
Result<std::string> rig_text_of(const CampaignRequest& request) {
  Result<std::string> rig = read_text_file(request.rig);
  if (!rig || request.level.empty()) return rig;
  const Result<std::string> level = read_text_file(request.level);
  if (!level) return pass(level.error());
  const auto oldest = request.resume ? std::chrono::seconds{} : request.oldest_level;
  Result<std::string> both = with_level(*rig, *level, utc_now(), oldest);
  if (!both) return pass(both.error(), request.level.string());
  return both;
}

/// Simulation of the campaign to resume. Nothing if no trial has begun and nothing was requested.
std::optional<RecordedSimulation> recorded_simulation(const CampaignRequest& request) {
  if (!request.resume) return std::nullopt;
  const std::filesystem::path campaign = request.out / campaign_file_name;
  auto history = load_history(campaign);
  if (!history) return std::nullopt;
  SimulationNote note = simulation_on_record(campaign);
  if (history->attempts.empty() && !note.has_request()) return std::nullopt;
  return RecordedSimulation{std::move(history->info.rig_json), std::move(note)};
}

/// Writes level, integrator and step into the rig file that is run and recorded.
Result<SimulationNote> settle_fidelity(const CampaignRequest& request, CheckedRequest& checked,
                                       RigFile& rig) {
  auto chosen = choose_fidelity(request, checked.plan, rig);
  if (!chosen) return pass(chosen.error());
  Result<RigFile> settled = parse_rig_file(chosen->rig_text);
  if (!settled) return pass(settled.error());
  settled->drivers = rig.drivers;
  rig = std::move(*settled);
  checked.rig_text = std::move(chosen->rig_text);
  return std::move(chosen->note);
}

/// Leaves the trials on one fabric, if one is named.
Status restrict_to(const std::optional<std::string>& fabric, recipes::Plan& plan) {
  if (!fabric) return {};
  const auto found = std::ranges::find(plan.fabrics, *fabric);
  if (found == plan.fabrics.end())
    return fail({.code = Errc::not_found,
                 .where = "/fabrics",
                 .what = "fabric not in the recipe",
                 .got = *fabric,
                 .hint = did_you_mean(*fabric, {plan.fabrics.begin(), plan.fabrics.end()})});
  plan = recipes::part_on(std::move(plan), static_cast<std::size_t>(found - plan.fabrics.begin()));
  return {};
}

/// check_request() without the models.
Result<CheckedRequest> check_recipe_and_rig(const CampaignRequest& request) {
  Result<std::string> rig_text = rig_text_of(request);
  if (!rig_text) return pass(rig_text.error());
  Result<recipes::RigLimits> limits = recipes::parse_rig_limits(*rig_text);
  if (!limits) return pass(limits.error(), request.rig.string());
  Result<std::string> recipe = load_recipe_text(request);
  if (!recipe) return pass(recipe.error());
  recipes::CheckReport report =
      recipes::check_recipe(*recipe, *limits, request.seed, request.parameters_json);
  if (!report.plan) return fail(refusal(request.recipe, report.problems));
  CheckedRequest out{std::move(*report.plan),
                     std::move(report.recipe_json),
                     *rig_text,
                     std::move(report.warnings),
                     {},
                     request.only_fabric};
  if (Status ok = restrict_to(request.only_fabric, out.plan); !ok)
    return pass(ok.error(), request.recipe.string());
  return out;
}

/// Collects all problems of the rig file or its bench with the plan.
Status check_its_bench(const CampaignRequest& request, const CheckedRequest& checked) {
  Result<RigFile> rig = parse_rig_file(checked.rig_text);
  if (!rig) return pass(rig.error(), request.rig.string());
  use_plugins(*rig, request.rig, request.plugins);
  const auto bench = preflight_bench(request, checked.plan, *rig, PluginDrivers::unread);
  if (!bench) return pass(bench.error());
  if (const auto& problems = bench->found_problems.rig; !problems.empty())
    return fail(refusal(request.rig, problems));
  if (const auto& problems = bench->found_problems.recipe; !problems.empty())
    return fail(refusal(request.recipe, problems));
  return {};
}

}  // namespace

Result<std::string> load_recipe_text(const CampaignRequest& request) {
  if (request.recipe_text) return *request.recipe_text;
  return read_text_file(request.recipe, recipes::max_recipe_bytes);
}

Result<CheckedRequest> check_request(const CampaignRequest& request) {
  Result<CheckedRequest> checked = check_recipe_and_rig(request);
  if (!checked) return checked;
  auto models = load_live_models(checked->plan, request.recipe.parent_path());
  if (!models) return pass(models.error(), request.recipe.string());
  checked->models = std::move(*models);
  return checked;
}

Result<CheckedRequest> check_quickly(const CampaignRequest& request) {
  Result<CheckedRequest> checked = check_recipe_and_rig(request);
  if (!checked) return checked;
  const Status fit = check_live_models(checked->plan, request.recipe.parent_path());
  if (!fit) return pass(fit.error(), request.recipe.string());
  if (Status runs = check_its_bench(request, *checked); !runs) return pass(runs.error());
  return checked;
}

Result<ChosenSimulation> choose_fidelity(const CampaignRequest& request, const recipes::Plan& plan,
                                         const RigFile& rig) {
  FidelityRequest fidelity = request.fidelity;
  fidelity.is_checked = request.error_check;
  auto chosen = choose_simulation(rig, request.rig, plan, fidelity, recorded_simulation(request));
  if (!chosen || !chosen->note.promise || request.error_check) return chosen;
  return fail({.code = Errc::invalid_argument,
               .where = "--no-error-check",
               .what = "option excludes --accuracy",
               .expected = "--accuracy without --no-error-check",
               .hint = "Remove one of the two options"});
}

std::uint64_t disk_forecast(const recipes::Plan& plan) {
  const recipes::RigLimits& limits = plan.limits;
  RecordingForecast forecast;
  forecast.trials = static_cast<std::uint32_t>(plan.trials.size()) * recipes::most_attempts(plan);
  forecast.trial_duration_s = plan.forecast.trials_s() / static_cast<double>(plan.trials.size());
  forecast.taxels = limits.taxels;
  forecast.axes = recipes::axis_count;
  forecast.taxel_rate_hz = limits.taxel_rate_hz;
  forecast.wrench_rate_hz = limits.wrench_rate_hz;
  forecast.stage_rate_hz = limits.stage_rate_hz();
  forecast.acceleration_rate_hz = limits.acceleration_rate_hz;
  forecast.sound_rate_hz = limits.sound_rate_hz;
  return forecast_bytes(forecast);
}

Result<SettledRequest> settled_request(const CampaignRequest& request) {
  Result<CheckedRequest> checked = check_request(request);
  if (!checked) return pass(checked.error());
  Result<RigFile> rig = parse_rig_file(checked->rig_text);
  if (!rig) return pass(rig.error(), request.rig.string());
  use_plugins(*rig, request.rig, request.plugins);
  Result<SimulationNote> simulation = settle_fidelity(request, *checked, *rig);
  if (!simulation) return pass(simulation.error(), request.rig.string());
  return SettledRequest{std::move(*checked), std::move(*rig), std::move(*simulation)};
}

}  // namespace weft::daemon
