#include "daemon/dataset/sample_times.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/base/time.hpp"

namespace weft::daemon {
namespace {

std::vector<std::int64_t> intervals_of(const std::vector<std::int64_t>& t_ns) {
  std::vector<std::int64_t> out;
  for (std::size_t i = 1; i < t_ns.size(); ++i) out.push_back(t_ns[i] - t_ns[i - 1]);
  return out;
}

/// The interval that `quarters` of four keep within; of one or more.
std::int64_t quartile(std::vector<std::int64_t> intervals, std::size_t quarters) {
  const auto at = intervals.begin() + static_cast<std::ptrdiff_t>(quarters * intervals.size() / 4);
  std::ranges::nth_element(intervals, at);
  return *at;
}

}  // namespace

SampledTime& SampledTime::operator+=(const SampledTime& other) {
  seconds += other.seconds;
  intervals += other.intervals;
  return *this;
}

SampledTime sampled_time(const std::vector<std::int64_t>& t_ns) {
  const std::vector<std::int64_t> intervals = intervals_of(t_ns);
  if (intervals.empty()) return {};
  const std::int64_t usual = quartile(intervals, 3);
  SampledTime out;
  std::int64_t sampled_ns = 0;
  for (const std::int64_t interval : intervals) {
    if (usual > 0 && interval > usual + usual / 2) continue;
    sampled_ns += interval;
    ++out.intervals;
  }
  out.seconds = to_seconds(Duration(sampled_ns));
  return out;
}

bool may_have_period(const std::vector<std::int64_t>& t_ns, double period_s) {
  constexpr double shortest_s = 1e-4;  // less says when samples were read, not when taken
  const std::vector<std::int64_t> intervals = intervals_of(t_ns);
  if (intervals.empty()) return true;
  const auto alike = [period_s](double own_s) {
    return own_s <= shortest_s || std::abs(own_s / period_s - 1.0) <= rate_tolerance;
  };
  return alike(sampled_time(t_ns).period_s()) ||
         alike(to_seconds(Duration(quartile(intervals, 2))));
}

}  // namespace weft::daemon
