#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/apps/weft/bench_options.hpp"
#include "daemon/apps/weft/daemon_call.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

struct QueueAddArgs : SocketArgs {
  std::string recipe;
  std::optional<std::uint64_t> seed;
  std::string name;
  std::optional<std::int64_t> place;  ///< from 0; the end
  ParameterArgs parameters;
};
struct QueuedRunArgs : SocketArgs {
  std::string run;
};
struct QueueMoveArgs : QueuedRunArgs {
  std::int64_t place = 0;
};

void add_options(CLI::App& command, QueueAddArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RECIPE", args.recipe, "name of a recipe in the daemon's folder")->required();
  command.add_option("--seed", args.seed, "in place of the recipe's");
  command.add_option("--name", args.name, "added to the name of the run's folder");
  add_options(command, args.parameters);
  command.add_option("--place", args.place, "in line, 0 is the next; the end where it is left out")
      ->check(CLI::NonNegativeNumber);
}
void add_options(CLI::App& command, QueuedRunArgs& args) {
  add_options(command, static_cast<SocketArgs&>(args));
  command.add_option("RUN", args.run, "its name, R-000318")->required();
}
void add_options(CLI::App& command, QueueMoveArgs& args) {
  add_options(command, static_cast<QueuedRunArgs&>(args));
  command.add_option("PLACE", args.place, "in line, 0 is the next")
      ->required()
      ->check(CLI::NonNegativeNumber);
}

std::string queue_text(const json& queue) {
  const json by = queue.value("paused_by", json());
  std::string text = by.is_string() ? "paused by " + by.get<std::string>() + "\n" : "";
  for (const json& run : queue.at("runs")) text += format_run(run);
  return text.empty() ? "nobody waits\n" : text;
}

/// Prints what the queue is after a call.
Result<int> print_queue(const Result<json>& queue, Console& console) {
  if (!queue) return pass(queue.error());
  print(console, queue_text(*queue), *queue);
  return exit_ok;
}

Result<int> run_queue_add(client::Client& daemon, const QueueAddArgs& args, Console& console) {
  json params{{"recipe", args.recipe}, {"name", args.name}};
  if (args.seed) params["seed"] = *args.seed;
  if (args.place) params["place"] = *args.place;
  if (const Status ok = put_parameters(args.parameters, params); !ok) return pass(ok.error());
  return print_run(
      under_lease(daemon, {"weft queue add " + args.recipe}, "queue.add", std::move(params)),
      console);
}

}  // namespace

void add_queue_commands(const CommandGroup& weft) {
  const CommandGroup queue = weft.group("queue", "the runs that wait for the daemon's rig");
  add_daemon_command<SocketArgs>(queue, "list", "who waits, the next first",
                                 [](auto& daemon, auto&, auto& console) {
                                   return print_queue(call(daemon, "queue.list"), console);
                                 });
  add_daemon_command(queue, "add", "puts a recipe in line", run_queue_add);
  add_daemon_command<QueuedRunArgs>(
      queue, "remove", "takes a run out of the line", [](auto& daemon, auto& args, auto& console) {
        return print_queue(call(daemon, "queue.remove", {{"run", args.run}}), console);
      });
  add_daemon_command<QueueMoveArgs>(
      queue, "move", "another place in line", [](auto& daemon, auto& args, auto& console) {
        const json params{{"run", args.run}, {"place", args.place}};
        return print_queue(call(daemon, "queue.move", params), console);
      });
  add_daemon_command<SocketArgs>(queue, "pause", "nothing more begins",
                                 [](auto& daemon, auto&, auto& console) {
                                   return print_queue(call(daemon, "queue.pause"), console);
                                 });
  add_daemon_command<SocketArgs>(
      queue, "start", "the next begins when the rig is free",
      [](auto& daemon, auto&, auto& console) {
        const LeaseRequest lease{"weft queue start"};
        return print_queue(under_lease(daemon, lease, "queue.start", json::object()), console);
      });
}

}  // namespace weft::daemon::cli
