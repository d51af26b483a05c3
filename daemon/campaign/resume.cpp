#include "daemon/campaign/resume.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "protocols/base/time.hpp"
#include "recipes/engine/motion.hpp"
#include "recipes/engine/operator_steps.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

Status same_text(const char* what, const std::string& recorded, const std::string& now) {
  if (recorded == now) return {};
  return fail({.code = Errc::wrong_state,
               .where = "resume",
               .what = std::string("campaign was started with another ") + what,
               .expected = recorded,
               .got = now,
               .hint = "Resume with the same one, or start a new campaign"});
}

std::string shortened(const json& value) {
  constexpr std::size_t most = 120;
  const std::string text = value.dump(-1, ' ', true);  // ASCII: a cut leaves valid text
  return text.size() <= most ? text : text.substr(0, most) + " ...";
}

/// "/repetitions: 2, recorded 3" for the first differences of two documents; "" if their content is
/// equal.
std::string differences_text(const std::string& recorded_text, const std::string& now_text) {
  constexpr std::size_t most = 5;
  const json recorded = json::parse(recorded_text, nullptr, false);
  const json now = json::parse(now_text, nullptr, false);
  if (recorded == now) return {};
  const json changes = json::diff(recorded, now);
  std::string text;
  for (std::size_t i = 0; i < changes.size() && i < most; ++i) {
    const json::json_pointer place(changes[i].at("path").get<std::string>());
    const auto value = [&](const json& document) {
      return document.contains(place) ? shortened(document[place]) : std::string("nothing");
    };
    // An addition at the end of a list has the place "/-".
    const bool added = changes[i].at("op") == "add";
    text += (i == 0 ? "" : "; ") + place.to_string() + ": " +
            (added ? shortened(changes[i].at("value")) : value(now)) + ", recorded " +
            (added ? std::string("nothing") : value(recorded));
  }
  return changes.size() > most ? text + "; and more" : text;
}

/// Layout and order of keys do not count. `document`: as in `weft dataset info --document`.
Status same_document(const std::filesystem::path& campaign, const std::string& document,
                     const std::string& recorded, const std::string& now) {
  const std::string different = recorded == now ? "" : differences_text(recorded, now);
  if (different.empty()) return {};
  return fail({.code = Errc::wrong_state,
               .where = "resume",
               .what = "campaign was started with another " + document,
               .expected = "the recorded " + document,
               .got = different,
               .hint = "Use the recorded one (weft dataset info " + campaign.string() +
                       " --document " + document + "), or start a new campaign"});
}

/// The fabric of a campaign on one fabric, as recorded; "{}" for a whole campaign.
Status same_part(const std::filesystem::path& campaign, const CheckedRequest& checked) {
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  std::string recorded = "{}";
  for (const JournalEntry& line : *journal)
    if (line.kind == part_kind) recorded = line.payload_json;
  json requested = json::object();
  if (checked.only_fabric) requested["fabric"] = *checked.only_fabric;
  return same_text("fabric as its part", recorded, requested.dump());
}

Status same_request(const std::filesystem::path& campaign, const CampaignHistory& history,
                    const CheckedRequest& checked) {
  const DatasetInfo& info = history.info;
  Status same = same_document(campaign, "recipe", info.recipe_json, checked.recipe_text);
  if (same) same = same_document(campaign, "rig", info.rig_json, checked.rig_text);
  if (same) same = same_text("seed", std::to_string(info.seed), std::to_string(checked.plan.seed));
  if (same) same = same_part(campaign, checked);
  if (same && history.progress.planned != checked.plan.trials.size())
    return fail({.code = Errc::corrupt,
                 .where = "resume",
                 .what = "number of trials differs from the recipe",
                 .expected = std::to_string(checked.plan.trials.size()),
                 .got = std::to_string(history.progress.planned)});
  return same;
}

Status same_rules(const std::string& recorded_json) {
  const auto line = nlohmann::json::parse(recorded_json, nullptr, false);
  const int recorded = line.is_object() ? line.value("rules", 1) : 1;
  if (recorded == recipes::engine_rules) return {};
  return fail({.code = Errc::wrong_state,
               .where = "resume",
               .what = "campaign was started by a Weft version with other trial rules",
               .expected = "rules " + std::to_string(recorded),
               .got = "rules " + std::to_string(recipes::engine_rules),
               .hint = "Resume with that version, or start a new campaign; the recorded data "
                       "stays readable"});
}

/// Refuses other models and other engine rules if trials are `left`: models decide where strokes
/// end, and rules change the trials.
Status same_conditions(const std::filesystem::path& campaign, const CheckedRequest& checked,
                       bool left) {
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  std::string models = "[]", rules;
  for (const JournalEntry& line : *journal) {
    if (line.kind == live_models_kind) models = line.payload_json;
    if (line.kind == recipes::rules_kind) rules = line.payload_json;
  }
  const Status same =
      same_text("model for its live votes", models, live_models_json(checked.plan, checked.models));
  return same && left ? same_rules(rules) : same;
}

