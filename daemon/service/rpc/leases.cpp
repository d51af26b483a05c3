#include "daemon/service/rpc/leases.hpp"

#include <algorithm>

namespace weft::daemon::access {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t shortest_reason = 3;

Status check_ttl(milliseconds ttl) {
  if (ttl >= Leases::shortest && ttl <= Leases::longest) return {};
  return fail(
      Errc::range, "time to live out of range", "/params/ttl_ms",
      std::to_string(Leases::shortest.count()) + " to " + std::to_string(Leases::longest.count()),
      std::to_string(ttl.count()), "Renew it as long as it is needed");
}

tl::unexpected<Error> held(const Lease& lease, Leases::Clock now) {
  const auto left_s = std::chrono::duration<double>(lease.expires - now).count();
  return fail(Errc::wrong_state, lease.scope + " is leased", lease.scope, {},
              lease.user + " for another " + std::to_string(static_cast<long>(left_s) + 1) + " s" +
                  (lease.note.empty() ? "" : " (" + lease.note + ")"),
              "Wait, ask them, or lease.break with a reason");
}

}  // namespace

Result<Lease> Leases::acquire(const Asked& asked, Clock now) {
  if (Status ok = check_ttl(asked.ttl); !ok) return pass(ok.error());
  if (const auto other = holder(asked.scope, now)) return held(*other, now);
  const std::string id = "L-" + epoch_ + "-" + std::to_string(next_++);
  return by_id_
      .insert_or_assign(id, Lease{id, asked.scope, asked.user, asked.session, asked.note,
                                  now + asked.ttl, now + asked.ttl})
      .first->second;
}

Result<Lease*> Leases::mine(std::string_view id, std::string_view user, Clock now) {
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || found->second.expires <= now)
    return fail(Errc::not_found, "no such lease, or its time is over", "/params/lease", {},
                std::string(id), "lease.acquire gives a new one");
  if (found->second.user != user)
    return fail(Errc::wrong_state, "somebody else's lease", "/params/lease", std::string(user),
                found->second.user);
  return &found->second;
}

Result<Lease> Leases::renew(std::string_view id, std::string_view user, milliseconds ttl,
                            Clock now) {
  if (Status ok = check_ttl(ttl); !ok) return pass(ok.error());
  auto lease = mine(id, user, now);
  if (!lease) return pass(lease.error());
  (*lease)->expires = now + ttl;
  return **lease;
}

bool Leases::is_to_be_noted(std::string_view id) {
  constexpr std::chrono::seconds worth_a_line{1};
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || found->second.expires - found->second.noted < worth_a_line)
    return false;
  found->second.noted = found->second.expires;
  return true;
}

Result<Lease> Leases::release(std::string_view id, std::string_view user, Clock now) {
  const auto lease = mine(id, user, now);
  if (!lease) return pass(lease.error());
  Lease over = **lease;
  by_id_.erase(over.id);
  return over;
}

Result<Lease> Leases::break_lease(std::string_view id, std::string_view reason, Clock now) {
  if (reason.size() < shortest_reason)
    return fail(Errc::invalid_argument, "a broken lease needs a reason", "/params/reason",
                "a few words", std::string(reason));
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || found->second.expires <= now)
    return fail(Errc::not_found, "no such lease, or its time is over", "/params/lease", {},
                std::string(id));
  Lease over = found->second;
  by_id_.erase(found);
  return over;
}

Result<Lease> Leases::check(std::string_view id, std::string_view scope, std::string_view user,
                            Clock now) const {
  const auto found = by_id_.find(id);
  if (found == by_id_.end() || found->second.expires <= now)
    return fail(Errc::not_found, "no such lease, or its time is over", "/params/lease", {},
                std::string(id), "lease.acquire gives a new one");
  const Lease& lease = found->second;
  if (lease.user != user)
    return fail(Errc::wrong_state, "somebody else's lease", "/params/lease", std::string(user),
                lease.user);
  if (lease.scope != scope)
    return fail(Errc::wrong_state, "a lease of something else", "/params/lease", std::string(scope),
                lease.scope);
  return lease;
}

std::optional<Lease> Leases::holder(std::string_view scope, Clock now) const {
  const auto found = std::find_if(by_id_.begin(), by_id_.end(), [&](const auto& entry) {
    return entry.second.scope == scope && entry.second.expires > now;
  });
  if (found == by_id_.end()) return std::nullopt;
  return found->second;
}

std::vector<Lease> Leases::all(Clock now) const {
  std::vector<Lease> out;
  for (const auto& [id, lease] : by_id_)
    if (lease.expires > now) out.push_back(lease);
  return out;
}

std::vector<Lease> Leases::expire(Clock now) {
  std::vector<Lease> over;
  for (auto it = by_id_.begin(); it != by_id_.end();) {
    const bool done = it->second.expires <= now;
    if (done) over.push_back(it->second);
    it = done ? by_id_.erase(it) : std::next(it);
  }
  return over;
}

}  // namespace weft::daemon::access
