#pragma once
// One client's conversation with the daemon's own methods, without sockets.

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/api/services.hpp"
#include "daemon/server/conversation.hpp"
#include "tests/unit/daemon/desk_bench.hpp"

namespace weft::daemon::test {

using nlohmann::json;

/// A daemon whose clock is the test's, and one client of it.
struct Talk {
  explicit Talk(server::Peer peer = {true, "ada", access::Role::admin}) {
    services.hub = &hub;
    services.leases = &leases;
    services.desk = bench.desk.get();
    services.log = &bench.store;
    services.rig = bench.request.rig;
    services.rig_name = "bench";
    services.recipes = services.data = folder.path();
    services.now = [this] { return now; };
    services.utc_us = [] { return std::int64_t{0}; };
    services.sessions = &shared.sessions;
    services.pace = &pace;
    services.change_errand = [](const auto& work, const auto&) {
      work()();
      return true;
    };
    services.errand = services.change_errand;
    api::add_methods(methods, services);
    methods.add({"later.say", "", {}, {}, {}, ""},
                rpc::Handler([this](const rpc::Call&, rpc::Responder respond) {
                  unanswered.push_back(std::move(respond));
                }));
    shared.methods = &methods;
    shared.hub = &hub;
    shared.answered = &answered;
    shared.readiness_json = [this] { return api::readiness_json(services); };
    shared.now = services.now;
    shared.halt = [this](const rpc::Caller& caller) { bench.desk->halt(caller.session); };
    shared.emergency_stop = [this](const rpc::Caller& caller) {
      bench.desk->emergency_stop(caller.session);
    };
    shared.token_owner = [](std::string_view token) -> Result<server::TokenOwner> {
      if (token == "good") return server::TokenOwner{"token:ada", access::Role::operator_};
      return fail(Errc::wrong_state, "no good");
    };
    client = std::make_unique<server::Conversation>(
        shared, std::move(peer), "s-1",
        [this](std::string line) { said.push_back(json::parse(line)); });
  }
  json hear(const std::string& line) {
    said.clear();
    client->hear(line);
    return said.empty() ? json() : said.back();
  }
  json ask(const std::string& method, const json& params = json::object()) {
    return hear(json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump());
  }
  static std::string kind_of(const json& answer) {
    return answer.at("error").at("data").at("kind");
  }
  bool is_latched() const {
    return bench.desk->standing().fact == control::RigStanding::Fact::latched;
  }
  void reset() { REQUIRE(bench.desk->reset("looked at it", "test")); }
  std::vector<control::RunStore::Line> lines() { return bench.store.tail("", 10'000).value(); }

  TemporaryFolder folder;
  DeskBench bench{folder, tiny_recipe(1)};
  server::Clock now{};
  server::Hub hub;
  access::Leases leases{"e1"};
  access::IdempotencyCache answered;
  BenchPace pace = 0;
  server::Shared shared;
  api::Services services;
  rpc::Methods methods;
  std::vector<rpc::Responder> unanswered;
  std::vector<json> said;
  std::unique_ptr<server::Conversation> client;
};

inline const json introduction{{"client", "test"}};

}  // namespace weft::daemon::test
