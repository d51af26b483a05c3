// weft halt and weft estop. They never fail for their arguments, and call every given daemon: a
// person who types one of them wants the motion to stop.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <system_error>
#include <thread>

#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/apps/weft/stop_signals.hpp"
#include "daemon/base/loop/threads.hpp"

namespace weft::daemon::cli {
namespace {

using client::Client;
using nlohmann::json;

struct StopArgs : SocketArgs {
  std::vector<std::string> sockets, daemons;
  std::string reason;
};

void add_options(CLI::App& command, StopArgs& args) {
  constexpr auto last = CLI::MultiOptionPolicy::TakeLast;
  command.add_option("--socket", args.sockets, "stop the daemon at this Unix socket (repeatable)");
  command.add_option("--daemon", args.daemons,
                     "stop the daemon at tls://HOST:PORT or tcp://127.0.0.1:PORT (repeatable)");
  command.add_option("--tls-ca", args.tls_ca, "trust the CA certificates in this file (PEM)")
      ->envname("WEFT_TLS_CA")
      ->multi_option_policy(last);
  command
      .add_option("--token-file", args.token_file,
                  "read your token from this file (or set WEFT_TOKEN)")
      ->multi_option_policy(last);
  command
      .add_option("--reason", args.reason,
                  "state the reason for the journal; all other words are added to it")
      ->multi_option_policy(last);
}

/// Every daemon that the command line or the environment names; by default the unit's.
std::vector<SocketArgs> targets_of(const StopArgs& args) {
  std::vector<SocketArgs> out;
  const auto add = [&](const std::filesystem::path& socket, const std::string& daemon) {
    if (socket.empty() && daemon.empty()) return;
    SocketArgs one = args;
    one.socket = socket;
    one.daemon = daemon;
    const auto is_same = [&](const SocketArgs& known) {
      return known.socket == socket && known.daemon == daemon;
    };
    if (std::ranges::none_of(out, is_same)) out.push_back(std::move(one));
  };
  for (const std::string& socket : args.sockets) add(socket, {});
  for (const std::string& daemon : args.daemons) add({}, daemon);
  add(from_environment("WEFT_SOCKET"), {});
  add({}, from_environment("WEFT_DAEMON"));
  if (out.empty()) add(unit_socket, {});
  return out;
}

/// Stops one rig and returns its state afterwards. Motion first: the raw line needs no answer.
Result<json> stop_one(const SocketArgs& target, bool is_emergency, const std::string& reason) {
  const bool is_local = target.daemon.empty();
  if (is_local)
    if (Status sent = Client::halt(target.socket, is_emergency); !sent) return pass(sent.error());
  auto found = reached(target);
  if (!found) return pass(found.error());
  Client& daemon = found->client;
  const json params = reason.empty() ? json::object() : json{{"reason", reason}};
  if (!is_local || !reason.empty())
    if (const auto stopped = call(daemon, is_emergency ? "rig.estop" : "rig.halt", params);
        !stopped)
      return pass(stopped.error());
  auto rig = call(daemon, "rig.state");
  if (!rig || rig->value("rig", "") == "latched") return rig;
  return fail({.code = Errc::wrong_state,
               .where = "rig",
               .what = "rig not latched after the stop",
               .expected = "latched",
               .got = rig->value("rig", ""),
               .hint = "Use the power switch of the bench"});
}

std::string name_of(const SocketArgs& target) {
  return target.daemon.empty() ? target.socket.string() : target.daemon;
}

struct Sent {
  SocketArgs target;
  std::future<Result<json>> reply;
};

Sent send_stop(const SocketArgs& target, bool is_emergency, const std::string& reason) {
  std::promise<Result<json>> promise;
  Sent sent{target, promise.get_future()};
  const auto ordered = std::make_shared<std::promise<Result<json>>>(std::move(promise));
  const auto work = [target, is_emergency, reason, ordered] {
    ordered->set_value(catch_as_error([&] { return stop_one(target, is_emergency, reason); }));
  };
  try {
    std::thread(work).detach();  // a hanging one ends with the process
  } catch (const std::system_error&) {
    work();  // the user's limit of threads is reached
  }
  return sent;
}

enum class Reply : std::uint8_t { latched, refused, none };

Reply print_reply(Sent& sent, bool is_only_one, Console& console) {
  constexpr std::chrono::seconds patience{10};
  const std::string name = name_of(sent.target);
  if (sent.reply.wait_for(patience) != std::future_status::ready) {
    console.err << "weft: " << name
                << ": no reply to the stop within 10 s. Use the power switch of the bench."
                << std::endl;
    return Reply::none;
  }
  const Result<json> rig = sent.reply.get();
  if (rig) {
    print_line(console, (is_only_one ? "" : name + ": ") + "rig latched\n", *rig);
    for (const json& warning : rig->value("warnings", json::array()))
      console.err << "weft: " << name << ": " << warning.value("message", "") << std::endl;
  } else {
    console.err << "weft: " << name << ": " << to_string(rig.error()) << std::endl;
  }
  return rig ? Reply::latched : Reply::refused;
}

/// Clips for the daemon's limit of 1000 bytes; an invalid UTF-8 byte becomes three bytes.
std::string clipped_reason(const std::string& reason) {
  constexpr std::size_t most = 330;
  std::size_t end = std::min(reason.size(), most);
  const auto continues = [&](std::size_t at) { return (reason[at] & 0xC0) == 0x80; };
  while (end < reason.size() && end > 0 && continues(end)) --end;
  return reason.substr(0, end) + (end < reason.size() ? " ..." : "");
}

/// A hanging daemon does not delay the stop of the others.
Result<int> stop_all(const StopArgs& args, bool is_emergency, Console& console) {
  const IgnoreWriteSignals to_the_end;  // for `weft halt | head`
  const std::string reason = clipped_reason(args.reason);
  std::vector<Sent> sent;
  for (const SocketArgs& target : targets_of(args))
    sent.push_back(send_stop(target, is_emergency, reason));
  std::size_t latched = 0, hanging = 0;
  for (Sent& one : sent) {
    const Reply reply = print_reply(one, sent.size() == 1, console);
    latched += reply == Reply::latched ? 1 : 0;
    hanging += reply == Reply::none ? 1 : 0;
  }
  const int status = latched == sent.size() ? exit_ok : exit_failure;
  if (!reason.empty()) console.err << "weft: reason for the journal: " << reason << std::endl;
  if (hanging == 0) return status;
  console.out.flush();
  std::quick_exit(status);  // a thread is still working
}

constexpr std::array<std::string_view, 4> options_with_value{"--socket", "--daemon", "--tls-ca",
                                                             "--token-file"};

bool takes_value(const std::string& word) {
  return std::ranges::count(options_with_value, word) > 0;
}

/// The position of a stop command. After an unknown option, or if no command is left, the first
/// `halt` or `estop`: any other reading would be refused.
std::vector<std::string>::iterator find_stop(std::vector<std::string>& words) {
  const auto is_stop = [](const std::string& word) { return word == "halt" || word == "estop"; };
  bool is_odd = false;
  auto word = words.begin();
  while (word != words.end() && word->starts_with('-')) {
    const bool has_value = takes_value(*word);
    is_odd = is_odd || !(has_value || *word == "--json");
    word += std::min<std::ptrdiff_t>(has_value ? 2 : 1, words.end() - word);
  }
  const bool is_missing = word == words.end();  // `weft --socket halt`
  if (is_odd || is_missing) return std::find_if(words.begin(), words.end(), is_stop);
  return word != words.end() && is_stop(*word) ? word : words.end();
}

}  // namespace

std::vector<std::string> stop_arguments(std::vector<std::string> words) {
  const auto verb = find_stop(words);
  if (verb == words.end()) return words;
  const auto asks_help = [](const std::string& word) { return word == "--help" || word == "-h"; };
  const bool is_help = words.size() == 2 && (asks_help(words.front()) || asks_help(words.back()));
  if (is_help) return words;
  std::vector<std::string> out{*verb};
  std::string reason;
  for (auto word = words.begin(); word != words.end(); ++word) {
    if (word == verb) continue;
    const std::size_t equals = word->find('=');
    const bool is_joined = equals != std::string::npos && equals + 1 < word->size() &&
                           takes_value(word->substr(0, equals));
    const bool has_next =
        word + 1 != words.end() && word + 1 != verb && !(word + 1)->starts_with('-');
    if (*word == "--json" || is_joined) {
      out.push_back(*word);
    } else if (takes_value(*word) && has_next) {
      out.push_back(*word);
      out.push_back(*++word);
    } else if (*word != "--reason") {
      reason +=
          (reason.empty() ? "" : " ") + (word->starts_with("--reason=") ? word->substr(9) : *word);
    }
  }
  if (!reason.empty()) out.push_back("--reason=" + reason);
  return out;
}

void add_stop_commands(const CommandGroup& weft) {
  weft.add<StopArgs>("halt",
                     [](auto& args, auto& console) { return stop_all(args, false, console); });
  weft.add<StopArgs>("estop",
                     [](auto& args, auto& console) { return stop_all(args, true, console); });
}

}  // namespace weft::daemon::cli
