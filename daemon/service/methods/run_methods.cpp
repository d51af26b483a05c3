#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using runs::RunState;
using runs::RunView;

using Checked = runs::Checked;

Outcome entered(const Services& services, const Call& call, const Checked& checked) {
  if (auto held = can_queue(services, call); !held) return tl::unexpected(held.error());
  const auto run_request = request_for_run(services, call);
  if (!run_request) return refused(run_request.error());
  return run_outcome(services.run_manager->submit(*run_request, checked));
}

void start(const Services& services, const Call& call, const Responder& respond) {
  if (auto held = can_queue(services, call); !held) return respond(tl::unexpected(held.error()));
  const auto run_request = request_for_run(services, call);
  if (!run_request) return respond(refused(run_request.error()));
  check_in_background(services, call, respond, request_for(*run_request, services.rig),
                      [s = &services](const Call& then, const Checked& checked) {
                        return entered(*s, then, checked);
                      });
}

/// The least role that breaks another user's lease for an order; none for what everybody may order.
std::optional<Role> breaking_role(Order order) {
  if (order == Order::abort) return Role::operator_;
  if (order == Order::resume || order == Order::confirm) return Role::engineer;
  return std::nullopt;
}

Outcome ordered(const Services& services, const Call& call, Order order) {
  if (const auto role = breaking_role(order))
    if (auto allowed = can_order(services, call, order, *role); !allowed)
      return tl::unexpected(allowed.error());
  return run_outcome(services.run_manager->order(run_of(call), order, by(call.caller)));
}

Outcome confirm(const Services& services, const Call& call) {
  if (auto allowed = can_order(services, call, Order::confirm, Role::engineer); !allowed)
    return tl::unexpected(allowed.error());
  const std::string step = call.params.at("step").get<std::string>();
  return run_outcome(
      services.run_manager->order(run_of(call), Order::confirm, by(call.caller), step));
}

json preview_json(const ResumePreview& preview) {
  return {{"will", preview.will},
          {"trials_planned", preview.planned},
          {"trials_done", preview.complete},
          {"trials_left", preview.left}};
}

/// What the daemon's death interrupted goes on, with a lease.
void resume_run(const Services& services, const Call& call, const Responder& respond) {
  if (auto open = require_unlocked(services); !open) return respond(tl::unexpected(open.error()));
  if (auto held = holds_lease(services, call); !held) return respond(tl::unexpected(held.error()));
  const auto request = services.run_manager->request_to_recover(run_of(call));
  if (!request) return respond(refused(request.error()));
  check_in_background(services, call, respond, *request,
                      [s = &services](const Call& then, const Checked& checked) -> Outcome {
                        if (auto held = holds_lease(*s, then); !held)
                          return tl::unexpected(held.error());
                        const runs::RecoverRequest wanted{by(then.caller), then.caller.user};
                        return run_outcome(s->run_manager->recover(run_of(then), wanted, checked));
                      });
}

/// A run that is held goes on as well.
void resume(const Services& services, const Call& call, const Responder& respond) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return respond(refused(run.error()));
  const bool has_lease = !call.params.value("lease", "").empty();  // else an ended run is refused
  if (run->machine.state == RunState::interrupted || (has_lease && runs::is_recoverable(*run)))
    return resume_run(services, call, respond);
  respond(ordered(services, call, Order::resume));
}

void preview(const Services& services, const Call& call, runs::Recovery choice,
             const Responder& respond) {
  services.run_manager->preview(run_of(call), choice, [respond](const Result<ResumePreview>& left) {
    respond(left ? Outcome(format_text(preview_json(*left))) : refused(left.error()));
  });
}

void resume_or_preview(const Services& services, const Call& call, const Responder& respond) {
  if (!call.params.value("preview", false)) return resume(services, call, respond);
  preview(services, call, runs::Recovery::resume, respond);
}

