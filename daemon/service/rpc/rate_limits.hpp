#pragma once
// Limits of requests per user (token bucket) and of refused tokens per address.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace weft::daemon::access {

/// Time is an argument; any monotonic origin.
class RateLimits {
 public:
  using Clock = std::chrono::nanoseconds;
  static constexpr std::size_t per_second = 10'000;  ///< [requests]
  static constexpr std::size_t burst = 50'000;       ///< [requests] after an idle time
  /// Number of buckets; a new one replaces the one idle longest.
  static constexpr std::size_t most_known = 1024;

  /// Takes one request of `user` from its bucket. False if the bucket is empty.
  bool take(std::string_view user, Clock now);

 private:
  struct Bucket {
    double left = static_cast<double>(burst);
    Clock as_of{};
  };
  void forget_oldest();
  std::map<std::string, Bucket, std::less<>> buckets_;
};

inline bool RateLimits::take(std::string_view user, Clock now) {
  auto found = buckets_.find(user);
  if (found == buckets_.end()) {
    if (buckets_.size() >= most_known) forget_oldest();
    found = buckets_.emplace(std::string(user), Bucket{static_cast<double>(burst), now}).first;
  }
  Bucket& bucket = found->second;
  const double passed_s = std::chrono::duration<double>(now - bucket.as_of).count();
  bucket.left = std::min(bucket.left + passed_s * static_cast<double>(per_second),
                         static_cast<double>(burst));
  bucket.as_of = now;
  if (bucket.left < 1) return false;
  bucket.left -= 1;
  return true;
}

inline void RateLimits::forget_oldest() {
  buckets_.erase(
      std::ranges::min_element(buckets_, {}, [](const auto& entry) { return entry.second.as_of; }));
}

/// Counts refused tokens by the client's address within a window. Time is an argument; any
/// monotonic origin.
class RefusedTokens {
 public:
  using Clock = std::chrono::nanoseconds;
  static constexpr std::chrono::seconds window{10};
  /// Refused tokens in a window at which the address is limited until the window ends.
  static constexpr std::size_t most_in_window = 20;
  /// Number of addresses; a new one replaces the one with the oldest window.
  static constexpr std::size_t most_known = 1024;

  void add(std::string_view address, Clock now);
  [[nodiscard]] bool is_limited(std::string_view address, Clock now) const;

 private:
  struct Window {
    Clock since{};
    std::size_t refused = 0;
  };
  std::map<std::string, Window, std::less<>> windows_;
};

inline void RefusedTokens::add(std::string_view address, Clock now) {
  auto found = windows_.find(address);
  if (found == windows_.end()) {
    if (windows_.size() >= most_known)
      windows_.erase(std::ranges::min_element(
          windows_, {}, [](const auto& entry) { return entry.second.since; }));
    found = windows_.emplace(std::string(address), Window{now, 0}).first;
  }
  if (now - found->second.since >= window) found->second = {now, 0};
  ++found->second.refused;
}

inline bool RefusedTokens::is_limited(std::string_view address, Clock now) const {
  const auto found = windows_.find(address);
  return found != windows_.end() && now - found->second.since < window &&
         found->second.refused >= most_in_window;
}

}  // namespace weft::daemon::access
