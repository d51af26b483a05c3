#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

constexpr rpc::ParamSpec if_rev{
    "if_rev", ParamType::integer, false,
    "expected rev of the queue; if it has changed, the request is refused (rev.changed)"};
constexpr rpc::ParamSpec place{"place", ParamType::integer, false,
                               "place in the queue, from 0 (default: the end)"};
constexpr const char* whole_queue =
    "rev, paused_by (null: not paused), runs, next (first place of the next page; null: last "
    "page)";

/// Refuses the change if the queue is no longer at the revision that the client read.
tl::expected<void, rpc::RpcError> as_known(const Services& services, const Call& call) {
  const auto known = call.params.find("if_rev");
  const std::int64_t now = services.run_manager->queue().revision();
  if (known == call.params.end() || *known == now) return {};
  return refused(rpc::code::state + 12, "rev.changed",
                 {.code = Errc::wrong_state,
                  .where = "/params/if_rev",
                  .what = "queue has changed meanwhile",
                  .expected = std::to_string(now),
                  .got = known->dump(),
                  .hint = "Read the queue again with queue.list"});
}

/// For changes that cannot start a run.
tl::expected<void, rpc::RpcError> can_change(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free) return free;
  return as_known(services, call);
}

/// For changes after which a run may start.
tl::expected<void, rpc::RpcError> can_begin(const Services& services, const Call& call) {
  if (auto held = can_queue(services, call); !held) return held;
  return as_known(services, call);
}

json entry_json(const Services& services, std::size_t at) {
  runs::StoredRun numbered;
  numbered.number = services.run_manager->queue().runs()[at];
  json out = run_json(*services.run_manager->get(numbered.id()));
  out["place"] = at;
  return out;
}

Outcome list_queue(const Services& services, std::size_t from = 0,
                   std::size_t most = runs::most_queued) {
  const std::size_t end = services.run_manager->queue().runs().size();
  json out = queue_json(services.run_manager->queue());
  json runs = json::array();
  std::size_t at = from;
  for (; at < end && runs.size() < most; ++at) runs.push_back(entry_json(services, at));
  out["runs"] = std::move(runs);
  out["next"] = at < end ? json(at) : json();
  return format_text(out);
}

Outcome list_page(const Services& services, const Call& call) {
  const auto from = read_whole_number(call, {"from", 0, 0, unbounded, "place out of range"});
  if (!from) return refused(from.error());
  const auto most = read_whole_number(
      call, {"most", runs::most_queued, 1, runs::most_queued, "number of runs out of range"});
  if (!most) return refused(most.error());
  return list_queue(services, *from, *most);
}

Outcome get_queued(const Services& services, const Call& call) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return refused(run.error());
  const runs::RunQueue& queue = services.run_manager->queue();
  const std::size_t at = queue.find_place(run->stored.number);
  if (at == queue.runs().size())
    return refused({.code = Errc::wrong_state,
                    .where = "/params/run",
                    .what = "run not in the queue",
                    .expected = "queued",
                    .got = std::string(to_string(run->machine.state)),
                    .hint = "Read its state with run.get"});
  json out = entry_json(services, at);
  out["rev"] = queue.revision();
  return format_text(out);
}

tl::expected<runs::RunRequest, rpc::RpcError> request_for_place(const Services& services,
                                                                const Call& call) {
  if (auto allowed = can_begin(services, call); !allowed) return tl::unexpected(allowed.error());
  const auto at = read_unsigned(call, "place", "place out of range");
  if (!at) return refused(at.error());
  auto run_request = request_for_run(services, call);
  if (!run_request) return refused(run_request.error());
  run_request->place = *at;
  return *run_request;
}

Outcome added(const Services& services, const Call& call, const runs::Checked& checked) {
  const auto run_request = request_for_place(services, call);
  if (!run_request) return tl::unexpected(run_request.error());
  const auto run = services.run_manager->submit(*run_request, checked);
  if (!run) return refused(run.error());
  json out = run_json(*services.run_manager->get(run->stored.id()));
  out["rev"] = services.run_manager->queue().revision();
  return format_text(out);
}

/// Makes the change if `allowed` and returns the resulting queue.
Outcome changed(const Services& services, const tl::expected<void, rpc::RpcError>& allowed,
                const std::function<Status()>& change) {
  if (!allowed) return tl::unexpected(allowed.error());
  if (const Status done = change(); !done) return refused(done.error());
  return list_queue(services);
}

void add_run(const Services& services, const Call& call, const Responder& respond) {
  const auto run_request = request_for_place(services, call);
  if (!run_request) return respond(tl::unexpected(run_request.error()));
  check_in_background(services, call, respond, request_for(*run_request, services.rig),
                      [s = &services](const Call& then, const runs::Checked& checked) {
                        return added(*s, then, checked);
                      });
}

