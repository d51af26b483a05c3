#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "recipes/engine/operator_steps.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

json diagnostic_json(const recipes::Diagnostic& d) {
  json out{{"where", d.pointer}, {"message", d.message}};
  if (!d.expected.empty()) out["expected"] = d.expected;
  if (!d.got.empty()) out["got"] = d.got;
  if (!d.hint.empty()) out["hint"] = d.hint;
  return out;
}

json diagnostics_json(const std::vector<recipes::Diagnostic>& list) {
  json out = json::array();
  for (const auto& one : list) out.push_back(diagnostic_json(one));
  return out;
}

json plan_json(const recipes::Plan& plan) {
  json next = nullptr;
  if (const auto prompt = recipes::next_prompt(plan, 0))
    next = {{"text", prompt->text},
            {"people_s", prompt->people_s},
            {"after_s", recipes::machine_s(plan, 0, prompt->trial)}};
  return {{"name", plan.name},
          {"trials", plan.trials.size()},
          {"fabrics", plan.fabrics},
          {"eta_s", plan.forecast.total_s()},
          {"people_s", plan.forecast.people_s},
          {"asks", plan.forecast.prompts},
          {"next_attention", std::move(next)},
          {"envelope", envelope_json(plan.forecast)},
          {"force_min_n", plan.forecast.force_n.min},
          {"force_max_n", plan.forecast.force_n.max},
          {"bytes", disk_forecast(plan)}};
}

Outcome list_recipes(const Services& services) {
  json out = json::array();
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(services.recipes, error))
    if (entry.path().extension() == ".json") out.push_back(entry.path().stem().string());
  if (error)
    return refused({.code = Errc::io,
                    .where = services.recipes.string(),
                    .what = "cannot read the recipe folder",
                    .got = error.message()});
  std::sort(out.begin(), out.end());
  return format_text({{"recipes", std::move(out)}});
}

json problems_json(const std::vector<FileProblem>& list) {
  json out = json::array();
  for (const FileProblem& one : list) {
    out.push_back(diagnostic_json(one.what));
    out.back()["file"] = one.file.string();
  }
  return out;
}

/// Nothing of the call's: it is done on another thread.
Outcome checked(const CampaignRequest& request, const std::filesystem::path& data) {
  const auto found = preflight(request, PluginDrivers::unread);
  if (!found) return refused(found.error());
  json out{{"ok", found->problems.empty()},
           {"digest", "sha256:" + sha256_hex(found->recipe_text)},
           {"problems", problems_json(found->problems)},
           {"warnings", diagnostics_json(found->warnings)}};
  if (found->plan) {
    out["plan"] = plan_json(*found->plan);
    out["disk_ok"] = check_space(data, disk_forecast(*found->plan)).has_value();
  }
  return format_text(out);
}

// A model may have hundreds of megabytes, and a halt does not wait for them.
void check(const Services& services, const Call& call, const rpc::Responder& respond) {
  const auto file = recipe_file(services, call.params.at("recipe").get<std::string>());
  if (!file) return respond(refused(file.error()));
  const auto seed = read_seed(call);
  if (!seed) return respond(refused(seed.error()));
  answer_in_background(services.background, respond,
                       [request = CampaignRequest{*file, services.rig, {}, *seed},
                        data = services.data] { return checked(request, data); });
}

}  // namespace

void add_recipe_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"recipe.list", "recipes of the daemon's folder", {}, {}, {}, "recipes"},
              [s](const Call&) { return list_recipes(*s); });
  methods.add(
      {"recipe.schema",
       "JSON Schema of a recipe",
       {},
       {},
       {},
       "a JSON Schema of draft 2020-12 with x-unit"},
      [](const Call&) -> Outcome { return format_text(json::parse(recipe_schema_json())); });
  methods.add({"recipe.check",
               "everything that would be refused, before anything moves",
               {},
               {},
               {{"recipe", ParamType::text, true, "its name"},
                {"seed", ParamType::integer, false, "in place of the recipe's"}},
               "ok, digest, plan (eta_s with the people_s that people need, asks, next_attention, "
               "envelope of each stage with its margin), problems of the recipe, the rig file and "
               "the bench put together dry: file, where, message, expected, got, hint; warnings, "
               "disk_ok"},
              rpc::Handler([s](const Call& call, const rpc::Responder& respond) {
                check(*s, call, respond);
              }));
}

}  // namespace weft::daemon::api
