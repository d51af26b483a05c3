#include "tests/unit/daemon/service/weftd_talk.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon::test {

using nlohmann::json;

Talk::Talk(server::Peer peer) {
  services.hub = &hub;
  services.leases = &leases;
  services.run_manager = bench.manager.get();
  services.log = &bench.store;
  services.rig = bench.request.rig;
  services.rig_name = "bench";
  services.recipes = services.data = folder.path();
  services.now = [this] { return now; };
  services.utc_us = [] { return std::int64_t{0}; };
  services.sessions = &shared.sessions;
  services.pace = &pace;
  services.frame_sampler = &frame_sampler;
  services.change_background = [](const auto& work, const auto&) {
    work()();
    return true;
  };
  services.background = services.change_background;
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
  shared.halt = [this](const rpc::Caller& caller) {
    bench.manager->halt(runs::RigState::Stop::halt, caller.session);
  };
  shared.emergency_stop = [this](const rpc::Caller& caller) {
    bench.manager->halt(runs::RigState::Stop::emergency, caller.session);
  };
  shared.token_owner = [](std::string_view token) -> Result<server::TokenOwner> {
    if (token == "good") return server::TokenOwner{"token:ada", access::Role::operator_};
    return fail({.code = Errc::wrong_state, .what = "no good"});
  };
  client = std::make_unique<server::Session>(
      shared, std::move(peer), "s-1",
      [this](std::string line) { reply.push_back(std::move(line)); });
}

Talk::~Talk() = default;

json Talk::on_message(const std::string& line) {
  reply.clear();
  client->on_message(line);
  return reply.empty() ? json() : json::parse(reply.back());
}

json Talk::query(const std::string& method) {
  return query(method, json::object());
}

json Talk::query(const std::string& method, const json& params) {
  return on_message(
      json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump());
}

std::string Talk::kind_of(const json& answer) {
  return answer.at("error").at("data").at("kind");
}

bool Talk::is_latched() const {
  return bench.manager->rig_state().is_latched();
}

void Talk::reset() {
  REQUIRE(bench.manager->reset("looked at it", "test"));
}

std::vector<runs::JournalLine> Talk::lines() {
  return bench.store.tail("", 10'000).value();
}

const json& introduction() {
  static const json params{{"client", "test"}};
  return params;
}

}  // namespace weft::daemon::test
