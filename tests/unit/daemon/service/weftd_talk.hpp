#pragma once
// One client's session with the daemon's own methods, without sockets.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/service/methods/services.hpp"
#include "daemon/service/rpc/session.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace weft::daemon::test {

/// A daemon with the test's clock, and one client of it.
struct Talk {
  explicit Talk(server::Peer peer = {true, "ada", access::Role::admin});
  ~Talk();
  Talk(const Talk&) = delete;
  Talk& operator=(const Talk&) = delete;

  /// The last message in reply to a line, an answer or an event.
  nlohmann::json on_message(const std::string& line);
  nlohmann::json query(const std::string& method);
  nlohmann::json query(const std::string& method, const nlohmann::json& params);
  static std::string kind_of(const nlohmann::json& answer);
  [[nodiscard]] bool is_latched() const;
  void reset();
  std::vector<runs::JournalLine> lines();

  TemporaryFolder folder;
  RunManagerBench bench{folder, tiny_recipe(1)};
  server::Clock now{};
  server::Hub hub;
  access::Leases leases{"e1"};
  access::IdempotencyCache answered;
  BenchPace pace = 0;
  LiveFrameSampler frame_sampler;
  server::Shared shared;
  api::Services services;
  rpc::Methods methods;
  std::vector<rpc::Responder> unanswered;
  std::vector<std::string> reply;
  std::unique_ptr<server::Session> client;
};

/// Parameters of session.open.
const nlohmann::json& introduction();

}  // namespace weft::daemon::test
