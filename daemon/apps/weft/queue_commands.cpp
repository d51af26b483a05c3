#include "daemon/apps/weft/daemon_commands.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft/daemon_call.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

std::string queue_text(const json& queue) {
  const json by = queue.value("paused_by", json());
  std::string text = by.is_string() ? "paused by " + by.get<std::string>() + "\n" : "";
  for (const json& run : queue.at("runs")) text += format_run(run);
  return text.empty() ? "nobody waits\n" : text;
}

/// Asks, and prints what the queue is then.
Result<int> call_queue(const SocketArgs& args, std::string_view method, const json& params,
                       Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto queue = call(*daemon, method, params);
  if (!queue) return pass(queue.error());
  print(console, queue_text(*queue), *queue);
  return exit_ok;
}

}  // namespace

void add_options(CLI::App& command, QueueListArgs& args) {
  add_socket(command, args);
}
void add_options(CLI::App& command, QueueAddArgs& args) {
  add_socket(command, args);
  command.add_option("RECIPE", args.recipe, "name of a recipe in the daemon's folder")->required();
  command.add_option("--seed", args.seed, "in place of the recipe's");
  command.add_option("--name", args.name, "added to the name of the run's folder");
  command.add_option("--place", args.place, "in line, 0 is the next; the end where it is left out")
      ->check(CLI::NonNegativeNumber);
}
void add_options(CLI::App& command, QueueRemoveArgs& args) {
  add_socket(command, args);
  command.add_option("RUN", args.run, "its name, R-000318")->required();
}
void add_options(CLI::App& command, QueueMoveArgs& args) {
  add_socket(command, args);
  command.add_option("RUN", args.run, "its name, R-000318")->required();
  command.add_option("PLACE", args.place, "in line, 0 is the next")
      ->required()
      ->check(CLI::NonNegativeNumber);
}
void add_options(CLI::App& command, QueuePauseArgs& args) {
  add_socket(command, args);
}
void add_options(CLI::App& command, QueueStartArgs& args) {
  add_socket(command, args);
}

Result<int> run_queue_list(const QueueListArgs& args, Console& console) {
  return call_queue(args, "queue.list", json::object(), console);
}

Result<int> run_queue_add(const QueueAddArgs& args, Console& console) {
  json params{{"recipe", args.recipe}, {"name", args.name}};
  if (args.seed) params["seed"] = *args.seed;
  if (args.place) params["place"] = *args.place;
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto run =
      under_lease(*daemon, {"weft queue add " + args.recipe}, "queue.add", std::move(params));
  if (!run) return pass(run.error());
  print(console, format_run(*run), *run);
  return exit_ok;
}

Result<int> run_queue_remove(const QueueRemoveArgs& args, Console& console) {
  return call_queue(args, "queue.remove", {{"run", args.run}}, console);
}

Result<int> run_queue_move(const QueueMoveArgs& args, Console& console) {
  return call_queue(args, "queue.move", {{"run", args.run}, {"place", args.place}}, console);
}

Result<int> run_queue_pause(const QueuePauseArgs& args, Console& console) {
  return call_queue(args, "queue.pause", json::object(), console);
}

Result<int> run_queue_start(const QueueStartArgs& args, Console& console) {
  auto daemon = opened(args);
  if (!daemon) return pass(daemon.error());
  const auto queue = under_lease(*daemon, {"weft queue start"}, "queue.start", json::object());
  if (!queue) return pass(queue.error());
  print(console, queue_text(*queue), *queue);
  return exit_ok;
}

}  // namespace weft::daemon::cli
