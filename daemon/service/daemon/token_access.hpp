#pragma once
// The daemon's tokens, and what the journal says of them: a file that cannot be read, and tokens
// that were refused.

#include <chrono>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/run_model/rig_state.hpp"

namespace weft::daemon::server {

/// Used by one thread. Time is an argument; any monotonic origin.
class TokenAccess {
 public:
  using Journal = std::function<void(std::string_view kind, const nlohmann::json& payload)>;
  TokenAccess(access::TokenKeeper tokens, Journal journal)
      : tokens_(std::move(tokens)), journal_(std::move(journal)) {}

  [[nodiscard]] access::TokenKeeper& keeper() { return tokens_; }
  /// Errors: wrong_state, in one wording for all that can be wrong with a token.
  Result<TokenOwner> owner(std::string_view token, std::int64_t utc_us);
  /// Journalled as "token.refused" with the address and how many, once in RepeatedStops::window
  /// for an address; those of many addresses are counted together.
  void on_refused(std::string_view address, Clock now);
  /// Call often: a token that was removed ends what it was good for within a second.
  void tick(Clock now);
  /// Reads the file now. Errors: TokenFile::load()'s; the tokens are as before then.
  Status reload();
  /// The daemon ends: journals the refusals that are still being counted.
  void close() { journal_refused(refused_.take()); }

 private:
  void journal_refused(const std::vector<runs::RepeatedStops::Counted>& counted);

  access::TokenKeeper tokens_;
  Journal journal_;
  std::optional<Clock> refreshed_;
  bool is_unreadable_ = false;  ///< and the journal says so
  runs::RepeatedStops refused_;
};

}  // namespace weft::daemon::server
