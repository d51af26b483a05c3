#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/daemon_call.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct QueueAddArgs : RunRequestArgs {
  std::optional<std::int64_t> place;  ///< from 0; empty: the end
};
struct QueuedRunArgs : SocketArgs {
  std::string run;
};
struct QueueEditArgs : QueuedRunArgs {
  std::optional<std::int64_t> place;
  std::optional<std::uint64_t> seed;
  std::optional<std::string> name, after;
  std::optional<bool> keep_going;
};
struct QueueMoveArgs : QueuedRunArgs {
  std::int64_t place = 0;
};

void add_options(CLI::App& command, QueueAddArgs& args) {
  add_options(command, static_cast<RunRequestArgs&>(args));
  command.add_option("--place", args.place, "insert at this place; 0 is the next run")
      ->check(CLI::NonNegativeNumber);
}
void add_options(CLI::App& command, QueuedRunArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RUN", args.run, "run, such as R-000318")->required();
}
void add_options(CLI::App& command, QueueEditArgs& args) {
  add_options(command, static_cast<QueuedRunArgs&>(args));
  command.add_option("--place", args.place, "move to this place; 0 is the next run")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--seed", args.seed, "change the seed");
  command.add_option("--name", args.name,
                     "change the text appended to the name of the run's folder");
  command.add_option("--after", args.after,
                     "start only after this run has ended complete; '' removes the condition");
  command.add_option(
      "--keep-going", args.keep_going,
      "start the next run even if this one is stopped, aborted or fails (true, false)");
}
void add_options(CLI::App& command, QueueMoveArgs& args) {
  add_options(command, static_cast<QueuedRunArgs&>(args));
  command.add_option("PLACE", args.place, "new place in the queue; 0 is the next run")
      ->required()
      ->check(CLI::NonNegativeNumber);
}

/// The user, or the automatic cause: "auto:rig_file" is "automatically: rig file".
std::string pause_text(std::string by) {
  constexpr std::string_view automatic = "auto:";
  if (!by.starts_with(automatic)) return "paused by " + by;
  std::ranges::replace(by, '_', ' ');
  return "paused automatically: " + by.substr(automatic.size());
}

std::string queue_text(const json& queue) {
  const json by = queue.value("paused_by", json());
  std::string text = by.is_string() ? pause_text(by.get<std::string>()) + "\n" : "";
  for (const json& run : queue.at("runs")) {
    text += format_run(run);
    if (run.contains("after"))
      text += "  after " + run.value("after", "") +
              (run.value("blocked", false)
                   ? ", which did not end complete. To start anyway: weft queue edit " +
                         run.value("run", "") + " --after ''\n"
                   : "\n");
  }
  return text.empty() ? "the queue is empty\n" : text;
}

/// Prints the queue after a call.
Result<int> print_queue(const Result<json>& queue, Console& console) {
  if (!queue) return pass(queue.error());
  print(console, queue_text(*queue), *queue);
  return exit_ok;
}

Result<int> run_queue_edit(client::Client& daemon, const QueueEditArgs& args, Console& console) {
  json params{{"run", args.run}};
  const auto put = [&params](const char* name, const auto& value) {
    if (value) params[name] = *value;
  };
  put("place", args.place);
  put("seed", args.seed);
  put("name", args.name);
  put("after", args.after);
  put("keep_going", args.keep_going);
  if (!args.after) return print_queue(call(daemon, "queue.edit", params), console);
  return print_queue(under_lease(daemon, {"weft queue edit " + args.run}, "queue.edit", params),
                     console);
}

/// Prints the journal lines about the queue, oldest first.
Result<int> run_queue_history(client::Client& daemon, const SocketArgs&, Console& console) {
  json params{{"kind", "submitted,edited,removed,queue_paused,queue_started,queue_cleared"},
              {"most", 1000}};
  json lines = json::array();
  std::string text;
  for (json next = 1; !next.is_null();) {
    params["from"] = next;
    const auto page = call(daemon, "log.query", params);
    if (!page) return pass(page.error());
    for (const json& line : page->at("lines")) {
      text += format_journal_line(line);
      lines.push_back(line);
    }
    next = page->at("next");
  }
  print(console, text, {{"lines", std::move(lines)}});
  return exit_ok;
}

Result<int> run_queue_add(client::Client& daemon, const QueueAddArgs& args, Console& console) {
  auto params = request_params(args);
  if (!params) return pass(params.error());
  if (args.place) (*params)["place"] = *args.place;
  return print_run(
      under_lease(daemon, {"weft queue add " + args.recipe}, "queue.add", std::move(*params)),
      console);
}

}  // namespace

void add_queue_commands(const CommandGroup& weft) {
  const CommandGroup queue = weft.group("queue");
  queue.by_default<SocketArgs>([](const SocketArgs& args, Console& console) -> Result<int> {
    auto found = reached(args);
    if (!found) return pass(found.error());
    return print_queue(call(found->client, "queue.list"), console);
  });
  add_daemon_command<SocketArgs>(queue, "list", [](auto& daemon, auto&, auto& console) {
    return print_queue(call(daemon, "queue.list"), console);
  });
  add_daemon_command(queue, "add", run_queue_add);
  add_daemon_command<QueuedRunArgs>(queue, "remove", [](auto& daemon, auto& args, auto& console) {
    return print_queue(call(daemon, "queue.remove", {{"run", args.run}}), console);
  });
  add_daemon_command<QueueMoveArgs>(queue, "move", [](auto& daemon, auto& args, auto& console) {
    const json params{{"run", args.run}, {"place", args.place}};
    return print_queue(call(daemon, "queue.move", params), console);
  });
  add_daemon_command(queue, "edit", run_queue_edit);
  add_daemon_command<SocketArgs>(queue, "clear", [](auto& daemon, auto&, auto& console) {
    return print_queue(call(daemon, "queue.clear"), console);
  });
  add_daemon_command(queue, "history", run_queue_history);
  add_daemon_command<SocketArgs>(queue, "pause", [](auto& daemon, auto&, auto& console) {
    return print_queue(call(daemon, "queue.pause"), console);
  });
  add_daemon_command<SocketArgs>(queue, "start", [](auto& daemon, auto&, auto& console) {
    const LeaseRequest lease{"weft queue start"};
    return print_queue(under_lease(daemon, lease, "queue.start", json::object()), console);
  });
}

}  // namespace weft::daemon::cli
