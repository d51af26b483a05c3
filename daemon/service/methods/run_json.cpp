// A run as JSON for clients.

#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {

using runs::RunView;

namespace {

json operator_prompt_json(const runs::OperatorPrompt& operator_prompt) {
  json out{{"text", operator_prompt.prompt.text},
           {"people_s", operator_prompt.prompt.people_s},
           {"trial", operator_prompt.prompt.trial},
           {"asked", !operator_prompt.step.empty()},
           {"step", nullptr}};
  if (!operator_prompt.step.empty()) out["step"] = operator_prompt.step;
  return out;
}

/// Seconds; 0 for a run that has ended, null if unknown.
json left_json(const RunView& run) {
  if (run.is_over()) return 0;
  return run.wall_left_s ? json(*run.wall_left_s) : json();
}

}  // namespace

json run_json(const RunView& run) {
  const runs::StoredRun& stored = run.stored;
  json out{{"run", stored.id()},
           {"state", to_string(run.machine.state)},
           {"recipe", stored.recipe.stem().string()},
           {"name", stored.name},
           {"submitted_by", stored.by},
           {"by", run.changed_by.empty() ? "auto:daemon" : run.changed_by},
           {"created_us", stored.created_us},
           {"folder", stored.folder.string()},
           {"takes_rejected", run.attempts_rejected},
           {"wall_left_s", left_json(run)},
           {"next_attention_us", nullptr},
           {"attention", nullptr}};
  if (run.trials_planned > 0) {  // otherwise unknown: the run is older than this record
    out["trials_done"] = run.trials_done;
    out["trials_planned"] = run.trials_planned;
  }
  if (!stored.bench.empty()) out["bench"] = stored.bench;
  if (stored.keep_going) out["keep_going"] = true;
  if (stored.after != 0) out["after"] = runs::run_id(stored.after);
  out["tags"] = stored.tags;
  out["note"] = stored.note;
  if (run.is_blocked) out["blocked"] = true;
  if (run.pause_is_carried_over) out["pause_carried_over"] = true;
  if (!stored.recipe_sha256.empty()) out["digest"] = "sha256:" + stored.recipe_sha256;
  if (run.operator_prompt) {
    if (run.operator_prompt->at_us) out["next_attention_us"] = *run.operator_prompt->at_us;
    out["attention"] = operator_prompt_json(*run.operator_prompt);
  }
  if (!run.last_rejection.empty()) out["last_rejection"] = run.last_rejection;
  if (run.moment)
    out["at"] = {
        {"trial", run.moment->trial},           {"step", recipes::to_string(run.moment->step)},
        {"fabric", run.moment->fabric},         {"exploration", run.moment->exploration},
        {"repetition", run.moment->repetition}, {"bench_s", run.moment->virtual_s}};
  if (!stored.outcome.empty()) {
    out["outcome"] = stored.outcome;
    out["cleanup"] = stored.cleanup;
    out["rig"] = stored.rig_fact;
  }
  if (!stored.recovered.empty()) out["recovered"] = stored.recovered;
  if (!stored.error.empty()) out["error"] = stored.error;
  if (!stored.dataset_error.empty()) out["dataset_error"] = stored.dataset_error;
  if (!stored.promise.empty()) out["promise"] = {{"held", stored.promise == "held"}};
  if (run.handover) out["handover"] = handover_json(*run.handover);
  out["result"] = result_json(run);
  if (!stored.dataset_sha256.empty()) out["dataset_sha256"] = stored.dataset_sha256;
  if (run.external_resume)
    out["campaign_since"] = {{"trials_done", run.external_resume->trials_done},
                             {"trials_planned", run.external_resume->trials_planned},
                             {"complete", run.external_resume->complete},
                             {"dataset_sha256", run.external_resume->dataset_sha256}};
  return out;
}

server::Hub::Archive run_archive(const Services& services) {
  static constexpr std::string_view prefix = "run:";
  return {.prefix = std::string(prefix),
          .find = [s = &services](std::string_view topic) -> std::optional<json> {
            if (!topic.starts_with(prefix)) return std::nullopt;
            const auto run = s->run_manager->get(topic.substr(prefix.size()));
            return run ? std::optional(run_json(*run)) : std::nullopt;
          },
          .count =
              [s = &services] {
                std::int64_t all = 0;
                if (const auto counts = s->log->state_counts())
                  for (const auto& [state, runs] : *counts) all += runs;
                return static_cast<std::size_t>(all);
              }};
}

}  // namespace weft::daemon::api