/// Told first, then done with a lease: nothing of it happens by itself.
void recover(const Services& services, const Call& call, const Responder& respond) {
  using runs::Recovery;
  const std::string wanted = call.params.at("choice").get<std::string>();
  std::optional<Recovery> choice;
  for (const Recovery each : {Recovery::resume, Recovery::discard, Recovery::keep_partial})
    if (wanted == to_string(each)) choice = each;
  if (!choice)
    return respond(
        refused(bad_param("choice", "no such choice", "resume, discard or keep-partial", wanted)));
  if (call.params.value("preview", false)) return preview(services, call, *choice, respond);
  if (*choice == Recovery::resume) return resume_run(services, call, respond);
  if (auto held = holds_lease(services, call); !held) return respond(tl::unexpected(held.error()));
  const auto reply = [respond](const Result<RunView>& run) { respond(run_outcome(run)); };
  services.run_manager->settle(run_of(call), *choice, by(call.caller), reply);
}

Outcome pause(const Services& services, const Call& call) {
  const std::string at = call.params.value("at", "boundary");
  if (at != "boundary" && at != "now")
    return refused(bad_param("at", "no such place to pause", "boundary or now", at));
  return ordered(services, call, at == "now" ? Order::pause_now : Order::pause);
}

Outcome list_runs(const Services& services, const Call& call) {
  const std::string wanted = call.params.value("state", "");
  std::vector<RunState> states;
  for (const RunState state : runs::all_run_states)
    if (wanted == to_string(state)) states.push_back(state);
  if (!wanted.empty() && states.empty())
    return refused(
        bad_param("state", "no such state", "queued, running, ended, ...", wanted.substr(0, 100)));
  return runs_page(services, call, "runs", run_json, states);
}

std::vector<rpc::ParamSpec> list_params() {
  std::vector<rpc::ParamSpec> params{{"state", ParamType::text, false, "only those in this state"}};
  params.insert(params.end(), page_params().begin(), page_params().end());
  return params;
}

Outcome annotate(const Services& services, const Call& call) {
  const std::string text = call.params.at("text").get<std::string>();
  if (text.empty()) return refused(bad_param("text", "nothing is said", "a few words", {}));
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return refused(run.error());
  const std::int64_t t_us = services.utc_us();
  if (const Status ok = services.log->append_journal(
          t_us, run->stored.id(), "note", by(call.caller), format_text({{"text", text}}));
      !ok)
    return refused(ok.error());
  return format_text({{"run", run->stored.id()}, {"t_us", t_us}, {"text", text}});
}

Outcome withdraw(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return tl::unexpected(free.error());
  if (const Status ok = services.run_manager->remove(run_of(call), by(call.caller)); !ok)
    return refused(ok.error());
  return run_outcome(services.run_manager->get(run_of(call)));
}

constexpr rpc::ParamSpec break_lease_param{"break_lease", ParamType::text, false,
                                           "a reason: break the lease that another user has for "
                                           "this run (abort: operator, else engineer)"};

void add_order(MethodGroup& group, std::string_view name, std::string_view summary, Order order,
               const std::vector<rpc::ParamSpec>& params = {run_param}) {
  group
      .change(name, summary, Role::operator_, params, "the run",
              [order](const Services& services, const Call& call) {
                return ordered(services, call, order);
              })
      .urgency = rpc::Urgency::urgent;
}

void wait(const Services& services, const Call& call, const Responder& respond) {
  const std::string id = run_of(call);
  if (const auto run = services.run_manager->get(id); !run) return respond(refused(run.error()));
  const bool also_handover = call.params.value("hand_over", false);
  const auto over = [s = &services, id, respond, also_handover,
                     listener = call.listener](const RunView& run) {
    if (!also_handover) return respond(format_text(run_json(run)));
    const auto reply = [s, id, respond] {
      if (const auto now = s->run_manager->get(id)) respond(format_text(run_json(*now)));
    };
    s->handovers->when_over(id, reply, listener);
  };
  services.run_manager->when_ended(id, over, call.listener);
}

// Into the line and out of it.
void add_run_queueing(MethodGroup& group) {
  group.change("run.start",
               "puts a campaign in line, with its recipe as it is now; it begins when the rig is "
               "free",
               Role::operator_, run_request_params(), "the run", start);
  group.change("run.withdraw",
               "takes a run out of the queue: the old name of queue.remove, kept for one version",
               Role::operator_, {run_param}, "the run", withdraw);
}

