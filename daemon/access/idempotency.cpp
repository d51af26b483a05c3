#include "daemon/access/idempotency.hpp"

namespace weft::daemon::access {
namespace {

// Lengths keep "a" + "bc" and "ab" + "c" apart.
std::string name_of(std::string_view user, std::string_view key) {
  return std::to_string(user.size()).append(":").append(user).append(key);
}

}  // namespace

IdempotencyCache::Look IdempotencyCache::look(std::string_view user, std::string_view key,
                                              std::string_view fingerprint) {
  const std::string name = name_of(user, key);
  if (const auto found = entries_.find(name); found != entries_.end()) {
    if (found->second.fingerprint != fingerprint) return {Found::other_request, {}};
    if (!found->second.outcome) return {Found::under_way, {}};
    return {Found::answered, found->second.outcome};
  }
  by_age_.push_back(name);
  entries_.emplace(name, Entry{std::string(fingerprint), {}, std::prev(by_age_.end())});
  if (entries_.size() > most_kept) {
    entries_.erase(by_age_.front());
    by_age_.pop_front();
  }
  return {};
}

void IdempotencyCache::answered(std::string_view user, std::string_view key,
                                const rpc::Outcome& outcome) {
  const auto found = entries_.find(name_of(user, key));
  if (found == entries_.end()) return;
  // what may be tried again is not kept: the next try is a new one
  if (!outcome && outcome.error().retryable) {
    by_age_.erase(found->second.age);
    entries_.erase(found);
    return;
  }
  found->second.outcome = outcome;
}

}  // namespace weft::daemon::access
