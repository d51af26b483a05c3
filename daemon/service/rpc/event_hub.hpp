#pragma once
// Events for whoever listens: a snapshot, then deltas, numbered without gaps since the daemon
// began. A listener that is slow loses events of its own, counted and told; nobody else's and not
// the run's. Source: docs/api.md, Events.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/rpc/message.hpp"

namespace weft::daemon::server {

using Clock = std::chrono::nanoseconds;  ///< monotonic, any origin

enum class Mode : std::uint8_t {
  latest,  ///< deltas of a topic are merged until they can be sent: cannot grow
  every    ///< in order, at most `most_waiting` beside what is replayed; what does not fit is a gap
           ///< that is told
};

struct SubscriptionRequest {
  std::vector<std::string> topics;  ///< "run:R-000318", or "run:*" for all that begin so
  Mode mode = Mode::latest;
  double max_hz = 20;  ///< of `latest`; 0: as fast as it can be sent
  /// So many events are sent until more are granted; left out: all.
  std::optional<std::uint64_t> credit = {};
};

struct Event;  // one numbered delta

/// One subscription. Events are taken, not pushed: a client that reads nothing costs one bound.
class Subscription {
 public:
  static constexpr std::size_t most_waiting = 1024;
  static constexpr std::uint64_t most_credit = 1'000'000;  ///< [events]

  Subscription(std::string id, SubscriptionRequest request);
  ~Subscription();

  [[nodiscard]] const std::string& id() const { return id_; }
  [[nodiscard]] bool wants(std::string_view topic) const;
  /// The next event's params as JSON, or empty when there is none to send at `now`.
  std::string take(Clock now);
  /// What may still be sent; nothing where all may be.
  [[nodiscard]] std::optional<std::uint64_t> credit() const { return request_.credit; }
  /// Lets more be sent. Errors: wrong_state, of one that was opened without credit.
  Status grant(std::uint64_t events);

 private:
  friend class Hub;
  std::string taken(Clock now);
  void offer(const std::shared_ptr<const Event>& event);

  std::string id_;
  SubscriptionRequest request_;
  /// Every: those of before it was opened, at most Hub::most_replayed, the oldest first.
  std::deque<std::shared_ptr<const Event>> replayed_;
  std::deque<std::shared_ptr<const Event>> waiting_;      // every, after these
  std::map<std::string, std::shared_ptr<Event>> merged_;  // latest, by topic
  std::uint64_t dropped_ = 0;                             // since the last event that was taken
  Clock not_before_{};
};

struct Opened {
  std::shared_ptr<Subscription> subscription;
  std::uint64_t seq = 0;      ///< the newest event's, which the snapshot has in it
  std::string snapshot_json;  ///< by topic
  /// Topics whose state had no room in the snapshot: those that changed longest ago [count].
  std::size_t left_off = 0;
};

/// Used by the server's thread alone.
class Hub {
 public:
  /// Events that can be had again [count].
  static constexpr std::size_t most_replayed = 8192;
  /// Of a snapshot, so that a client reads it as one line however many runs there were.
  static constexpr std::size_t most_snapshot_bytes = std::size_t{1} << 20;

  /// What changed about a topic: an RFC 7386 merge patch of its snapshot.
  void publish(std::string_view topic, const nlohmann::json& delta, std::int64_t t_us);

  /// The topic's snapshot takes no memory from here on: `archive` has it.
  void forget(std::string_view topic);
  /// Topics of one kind that may have been forgotten, or not been published since the daemon began.
  struct Archive {
    std::string prefix;  ///< of their names, "run:"
    /// The snapshot of one; nothing where there is no such topic.
    std::function<std::optional<nlohmann::json>(std::string_view topic)> find;
    std::function<std::size_t()> count;  ///< of all, whether forgotten or not
  };
  void archive_in(Archive archive) { archive_ = std::move(archive); }
  /// To who listens now and nobody later: part of no snapshot, and not to be had again.
  void pass_on(std::string_view topic, const nlohmann::json& delta, std::int64_t t_us);
  /// Whether anybody listens to this topic.
  [[nodiscard]] bool wanted(std::string_view topic) const;

  Opened open(const SubscriptionRequest& request);
  /// Instead of a snapshot all events after `from_seq`; mode `every`. Errors: "replay.gone", where
  /// some of them are not kept any more.
  tl::expected<Opened, rpc::RpcError> replay(const SubscriptionRequest& request,
                                             std::uint64_t from_seq);

  [[nodiscard]] std::uint64_t seq() const { return seq_; }
  [[nodiscard]] std::size_t listeners() const;
  /// Called after each publish(): somebody may have something to send.
  void on_news(std::function<void()> news) { news_ = std::move(news); }

 private:
  std::shared_ptr<Subscription> add(const SubscriptionRequest& request);
  /// Adds topics by name that only the archive has, and counts those that a pattern for all of them
  /// leaves to it.
  void open_archived(const SubscriptionRequest& request, Opened& opened) const;
  void offer(const std::shared_ptr<const Event>& event);

  std::uint64_t seq_ = 0;
  std::uint64_t next_id_ = 1;
  std::map<std::string, std::unique_ptr<nlohmann::json>, std::less<>> snapshots_;
  std::map<std::string, std::uint64_t, std::less<>> changed_;  // by topic: the newest event
  std::deque<std::shared_ptr<const Event>> recent_;
  std::uint64_t forgotten_ = 0;  // the newest event that is not in recent_ any more
  std::list<std::weak_ptr<Subscription>> subscriptions_;
  std::function<void()> news_;
  Archive archive_;
};

}  // namespace weft::daemon::server
