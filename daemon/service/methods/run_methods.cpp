#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

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

/// The least role that may break another user's lease for an order; none if everyone may order it.
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

/// Resumes an ended run with trials left, such as one that the daemon's death interrupted. Needs a
/// lease.
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

/// Resumes a held run too.
void resume(const Services& services, const Call& call, const Responder& respond) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return respond(refused(run.error()));
  const bool has_lease = !call.params.value("lease", "").empty();  // else ended runs are refused
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

/// With "preview" only reports the effect; otherwise does it, which needs a lease. Nothing is
/// recovered automatically.
void recover(const Services& services, const Call& call, const Responder& respond) {
  using runs::Recovery;
  const std::string wanted = call.params.at("choice").get<std::string>();
  std::optional<Recovery> choice;
  for (const Recovery each : {Recovery::resume, Recovery::discard, Recovery::keep_partial})
    if (wanted == to_string(each)) choice = each;
  if (!choice)
    return respond(refused(
        bad_param("choice", "unknown recovery choice", "resume, discard or keep-partial", wanted)));
  if (call.params.value("preview", false)) return preview(services, call, *choice, respond);
  if (*choice == Recovery::resume) return resume_run(services, call, respond);
  if (auto held = holds_lease(services, call); !held) return respond(tl::unexpected(held.error()));
  const auto reply = [respond](const Result<RunView>& run) { respond(run_outcome(run)); };
  services.run_manager->settle(run_of(call), *choice, by(call.caller), reply);
}

Outcome pause(const Services& services, const Call& call) {
  const std::string at = call.params.value("at", "boundary");
  if (at != "boundary" && at != "now")
    return refused(bad_param("at", "unknown pause point", "boundary or now", at));
  return ordered(services, call, at == "now" ? Order::pause_now : Order::pause);
}

constexpr std::size_t most_tags = 16, most_tag_characters = 40, most_note_characters = 4000;

/// The request's check has already verified that the text is UTF-8.
Status check_text(std::string_view param, std::string_view text, std::size_t most) {
  const auto characters = std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
  if (std::cmp_less_equal(characters, most)) return {};
  return pass(bad_param(param, "text too long", "at most " + std::to_string(most) + " characters",
                        std::to_string(characters) + " characters"));
}

Result<std::vector<std::string>> read_tags(const json& list) {
  if (list.size() > most_tags)
    return pass(bad_param("tags", "too many tags", "at most " + std::to_string(most_tags),
                          std::to_string(list.size())));
  std::vector<std::string> out;
  for (const json& tag : list) {
    if (!tag.is_string() || tag.get_ref<const std::string&>().empty())
      return pass(bad_param("tags", "invalid tag", "a list of non-empty strings",
                            format_text(tag).substr(0, 100)));
    out.push_back(tag.get<std::string>());
    if (Status ok = check_text("tags", out.back(), most_tag_characters); !ok)
      return pass(ok.error());
  }
  return out;
}

Outcome annotate(const Services& services, const Call& call) {
  runs::Annotation wanted;
  if (call.params.contains("tags")) {
    auto tags = read_tags(call.params.at("tags"));
    if (!tags) return refused(tags.error());
    wanted.tags = std::move(*tags);
  }
  if (call.params.contains("note")) {
    wanted.note = call.params.at("note").get<std::string>();
    if (Status ok = check_text("note", *wanted.note, most_note_characters); !ok)
      return refused(ok.error());
  }
  if (!wanted.tags && !wanted.note)
    return refused(bad_param("note", "tags and note missing", "tags, note or both", {}));
  return run_outcome(services.run_manager->annotate(run_of(call), wanted, by(call.caller)));
}

Outcome list_runs(const Services& services, const Call& call) {
  const std::string wanted = call.params.value("state", "");
  std::vector<RunState> states;
  for (const RunState state : runs::all_run_states)
    if (wanted == to_string(state)) states.push_back(state);
  if (!wanted.empty() && states.empty())
    return refused(
        bad_param("state", "unknown state", "queued, running, ended, ...", wanted.substr(0, 100)));
  const std::string search = call.params.value("search", "");
  if (const Status ok = check_text("search", search, most_tag_characters); !ok)
    return refused(ok.error());
  return runs_page(services, call, "runs", run_json, {states, false, search});
}

std::vector<rpc::ParamSpec> list_params() {
  std::vector<rpc::ParamSpec> params{
      {"state", ParamType::text, false, "only runs in this state"},
      {"search", ParamType::text, false,
       "only runs with this text in id, recipe, name, fabrics, tags, note or outcome, ignoring the "
       "case of a to z; at most 40 characters"}};
  params.insert(params.end(), page_params().begin(), page_params().end());
  return params;
}