// To a run that is under way.
void add_run_orders(MethodGroup& group) {
  group
      .change("run.pause",
              "holds before the next repetition, or now: then that repetition is run again; where "
              "no repetition is left, the queue is paused instead (pause_carried_over)",
              Role::operator_,
              {run_param, {"at", ParamType::text, false, "boundary (default) or now"}}, "the run",
              pause)
      .urgency = rpc::Urgency::urgent;
  group.change(
      "run.resume",
      "resume: up, position, bias, then the next repetition; a run that is over and can be "
      "recovered with the repetition that was cut short",
      Role::operator_,
      {run_param,
       {"preview", ParamType::flag, false,
        "runs that are over: answer what it would do, and do nothing"},
       {"lease", ParamType::text, false, "of the rig; runs that are over need it"},
       break_lease_param},
      "the run, or will, trials_planned, trials_done, trials_left", resume_or_preview);
  group.change("run.confirm",
               "a person has done what the run waits for, as its \"attention\" says; it goes on",
               Role::operator_,
               {run_param,
                {"step", ParamType::text, true, "which one: step of the run's attention, \"Q-12\""},
                break_lease_param},
               "the run", confirm);
  add_order(group, "run.stop", "finishes the repetition, cleans up, ends", Order::stop);
  add_order(group, "run.abort", "stops motion, retracts, ends", Order::abort,
            {run_param, break_lease_param});
}

// To a run that was interrupted, and to any.
void add_run_care(MethodGroup& group) {
  group.change(
      "run.recover",
      "resume a run that was interrupted, stopped, aborted or failed with trials left, or "
      "discard it (it is never made a data set), or keep its complete trials as a data set",
      Role::operator_,
      {run_param,
       {"choice", ParamType::text, true, "resume, discard or keep-partial"},
       {"preview", ParamType::flag, false, "answers what it would do, and does nothing"},
       {"lease", ParamType::text, false, "of the rig; needed without preview"}},
      "the run, or will, trials_planned, trials_done, trials_left", recover);
  group.change(
      "run.annotate",
      "a note about a run, of any time, for the journal (log.query, kind \"note\"); its data "
      "stay as they are",
      Role::operator_, {run_param, {"text", ParamType::text, true, "what was seen or done"}},
      "run, t_us, text", annotate);
}

void add_run_reads(MethodGroup& group) {
  group.read("run.get", "one run", {run_param},
             "the run; submitted_by who put it in line, by who changed it last; attention is the "
             "next human action (null: none), next_attention_us since "
             "when it is asked or when it will be; campaign_since, where its campaign was gone "
             "on with without the daemon (weft run --resume): what its folder holds by now, "
             "trials_done, trials_planned, complete, dataset_sha256; promise, where an accuracy of "
             "the simulation was asked for: held; result, the accuracy of each exploration (null: not "
             "evaluated): exploration, learner, protocol, accuracy, ci95, tested, unit, labels, "
             "not_tested, base_rate, chance",
             [](const Services& services, const Call& call) {
               return run_outcome(services.run_manager->get(run_of(call)));
             });
  group.read("run.list", "the runs, page by page", list_params(),
             "runs, next (null where there is no more)", list_runs);
  group.read(
      "run.wait", "answers when the run has ended",
      {run_param, {"hand_over", ParamType::flag, false, "and what its recipe hands over as well"}},
      "the run", wait);
}

json operator_prompt_json(const runs::OperatorPrompt& operator_prompt) {
  json out{{"text", operator_prompt.prompt.text},
           {"people_s", operator_prompt.prompt.people_s},
           {"trial", operator_prompt.prompt.trial},
           {"asked", !operator_prompt.step.empty()},
           {"step", nullptr}};
  if (!operator_prompt.step.empty()) out["step"] = operator_prompt.step;
  return out;
}

}  // namespace

namespace {

/// 0 of a run that is over; null where the time left is not known.
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
  if (run.trials_planned > 0) {  // else nobody knows: it is from before that was kept
    out["trials_done"] = run.trials_done;
    out["trials_planned"] = run.trials_planned;
  }
  if (!stored.bench.empty()) out["bench"] = stored.bench;
  if (stored.keep_going) out["keep_going"] = true;
  if (stored.after != 0) out["after"] = runs::run_id(stored.after);
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

void add_run_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  add_run_queueing(group);
  add_run_orders(group);
  add_run_care(group);
  add_run_reads(group);
}

}  // namespace weft::daemon::api
