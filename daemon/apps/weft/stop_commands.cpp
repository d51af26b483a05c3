// weft halt and weft estop. They never fail for their arguments, and reach every daemon that they
// are given: a person who types one of them wants the motion to stop.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <future>
#include <nlohmann/json.hpp>
#include <ostream>
#include <thread>

#include "daemon/apps/weft/daemon_call.hpp"
#include "daemon/base/loop/threads.hpp"

namespace weft::daemon::cli {
namespace {

using client::Client;
using nlohmann::json;

struct StopArgs : SocketArgs {
  std::string reason;
};

void add_options(CLI::App& command, StopArgs& args) {
  command.add_option("--socket", args.socket,
                     "Unix socket; also WEFT_SOCKET; default: " + std::string(unit_socket));
  command.add_option("--daemon", args.daemon,
                     "tls://HOST:PORT or tcp://127.0.0.1:PORT; also WEFT_DAEMON");
  command.add_option("--tls-ca", args.tls_ca, "trusted certificates (PEM); also WEFT_TLS_CA");
  command.add_option("--token-file", args.token_file,
                     "file that holds your token; also WEFT_TOKEN");
  command.add_option("--reason", args.reason,
                     "reason for the journal; any other words are added to it");
}

/// Every daemon that the command line or the environment names; the unit's, where none is named.
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
  add(args.socket, {});
  add({}, args.daemon);
  add(from_environment("WEFT_SOCKET"), {});
  add({}, from_environment("WEFT_DAEMON"));
  if (out.empty()) add(unit_socket, {});
  return out;
}

/// The rig as one daemon has it after the stop. Motion first: the raw line needs no answer.
Result<json> stop_one(const SocketArgs& target, bool is_emergency, const std::string& reason) {
  auto found = reached(target);
  if (!found) return pass(found.error());
  Client& daemon = found->client;
  const std::string_view method = is_emergency ? "rig.estop" : "rig.halt";
  if (found->is_local)
    if (Status sent = daemon.halt(is_emergency); !sent) return pass(sent.error());
  const bool is_told = found->is_local && reason.empty();
  const json params = reason.empty() ? json::object() : json{{"reason", reason}};
  if (!is_told)
    if (const auto stopped = call(daemon, method, params); !stopped) return pass(stopped.error());
  auto rig = call(daemon, "rig.state");
  if (!rig) return rig;
  if (rig->value("rig", "") == "latched") return rig;
  return fail({.code = Errc::wrong_state,
               .where = "rig",
               .what = "the rig is not latched after the stop",
               .expected = "latched",
               .got = rig->value("rig", ""),
               .hint = "Use the power switch of the bench"});
}

std::string name_of(const SocketArgs& target) {
  return target.daemon.empty() ? target.socket.string() : target.daemon;
}

/// A daemon that hangs keeps the stop from no other one.
Result<int> stop_all(const StopArgs& args, bool is_emergency, Console& console) {
  constexpr std::chrono::seconds patience{10};
  struct Sent {
    SocketArgs target;
    std::future<Result<json>> reply;
  };
  std::vector<Sent> sent;
  for (const SocketArgs& target : targets_of(args)) {
    std::promise<Result<json>> promise;
    sent.push_back({target, promise.get_future()});
    std::thread([target, is_emergency, reason = args.reason,
                 promise = std::move(promise)]() mutable {
      promise.set_value(catch_as_error([&] { return stop_one(target, is_emergency, reason); }));
    }).detach();  // one that hangs ends with the process
  }
  int status = exit_ok;
  bool is_hanging = false;
  for (auto& [target, reply] : sent) {
    const bool answers = reply.wait_for(patience) == std::future_status::ready;
    is_hanging = is_hanging || !answers;
    const Result<json> rig =
        answers ? reply.get()
                : Result<json>(fail({.code = Errc::timeout,
                                     .where = name_of(target),
                                     .what = "no answer to the stop within 10 s",
                                     .hint = "Use the power switch of the bench"}));
    if (rig) {
      print_line(console, sent.size() == 1 ? "rig latched\n" : name_of(target) + ": rig latched\n",
                 *rig);
    } else {
      console.err << "weft: " << name_of(target) << ": " << to_string(rig.error()) << std::endl;
      status = exit_failure;
    }
  }
  if (!args.reason.empty())
    console.err << "weft: taken as the reason: " << args.reason << std::endl;
  if (!is_hanging) return status;
  console.out.flush();
  std::quick_exit(status);  // its thread is at work yet
}

constexpr std::array<std::string_view, 4> options_with_value{"--socket", "--daemon", "--tls-ca",
                                                             "--token-file"};

}  // namespace

std::vector<std::string> heeded_words(std::vector<std::string> words) {
  const auto stop =
      std::ranges::find_if(words, [](const std::string& word) { return !word.starts_with('-'); });
  if (stop == words.end() || (*stop != "halt" && *stop != "estop")) return words;
  std::vector<std::string> out(words.begin(), stop + 1), reason;
  for (auto word = stop + 1; word != words.end(); ++word) {
    const std::string name = word->substr(0, word->find('='));
    const bool has_value = std::ranges::count(options_with_value, name) > 0;
    const bool is_joined = name.size() < word->size();
    if (*word == "--json" || (has_value && is_joined && name.size() + 1 < word->size()) ||
        ((*word == "--help" || *word == "-h") && words.size() == out.size() + 1)) {
      out.push_back(*word);
    } else if (has_value && !is_joined && word + 1 != words.end()) {
      out.push_back(*word);
      out.push_back(*++word);
    } else if (*word != "--reason") {
      reason.push_back(word->starts_with("--reason=") ? word->substr(9) : *word);
    }
  }
  std::string text;
  for (const std::string& word : reason) text += (text.empty() ? "" : " ") + word;
  if (!text.empty()) out.push_back("--reason=" + text);
  return out;
}

void add_stop_commands(const CommandGroup& weft) {
  weft.add<StopArgs>("halt", "stop all motion and latch the rig; any words are the reason",
                     [](auto& args, auto& console) { return stop_all(args, false, console); });
  weft.add<StopArgs>("estop", "as halt, and only an engineer resets it",
                     [](auto& args, auto& console) { return stop_all(args, true, console); });
}

}  // namespace weft::daemon::cli
