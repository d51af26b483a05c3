#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/hardware/rig/rig_file.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/rpc/session.hpp"
#include "daemon/storage/recorder/recorder.hpp"

namespace weft::daemon::api {
namespace {

constexpr std::int64_t most_lines = 10'000;

Outcome system_info(const Services& services, const Call&) {
  return format_text(
      {{"product", "weftd"},
       {"version", software_version()},
       {"protocol", server::protocol_version},
       {"epoch", services.epoch},
       {"rig", services.rig_name},
       {"bench", to_string(load_bench_kind(services.rig))},  // read each time: it may change
       {"pace", services.pace->load(std::memory_order_relaxed)},
       {"http", services.http_url.empty() ? json() : json(services.http_url)},
       {"listeners", services.hub->listeners()},
       {"seq", services.hub->seq()}});
}

json metrics(const Services& services, std::chrono::nanoseconds began) {
  json states = json::object();
  if (const auto counts = services.log->state_counts()) states = *counts;
  std::error_code error;
  const auto disk = std::filesystem::space(services.data, error);
  return {{"up_s", std::chrono::duration<double>(services.now() - began).count()},
          {"seq", services.hub->seq()},
          {"listeners", services.hub->listeners()},
          {"leases", services.leases->all(services.now()).size()},
          {"queued", services.run_manager->queue().runs().size()},
          {"runs", std::move(states)},
          {"disk_free_bytes", error ? json() : json(disk.available)}};
}

Outcome whoami(const Services&, const Call& call) {
  const rpc::Caller& caller = call.caller;
  return format_text({{"session", caller.session},
                      {"client", caller.client},
                      {"user", caller.user},
                      {"role", access::to_string(caller.role)},
                      {"local", caller.local}});
}

json blocker(std::string_view kind, std::string where, std::string hint) {
  return {{"kind", kind}, {"where", std::move(where)}, {"hint", std::move(hint)}};
}

/// The state in which a run left the rig does not matter while something moves it.
void add_rig_blocker(const runs::RigState& rig, bool is_moving, json& blockers) {
  const runs::RigFacts& facts = rig.facts();
  if (facts.lock_out)
    blockers.push_back(blocker("rig.locked", "rig",
                               "Locked out by " + facts.lock_out->user + ": " +
                                   facts.lock_out->reason + ". Ask that user to unlock it"));
  if (facts.latch)
    blockers.push_back(blocker("rig.latched", "rig",
                               (facts.latch->is_emergency ? "E-stop by " : "Halted by ") +
                                   facts.latch->why + ": inspect the rig, then call rig.reset"));
  if (is_moving || facts.fact == runs::RigFact::safe || facts.acknowledged || facts.latch) return;
  const bool is_unknown = facts.fact == runs::RigFact::unknown;
  blockers.push_back(blocker(is_unknown ? "rig.unknown" : "rig.holding", facts.left_by,
                             std::string(is_unknown ? "The position of the rig is unknown"
                                                    : "The probe may be on the fabric") +
                                 ": inspect it, then call rig.reset" +
                                 (facts.left_by.starts_with("R-") ? ", or resume that run" : "")));
}

void add_rig_file_blocker(const Services& services, json& blockers) {
  const auto text = read_text_file(services.rig);
  if (!text)
    return blockers.push_back(
        blocker("rig.unreadable", services.rig.string(), to_string(text.error())));
  const auto& problems = services.rig_watch->problems(services.rig, *text);
  if (problems.empty()) return;
  const std::string more = problems.size() == 1 ? ""
                                                : "; and " + std::to_string(problems.size() - 1) +
                                                      " more, listed by weft check";
  blockers.push_back(blocker("rig.invalid", services.rig.string(), problems.front() + more));
}

/// If the recipe folder is missing or unreadable, no run can be started from it.
void add_recipes_blocker(const Services& services, json& blockers) {
  std::error_code error;
  const std::filesystem::directory_iterator found(services.recipes, error);
  if (error)
    blockers.push_back(blocker("recipes.unreadable", services.recipes.string(),
                               "Runs cannot be started: " + error.message()));
}

/// If the data folder is missing, only that is reported, although it has no free space either.
void add_storage_blocker(const Services& services, json& blockers) {
  const std::string data = services.data.string();
  if (const Status here = services.log->in_place(); !here)
    return blockers.push_back(blocker("storage.gone", data, to_string(here.error())));
  if (!services.log->is_persisted())
    blockers.push_back(
        blocker("storage.io", data,
                "The state of the rig or a run could not be saved: free disk space; the "
                "daemon tries again"));
  constexpr std::uint64_t least_bytes = std::uint64_t{1} << 28;
  const std::uint64_t wanted = std::max(least_bytes, services.run_manager->status().bytes_awaited);
  if (const Status space = check_space(services.data, wanted); !space)
    blockers.push_back(blocker("disk.low", data, to_string(space.error())));
}

json line_json(const runs::JournalLine& line) {
  return {{"sequence", line.sequence},
          {"t_us", line.utc_us},
          {"run", line.run},
          {"kind", line.kind},
          {"by", line.by},
          {"data", json::parse(line.payload_json, nullptr, false)}};
}

Result<std::size_t> lines_wanted(const Call& call) {
  return read_whole_number(call, {"most", 100, 1, most_lines, "number of lines out of range"});
}

Outcome log_tail(const Services& services, const Call& call) {
  const auto most = lines_wanted(call);
  if (!most) return refused(most.error());
  const auto lines = services.log->tail(call.params.value("run", ""), *most);
  if (!lines) return refused(lines.error());
  ListPage page(*most);
  std::size_t left = lines->size();  // keep the newest that fit
  while (left > 0 && page.add(line_json((*lines)[left - 1]))) --left;
  return R"({"lines":)" + page.text(ListPage::Order::reversed) + R"(,"left_off":)" +
         std::to_string(left) + "}";
}

/// Reads a whole number from 0 to the largest that SQLite stores.
Result<std::int64_t> number_in(const Call& call, const char* name, std::int64_t fallback) {
  const auto found = call.params.find(name);
  if (found == call.params.end()) return fallback;
  // Numbers above the largest signed integer are unsigned in nlohmann::json; as signed they are
  // negative.
  if (const auto number = found->get<std::int64_t>(); number >= 0) return number;
  return fail({.code = Errc::range,
               .where = std::string("/params/") + name,
               .what = "number out of range",
               .expected = "0 to 2^63 - 1",
               .got = found->dump()});
}

Outcome log_query(const Services& services, const Call& call) {
  runs::RunStore::Query wanted;
  wanted.run = call.params.value("run", "");
  wanted.kind = call.params.value("kind", "");
  for (const auto& [name, value] :
       {std::pair("since_us", &wanted.since_us), std::pair("until_us", &wanted.until_us),
        std::pair("from", &wanted.from)}) {
    const auto number = number_in(call, name, *value);
    if (!number) return refused(number.error());
    *value = *number;
  }
  const auto most = lines_wanted(call);
  if (!most) return refused(most.error());
  wanted.most = *most;
  const auto page = services.log->query(wanted);
  if (!page) return refused(page.error());
  ListPage reply(*most);
  json next = page->next ? json(*page->next) : json();
  for (const auto& line : page->lines) {
    if (reply.add(line_json(line))) continue;
    next = line.sequence;
    break;
  }
  return R"({"lines":)" + reply.text() + R"(,"next":)" + format_text(next) + "}";
}

void add_log_methods(MethodGroup& group) {
  group.read(
      "log.tail", "get the newest lines of the daemon's journal",
      {{"run", ParamType::text, false, "only lines of this run"},
       {"most", ParamType::integer, false,
        "largest number of lines, up to 10000 and 1 MiB (default: 100)"}},
      "lines: sequence, t_us, run, kind, by, data; left_off: number of older lines that did not "
      "fit; get them with log.query",
      log_tail);
  group.read(
      "log.query", "query the daemon's journal by run, kind and time, oldest lines first",
      {{"run", ParamType::text, false, "only lines of this run"},
       {"kind", ParamType::text, false,
        "only lines of this kind, \"state\", or of several, separated by commas; the history of "
        "the queue: \"submitted,edited,removed,queue_paused,queue_started,queue_cleared\""},
       {"since_us", ParamType::integer, false, "from this time on, UTC [us]"},
       {"until_us", ParamType::integer, false, "before this time, UTC [us]"},
       {"from", ParamType::integer, false, "first sequence number: next of the previous page"},
       {"most", ParamType::integer, false, "largest number of lines, up to 10000 (default: 100)"}},
      "lines: sequence, t_us, run, kind, by, data; next (null: last page; a short or empty page "
      "may have one)",
      log_query);
}

}  // namespace

std::string readiness_json(const Services& services) {
  json blockers = json::array();
  if (services.run_manager->status().is_closing)
    blockers.push_back(blocker("daemon.stops", "daemon",
                               "The daemon is shutting down and starts nothing new: restart it"));
  add_rig_file_blocker(services, blockers);
  add_recipes_blocker(services, blockers);
  const bool is_moving =
      services.run_manager->active() || services.run_manager->status().maintenance;
  add_rig_blocker(services.run_manager->rig_state(), is_moving, blockers);
  add_storage_blocker(services, blockers);
  if (const auto problem = services.tokens_problem ? services.tokens_problem() : std::nullopt)
    blockers.push_back(
        blocker("tokens.unreadable", problem->where,
                "Tokens removed since may still be accepted: " + to_string(*problem)));
  if (const runs::RunQueue& queue = services.run_manager->queue(); queue.is_paused())
    blockers.push_back(blocker("queue.paused", "queue",
                               "Paused by " + queue.paused_by() + ": resume it with queue.start"));
  if (const auto run = services.run_manager->active())
    blockers.push_back(blocker("rig.busy", *run, "Wait until it ends, or queue your run"));
  if (const auto motion = services.run_manager->status().maintenance)
    blockers.push_back(blocker("rig.busy", *motion, "Wait until it ends, or queue your run"));
  const bool ok = blockers.empty();
  return format_text({{"ok", ok}, {"blockers", std::move(blockers)}});
}

void add_system_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read(
      "system.info", "get version, rig and settings of the daemon", {},
      "product, version, rig, bench (\"simulated\" or \"real\"), pace, http (null: not served), "
      "epoch, seq",
      system_info);
  group.read("system.ready", "check whether a run can start and list all blockers", {},
             "ok, blockers", [](const Services& s, const Call&) { return readiness_json(s); });
  group.read("system.time", "get the UTC and the monotonic clock", {}, "t_us (UTC), mono_us",
             [](const Services& s, const Call&) {
               return format_text({{"t_us", s.utc_us()}, {"mono_us", s.now().count() / 1000}});
             });
  group.read("system.metrics", "get counters and free disk space", {},
             "up_s, seq (events published), listeners, leases, queued, runs by state, "
             "disk_free_bytes (null: not known)",
             [began = services.now()](const Services& s, const Call&) {
               return format_text(metrics(s, began));
             });
  group.read("session.whoami", "get your session, user and role", {}, "session, client, user, role",
             whoami);
  add_log_methods(group);
  rpc::Methods* const all = &methods;
  group.read("rpc.discover", "get this OpenRPC document", {}, "OpenRPC",
             [all](const Services&, const Call&) {
               return all->open_rpc(std::string(server::protocol_version) + ".0");
             });
}

}  // namespace weft::daemon::api
