#include "daemon/service/rpc/leases.hpp"

#include <algorithm>

namespace weft::daemon::access {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t shortest_reason = 3;

Status check_ttl(milliseconds ttl) {
  if (ttl >= Leases::shortest && ttl <= Leases::longest) return {};
  return fail({.code = Errc::range,
               .where = "/params/ttl_ms",
               .what = "time to live out of range",
               .expected = std::to_string(Leases::shortest.count()) + " to " +
                           std::to_string(Leases::longest.count()),
               .got = std::to_string(ttl.count()),
               .hint = "Renew the lease before it expires"});
}

bool is_over(const Lease& lease, Leases::Clock now) {
  return lease.expires <= now && lease.kept_for.empty();
}

tl::unexpected<Error> held(const Lease& lease, Leases::Clock now) {
  const auto left_s = std::chrono::duration<double>(lease.expires - now).count();
  const std::string until =
      lease.kept_for.empty() ? "for another " + std::to_string(static_cast<long>(left_s) + 1) + " s"
                             : "until " + lease.kept_for + " ends";
  return fail(
      {.code = Errc::wrong_state,
       .where = lease.scope,
       .what = lease.scope + " already leased",
       .got = lease.user + " " + until + (lease.note.empty() ? "" : " (" + lease.note + ")"),
       .hint = "Wait, ask that user to release it, or call lease.break with a reason"});
}

}  // namespace

Result<Lease> Leases::acquire(const Request& requested, Clock now) {
  if (Status ok = check_ttl(requested.ttl); !ok) return pass(ok.error());
  // A run may keep a lease beside another user's.
  for (const auto& [known_id, lease] : by_id_)
    if (lease.scope == requested.scope && !is_over(lease, now) &&
        (lease.expires > now || lease.user != requested.user))
      return held(lease, now);
  for (auto& [known_id, lease] : by_id_) {
    if (lease.scope != requested.scope || is_over(lease, now)) continue;
    lease.session = requested.session;
    lease.note = requested.note;
    lease.expires = lease.journalled = now + requested.ttl;
    return lease;
  }
  const std::string id = "L-" + epoch_ + "-" + std::to_string(next_++);
  return by_id_
      .insert_or_assign(id, Lease{id, requested.scope, requested.user, requested.session,
                                  requested.note, now + requested.ttl, now + requested.ttl})
      .first->second;
}

Result<Lease> Leases::find(std::string_view id, std::string_view user, Clock now) const {
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || is_over(found->second, now))
    return fail({.code = Errc::not_found,
                 .where = "/params/lease",
                 .what = "lease unknown or expired",
                 .got = std::string(id),
                 .hint = "Acquire a lease with lease.acquire"});
  if (found->second.user != user)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/lease",
                 .what = "lease belongs to another user",
                 .expected = std::string(user),
                 .got = found->second.user,
                 .hint = "Acquire your own lease"});
  return found->second;
}

Result<Lease> Leases::renew(std::string_view id, std::string_view user, milliseconds ttl,
                            Clock now) {
  if (Status ok = check_ttl(ttl); !ok) return pass(ok.error());
  auto lease = find(id, user, now);
  if (!lease) return lease;
  if (const auto other = holder(lease->scope, now); other && other->id != lease->id)
    return held(*other, now);
  lease->expires = now + ttl;
  by_id_.find(id)->second.expires = lease->expires;
  return lease;
}

bool Leases::should_journal(std::string_view id) {
  constexpr std::chrono::seconds worth_a_line{1};
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || found->second.expires - found->second.journalled < worth_a_line)
    return false;
  found->second.journalled = found->second.expires;
  return true;
}

Result<Lease> Leases::release(std::string_view id, std::string_view user, Clock now) {
  auto lease = find(id, user, now);
  if (!lease) return lease;
  if (lease->kept_for.empty())
    by_id_.erase(lease->id);
  else
    by_id_.find(id)->second.expires = now;
  return lease;
}

std::optional<Lease> Leases::keep(std::string_view run, const Request& owner, Clock now) {
  if (kept_for(run) || broken_for_ == run) return std::nullopt;
  for (auto& [id, lease] : by_id_)
    if (lease.scope == owner.scope && lease.user == owner.user && !is_over(lease, now)) {
      lease.kept_for = run;
      return lease;
    }
  const std::string id = "L-" + epoch_ + "-" + std::to_string(next_++);
  return by_id_
      .insert_or_assign(id, Lease{id, owner.scope, owner.user, owner.session, owner.note, now, now,
                                  std::string(run)})
      .first->second;
}

std::optional<Lease> Leases::end_keeping(std::string_view run, Clock now) {
  if (broken_for_ == run) broken_for_.clear();
  const auto found =
      std::ranges::find(by_id_, run, [](const auto& entry) { return entry.second.kept_for; });
  if (found == by_id_.end()) return std::nullopt;
  found->second.kept_for.clear();
  Lease lease = found->second;
  if (is_over(lease, now)) by_id_.erase(found);
  return lease;
}

std::optional<Lease> Leases::kept_for(std::string_view run) const {
  for (const auto& [id, lease] : by_id_)
    if (lease.kept_for == run) return lease;
  return std::nullopt;
}

Result<Lease> Leases::break_lease(std::string_view id, std::string_view reason, Clock now) {
  if (reason.size() < shortest_reason)
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/reason",
                 .what = "reason missing or too short",
                 .expected = "at least " + std::to_string(shortest_reason) + " characters",
                 .got = std::string(reason)});
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || is_over(found->second, now))
    return fail({.code = Errc::not_found,
                 .where = "/params/lease",
                 .what = "lease unknown or expired",
                 .got = std::string(id)});
  Lease over = found->second;
  if (!over.kept_for.empty()) broken_for_ = over.kept_for;
  by_id_.erase(found);
  return over;
}

Result<Lease> Leases::check(std::string_view id, std::string_view scope, std::string_view user,
                            Clock now) const {
  auto lease = find(id, user, now);
  if (lease && lease->scope != scope)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/lease",
                 .what = "lease has another scope",
                 .expected = std::string(scope),
                 .got = lease->scope});
  return lease;
}

std::optional<Lease> Leases::holder(std::string_view scope, Clock now) const {
  for (const auto& [id, lease] : by_id_)
    if (lease.scope == scope && lease.expires > now) return lease;
  return std::nullopt;
}

std::vector<Lease> Leases::all(Clock now) const {
  std::vector<Lease> out;
  for (const auto& [id, lease] : by_id_)
    if (!is_over(lease, now)) out.push_back(lease);
  return out;
}

std::vector<Lease> Leases::expire(Clock now) {
  std::vector<Lease> over;
  std::erase_if(by_id_, [&](const auto& entry) {
    const bool done = is_over(entry.second, now);
    if (done) over.push_back(entry.second);
    return done;
  });
  return over;
}

}  // namespace weft::daemon::access