Outcome move_run(const Services& services, const Call& call) {
  if (auto allowed = can_change(services, call); !allowed) return tl::unexpected(allowed.error());
  const auto at = read_unsigned(call, "place", "place out of range");
  if (!at) return refused(at.error());
  return changed(services, {}, [&] {
    const std::size_t end = services.run_manager->queue().runs().size();
    return services.run_manager->edit(run_of(call), {.place = at->value_or(end)}, by(call.caller));
  });
}

Outcome edit_run(const Services& services, const Call& call) {
  const bool can_begin_by_that = call.params.contains("after");  // may start the run
  if (auto allowed = can_begin_by_that ? can_begin(services, call) : can_change(services, call);
      !allowed)
    return tl::unexpected(allowed.error());
  const auto at = read_unsigned(call, "place", "place out of range");
  if (!at) return refused(at.error());
  const auto seed = read_seed(call);
  if (!seed) return refused(seed.error());
  runs::QueueEdit edit{.place = *at, .seed = *seed};
  const auto text = [&](const char* name, std::optional<std::string>& to) {
    if (call.params.contains(name)) to = call.params.at(name).get<std::string>();
  };
  text("name", edit.name);
  text("after", edit.after);
  if (call.params.contains("keep_going"))
    edit.keep_going = call.params.at("keep_going").get<bool>();
  return changed(services, {},
                 [&] { return services.run_manager->edit(run_of(call), edit, by(call.caller)); });
}

Outcome clear(const Services& services, const Call& call) {
  return changed(services, can_change(services, call),
                 [&] { return services.run_manager->clear_queue(by(call.caller)); });
}

Outcome remove_run(const Services& services, const Call& call) {
  return changed(services, can_change(services, call),
                 [&] { return services.run_manager->remove(run_of(call), by(call.caller)); });
}

Outcome pause_queue(const Services& services, const Call& call) {
  return changed(services, as_known(services, call),
                 [&] { return services.run_manager->pause_queue(by(call.caller)); });
}

Outcome start_queue(const Services& services, const Call& call) {
  if (auto open = require_unlocked(services); !open) return tl::unexpected(open.error());
  if (auto held = holds_lease(services, call); !held) return tl::unexpected(held.error());
  return changed(services, as_known(services, call),
                 [&] { return services.run_manager->resume_queue(by(call.caller)); });
}

}  // namespace

json queue_json(const runs::RunQueue& queue) {
  json out{{"rev", queue.revision()}, {"paused_by", nullptr}, {"runs", json::array()}};
  if (queue.is_paused()) out["paused_by"] = queue.paused_by();
  for (const std::int64_t number : queue.runs()) {
    runs::StoredRun run;
    run.number = number;
    out["runs"].push_back(run.id());
  }
  return out;
}

void add_queue_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read("queue.list", "list the queued runs in order",
             {{"from", ParamType::integer, false,
               "first place of the page: next of the previous page (default: 0)"},
              {"most", ParamType::integer, false, "largest number of runs, up to 1000"}},
             whole_queue, list_page);
  group.read("queue.get", "get a queued run", {run_param}, "the run, place, rev", get_queued);
  group.change("queue.add",
               "add a run of a recipe, as it is now, to the queue; it starts when it is first and "
               "the rig is free",
               Role::operator_, run_request_params({place, if_rev}), "the run, rev", add_run);
  group.change("queue.remove", "remove a run from the queue", Role::operator_, {run_param, if_rev},
               whole_queue, remove_run);
  group.change("queue.move", "move a queued run to another place", Role::operator_,
               {run_param, place, if_rev}, whole_queue, move_run);
  group.change("queue.edit", "change a queued run; omitted parameters keep their values",
               Role::operator_,
               {run_param,
                place,
                {"seed", ParamType::integer, false, "seed (default: that of the recipe)"},
                {"name", ParamType::text, false, "text appended to the name of the run's folder"},
                after_param,
                {"lease", ParamType::text, false, "your lease of the rig; needed with after"},
                {"keep_going", ParamType::flag, false,
                 "start the next run even if this one is stopped, aborted or fails"},
                if_rev},
               whole_queue, edit_run);
  group.change("queue.clear", "remove all runs from the queue", Role::operator_, {if_rev},
               whole_queue, clear);
  group.change("queue.pause", "pause the queue: no further run starts; the active run continues",
               Role::operator_, {if_rev}, whole_queue, pause_queue);
  group.change(
      "queue.start",
      "resume the queue: the next run starts when the rig is free. A queue with runs is paused "
      "after a run that is not complete, after a restart and after a reset",
      Role::operator_, {rig_lease_param, if_rev}, whole_queue, start_queue);
}

}  // namespace weft::daemon::api
