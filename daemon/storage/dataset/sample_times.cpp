#include "daemon/storage/dataset/sample_times.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace weft::daemon {
namespace {

constexpr double tolerance = 0.01;       // as a share of an interval
constexpr std::size_t rest_share = 100;  // one in this number of intervals may differ
constexpr double pause_ns = 500e6;       // no adapter holds samples back for longer
constexpr double pause_intervals = 5;
constexpr double slow_ns = 5e6;  // no reader needs this long for each waiting sample

/// The difference of two times can exceed 64 bits.
double since_ns(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(static_cast<long double>(to_ns) - static_cast<long double>(from_ns));
}

double compute_median(std::vector<double> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::ranges::nth_element(values, at);
  return *at;
}

std::vector<double> intervals_of(const std::vector<std::int64_t>& t_ns) {
  std::vector<double> out;
  for (std::size_t i = 1; i < t_ns.size(); ++i) out.push_back(since_ns(t_ns[i - 1], t_ns[i]));
  return out;
}

/// True if the intervals after number `at` are shorter: then samples were held back, not lost.
bool is_made_up_for(const std::vector<double>& intervals_ns, std::size_t at, double usual_ns) {
  const auto held_back = static_cast<std::size_t>(intervals_ns[at] / usual_ns);
  const std::size_t end = std::min(at + 1 + held_back, intervals_ns.size());
  double ns = 0;
  for (std::size_t i = at + 1; i < end; ++i) ns += intervals_ns[i];
  return ns < usual_ns * static_cast<double>(end - at - 1) / 2;
}

/// The step of the stamps' clock: all intervals are multiples of it. 0 if it exceeds half of an
/// interval, because regular times are multiples of their period.
double stamp_step_ns(const std::vector<double>& intervals_ns, double usual_ns) {
  std::uint64_t common_ns = 0;
  for (const double ns : intervals_ns)
    common_ns = std::gcd(common_ns, static_cast<std::uint64_t>(ns));
  return static_cast<double>(common_ns) <= usual_ns / 2 ? static_cast<double>(common_ns) : 0;
}

}  // namespace

SampledTime& SampledTime::operator+=(const SampledTime& other) {
  ns += other.ns;
  intervals += other.intervals;
  return *this;
}

SampledTime sampled_time(const std::vector<std::int64_t>& t_ns) {
  const std::vector<double> intervals_ns = intervals_of(t_ns);
  const double usual_ns = intervals_ns.empty() ? 0 : compute_median(intervals_ns);
  if (usual_ns <= 0) return {};
  const double most_ns = std::max(pause_ns, pause_intervals * usual_ns);
  const double range_ns = tolerance * usual_ns + stamp_step_ns(intervals_ns, usual_ns);
  SampledTime out;
  std::size_t others = 0, pauses = 0;
  for (const double ns : intervals_ns) {
    if (ns > most_ns)
      ++pauses;
    else if (std::abs(ns - usual_ns) > range_ns)
      ++others;
    else
      out += {ns, 1};
  }
  const bool short_runs = pauses > 0 && out.ns < pause_ns * static_cast<double>(pauses + 1);
  if (others > std::max<std::size_t>(1, intervals_ns.size() / rest_share) ||
      (short_runs && usual_ns < slow_ns))
    return {};
  return out;
}

std::vector<std::size_t> samples_after_pause(const std::vector<std::int64_t>& t_ns) {
  const std::vector<double> intervals_ns = intervals_of(t_ns);
  std::vector<std::size_t> out;
  if (intervals_ns.empty()) return out;
  const double usual_ns = compute_median(intervals_ns);
  const bool regular = sampled_time(t_ns).intervals > 0;
  for (std::size_t i = 0; i < intervals_ns.size(); ++i) {
    if (intervals_ns[i] <= pause_intervals * usual_ns) continue;
    if (intervals_ns[i] > pause_ns || (regular && !is_made_up_for(intervals_ns, i, usual_ns)))
      out.push_back(i + 1);
  }
  return out;
}

std::vector<std::int64_t> motion_times(const Dataset& dataset, std::size_t i) {
  const std::vector<Phase>& phase = dataset.trials[i].phase;
  const std::vector<std::int64_t>& t_ns = dataset.records[i].t_ns;
  std::vector<std::int64_t> out;
  for (std::size_t k = 0; k < t_ns.size(); ++k)
    if (phase[k] == Phase::motion) out.push_back(t_ns[k]);
  return out.size() < 2 ? t_ns : out;
}

bool can_have_period(const std::vector<std::int64_t>& t_ns, double period_s) {
  const double own_s = sampled_time(t_ns).period_s();
  return own_s == 0 || std::abs(own_s / period_s - 1) <= rate_tolerance;
}

double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings) {
  SampledTime all;
  for (const std::vector<std::int64_t>& t_ns : recordings) all += sampled_time(t_ns);
  return all.period_s();
}

}  // namespace weft::daemon
