#pragma once
// How often somebody may ask: a bucket of requests for each, which fills at a steady rate.

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
  static constexpr std::size_t burst = 50'000;       ///< at once, after a while of silence
  /// Buckets are kept of so many; who has asked for nothing longest is forgotten.
  static constexpr std::size_t most_known = 1024;

  /// Takes one request of `user`. False where none is left.
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

}  // namespace weft::daemon::access
