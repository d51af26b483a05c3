#pragma once
// Events for one receiver, bounded in number and in age. The server's thread adds them and never
// waits; one sender thread takes them out.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "daemon/service/notify/notify_event.hpp"

namespace weft::daemon::notify {

using Clock = std::chrono::nanoseconds;  ///< monotonic, any origin

/// How often and how long sending is tried.
struct RetryLimits {
  std::chrono::milliseconds first_wait{500};  ///< doubled after each failure
  std::chrono::seconds longest_wait{60};
  std::chrono::seconds longest_life{3600};  ///< of an event; older ones are dropped
};

/// Results of a sender since the daemon started [count].
struct DeliveryCounts {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;             ///< refused for good, too old, or dropped
  std::uint64_t failed_attempts = 0;  ///< includes events that were sent later
  std::size_t waiting = 0;
};

class Outbox {
 public:
  /// One more replaces the oldest.
  static constexpr std::size_t most_waiting = 256;
  /// After this number of failures in a row a journal line is due; at most one per window.
  static constexpr std::uint64_t failures_before_report = 3;
  static constexpr std::chrono::minutes report_window{10};

  struct Entry {
    std::uint64_t number = 0;
    Event event;
    Clock since{};
  };

  explicit Outbox(const RetryLimits& limits = {}) : limits_(limits) {}

  // For the server's thread.
  void put(Event event, Clock now);
  [[nodiscard]] DeliveryCounts counts() const;
  /// For the journal, once per window with failed deliveries: lost and failed_attempts since the
  /// last report, and the newest error.
  struct Report {
    std::uint64_t lost = 0, failed_attempts = 0;
    std::size_t waiting = 0;
    std::string error;
  };
  std::optional<Report> take_report(Clock now);

  // For the sender's thread.
  /// The oldest event; waits for one until `stop` is requested or `longest` has passed.
  std::optional<Entry> front(const std::stop_token& stop, std::chrono::milliseconds longest);
  void on_sent(std::uint64_t number);
  /// Call when the receiver responds: resets the count of failures in a row.
  void on_reached();
  /// Drops the event, which would be refused again.
  void on_refused(std::uint64_t number, std::string error);
  /// Returns the time to wait before the next attempt. Drops events that are too old.
  std::chrono::milliseconds on_failed(std::string error, Clock now);
  /// Waits for `duration`, or less if `stop` is requested.
  void wait(const std::stop_token& stop, std::chrono::milliseconds duration);

 private:
  void remove(std::uint64_t number);

  const RetryLimits limits_;
  mutable std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::deque<Entry> waiting_;
  std::uint64_t numbers_ = 0;
  DeliveryCounts counts_, reported_;
  std::uint64_t failures_in_a_row_ = 0;
  std::string error_;
  std::optional<Clock> reported_at_;
};

}  // namespace weft::daemon::notify