Outcome withdraw(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return tl::unexpected(free.error());
  if (const Status ok = services.run_manager->remove(run_of(call), by(call.caller)); !ok)
    return refused(ok.error());
  return run_outcome(services.run_manager->get(run_of(call)));
}

constexpr rpc::ParamSpec break_lease_param{"break_lease", ParamType::text, false,
                                           "reason to break the lease of another user for "
                                           "this run (abort: as operator, else as engineer)"};

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

// Methods that add runs to the queue and remove them.
void add_run_queueing(MethodGroup& group) {
  group.change(
      "run.start",
      "queue a run of a recipe, as it is now; it starts when it is first and the rig is free",
      Role::operator_, run_request_params(), "the run", start);
  group.change("run.withdraw",
               "remove a run from the queue: the old name of queue.remove, kept for one version",
               Role::operator_, {run_param}, "the run", withdraw);
}

// Orders to an active run.
void add_run_orders(MethodGroup& group) {
  group
      .change("run.pause",
              "pause the run before the next trial, or now and repeat the interrupted trial. If no "
              "trial is left, the queue is paused instead (pause_carried_over)",
              Role::operator_,
              {run_param,
               {"at", ParamType::text, false, "pause point (default: boundary; boundary, now)"}},
              "the run", pause)
      .urgency = rpc::Urgency::urgent;
  group.change(
      "run.resume",
      "resume a held run with its next trial: retract, position, bias; or a recoverable ended "
      "run with its interrupted trial",
      Role::operator_,
      {run_param,
       {"preview", ParamType::flag, false, "for an ended run: only report what would be done"},
       {"lease", ParamType::text, false, "your lease of the rig; needed for an ended run"},
       break_lease_param},
      "the run, or will, trials_planned, trials_done, trials_left", resume_or_preview);
  group.change(
      "run.confirm",
      "confirm that the requested operator step (\"attention\") is done; the run continues",
      Role::operator_,
      {run_param,
       {"step", ParamType::text, true, "step of the run's \"attention\", \"Q-12\""},
       break_lease_param},
      "the run", confirm);
  add_order(group, "run.stop", "end the run after the current trial and the clean-up", Order::stop);
  add_order(group, "run.abort", "stop motion, retract the probe and end the run", Order::abort,
            {run_param, break_lease_param});
}

// Recovery of interrupted runs, and methods for any run.
void add_run_care(MethodGroup& group) {
  group.change(
      "run.recover",
      "recover an interrupted, stopped, aborted or failed run with trials left: resume it, discard "
      "it (no data set is made), or keep its complete trials as a data set",
      Role::operator_,
      {run_param,
       {"choice", ParamType::text, true, "choice (resume, discard, keep-partial)"},
       {"preview", ParamType::flag, false, "only report what would be done"},
       {"lease", ParamType::text, false, "your lease of the rig; needed without preview"}},
      "the run, or will, trials_planned, trials_done, trials_left", recover);
  group.change(
      "run.annotate",
      "set the tags or the note of a run, at any time; its data do not change. Journal kind: "
      "\"note\"",
      Role::operator_,
      {run_param,
       {"tags", ParamType::list, false,
        "the new list of tags: at most 16, of at most 40 characters"},
       {"note", ParamType::text, false, "the new note, at most 4000 characters",
        4 * most_note_characters}},
      "the run", annotate);
}

void add_run_reads(MethodGroup& group) {
  group.read(
      "run.get", "get a run", {run_param},
      "the run; submitted_by: who queued it; by: who changed it last; attention: the next operator "
      "step (null: none); next_attention_us: time of its prompt, past or expected; "
      "campaign_since, if the campaign was resumed without the daemon (weft run --resume): "
      "present content of its folder, "
      "trials_done, trials_planned, complete, dataset_sha256; promise, if an accuracy of "
      "the simulation was requested: held; result, the accuracy of each exploration (null: not "
      "evaluated): exploration, learner, protocol, accuracy, ci95, tested, unit, labels, "
      "not_tested, base_rate, chance",
      [](const Services& services, const Call& call) {
        return run_outcome(services.run_manager->get(run_of(call)));
      });
  group.read("run.list", "list the runs in pages", list_params(), "runs, next (null: last page)",
             list_runs);
  group.read("run.wait", "wait until the run has ended, then answer",
             {run_param, {"hand_over", ParamType::flag, false, "also wait for the handover"}},
             "the run", wait);
}

}  // namespace

void add_run_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  add_run_queueing(group);
  add_run_orders(group);
  add_run_care(group);
  add_run_reads(group);
}

}  // namespace weft::daemon::api
