#pragma once
// Commands of a running daemon: runs, the queue, tokens.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/apps/weft/console.hpp"
#include "protocols/base/result.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

// Which daemon a command speaks to, by its options or by the environment.

/// Where the daemon is: --socket or --daemon; where there is neither, the environment's WEFT_SOCKET
/// or WEFT_DAEMON.
struct SocketArgs {
  std::filesystem::path socket;
  std::string daemon;                ///< "tls://HOST:PORT" or "tcp://127.0.0.1:PORT"
  std::filesystem::path tls_ca;      ///< --tls-ca, WEFT_TLS_CA
  std::filesystem::path token_file;  ///< one token; else the environment's WEFT_TOKEN
};

void add_socket(CLI::App& command, SocketArgs& args);

// `weft token add | list | remove`: the tokens of a daemon's clients by TCP and HTTP, in its file.

struct TokenAddArgs {
  std::filesystem::path file;
  std::string name;
  std::string role = "operator";
  int days = 30;
};
struct TokenListArgs {
  std::filesystem::path file;
};
struct TokenRemoveArgs {
  std::filesystem::path file;
  std::string name;
};

void add_options(CLI::App& command, TokenAddArgs& args);
void add_options(CLI::App& command, TokenListArgs& args);
void add_options(CLI::App& command, TokenRemoveArgs& args);

/// Makes a token for TCP and prints it, once.
Result<int> run_token_add(const TokenAddArgs& args, Console& console);
/// Names, roles and until when each is good: the file knows no more of a token.
Result<int> run_token_list(const TokenListArgs& args, Console& console);
/// Takes one away; within a second or so it is good for nothing more.
Result<int> run_token_remove(const TokenRemoveArgs& args, Console& console);

struct StatusArgs : SocketArgs {};
struct StartArgs : SocketArgs {
  std::string recipe;
  std::optional<std::uint64_t> seed;
  std::string name;
  bool wait = false;
};
struct RunOrderArgs : SocketArgs {
  std::string run;  ///< the one under way, where it is empty
  bool now = false;
};
struct PauseArgs : RunOrderArgs {};
struct ResumeArgs : RunOrderArgs {
  bool preview = false;
};
struct ConfirmArgs : RunOrderArgs {};
struct RecoverArgs : ResumeArgs {
  std::string choice;
};
struct StopArgs : RunOrderArgs {};
struct AbortArgs : RunOrderArgs {};
struct HaltArgs : SocketArgs {};
struct ResetArgs : SocketArgs {
  std::string reason;
};
struct EstopArgs : SocketArgs {};
struct WatchArgs : RunOrderArgs {};
struct LogArgs : RunOrderArgs {
  std::int64_t most = 100;
};
struct CallArgs : SocketArgs {
  std::string method;
  std::string params = "{}";
};
struct PageArgs : SocketArgs {
  std::string name;  ///< your own in the system, or that with a number, where it is empty
  std::string role = "operator";
  int days = 1;
};
void add_options(CLI::App& command, StatusArgs& args);
void add_options(CLI::App& command, StartArgs& args);
void add_options(CLI::App& command, PauseArgs& args);
void add_options(CLI::App& command, ResumeArgs& args);
void add_options(CLI::App& command, ConfirmArgs& args);
void add_options(CLI::App& command, RecoverArgs& args);
void add_options(CLI::App& command, StopArgs& args);
void add_options(CLI::App& command, AbortArgs& args);
void add_options(CLI::App& command, HaltArgs& args);
void add_options(CLI::App& command, ResetArgs& args);
void add_options(CLI::App& command, EstopArgs& args);
void add_options(CLI::App& command, WatchArgs& args);
void add_options(CLI::App& command, LogArgs& args);
void add_options(CLI::App& command, CallArgs& args);
void add_options(CLI::App& command, PageArgs& args);

Result<int> run_status(const StatusArgs& args, Console& console);
/// Takes a lease of the rig, puts the run in line; with --wait until it has ended: exit_ok only
/// where it is complete.
Result<int> run_start(const StartArgs& args, Console& console);
Result<int> run_pause(const PauseArgs& args, Console& console);
/// A run that is held, or one that the daemon's death interrupted: what is left is told first.
Result<int> run_resume(const ResumeArgs& args, Console& console);
/// Told first: what becomes of an interrupted run.
Result<int> run_recover(const RecoverArgs& args, Console& console);
/// A person has done what the run waits for, which is told first.
Result<int> run_confirm(const ConfirmArgs& args, Console& console);
Result<int> run_stop(const StopArgs& args, Console& console);
Result<int> run_abort(const AbortArgs& args, Console& console);
Result<int> run_halt(const HaltArgs& args, Console& console);
/// Somebody has looked at the rig: it may move again.
Result<int> run_reset(const ResetArgs& args, Console& console);
Result<int> run_estop(const EstopArgs& args, Console& console);
/// A line for each change, until the run has ended.
Result<int> run_watch(const WatchArgs& args, Console& console);
Result<int> run_log(const LogArgs& args, Console& console);
/// Any method: the result as the daemon gives it.
Result<int> run_call(const CallArgs& args, Console& console);
/// Has the daemon make a token, and prints the link that opens its page with it.
Result<int> run_page(const PageArgs& args, Console& console);

// `weft queue list | add | remove | move | pause | start`: the runs that wait for a daemon's rig.

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
