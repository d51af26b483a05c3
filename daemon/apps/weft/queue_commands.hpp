#pragma once
// `weft queue list | add | remove | move | pause | start`: the runs that wait for a daemon's rig.

#include "daemon/apps/weft/daemon_commands.hpp"

namespace weft::daemon::cli {

struct QueueListArgs : SocketArgs {};
struct QueueAddArgs : SocketArgs {
  std::string recipe;
  std::optional<std::uint64_t> seed;
  std::string name;
  std::optional<std::int64_t> place;  ///< from 0; the end
};
struct QueueRemoveArgs : SocketArgs {
  std::string run;
};
struct QueueMoveArgs : QueueRemoveArgs {
  std::int64_t place = 0;
};
struct QueuePauseArgs : SocketArgs {};
struct QueueStartArgs : SocketArgs {};

void add_options(CLI::App& command, QueueListArgs& args);
void add_options(CLI::App& command, QueueAddArgs& args);
void add_options(CLI::App& command, QueueRemoveArgs& args);
void add_options(CLI::App& command, QueueMoveArgs& args);
void add_options(CLI::App& command, QueuePauseArgs& args);
void add_options(CLI::App& command, QueueStartArgs& args);

Result<int> run_queue_list(const QueueListArgs& args, Console& console);
Result<int> run_queue_add(const QueueAddArgs& args, Console& console);
Result<int> run_queue_remove(const QueueRemoveArgs& args, Console& console);
Result<int> run_queue_move(const QueueMoveArgs& args, Console& console);
Result<int> run_queue_pause(const QueuePauseArgs& args, Console& console);
Result<int> run_queue_start(const QueueStartArgs& args, Console& console);

}  // namespace weft::daemon::cli
