#include "daemon/service/notify/outbox.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon::notify {

void Outbox::put(Event event, Clock now) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == most_waiting) {
    waiting_.pop_front();
    ++counts_.lost;
    error_ = "too many waiting events";
  }
  waiting_.push_back({++numbers_, std::move(event), now});
  arrived_.notify_all();
}

DeliveryCounts Outbox::counts() const {
  const std::lock_guard lock(mutex_);
  DeliveryCounts out = counts_;
  out.waiting = waiting_.size();
  return out;
}

std::optional<Outbox::Report> Outbox::take_report(Clock now) {
  const std::lock_guard lock(mutex_);
  const bool is_news =
      counts_.lost > reported_.lost || (failures_in_a_row_ >= failures_before_report &&
                                        counts_.failed_attempts > reported_.failed_attempts);
  if (!is_news || (reported_at_ && now - *reported_at_ < report_window)) return std::nullopt;
  Report report{counts_.lost - reported_.lost, counts_.failed_attempts - reported_.failed_attempts,
                waiting_.size(), error_};
  reported_ = counts_;
  reported_at_ = now;
  return report;
}

std::optional<Outbox::Entry> Outbox::front(const std::stop_token& stop,
                                           std::chrono::milliseconds longest) {
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, stop, longest, [this] { return !waiting_.empty(); });
  if (waiting_.empty()) return std::nullopt;
  return waiting_.front();
}

void Outbox::remove(std::uint64_t number) {
  std::erase_if(waiting_, [number](const Entry& entry) { return entry.number == number; });
}

void Outbox::on_sent(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  remove(number);
  ++counts_.sent;
  failures_in_a_row_ = 0;
}

void Outbox::on_reached() {
  const std::lock_guard lock(mutex_);
  failures_in_a_row_ = 0;
}

void Outbox::on_refused(std::uint64_t number, std::string error) {
  const std::lock_guard lock(mutex_);
  remove(number);
  ++counts_.lost;
  error_ = std::move(error);
}

std::chrono::milliseconds Outbox::on_failed(std::string error, Clock now) {
  const std::lock_guard lock(mutex_);
  ++counts_.failed_attempts;
  error_ = std::move(error);
  counts_.lost += std::erase_if(
      waiting_, [&](const Entry& entry) { return now - entry.since > limits_.longest_life; });
  constexpr std::uint64_t most_doublings = 20;
  const auto doublings = std::min(failures_in_a_row_++, most_doublings);
  return std::min<std::chrono::milliseconds>(limits_.first_wait * (1LL << doublings),
                                             limits_.longest_wait);
}

void Outbox::wait(const std::stop_token& stop, std::chrono::milliseconds duration) {
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, stop, duration, [] { return false; });
}

}  // namespace weft::daemon::notify
