#include "daemon/service/rpc/idempotency.hpp"

#include <charconv>

#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::access {
namespace {

// The length keeps "a" + "bc" and "ab" + "c" apart.
std::string name_of(std::string_view user, std::string_view more) {
  return std::to_string(user.size()).append(":").append(user).append(more);
}

/// The user in a name made by name_of().
std::string_view user_of(std::string_view name) {
  const std::size_t colon = name.find(':');
  std::size_t length = 0;
  std::from_chars(name.data(), name.data() + colon, length);
  return name.substr(colon + 1, length);
}

/// Outcome in the columns `result` and `error` of a row; empty if both are null.
std::optional<rpc::Outcome> outcome_in(const sqlite::Statement& row, int result, int error) {
  if (!row.is_null(error)) return tl::unexpected(rpc::error_from_json(row.text(error)));
  if (!row.is_null(result)) return row.text(result);
  return std::nullopt;
}

}  // namespace

void IdempotencyCache::remember_in(AnswerMemory memory, std::vector<StoredAnswer> stored_answers) {
  memory_ = std::move(memory);
  for (StoredAnswer& one : stored_answers) {
    Entry entry{std::move(one.fingerprint),
                std::move(one.outcome),
                std::move(one.token),
                {},
                one.requested_us,
                true,
                true};
    release_outcome(one.name, entry);
    put(std::move(one.name), std::move(entry));
  }
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
    if (found->second.fingerprint != fingerprint) return {Found::other_request, {}};
    return find(found->first, found->second);
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

IdempotencyCache::Lookup IdempotencyCache::find(const std::string& name, const Entry& entry) const {
  const auto outcome = entry.is_outcome_stored ? memory_.load(name) : entry.outcome;
  if (outcome) return {Found::answered, outcome};
  const bool is_lost = entry.is_of_before || entry.is_outcome_stored;
  return {is_lost ? Found::cut_short : Found::under_way, {}};
}

void IdempotencyCache::release_outcome(const std::string& name, Entry& entry) const {
  if (!entry.outcome || !entry.is_persisted || !memory_.load || !memory_.load(name)) return;
  entry.is_outcome_stored = true;
  entry.outcome.reset();
}

void IdempotencyCache::answered(std::string_view user, std::string_view key,
                                const rpc::Outcome& outcome) {
  const auto found = entries_.find(name_of(user, key));
  if (found == entries_.end()) return;
  // Retryable errors are not kept, so that a retry is executed. The same applies to errors of a
  // lease: a retry may have another one.
  if (!outcome && (outcome.error().retryable || outcome.error().kind.starts_with("lease.")))
    return forget(found);
  found->second.outcome = outcome;
  if (found->second.is_persisted && memory_.answered) memory_.answered(found->first, outcome);
  release_outcome(found->first, found->second);
}

rpc::RpcError key_in_use(IdempotencyCache::Found found, const std::string& key) {
  using Found = IdempotencyCache::Found;
  using rpc::rpc_error;
  if (found == Found::cut_short)
    return rpc_error(
        rpc::code::request + 10, "idem.cut_short",
        {.code = Errc::wrong_state,
         .where = "/params/idem",
         .what = "result of the request with this key unknown after a daemon restart",
         .got = key,
         .hint = "Check run.list or log.tail, then repeat the request with a new key"});
  const bool waits = found == Found::under_way;
  return rpc_error(rpc::code::request + 9, "idem.reused",
                   {.code = Errc::wrong_state,
                    .where = "/params/idem",
                    .what = waits ? "request with this key still in progress"
                                  : "idempotency key already used for another request",
                    .got = key,
                    .hint = "Use a new key for each new change"},
                   waits);
}

Result<std::vector<StoredAnswer>> AnswerStore::answers() {
  std::vector<StoredAnswer> out;
  const Status read = database_->each(
      "SELECT name, token, fingerprint, asked_us, result, error FROM answer ORDER BY number",
      [&](const sqlite::Statement& row) {
        out.push_back(
            {row.text(0), row.text(1), row.text(2), row.integer(3), outcome_in(row, 4, 5)});
      });
  if (!read) return pass(read.error());
  return out;
}

std::optional<rpc::Outcome> AnswerStore::answer(std::string_view name) {
  auto row = database_->prepare("SELECT result, error FROM answer WHERE name = ?");
  if (!row) return std::nullopt;
  const auto found = row->bind(1, name).step();
  return found && *found ? outcome_in(*row, 0, 1) : std::nullopt;
}

Status AnswerStore::persist(const StoredAnswer& requested) {
  auto insert = database_->prepare_to_write(
      "INSERT OR REPLACE INTO answer (name, token, fingerprint, asked_us) VALUES (?, ?, ?, ?)");
  if (!insert) return pass(insert.error());
  return insert->run(requested.name, requested.token, requested.fingerprint,
                     requested.requested_us);
}

Status AnswerStore::persist_outcome(std::string_view name, const rpc::Outcome& outcome) {
  auto change = database_->prepare_to_write(outcome ? "UPDATE answer SET result = ? WHERE name = ?"
                                                    : "UPDATE answer SET error = ? WHERE name = ?");
  if (!change) return pass(change.error());
  const std::string text = outcome ? *outcome : rpc::to_json(outcome.error());
  return change->run(text, name);
}

Status AnswerStore::forget_answer(std::string_view name) {
  auto change = database_->prepare_to_write("DELETE FROM answer WHERE name = ?");
  if (!change) return pass(change.error());
  return change->run(name);
}

void IdempotencyCache::remember_in(AnswerStore& store, std::function<std::int64_t()> utc_us) {
  auto stored_answers = store.answers();
  remember_in(
      {.utc_us = std::move(utc_us),
       .requested = [&store](const StoredAnswer& one) { static_cast<void>(store.persist(one)); },
       .answered =
           [&store](const std::string& name, const rpc::Outcome& outcome) {
             static_cast<void>(store.persist_outcome(name, outcome));
           },
       .forgotten =
           [&store](const std::string& name) { static_cast<void>(store.forget_answer(name)); },
       .load = [&store](const std::string& name) { return store.answer(name); }},
      stored_answers ? std::move(*stored_answers) : std::vector<StoredAnswer>{});
}

}  // namespace weft::daemon::access
