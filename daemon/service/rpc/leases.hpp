#pragma once
// Holders of leases. A lease states that its user intends to control a rig; reading needs none.
// Source: docs/reference/api.md, Leases; the model is OPC UA DI's InitLock, RenewLock, ExitLock,
// BreakLock.

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::daemon::access {

struct Lease {
  std::string id;     ///< "L-9c1d40b2-7"
  std::string scope;  ///< "rig:bench-1"
  std::string user;
  std::string session;
  std::string note;
  std::chrono::nanoseconds expires{};     ///< on the clock of the calls' `now`
  std::chrono::nanoseconds journalled{};  ///< expiry as last journalled, on the same clock
  /// The user's active run: until it ends the lease does not expire, even if released.
  std::string kept_for = {};
};

/// Time is an argument; any monotonic origin.
class Leases {
 public:
  using Clock = std::chrono::nanoseconds;
  /// `epoch`: identifies this start of the daemon. Lease names contain it, so leases of earlier
  /// starts are invalid.
  explicit Leases(std::string epoch) : epoch_(std::move(epoch)) {}

  static constexpr std::chrono::milliseconds shortest{1000}, longest{3'600'000};

  struct Request {
    std::string scope, user, session, note;
    std::chrono::milliseconds ttl{15000};
  };
  /// A lease kept for a run is given to its user again, in any session. Errors: range (ttl),
  /// wrong_state (held or kept; with the user and the time left).
  Result<Lease> acquire(const Request& requested, Clock now);
  /// Extends the caller's lease. Errors: not_found (unknown or expired), wrong_state (another
  /// user's), range.
  Result<Lease> renew(std::string_view id, std::string_view user, std::chrono::milliseconds ttl,
                      Clock now);
  /// True if the lease expires at least 1 s later than last journalled; that expiry then counts as
  /// journalled.
  bool should_journal(std::string_view id);
  /// A lease that is kept for a run ends with that run.
  Result<Lease> release(std::string_view id, std::string_view user, Clock now);
  /// Call when the run starts: keeps its user's lease, or a new one, until the run ends. Empty: it
  /// is kept already, or was broken.
  std::optional<Lease> keep(std::string_view run, const Request& owner, Clock now);
  /// Call when the run has ended. Returns the lease that was kept for it, if any; removes it if it
  /// has expired.
  std::optional<Lease> end_keeping(std::string_view run, Clock now);
  [[nodiscard]] std::optional<Lease> kept_for(std::string_view run) const;
  /// Breaks any user's lease; the caller checks the permission. `reason`: at least three letters.
  Result<Lease> break_lease(std::string_view id, std::string_view reason, Clock now);

  /// Checks that `id` is this user's lease on `scope`. Errors: as renew().
  Result<Lease> check(std::string_view id, std::string_view scope, std::string_view user,
                      Clock now) const;
  /// The current lease; a lease that is only kept for a run does not count.
  [[nodiscard]] std::optional<Lease> holder(std::string_view scope, Clock now) const;
  [[nodiscard]] std::vector<Lease> all(Clock now) const;
  /// Removes and returns the leases that have expired and are not kept.
  std::vector<Lease> expire(Clock now);

 private:
  /// Errors: as renew(), except range.
  [[nodiscard]] Result<Lease> find(std::string_view id, std::string_view user, Clock now) const;

  std::map<std::string, Lease, std::less<>> by_id_;
  std::string epoch_;
  std::string broken_for_;  ///< the active run with a broken lease: none is kept for it again
  std::uint64_t next_ = 1;
};

}  // namespace weft::daemon::access
