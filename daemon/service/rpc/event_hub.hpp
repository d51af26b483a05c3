#pragma once
// Events for subscribers: a snapshot, then deltas, numbered without gaps since the daemon started.
// A slow subscriber loses only its own events, which are counted and reported; the run is not
// affected. Source: docs/reference/api.md, Events.

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
  latest,  ///< deltas of a topic are merged until they can be sent; bounded
  every    ///< in order, at most `most_waiting` beside the replayed ones; the others are a reported
           ///< gap
};

struct SubscriptionRequest {
  std::vector<std::string> topics;  ///< "run:R-000318", or "run:*" for all with this prefix
  Mode mode = Mode::latest;
  double max_hz = 20;  ///< for `latest`; 0: as fast as possible
  /// Number of events to send before more are granted; none: no limit.
  std::optional<std::uint64_t> credit = {};
};

struct Event;  // one numbered delta

/// One subscription. Events are taken, not pushed, so a client that does not read costs bounded
/// memory.
class Subscription {
 public:
  static constexpr std::size_t most_waiting = 1024;
  static constexpr std::uint64_t most_credit = 1'000'000;  ///< [events]

  Subscription(std::string id, SubscriptionRequest request);
  ~Subscription();

  [[nodiscard]] const std::string& id() const { return id_; }
  [[nodiscard]] bool wants(std::string_view topic) const;
  /// Params of the next event as JSON; empty if there is none to send at `now`.
  std::string take(Clock now);
  /// Number of events that may still be sent; empty: no limit.
  [[nodiscard]] std::optional<std::uint64_t> credit() const { return request_.credit; }
  /// Allows more events. Errors: wrong_state, if the subscription was opened without credit.
  Status grant(std::uint64_t events);

 private:
  friend class Hub;
  std::string taken(Clock now);
  void offer(const std::shared_ptr<const Event>& event);

  std::string id_;
  SubscriptionRequest request_;
  /// Mode `every`: events from before it was opened, at most Hub::most_replayed, oldest first.
  std::deque<std::shared_ptr<const Event>> replayed_;
  std::deque<std::shared_ptr<const Event>> waiting_;      // mode `every`, after replayed_
  std::map<std::string, std::shared_ptr<Event>> merged_;  // mode `latest`, by topic
  std::uint64_t dropped_ = 0;                             // since the last event taken
  Clock not_before_{};
};

struct Opened {
  std::shared_ptr<Subscription> subscription;
  std::uint64_t seq = 0;      ///< number of the newest event in the snapshot
  std::string snapshot_json;  ///< by topic
  /// Topics that did not fit in the snapshot: those that changed longest ago [count].
  std::size_t left_off = 0;
};

/// Thread: the server's only.
class Hub {
 public:
  /// Events that can be replayed [count].
  static constexpr std::size_t most_replayed = 8192;
  /// Limit of a snapshot, which a client reads as one line, whatever the number of runs [bytes].
  static constexpr std::size_t most_snapshot_bytes = std::size_t{1} << 20;

  /// Publishes a change of a topic: an RFC 7386 merge patch of its snapshot.
  void publish(std::string_view topic, const nlohmann::json& delta, std::int64_t t_us);

  /// Frees the topic's snapshot; from then on `archive` provides it.
  void forget(std::string_view topic);
  /// Topics of one kind that were forgotten, or not published since the daemon started.
  struct Archive {
    std::string prefix;  ///< prefix of their names, "run:"
    /// Snapshot of a topic; empty if there is no such topic.
    std::function<std::optional<nlohmann::json>(std::string_view topic)> find;
    std::function<std::size_t()> count;  ///< number of all topics, forgotten or not
  };
  void archive_in(Archive archive) { archive_ = std::move(archive); }
  /// Sends an event to the current subscribers only: not in a snapshot, not replayed.
  void pass_on(std::string_view topic, const nlohmann::json& delta, std::int64_t t_us);
  /// True if a client subscribes to this topic.
  [[nodiscard]] bool wanted(std::string_view topic) const;

  Opened open(const SubscriptionRequest& request);
  /// Opens with all events after `from_seq` in place of a snapshot; mode `every`. Errors:
  /// "replay.gone", if some of them are no longer kept.
  tl::expected<Opened, rpc::RpcError> replay(const SubscriptionRequest& request,
                                             std::uint64_t from_seq);

  [[nodiscard]] std::uint64_t seq() const { return seq_; }
  [[nodiscard]] std::size_t listeners() const;
  /// `news` is called after each publish(): a subscription may have an event to send.
  void on_news(std::function<void()> news) { news_ = std::move(news); }

 private:
  std::shared_ptr<Subscription> add(const SubscriptionRequest& request);
  /// Adds requested topics that only the archive has. For a pattern of the archive's topics only
  /// counts the missing ones.
  void open_archived(const SubscriptionRequest& request, Opened& opened) const;
  void offer(const std::shared_ptr<const Event>& event);

  std::uint64_t seq_ = 0;
  std::uint64_t next_id_ = 1;
  std::map<std::string, std::unique_ptr<nlohmann::json>, std::less<>> snapshots_;
  std::map<std::string, std::uint64_t, std::less<>> changed_;  // newest event number by topic
  std::deque<std::shared_ptr<const Event>> recent_;
  std::uint64_t forgotten_ = 0;  // number of the newest event no longer in recent_
  std::list<std::weak_ptr<Subscription>> subscriptions_;
  std::function<void()> news_;
  Archive archive_;
};

}  // namespace weft::daemon::server
