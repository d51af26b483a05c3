#pragma once
// Who holds what, until when. A lease says that its holder means to move a rig; reading needs none.
// Source: docs/api.md, Leases; the model is OPC UA DI's InitLock, RenewLock, ExitLock, BreakLock.

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
  std::chrono::nanoseconds journalled{};  ///< when it ends as the journal has it
  /// The run of its user that is under way: until that ends it does not expire, released or not.
  std::string kept_for = {};
};

/// Time is an argument; any monotonic origin.
class Leases {
 public:
  using Clock = std::chrono::nanoseconds;
  /// `epoch`: of this start of the daemon. It is in their names, so that a lease of an earlier
  /// start is nobody's now.
  explicit Leases(std::string epoch) : epoch_(std::move(epoch)) {}

  static constexpr std::chrono::milliseconds shortest{1000}, longest{3'600'000};

  struct Request {
    std::string scope, user, session, note;
    std::chrono::milliseconds ttl{15000};
  };
  /// A lease that is kept for a run is given to its user again, in any session. Errors: range
  /// (ttl), wrong_state (held or kept: who, and for how long still).
  Result<Lease> acquire(const Request& requested, Clock now);
  /// By its holder. Errors: not_found (never was, or is over), wrong_state (another's), range.
  Result<Lease> renew(std::string_view id, std::string_view user, std::chrono::milliseconds ttl,
                      Clock now);
  /// Whether it ends a second or more later than was noted of it; then it counts as noted.
  bool should_journal(std::string_view id);
  /// One that is kept for a run ends with that run.
  Result<Lease> release(std::string_view id, std::string_view user, Clock now);
  /// The run begins: its user's lease, or a new one, is kept until it ends. Nothing: it is kept
  /// already, or was broken.
  std::optional<Lease> keep(std::string_view run, const Request& owner, Clock now);
  /// The run is over. The lease that was kept for it, if any; it is gone, where its time is over.
  std::optional<Lease> end_keeping(std::string_view run, Clock now);
  [[nodiscard]] std::optional<Lease> kept_for(std::string_view run) const;
  /// By anybody who may, with a reason of at least three letters.
  Result<Lease> break_lease(std::string_view id, std::string_view reason, Clock now);

  /// That `id` is a lease on `scope` of this user's. Errors as renew().
  Result<Lease> check(std::string_view id, std::string_view scope, std::string_view user,
                      Clock now) const;
  /// Who holds it now; leases that are only kept do not count.
  [[nodiscard]] std::optional<Lease> holder(std::string_view scope, Clock now) const;
  [[nodiscard]] std::vector<Lease> all(Clock now) const;
  /// Those whose time is over and that are not kept, taken out.
  std::vector<Lease> expire(Clock now);

 private:
  /// Errors: as renew(), but for range.
  [[nodiscard]] Result<Lease> find(std::string_view id, std::string_view user, Clock now) const;

  std::map<std::string, Lease, std::less<>> by_id_;
  std::string epoch_;
  std::string broken_for_;  ///< the run under way whose lease was broken: it is not kept anew
  std::uint64_t next_ = 1;
};

}  // namespace weft::daemon::access