std::string place(recipes::Axis axis, double target) {
  return recipes::is_linear(axis) ? fixed(target / m_per_mm, 3) + " mm"
                                  : fixed(target / rad_per_deg, 3) + " deg";
}

std::string axis_to(recipes::Axis axis, double target) {
  return std::string(recipes::to_string(axis)) + " to " + place(axis, target);
}

/// Adds the moves of one trial in the order of the engine's commands.
Status add_moves(const recipes::Plan& plan, std::size_t index, std::vector<std::string>& will) {
  const recipes::TrialSpec& trial = plan.trials[index];
  const recipes::Exploration& exploration = plan.explorations[trial.exploration];
  const auto above = recipes::above_start(plan, trial);
  if (!above) return pass(above.error());
  will.push_back("move " + axis_to(recipes::Axis::z, plan.limits.clear_z_m()));
  will.push_back("mount " + plan.fabrics[trial.fabric]);
  std::string across;
  for (const recipes::AxisMove& move : recipes::transfer(plan, *above))
    across += (across.empty() ? "move " : ", ") + axis_to(move.axis, move.target);
  will.push_back(across);
  will.push_back("bias the force sensor");
  will.push_back("lower z until contact, at most to " +
                 place(recipes::Axis::z, recipes::lowest_z_m(plan.limits)));
  const std::string legs = std::to_string(exploration.path_m().size()) + " strokes, ";
  will.push_back("run the trial: rest, press, " + (exploration.slides() ? legs : "") + "rest");
  return {};
}

/// Adds the operator steps before a trial. `begins`: the fabric on the plate is unknown.
void add_prompts(const recipes::Plan& plan, std::size_t trial, bool begins,
                 std::vector<std::string>& will) {
  for (auto step = recipes::due_step(plan, trial, 0, begins); step;
       step = recipes::due_step(plan, trial, *step + 1, begins))
    will.push_back("wait for the operator to confirm: " +
                   recipes::step_prompt(plan, trial, *step).text);
}

bool carries_on(const recipes::Plan& plan) {
  return plan.on_trial_failure == recipes::OnTrialFailure::carry_on;
}

bool is_all_on_record(const CampaignHistory& history, const recipes::Plan& plan) {
  return history.first_left(carries_on(plan)) >= history.progress.planned;
}

bool is_over(const CampaignHistory& history, const recipes::Plan& plan) {
  return history.progress.finished && is_all_on_record(history, plan);
}

bool is_certified(const std::filesystem::path& folder) {
  std::error_code unseen;
  return std::filesystem::exists(folder / certificate_file_name, unseen);
}

}  // namespace

Status require_no_existing_dataset(const std::filesystem::path& folder) {
  std::error_code unseen;
  for (const char* name : {certificate_file_name, dataset_file_name})
    if (std::filesystem::exists(folder / name, unseen))
      return fail({.code = Errc::corrupt,
                   .where = (folder / name).string(),
                   .what = "campaign file missing or empty, but its results exist",
                   .hint = "Restore campaign.sqlite, or start in another folder"});
  return {};
}

Status holds(const std::filesystem::path& campaign, const StopRequested& stop_requested) {
  const auto report = verify(campaign, stop_requested);
  if (!report) return pass(report.error());
  if (report->holds()) return {};
  const VerifyProblem& first = report->found_problems.front();
  return fail({.code = Errc::corrupt,
               .where = first.where,
               .what = "campaign differs from its record: " + first.what,
               .hint = first.hint.empty() ? "Run `weft verify` to see all findings" : first.hint});
}

bool is_anything_left(const CampaignRequest& request) {
  const std::filesystem::path campaign = request.out / campaign_file_name;
  const auto checked = check_request(request);
  const auto history = load_history(campaign);
  return !checked || !history || !is_over(*history, checked->plan) || !is_certified(request.out);
}

std::string certified_dataset(const std::filesystem::path& folder) {
  const auto certificate = read_certificate(folder);
  return certificate && *certificate ? (*certificate)->dataset_sha256 : "";
}

bool is_handover_done(const std::filesystem::path& folder) {
  std::error_code unseen;
  return std::filesystem::exists(folder / handover_folder_name, unseen);
}

Result<bool> is_only_end_left(const std::filesystem::path& folder) {
  const auto history = load_history(folder / campaign_file_name);
  if (!history) return pass(history.error());
  constexpr bool last_can_have_failed = true;
  return history->first_left(last_can_have_failed) >= history->progress.planned &&
         !is_certified(folder);
}

