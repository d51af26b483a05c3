#pragma once
// Events on their way to one receiver: bounded in number and in time. The server's thread puts them
// in and never waits; one sender thread takes them out.

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

/// How often and how long a receiver is tried.
struct RetryLimits {
  std::chrono::milliseconds first_wait{500};  ///< doubled after each failure
  std::chrono::seconds longest_wait{60};
  std::chrono::seconds longest_life{3600};  ///< of an event; then it is given up
};

/// What a sender has done since the daemon started [count].
struct DeliveryCounts {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;             ///< refused for good, given up or without room
  std::uint64_t failed_attempts = 0;  ///< also of what was sent later
  std::size_t waiting = 0;
};

class Outbox {
 public:
  /// One more takes the place of the oldest.
  static constexpr std::size_t most_waiting = 256;
  /// So many failures in a row are a line of the journal, which has at most one each window.
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
  /// For the journal, once per window where deliveries failed: lost and failed_attempts since the
  /// last report, and the newest error.
  struct Report {
    std::uint64_t lost = 0, failed_attempts = 0;
    std::size_t waiting = 0;
    std::string error;
  };
  std::optional<Report> take_report(Clock now);

  // For the sender's thread.
  /// The oldest; waits for one until `stop` is requested or `longest` is over.
  std::optional<Entry> front(const std::stop_token& stop, std::chrono::milliseconds longest);
  void on_sent(std::uint64_t number);
  /// The receiver answers: the next failure is the first again.
  void on_reached();
  /// It will be refused again.
  void on_refused(std::uint64_t number, std::string error);
  /// How long to wait before the next attempt. An event that is too old is given up.
  std::chrono::milliseconds on_failed(std::string error, Clock now);
  /// Waits; shorter once `stop` is requested.
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
