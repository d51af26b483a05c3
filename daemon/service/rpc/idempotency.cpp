#include "daemon/service/rpc/idempotency.hpp"

#include <charconv>

namespace weft::daemon::access {
namespace {

// Lengths keep "a" + "bc" and "ab" + "c" apart.
std::string name_of(std::string_view user, std::string_view more) {
  return std::to_string(user.size()).append(":").append(user).append(more);
}

/// Of a name.
std::string_view user_of(std::string_view name) {
  const std::size_t colon = name.find(':');
  std::size_t length = 0;
  std::from_chars(name.data(), name.data() + colon, length);
  return name.substr(colon + 1, length);
}

}  // namespace

void IdempotencyCache::remember_in(AnswerMemory memory, std::vector<StoredAnswer> stored_answers) {
  memory_ = std::move(memory);
  for (StoredAnswer& one : stored_answers)
    put(std::move(one.name), {std::move(one.fingerprint),
                              std::move(one.outcome),
                              std::move(one.token),
                              {},
                              one.requested_us,
                              true,
                              true});
  forget_old();
}

void IdempotencyCache::put(std::string name, Entry entry) {
  Ages& ages = ages_[name_of(user_of(name), entry.token)];
  ages.push_back(name);
  entry.age = std::prev(ages.end());
  entries_.insert_or_assign(std::move(name), std::move(entry));
}

void IdempotencyCache::forget(Entries::iterator entry) {
  if (entry->second.is_persisted && memory_.forgotten) memory_.forgotten(entry->first);
  ages_.at(name_of(user_of(entry->first), entry->second.token)).erase(entry->second.age);
  entries_.erase(entry);
}

void IdempotencyCache::forget_old() {
  for (auto& [asker, ages] : ages_) forget_old(ages);
  std::erase_if(ages_, [](const auto& of_asker) { return of_asker.second.empty(); });
}

void IdempotencyCache::forget_old(Ages& ages) {
  while (ages.size() > most_stored) forget(entries_.find(ages.front()));
  if (!memory_.utc_us) return;
  const std::int64_t since =
      memory_.utc_us() -
      std::chrono::duration_cast<std::chrono::microseconds>(longest_stored).count();
  while (!ages.empty()) {
    const auto oldest = entries_.find(ages.front());
    if (oldest->second.requested_us >= since) return;
    forget(oldest);
  }
}

IdempotencyCache::Lookup IdempotencyCache::lookup(std::string_view user, std::string_view key,
                                                  std::string_view fingerprint, bool persistent,
                                                  std::string_view token) {
  forget_old();
  const std::string name = name_of(user, key);
  if (const auto found = entries_.find(name); found != entries_.end()) {
    const Entry& entry = found->second;
    if (entry.fingerprint != fingerprint) return {Found::other_request, {}};
    if (entry.outcome) return {Found::answered, entry.outcome};
    return {entry.is_of_before ? Found::cut_short : Found::under_way, {}};
  }
  Entry entry{std::string(fingerprint),
              {},
              std::string(token),
              {},
              memory_.utc_us ? memory_.utc_us() : 0,
              persistent};
  if (persistent && memory_.requested)
    memory_.requested({name, entry.token, entry.fingerprint, entry.requested_us, {}});
  put(name, std::move(entry));
  forget_old();
  return {};
}

void IdempotencyCache::answered(std::string_view user, std::string_view key,
                                const rpc::Outcome& outcome) {
  const auto found = entries_.find(name_of(user, key));
  if (found == entries_.end()) return;
  // What may be tried again is not kept: the next try is a new one. So is one with another lease.
  if (!outcome && (outcome.error().retryable || outcome.error().kind.starts_with("lease.")))
    return forget(found);
  found->second.outcome = outcome;
  if (found->second.is_persisted && memory_.answered) memory_.answered(found->first, outcome);
}

}  // namespace weft::daemon::access
