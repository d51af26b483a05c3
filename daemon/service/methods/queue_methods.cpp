#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using access::Role;
using nlohmann::json;
using rpc::Call;
using rpc::Effect;
using rpc::Outcome;
using rpc::ParamType;

constexpr rpc::ParamSpec if_rev{
    "if_rev", ParamType::integer, false,
    "rev of the queue as you know it: refused (rev.changed) where it is another by now"};
constexpr rpc::ParamSpec in_line{"run", ParamType::text, true, "its name, \"R-000318\""};
constexpr rpc::ParamSpec place{"place", ParamType::integer, false,
                               "in line, from 0; the end where it is left out"};
constexpr const char* whole_queue = "rev, paused_by (null where it is not), runs";

/// Who changes what he has read changes nothing else.
tl::expected<void, rpc::RpcError> as_known(const Services& services, const Call& call) {
  const auto known = call.params.find("if_rev");
  const std::int64_t now = services.run_manager->queue().revision();
  if (known == call.params.end() || *known == now) return {};
  return tl::unexpected(rpc::rpc_error(rpc::code::state + 12, "rev.changed",
                                       {.code = Errc::wrong_state,
                                        .where = "/params/if_rev",
                                        .what = "the queue has changed meanwhile",
                                        .expected = std::to_string(now),
                                        .got = known->dump(),
                                        .hint = "queue.list tells how it is now"}));
}

/// A change that moves nothing by itself.
tl::expected<void, rpc::RpcError> can_change(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free) return free;
  return as_known(services, call);
}

/// A change after which a run may begin.
tl::expected<void, rpc::RpcError> can_begin(const Services& services, const Call& call) {
  if (auto held = holds_lease(services, call); !held) return held;
  return as_known(services, call);
}

Result<std::optional<std::size_t>> place_in(const Call& call) {
  const auto found = call.params.find("place");
  if (found == call.params.end()) return std::optional<std::size_t>{};
  if (!found->is_number_unsigned())
    return fail({.code = Errc::range,
                 .where = "/params/place",
                 .what = "no place before the first",
                 .expected = "0 or more",
                 .got = found->dump()});
  return std::optional(found->get<std::size_t>());
}

json entry_json(const Services& services, std::size_t at) {
  runs::StoredRun numbered;
  numbered.number = services.run_manager->queue().runs()[at];
  json out = run_json(*services.run_manager->get(numbered.id()));
  out["place"] = at;
  return out;
}

Outcome list(const Services& services) {
  json out = queue_json(services.run_manager->queue());
  json runs = json::array();
  for (std::size_t at = 0; at < services.run_manager->queue().runs().size(); ++at)
    runs.push_back(entry_json(services, at));
  out["runs"] = std::move(runs);
  return format_text(out);
}

Outcome get(const Services& services, const Call& call) {
  const auto run = services.run_manager->get(run_of(call));
  if (!run) return refused(run.error());
  const runs::RunQueue& queue = services.run_manager->queue();
  const std::size_t at = queue.find_place(run->stored.number);
  if (at == queue.runs().size())
    return refused({.code = Errc::wrong_state,
                    .where = "/params/run",
                    .what = "the run does not wait in line",
                    .expected = "queued",
                    .got = std::string(to_string(run->machine.state)),
                    .hint = "run.get tells where it is"});
  json out = entry_json(services, at);
  out["rev"] = queue.revision();
  return format_text(out);
}

tl::expected<runs::RunRequest, rpc::RpcError> request_for_place(const Services& services,
                                                                const Call& call) {
  if (auto allowed = can_begin(services, call); !allowed) return tl::unexpected(allowed.error());
  const auto at = place_in(call);
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

/// What the queue is after a change.
Outcome changed(const Services& services, const Status& done) {
  if (!done) return refused(done.error());
  return list(services);
}

void add(const Services& services, const Call& call, const rpc::Responder& respond) {
  const auto run_request = request_for_place(services, call);
  if (!run_request) return respond(tl::unexpected(run_request.error()));
  check_in_background(services, call, respond, request_for(*run_request, services.rig),
                      [s = &services](const Call& then, const runs::Checked& checked) {
                        return added(*s, then, checked);
                      });
}

Outcome move(const Services& services, const Call& call) {
  if (auto allowed = can_change(services, call); !allowed) return tl::unexpected(allowed.error());
  const auto at = place_in(call);
  if (!at) return refused(at.error());
  const std::size_t end = services.run_manager->queue().runs().size();
  return changed(services,
                 services.run_manager->move(run_of(call), at->value_or(end), by(call.caller)));
}

constexpr rpc::ParamSpec queue_lease{"lease", ParamType::text, true, "your lease of the rig"};

void add_queue_reads(rpc::Methods& methods, const Services* s) {
  methods.add(
      {"queue.list", "the runs that wait for the rig, the next first", {}, {}, {}, whole_queue},
      [s](const Call&) { return list(*s); });
  methods.add({"queue.get", "one that waits", {}, {}, {in_line}, "the run, place, rev"},
              [s](const Call& call) { return get(*s, call); });
}

void add_queue_changes(rpc::Methods& methods, const Services* s) {
  methods.add({"queue.add",
               "puts a campaign in line, with its recipe as it is now; it begins when its turn "
               "comes and the rig is free",
               Role::operator_,
               Effect::change,
               {{"recipe", ParamType::text, true, "name of a recipe, see recipe.list"},
                queue_lease,
                {"seed", ParamType::integer, false, "in place of the recipe's"},
                {"name", ParamType::text, false, "added to the folder's name"},
                {"digest", ParamType::text, false,
                 "of the recipe that is meant, as recipe.check has it; another one is refused"},
                place,
                if_rev},
               "the run, rev"},
              rpc::Handler([s](const Call& call, const rpc::Responder& respond) {
                add(*s, call, respond);
              }));
  methods.add({"queue.remove",
               "takes a run out of the queue",
               Role::operator_,
               Effect::change,
               {in_line, if_rev},
               whole_queue},
              [s](const Call& call) -> Outcome {
                if (auto allowed = can_change(*s, call); !allowed)
                  return tl::unexpected(allowed.error());
                return changed(*s, s->run_manager->remove(run_of(call), by(call.caller)));
              });
  methods.add({"queue.move",
               "another place in line",
               Role::operator_,
               Effect::change,
               {in_line, place, if_rev},
               whole_queue},
              [s](const Call& call) { return move(*s, call); });
}

void add_queue_pauses(rpc::Methods& methods, const Services* s) {
  methods.add({"queue.pause",
               "nothing more begins; the run under way goes on",
               Role::operator_,
               Effect::change,
               {if_rev},
               whole_queue},
              [s](const Call& call) -> Outcome {
                if (auto allowed = can_change(*s, call); !allowed)
                  return tl::unexpected(allowed.error());
                return changed(*s, s->run_manager->pause_queue(by(call.caller)));
              });
  methods.add({"queue.start",
               "the next in line begins when the rig is free; after a restart of the daemon too, "
               "which pauses a queue that is not empty",
               Role::operator_,
               Effect::change,
               {queue_lease, if_rev},
               whole_queue},
              [s](const Call& call) -> Outcome {
                if (auto allowed = can_begin(*s, call); !allowed)
                  return tl::unexpected(allowed.error());
                return changed(*s, s->run_manager->resume_queue(by(call.caller)));
              });
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
  add_queue_reads(methods, &services);
  add_queue_changes(methods, &services);
  add_queue_pauses(methods, &services);
}

}  // namespace weft::daemon::api
