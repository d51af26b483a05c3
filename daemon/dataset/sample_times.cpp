#include "daemon/dataset/sample_times.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>

#include "protocols/base/time.hpp"

namespace weft::daemon {
namespace {

constexpr std::int64_t shortest_ns = 100'000;  // less says when samples were read, not when taken

/// Time, and how many samples were taken in it.
struct Piece {
  std::int64_t ns = 0;
  std::size_t samples = 1;
  [[nodiscard]] double period_ns() const {
    return static_cast<double>(ns) / static_cast<double>(samples);
  }
};

std::vector<std::int64_t> intervals_of(const std::vector<std::int64_t>& t_ns) {
  std::vector<std::int64_t> out;
  for (std::size_t i = 1; i < t_ns.size(); ++i) out.push_back(t_ns[i] - t_ns[i - 1]);
  return out;
}

/// What `quarters` of four keep within; of one or more.
template <typename T>
T quartile(std::vector<T> values, std::size_t quarters) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(quarters * values.size() / 4);
  std::ranges::nth_element(values, at);
  return *at;
}

/// What an interval from one batch to the next is longer than, where samples were read in batches:
/// three times those within. Such intervals come again and again and most of the time is in them,
/// not in a few: that is how pauses differ. Nothing where each sample was read for itself.
std::optional<std::int64_t> batch_gap_ns(const std::vector<std::int64_t>& intervals) {
  constexpr std::size_t most_samples = 32, fewest_batches = 5;
  const std::int64_t within = quartile(intervals, 1);
  std::vector<std::int64_t> gaps;
  std::ranges::copy_if(intervals, std::back_inserter(gaps),
                       [within](std::int64_t ns) { return ns > 3 * within; });
  if (gaps.size() < fewest_batches) return std::nullopt;
  if (within > shortest_ns && gaps.size() * most_samples < intervals.size()) return std::nullopt;
  const auto sum = [](const auto& all) {
    return std::accumulate(all.begin(), all.end(), std::int64_t{0});
  };
  const std::int64_t in_gaps = quartile(gaps, 1) * static_cast<std::int64_t>(gaps.size());
  if (in_gaps <= sum(intervals) - sum(gaps)) return std::nullopt;
  return 3 * within;
}

/// The time before each batch, in which its samples were taken. The last one may be cut.
std::vector<Piece> batches_of(const std::vector<std::int64_t>& t_ns,
                              const std::vector<std::int64_t>& intervals, std::int64_t gap_ns) {
  std::vector<std::size_t> starts{0};
  for (std::size_t i = 0; i < intervals.size(); ++i)
    if (intervals[i] > gap_ns) starts.push_back(i + 1);
  std::vector<Piece> out;
  for (std::size_t b = 1; b + 1 < starts.size(); ++b)
    out.push_back({t_ns[starts[b]] - t_ns[starts[b - 1]], starts[b + 1] - starts[b]});
  return out;
}

/// The interval in the middle, or the mean where this one does not tell; 0: neither does.
double middle_s(const std::vector<std::int64_t>& t_ns) {
  const std::vector<std::int64_t> intervals = intervals_of(t_ns);
  if (intervals.empty()) return 0;
  const std::int64_t middle = quartile(intervals, 2);
  if (middle <= shortest_ns || batch_gap_ns(intervals)) return sampled_time(t_ns).period_s();
  return to_seconds(Duration(middle));
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
  std::vector<Piece> pieces;
  if (const auto gap_ns = batch_gap_ns(intervals))
    pieces = batches_of(t_ns, intervals, *gap_ns);
  else
    for (const std::int64_t ns : intervals) pieces.push_back({ns});
  std::vector<double> periods_ns;
  for (const Piece& piece : pieces) periods_ns.push_back(piece.period_ns());
  const double usual_ns = quartile(std::move(periods_ns), 3);
  SampledTime out;
  std::int64_t sampled_ns = 0;
  for (const Piece& piece : pieces) {
    if (usual_ns > 0 && piece.period_ns() > 1.5 * usual_ns) continue;
    sampled_ns += piece.ns;
    out.intervals += static_cast<double>(piece.samples);
  }
  out.seconds = to_seconds(Duration(sampled_ns));
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

bool may_have_period(const std::vector<std::int64_t>& t_ns, double period_s) {
  const auto alike = [period_s](double own_s) {
    return own_s <= to_seconds(Duration(shortest_ns)) ||
           std::abs(own_s / period_s - 1.0) <= rate_tolerance;
  };
  return alike(sampled_time(t_ns).period_s()) || alike(middle_s(t_ns));
}

double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings) {
  SampledTime all;
  std::vector<double> middles_s;
  for (const std::vector<std::int64_t>& t_ns : recordings) {
    all += sampled_time(t_ns);
    if (const double own_s = middle_s(t_ns); own_s > 0) middles_s.push_back(own_s);
  }
  const auto suits_each = [&recordings](double period_s) {
    return std::ranges::all_of(
        recordings, [period_s](const auto& t_ns) { return may_have_period(t_ns, period_s); });
  };
  if (middles_s.empty() || suits_each(all.period_s())) return all.period_s();
  const double middle = quartile(std::move(middles_s), 2);
  return suits_each(middle) ? middle : all.period_s();
}

}  // namespace weft::daemon