Result<std::optional<ResumePlan>> resume_plan(const std::filesystem::path& campaign,
                                              const CheckedRequest& checked, BenchMode mode,
                                              bool accept_whole,
                                              const StopRequested& stop_requested) {
  std::error_code ignored;
  const auto log = read_log(campaign);
  if (!log) return pass(log.error());
  const bool nothing = log->bytes == 0 && !std::filesystem::exists(campaign, ignored);
  if (nothing || is_blank_campaign(campaign)) {
    if (Status ok = require_no_existing_dataset(campaign.parent_path()); !ok)
      return pass(ok.error());
    return std::optional<ResumePlan>{};
  }
  if (Status ok = holds(campaign, stop_requested); !ok) return pass(ok.error());
  auto history = load_history(campaign);
  if (!history) return pass(history.error());
  if (history->progress.discarded)
    return fail(
        {.code = Errc::wrong_state, .where = campaign.string(), .what = "campaign discarded"});
  if (Status same = same_request(campaign, *history, checked); !same) return pass(same.error());
  if (history->attempts.empty()) return std::optional<ResumePlan>{};  // no trial has begun
  const bool left = !is_all_on_record(*history, checked.plan);
  if (Status same = same_conditions(campaign, checked, left); !same) return pass(same.error());
  ResumePlan out;
  out.first_trial = history->first_left(carries_on(checked.plan));
  out.rejected = history->rejected_of(out.first_trial);
  out.is_replayed = mode == BenchMode::simulated && !history->disturbed;
  const bool over = is_over(*history, checked.plan);
  out.only_concludes =
      is_all_on_record(*history, checked.plan) && !(over && is_certified(campaign.parent_path()));
  out.only_runs_handover =
      over && !out.only_concludes && checked.plan.handover && !checked.plan.handover->by_default &&
      history->complete() == history->progress.planned && !is_handover_done(campaign.parent_path());
  out.only_reports = over && !out.only_concludes && !out.only_runs_handover;
  if (out.only_reports && !accept_whole)
    return fail({.code = Errc::wrong_state,
                 .where = campaign.string(),
                 .what = "campaign already complete, nothing to resume"});
  out.history = std::move(*history);
  return std::optional(std::move(out));
}

Status same_devices(const std::vector<DeviceInfo>& recorded, const Bench& bench) {
  for (const auto& device : bench.devices()) {
    const DeviceEntry& entry = device->entry();
    const DeviceInfo now{entry.name, entry.driver, to_json(device->identity())};
    const auto then = std::find_if(recorded.begin(), recorded.end(),
                                   [&](const DeviceInfo& d) { return d.name == now.name; });
    if (then == recorded.end() || *then != now)
      return fail({.code = Errc::wrong_state,
                   .where = now.name,
                   .what = "device differs from the one at the start of the campaign",
                   .expected = then == recorded.end() ? "" : then->identity_json,
                   .got = now.identity_json,
                   .hint = "Connect the original device, or start a new campaign"});
  }
  return {};
}

Result<ResumePreview> preview_resume(const CampaignRequest& request,
                                     const StopRequested& stop_requested) {
  auto settled = settled_request(request);
  if (!settled) return pass(settled.error());
  const recipes::Plan& plan = settled->checked.plan;
  auto found = resume_plan(request.out / campaign_file_name, settled->checked, settled->rig.mode,
                           request.accept_whole, stop_requested);
  if (!found) return pass(found.error());
  ResumePreview out;
  out.planned = plan.trials.size();
  const std::size_t first = *found ? (*found)->first_trial : 0;
  out.complete = *found ? (*found)->history.complete() : 0;
  out.left = out.planned - first;
  if (*found && (*found)->only_concludes) {
    out.will.push_back("write the data set and the certificate: every trial is recorded");
    return out;
  }
  if (*found && (*found)->only_runs_handover) {
    out.will.push_back("run the handover of the recipe: the campaign is complete and certified");
    return out;
  }
  if (*found && (*found)->only_reports) {
    out.will.push_back("report the end of the campaign: it is complete and certified");
    return out;
  }
  const std::string aside = *found ? "" : name_aside(request.out / campaign_file_name).string();
  if (!aside.empty()) out.will.push_back("rename the empty campaign file to " + aside);
  if (!*found) out.will.push_back("start the campaign: nothing is recorded");
  out.will.push_back("open and home " + std::to_string(settled->rig.devices.size()) +
                     " devices, z first" +
                     (*found ? ", and compare them with the recorded devices" : ""));
  if (*found && (*found)->is_replayed && first > 0)
    out.will.push_back("replay the first " + std::to_string(first) +
                       " trials on the simulated bench and compare each with its record");
  out.will.push_back("continue with " + recipes::format_trial(plan, first));
  add_prompts(plan, first, !*found || !(*found)->is_replayed, out.will);
  if (Status ok = add_moves(plan, first, out.will); !ok) return pass(ok.error());
  if (out.left > 1)
    out.will.push_back("run the " + std::to_string(out.left - 1) + " trials after it");
  return out;
}

}  // namespace weft::daemon
