// Lines of a weftd client: line buffer, messages, the table of methods with its checks, and the
// answers of the methods. The run manager is the daemon's own, but its rig does not exist, so no
// run ever starts. There are no threads, clocks and sockets.

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/services.hpp"
#include "daemon/service/rpc/message.hpp"
#include "daemon/service/rpc/session.hpp"
#include "protocols/base/bytes.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::rpc_lines_target {
namespace {

using namespace weft::daemon;
using nlohmann::json;
using Clock = std::chrono::nanoseconds;

constexpr std::size_t most_line_bytes = 16384;

/// A daemon without sockets, and one client.
class SmallDaemon {
 public:
  explicit SmallDaemon(server::Peer peer)
      : store_(std::move(runs::RunStore::open(":memory:").value())),
        manager_({
                     .rig = "no-rig.json",
                     .data = "/no/such/folder",
                     .post = [](const std::function<void()>&) {},
                     .now = [] { return Clock(); },
                     .utc_us = [] { return std::int64_t{0}; },
                 },
                 store_),
        handovers_({.post = [](const std::function<void()>&) {},
                    .utc_us = [] { return std::int64_t{0}; },
                    .on_changed = [](std::string_view, const HandoverStatus&) {}},
                   store_) {
    const auto at_once = [](const auto& work, const auto&) {
      work()();
      return true;
    };
    services_ = {
        .hub = &hub_,
        .leases = &leases_,
        .run_manager = &manager_,
        .handovers = &handovers_,
        .log = &store_,
        .rig = "no-rig.json",
        .rig_name = "no-rig",
        .recipes = "/no/such/folder",
        .data = "/no/such/folder",
        .epoch = "e1",
        .now = [] { return Clock(); },
        .utc_us = [] { return std::int64_t{0}; },
        .background = at_once,
        .change_background = at_once,
        .file_background = at_once,
        .files = &files_,
        .pace = &pace_,
        .frame_sampler = &frame_sampler_,
        .sessions = &shared_.sessions,
        .add_token = [](const std::string&, access::Role, std::int64_t,
                        const std::string&) -> Result<std::string> { return std::string("wft_0"); },
        .remove_token = [](std::string_view) -> Status { return {}; }};
    api::add_methods(methods_, services_);
    shared_ = {&methods_, &hub_, &answered_, "e1", {}, {}, {}, [] { return Clock(); }};
    shared_.token_owner = [](std::string_view) -> Result<server::TokenOwner> {
      return fail({.code = Errc::wrong_state, .what = "no good"});
    };
    shared_.readiness_json = [this] { return api::readiness_json(services_); };
    shared_.halt = [this](const rpc::Caller& caller) {
      manager_.halt(runs::RigState::Stop::halt, caller.session);
    };
    shared_.emergency_stop = [this](const rpc::Caller& caller) {
      manager_.halt(runs::RigState::Stop::emergency, caller.session);
    };
    client_ = std::make_unique<server::Session>(
        shared_, std::move(peer), "s-1", [this](std::string line) { reply(std::move(line)); });
    client_->send_hello();
  }

  /// Sends pieces of the given sizes. False if a line is too long, which ends a connection.
  bool on_message(ByteView bytes, ByteView sizes) {
    rpc::LineBuffer lines(most_line_bytes);
    for (std::size_t piece = 0; !bytes.empty(); ++piece) {
      const std::size_t wanted =
          sizes.empty() ? bytes.size() : std::max<std::size_t>(sizes[piece % sizes.size()], 1);
      const ByteView part = bytes.first(std::min(wanted, bytes.size()));
      lines.add({reinterpret_cast<const char*>(part.data()), part.size()});
      while (const auto line = lines.next()) on_message(*line);
      if (lines.overflows()) return false;
      bytes = bytes.subspan(part.size());
    }
    return true;
  }

  [[nodiscard]] const std::vector<std::string>& reported() const { return reported_; }
  [[nodiscard]] bool any_result() const { return any_result_; }

 private:
  void on_message(const std::string& line) {
    const std::size_t before = reported_.size();
    client_->on_message(line);
    client_->pump([] { return true; });
    const auto request = rpc::parse_request(line);
    const bool blank = line.find_first_not_of(" \t\r") == std::string::npos;
    const bool silent = blank || (request && !request->id_json);
    // only answers about a run may come later, and there is no run
    demand(silent || reported_.size() > before, "every line that asks is answered");
  }

  void reply(std::string line) {
    const json message = json::parse(line, nullptr, false);
    demand(message.is_object() && message.value("jsonrpc", "") == "2.0",
           "what is said is JSON-RPC");
    demand(line.find('\n') == std::string::npos, "a message is one line");
    if (message.contains("result")) any_result_ = true;
    if (message.contains("error")) {
      const json& error = message["error"];
      demand(error.value("code", 0) != 0 && !error.value("message", "").empty() &&
                 !error.at("data").value("kind", "").empty(),
             "an error says what is wrong");
    }
    reported_.push_back(std::move(line));
  }

  server::Hub hub_;
  access::Leases leases_{"9c1d40b2"};
  access::IdempotencyCache answered_;
  runs::RunStore store_;
  runs::RunManager manager_;
  handover::HandoverService handovers_;
  api::DataFiles files_{[] { return std::chrono::nanoseconds(); }};
  BenchPace pace_ = 0;
  LiveFrameSampler frame_sampler_;
  api::Services services_;
  rpc::Methods methods_;
  server::Shared shared_;
  std::vector<std::string> reported_;
  bool any_result_ = false;
  std::unique_ptr<server::Session> client_;
};

server::Peer read_peer(std::uint8_t choice) {
  using access::Role;
  constexpr std::array roles{Role::observer, Role::operator_, Role::engineer, Role::admin};
  if (choice % 5 == 4) return {false, {}, std::nullopt};  // TCP without a valid token
  return {true, "somebody", roles[choice % 5]};
}

}  // namespace

WEFT_FUZZ_TARGET(rpc_lines) {
  using namespace weft::fuzz;
  constexpr std::size_t header = 4;  // the peer, and the sizes of the pieces
  const weft::ByteView all(data, size);
  const weft::ByteView head = all.first(std::min(header, size));
  const weft::ByteView bytes = all.subspan(head.size());
  const weft::daemon::server::Peer peer = read_peer(head.empty() ? 3 : head[0]);
  SmallDaemon in_pieces(peer), at_once(peer);
  const bool all_received = in_pieces.on_message(bytes, head.empty() ? head : head.subspan(1));
  if (all_received && at_once.on_message(bytes, {}))
    demand(in_pieces.reported() == at_once.reported(), "where a read ends changes nothing");
  demand(peer.role || !in_pieces.any_result(), "nothing is told to whoever may not ask");
  return 0;
}

}  // namespace weft::fuzz::rpc_lines_target
