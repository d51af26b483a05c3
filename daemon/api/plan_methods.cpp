// What a recipe will do, and what differs between two of them.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/api/parts.hpp"
#include "daemon/api/recipe_difference.hpp"
#include "daemon/dataset/sha256.hpp"
#include "daemon/recorder/recorder.hpp"
#include "recipes/engine/forecast.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

constexpr std::int64_t most_steps = 1000;
constexpr std::size_t most_differences = 1000;

/// A recipe's text: of the folder, or as a run has it on record.
Result<std::string> recipe_text(const Services& services, const Call& call, const char* param) {
  const std::string name = call.params.at(param).get<std::string>();
  if (const auto run = services.desk->get(name)) {
    const auto header = load_header(run->stored.folder / "campaign.sqlite");
    if (header) return header->info.recipe_json;
    return pass(header.error(), name);
  }
  const auto file = recipe_file(services, name);
  if (file) return read_text_file(*file, recipes::max_recipe_bytes);
  Error none = file.error();
  none.where = std::string("/params/") + param;
  return pass(std::move(none));
}

Result<recipes::RigLimits> limits_of(const Services& services) {
  const auto rig = read_text_file(services.rig);
  if (!rig) return pass(rig.error());
  return recipes::parse_rig_limits(*rig);
}

json point_json(const recipes::Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

json phase_json(const recipes::PhaseStep& step) {
  json out{{"phase", std::string(1, to_char(step.phase))}, {"duration_s", step.duration_s}};
  if (step.phase == Phase::press || step.phase == Phase::motion) {
    out["force_n"] = step.force_n;
    out["force_band_n"] = step.force_band_n;
  }
  if (step.phase == Phase::motion) {
    out["speed_mps"] = step.speed_mps;
    out["corners"] = json::array();
    for (const recipes::Vec2& corner : step.path_m) out["corners"].push_back(point_json(corner));
  }
  return out;
}

json exploration_json(const recipes::Exploration& exploration) {
  json phases = json::array();
  for (const recipes::PhaseStep& step : exploration.phases) phases.push_back(phase_json(step));
  return {{"exploration", exploration.name},
          {"start", point_json(exploration.start_m)},
          {"phases", std::move(phases)}};
}

json hand_over_plan(const recipes::Plan& plan) {
  if (!plan.hand_over) return nullptr;
  return {{"learner", plan.hand_over->learner},
          {"groups", plan.hand_over->groups},
          {"at_most_s", plan.hand_over->at_most_s}};
}

/// Trials `from` on, each with when it begins if all before it take what is expected.
json steps_json(const recipes::Plan& plan, std::size_t from, std::size_t most) {
  const std::vector<double> lasts_s = recipes::trial_durations_s(plan);
  json out = json::array();
  double begins_s = 0;
  for (std::size_t i = 0; i < plan.trials.size() && out.size() < most; ++i) {
    const recipes::TrialSpec& trial = plan.trials[i];
    if (i >= from)
      out.push_back({{"trial", i},
                     {"fabric", plan.fabrics[trial.fabric]},
                     {"exploration", plan.explorations[trial.exploration].name},
                     {"repetition", trial.repetition},
                     {"mounts", i == 0 || plan.trials[i - 1].fabric != trial.fabric},
                     {"begins_s", begins_s},
                     {"lasts_s", lasts_s[i]}});
    begins_s += lasts_s[i];
  }
  return out;
}

Outcome planned(const Services& services, const Call& call) {
  const auto text = recipe_text(services, call, "recipe");
  if (!text) return refused(text.error());
  const auto limits = limits_of(services);
  if (!limits) return refused(limits.error());
  const auto seed = seed_of(call);
  if (!seed) return refused(seed.error());
  const std::int64_t from = call.params.value("from", std::int64_t{0});
  const std::int64_t most = call.params.value("most", std::int64_t{100});
  if (from < 0)
    return refused({Errc::range,
                    "before the first trial",
                    "/params/from",
                    "0 or more",
                    std::to_string(from),
                    {}});
  if (most < 1 || most > most_steps)
    return refused({Errc::range,
                    "how many trials",
                    "/params/most",
                    "1 to " + std::to_string(most_steps),
                    std::to_string(most),
                    {}});
  const recipes::CheckReport report = recipes::check_recipe(*text, *limits, *seed);
  if (!report.plan) {
    const recipes::Diagnostic& first = report.problems.front();
    return refused(
        {Errc::invalid_argument, first.message, first.pointer, first.expected, first.got,
         "recipe.check tells all " + std::to_string(report.problems.size()) + " problems"});
  }
  const recipes::Plan& found = *report.plan;
  json explorations = json::array();
  for (const recipes::Exploration& each : found.explorations)
    explorations.push_back(exploration_json(each));
  const auto first = static_cast<std::size_t>(from);
  json steps = steps_json(found, first, static_cast<std::size_t>(most));
  const std::size_t next = first + steps.size();
  return text_of({{"name", found.name},
                  {"digest", "sha256:" + sha256_hex(*text)},
                  {"plan_digest", "sha256:" + sha256_hex(found.canonical_json)},
                  {"trials", found.trials.size()},
                  {"duration_s", found.forecast.duration_s},
                  {"people_s", found.forecast.people_s},
                  {"bytes", disk_forecast(found)},
                  {"hand_over", hand_over_plan(found)},
                  {"explorations", std::move(explorations)},
                  {"steps", std::move(steps)},
                  {"next", next < found.trials.size() ? json(next) : json()}});
}

/// Whether both plan the same campaign on this rig; null where one of them cannot be run on it.
json same_campaign(const Services& services, const std::string& a, const std::string& b) {
  const auto limits = limits_of(services);
  if (!limits) return nullptr;
  const recipes::CheckReport one = recipes::check_recipe(a, *limits);
  const recipes::CheckReport other = recipes::check_recipe(b, *limits);
  if (!one.plan || !other.plan) return nullptr;
  return one.plan->canonical_json == other.plan->canonical_json;
}

Outcome compared(const Services& services, const Call& call) {
  std::string text[2];
  json document[2];
  const char* const params[2] = {"recipe", "other"};
  for (std::size_t i = 0; i < 2; ++i) {
    auto read = recipe_text(services, call, params[i]);
    if (!read) return refused(read.error());
    text[i] = std::move(*read);
    document[i] = json::parse(text[i], nullptr, false);
    if (document[i].is_discarded())
      return refused({Errc::parse,
                      "that recipe is no JSON",
                      std::string("/params/") + params[i],
                      {},
                      {},
                      "recipe.check says where"});
  }
  std::size_t all = 0;
  json found = differences(document[0], document[1], most_differences, all);
  return text_of({{"same", all == 0},
                  {"same_campaign", same_campaign(services, text[0], text[1])},
                  {"count", all},
                  {"differences", std::move(found)}});
}

}  // namespace

void add_plan_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add(
      {"recipe.plan",
       "what a recipe will do on this rig: phases, and each trial with its expected time",
       {},
       {},
       {{"recipe", ParamType::text, true, "its name, or a run's: then as that has it on record"},
        {"seed", ParamType::integer, false, "in place of the recipe's"},
        {"from", ParamType::integer, false, "the first trial that is told, 0"},
        {"most", ParamType::integer, false, "trials, 100; at most 1000"}},
       "name, digest, plan_digest, trials, duration_s, people_s, bytes, hand_over, explorations, "
       "steps, "
       "next"},
      [s](const Call& call) { return planned(*s, call); });
  methods.add(
      {"recipe.diff",
       "what differs between two recipes, by JSON pointer",
       {},
       {},
       {{"recipe", ParamType::text, true, "its name, or a run's: then as that has it on record"},
        {"other", ParamType::text, true, "likewise"}},
       "same (as written), same_campaign (planned on this rig; null where that cannot be said), "
       "count, differences: where, change, was, is; the first 1000"},
      [s](const Call& call) { return compared(*s, call); });
}

}  // namespace weft::daemon::api
