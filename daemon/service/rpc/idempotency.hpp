#pragma once
// Answers to changes that were requested with a key. A client that lost the reply repeats the
// request and gets the same answer, also after a restart of the daemon. Source:
// docs/reference/api.md, `idem`.

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

/// A request with a key, as stored over restarts.
struct StoredAnswer {
  std::string name;   ///< combines user and key
  std::string token;  ///< name of the token that the user came with; empty: none
  std::string fingerprint;
  std::int64_t requested_us = 0;        ///< UTC
  std::optional<rpc::Outcome> outcome;  ///< empty: the daemon ended before there was an outcome
};

/// Storage of answers, in the order of their requests; empty functions store nothing.
struct AnswerMemory {
  std::function<std::int64_t()> utc_us;
  std::function<void(const StoredAnswer&)> requested;
  std::function<void(const std::string& name, const rpc::Outcome&)> answered;
  std::function<void(const std::string& name)> forgotten;
  /// Returns the stored answer; empty if there is none or it cannot be read. If set, stored answers
  /// take no memory.
  std::function<std::optional<rpc::Outcome>(const std::string& name)> load = {};
};

class AnswerStore;

class IdempotencyCache {
 public:
  /// Limit per user and per token that acts for the user. One user's keys never displace another's,
  /// nor do those of an observer token displace those of its maker.
  static constexpr std::size_t most_stored = 4096;
  /// Keys are kept this long.
  static constexpr std::chrono::hours longest_stored{7 * 24};

  enum class Found {
    fresh,
    answered,
    under_way,
    other_request,
    cut_short  ///< the daemon ended during the request: it is unknown whether it was executed
  };
  struct Lookup {
    Found found = Found::fresh;
    std::optional<rpc::Outcome> outcome;  ///< only with Found::answered
  };
  /// Loads `stored_answers` (oldest first), and stores new answers in `memory` from now on.
  void remember_in(AnswerMemory memory, std::vector<StoredAnswer> stored_answers);
  /// As above, in `store`, which must outlive the cache. Answers that the disk refuses are kept in
  /// memory only.
  void remember_in(AnswerStore& store, std::function<std::int64_t()> utc_us);
  /// Looks up a key of a user; no user reads another's answer. `fingerprint`: digest of method and
  /// parameters. A fresh key is under way from now on. `persistent`: also over restarts. `token`:
  /// as in StoredAnswer.
  Lookup lookup(std::string_view user, std::string_view key, std::string_view fingerprint,
                bool persistent = true, std::string_view token = {});
  void answered(std::string_view user, std::string_view key, const rpc::Outcome& outcome);

 private:
  using Ages = std::list<std::string>;  ///< names of entries, oldest first
  struct Entry {
    std::string fingerprint;
    std::optional<rpc::Outcome> outcome;
    std::string token = {};
    Ages::iterator age = {};
    std::int64_t requested_us = 0;
    bool is_persisted = false, is_of_before = false;
    bool is_outcome_stored = false;  ///< `outcome` is only in the memory's store
  };
  using Entries = std::map<std::string, Entry, std::less<>>;
  void put(std::string name, Entry entry);
  [[nodiscard]] Lookup find(const std::string& name, const Entry& entry) const;
  /// Drops the outcome from memory if the store has it.
  void release_outcome(const std::string& name, Entry& entry) const;
  void forget(Entries::iterator entry);
  void forget_old();
  void forget_old(Ages& ages);

  AnswerMemory memory_;
  Entries entries_;                                // by user and key
  std::map<std::string, Ages, std::less<>> ages_;  // by user and token
};

/// Error for a key that has no answer to return.
rpc::RpcError key_in_use(IdempotencyCache::Found found, const std::string& key);

/// Stored answers to requests with a key: table `answer` of weftd.sqlite. Thread: the server's.
/// Errors: io, also if the file was moved or removed; corrupt.
class AnswerStore {
 public:
  /// `database` must outlive the store and have the table (RunStore::open()).
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
