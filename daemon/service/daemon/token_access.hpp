#pragma once
// The daemon's tokens and their journal lines: a token file that cannot be read, and refused
// tokens.

#include <chrono>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/run_model/rig_state.hpp"

namespace weft::daemon::server {

/// Thread: one. Time is an argument; any monotonic origin.
class TokenAccess {
 public:
  using Journal = std::function<void(std::string_view kind, const nlohmann::json& payload)>;
  TokenAccess(access::TokenKeeper tokens, Journal journal)
      : tokens_(std::move(tokens)), journal_(std::move(journal)) {}

  [[nodiscard]] access::TokenKeeper& keeper() { return tokens_; }
  /// Errors: wrong_state, with one wording for every defect of a token.
  Result<TokenOwner> owner(std::string_view token, std::int64_t utc_us);
  /// Journals "token.refused" with the address and the count, once per RepeatedStops::window and
  /// address. Refusals of many addresses are counted together.
  void on_refused(std::string_view address, Clock now);
  /// Call often: the removal of a token takes effect within one second.
  void tick(Clock now);
  /// Reads the file now. Errors: those of TokenFile::load(); the tokens then stay unchanged.
  Status reload();
  /// Call when the daemon ends: journals the refusals that are still being counted.
  void close() { journal_refused(refused_.take()); }

 private:
  void journal_refused(const std::vector<runs::RepeatedStops::Counted>& counted);

  access::TokenKeeper tokens_;
  Journal journal_;
  std::optional<Clock> refreshed_;
  bool is_unreadable_ = false;  ///< and the journal has a line about it
  runs::RepeatedStops refused_;
};

}  // namespace weft::daemon::server
