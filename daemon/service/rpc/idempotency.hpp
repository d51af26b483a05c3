#pragma once
// Answers to changes that were asked for with a key: a client that lost the reply asks again and
// gets the same one, also from another start of the daemon. Source: docs/api.md, `idem`.

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/rpc/method.hpp"

namespace weft::daemon::sqlite {
class Database;
}  // namespace weft::daemon::sqlite

namespace weft::daemon::access {

/// A request with a key, as it outlives the daemon.
struct StoredAnswer {
  std::string name;   ///< of user and key
  std::string token;  ///< with which the user came; empty: with none
  std::string fingerprint;
  std::int64_t requested_us = 0;        ///< UTC
  std::optional<rpc::Outcome> outcome;  ///< nothing: the daemon ended before there was one
};

/// Where answers are kept, in the order in which they are asked for; empty functions keep nothing.
struct AnswerMemory {
  std::function<std::int64_t()> utc_us;
  std::function<void(const StoredAnswer&)> requested;
  std::function<void(const std::string& name, const rpc::Outcome&)> answered;
  std::function<void(const std::string& name)> forgotten;
  /// The answer that is kept; nothing where there is none, or it cannot be read. With it, answers
  /// that are kept take no memory.
  std::function<std::optional<rpc::Outcome>(const std::string& name)> load = {};
};

class AnswerStore;

class IdempotencyCache {
 public:
  /// Of each user, and of each token that acts for him: nobody's keys make room for another's, nor
  /// those of a token that may only look on for its maker's.
  static constexpr std::size_t most_stored = 4096;
  /// A key is not asked for again after so long.
  static constexpr std::chrono::hours longest_stored{7 * 24};

  enum class Found {
    fresh,
    answered,
    under_way,
    other_request,
    cut_short  ///< the daemon ended while it was under way: whether it was done is not known
  };
  struct Lookup {
    Found found = Found::fresh;
    std::optional<rpc::Outcome> outcome;  ///< where it is answered
  };
  /// What is told to `memory` from here on, and what it holds from before, the oldest first.
  void remember_in(AnswerMemory memory, std::vector<StoredAnswer> stored_answers);
  /// In `store`, which outlives the cache. What the disk refuses is known while the daemon runs.
  void remember_in(AnswerStore& store, std::function<std::int64_t()> utc_us);
  /// A key belongs to a user: nobody reads another's answer with it. `fingerprint`: of method and
  /// parameters. A fresh key is under way from here on. `persistent`: also over the daemon's end.
  /// `token`: StoredAnswer's.
  Lookup lookup(std::string_view user, std::string_view key, std::string_view fingerprint,
                bool persistent = true, std::string_view token = {});
  void answered(std::string_view user, std::string_view key, const rpc::Outcome& outcome);

 private:
  using Ages = std::list<std::string>;  ///< names of entries, the oldest first
  struct Entry {
    std::string fingerprint;
    std::optional<rpc::Outcome> outcome;
    std::string token = {};
    Ages::iterator age = {};
    std::int64_t requested_us = 0;
    bool is_persisted = false, is_of_before = false;
    bool is_outcome_stored = false;  ///< `outcome` is in the memory's store alone
  };
  using Entries = std::map<std::string, Entry, std::less<>>;
  void put(std::string name, Entry entry);
  [[nodiscard]] Lookup find(const std::string& name, const Entry& entry) const;
  /// Keeps the outcome in memory only if the store has not got it.
  void release_outcome(const std::string& name, Entry& entry) const;
  void forget(Entries::iterator entry);
  void forget_old();
  void forget_old(Ages& ages);

  AnswerMemory memory_;
  Entries entries_;                                // by user and key
  std::map<std::string, Ages, std::less<>> ages_;  // by user and token
};

/// Why a key that was found so gives no answer.
rpc::RpcError key_in_use(IdempotencyCache::Found found, const std::string& key);

/// Answers to requests with a key, in the daemon's file: they outlive the daemon.
/// Table `answer` of weftd.sqlite. Used by the server's thread. Errors: io, also where the file was
/// moved or removed; corrupt.
class AnswerStore {
 public:
  /// `database` outlives the store and has the table (RunStore::open()).
  explicit AnswerStore(sqlite::Database& database) : database_(&database) {}
  /// Oldest first.
  [[nodiscard]] Result<std::vector<StoredAnswer>> answers();
  [[nodiscard]] std::optional<rpc::Outcome> answer(std::string_view name);
  Status persist(const StoredAnswer& requested);
  Status persist_outcome(std::string_view name, const rpc::Outcome& outcome);
  Status forget_answer(std::string_view name);

 private:
  sqlite::Database* database_;
};

}  // namespace weft::daemon::access
