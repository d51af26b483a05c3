#include "daemon/storage/dataset/sample_times.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace weft::daemon {
namespace {

constexpr double shortest_ns = 100e3;      // less says when samples were read, not when taken
constexpr double longest_wait_ns = 500e6;  // no adapter holds samples back for longer
constexpr double usual_waits = 5;          // nor for so many of its usual waits
constexpr double read_on_ns = 500e3;       // less where a reader takes what has waited for it
constexpr double slow_ns = 5e6;            // no reader takes so long for each
constexpr double most_reading = 0.1;  // of the time a reader reads; strokes of a sensor last longer

/// From one sample that was read without another waiting behind it to the next such one.
struct Step {
  double ns = 0;
  double samples = 1;
  [[nodiscard]] double period_ns() const { return ns / samples; }
};
using Run = std::vector<Step>;  // without a pause

/// What the steps of all runs are like.
struct Usual {
  double wait_ns = 0;
  double period_ns = 0;
  double short_period_ns = 0;  // one in ten is shorter
};

template <typename T>
T quantile(std::vector<T> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::ranges::nth_element(values, at);
  return *at;
}

using Stretch = std::span<const std::int64_t>;

/// 64 bits do not hold what lies between any two times.
double since_ns(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(static_cast<long double>(to_ns) - static_cast<long double>(from_ns));
}

std::vector<double> compute_intervals(Stretch t_ns) {
  std::vector<double> out;
  for (std::size_t i = 1; i < t_ns.size(); ++i) out.push_back(since_ns(t_ns[i - 1], t_ns[i]));
  return out;
}

/// Cut where more than `most_ns` went by.
std::vector<Stretch> stretches_of(Stretch t_ns, double most_ns) {
  std::vector<Stretch> out;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= t_ns.size(); ++i) {
    if (i < t_ns.size() && since_ns(t_ns[i - 1], t_ns[i]) <= most_ns) continue;
    if (i - begin > 1) out.push_back(t_ns.subspan(begin, i - begin));
    begin = i;
  }
  return out;
}

/// Samples of a batch, or read after a stall, follow each other within less than a third of the
/// mean interval: of these the last was waited for. Whether the last of all was is not seen in
/// batches.
Run steps_of(Stretch t_ns, double mean_ns) {
  std::vector<std::size_t> waited_for;
  for (std::size_t i = 0; i + 1 < t_ns.size(); ++i)
    if (since_ns(t_ns[i], t_ns[i + 1]) > mean_ns / 3) waited_for.push_back(i);
  if (waited_for.size() + 1 == t_ns.size()) waited_for.push_back(t_ns.size() - 1);
  Run out;
  for (std::size_t k = 1; k < waited_for.size(); ++k) {
    const std::size_t from = waited_for[k - 1], to = waited_for[k];
    out.push_back({since_ns(t_ns[from], t_ns[to]), static_cast<double>(to - from)});
  }
  return out;
}

Usual find_usual(const std::vector<Run>& runs) {
  std::vector<double> waits_ns, periods_ns;
  for (const Run& run : runs)
    for (const Step& step : run) {
      waits_ns.push_back(step.ns);
      periods_ns.push_back(step.period_ns());
    }
  if (waits_ns.empty()) return {};
  return {quantile(waits_ns, 0.5), quantile(periods_ns, 0.5), quantile(periods_ns, 0.1)};
}

/// Runs that are cut where much more time went by than their samples take.
std::vector<Run> cut_at_pauses(const std::vector<Run>& runs) {
  const Usual usual = find_usual(runs);
  std::vector<Run> out;
  for (const Run& run : runs) {
    out.emplace_back();
    for (const Step& step : run)
      if (step.ns - step.samples * usual.period_ns > usual_waits * usual.wait_ns)
        out.emplace_back();
      else
        out.back().push_back(step);
  }
  std::erase_if(out, [](const Run& run) { return run.empty(); });
  return out;
}

/// Of stretches that are cut at pauses of more than `most_ns`.
std::vector<Run> runs_of(Stretch t_ns, double most_ns) {
  const std::vector<Stretch> stretches = stretches_of(t_ns, most_ns);
  Step all{0, 0};
  for (const Stretch stretch : stretches) {
    all.ns += since_ns(stretch.front(), stretch.back());
    all.samples += static_cast<double>(stretch.size() - 1);
  }
  std::vector<Run> out;
  for (const Stretch stretch : stretches) out.push_back(steps_of(stretch, all.period_ns()));
  return cut_at_pauses(out);
}

Step sum_of(const std::vector<Run>& runs) {
  Step out{0, 0};
  for (const Run& run : runs)
    for (const Step& step : run) {
      out.ns += step.ns;
      out.samples += step.samples;
    }
  return out;
}

/// Stamps against numbers, of one run, each about its mean.
struct Points {
  explicit Points(const Run& run) : t_ns{0}, number{0} {
    for (const Step& step : run) {
      t_ns.push_back(t_ns.back() + step.ns);
      number.push_back(number.back() + step.samples);
    }
    for (std::vector<double>* values : {&t_ns, &number}) {
      double mean = 0;
      for (const double v : *values) mean += v / static_cast<double>(values->size());
      for (double& v : *values) v -= mean;
    }
  }
  std::vector<double> t_ns, number;
};

/// How late each stamp is of the straight lines through all runs, of one slope [ns].
std::vector<std::vector<double>> compute_lateness(const std::vector<Run>& runs) {
  std::vector<Points> points(runs.begin(), runs.end());
  double of_time = 0, of_number = 0;
  for (const Points& p : points)
    for (std::size_t i = 0; i < p.number.size(); ++i) {
      of_time += p.t_ns[i] * p.number[i];
      of_number += p.number[i] * p.number[i];
    }
  std::vector<std::vector<double>> out;
  for (Points& p : points) {
    for (std::size_t i = 0; i < p.number.size(); ++i)
      p.t_ns[i] -= of_time / of_number * p.number[i];
    out.push_back(std::move(p.t_ns));
  }
  return out;
}

double find_range(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax(values);
  return high - low;
}

/// A clock's step, or the wait for a batch, makes a stamp late by a usual wait or a period at most.
/// Where stamps scatter, and some steps are shorter than usual by a, they are off by about 6 a.
bool lost_frames(const std::vector<Run>& runs) {
  const Usual usual = find_usual(runs);
  const double most_ns = 1.25 * std::min(usual.wait_ns, sum_of(runs).period_ns()) +
                         6 * (usual.period_ns - usual.short_period_ns);
  return std::ranges::any_of(compute_lateness(runs), [most_ns](const std::vector<double>& late_ns) {
    return find_range(late_ns) > most_ns;
  });
}

/// Whether all runs are so short that each may be a batch.
bool are_short(const std::vector<Run>& runs) {
  std::vector<double> lasting_ns;
  for (const Run& run : runs) lasting_ns.push_back(sum_of({run}).ns);
  return runs.size() != 1 && (runs.empty() || quantile(lasting_ns, 0.9) < longest_wait_ns);
}

/// Batches hold as many samples as their wait is long: their ends lie on a straight line.
bool are_batches(const std::vector<Run>& runs) {
  const Usual usual = find_usual(runs);
  const double most_ns = 1.25 * usual.period_ns + 0.02 * usual.wait_ns;
  std::size_t steps = 0;
  for (const Run& run : runs) steps += run.size();
  return steps > 1 && usual.wait_ns > longest_wait_ns &&
         std::ranges::all_of(compute_lateness(runs),
                             [=](const auto& late_ns) { return find_range(late_ns) <= most_ns; });
}

/// None where the times do not tell whether short runs are of a fast sensor or of a slow reader.
std::vector<Run> runs_of(const std::vector<std::int64_t>& t_ns) {
  std::vector<double> waits_ns = compute_intervals(t_ns);
  if (waits_ns.empty()) return {};
  const double most_ns = std::max(longest_wait_ns, usual_waits * quantile(waits_ns, 0.5));
  std::vector<Run> runs = runs_of(t_ns, most_ns);
  if (!are_short(runs) || find_usual(runs).period_ns >= slow_ns) return runs;
  std::erase_if(waits_ns, [most_ns](double ns) { return ns <= most_ns; });
  if (waits_ns.empty() || find_usual(runs).period_ns >= read_on_ns) return {};
  if (sum_of(runs).ns > most_reading * since_ns(t_ns.front(), t_ns.back())) return {};
  runs = runs_of(t_ns, usual_waits * quantile(waits_ns, 0.5));
  return are_batches(runs) ? runs : std::vector<Run>{};
}

/// Periods of this length that the steps last, a whole number each. Steps that are late and those
/// that make up for it even out.
double whole_periods(const std::vector<Run>& runs, double period_ns) {
  double out = 0;
  for (const Run& run : runs)
    for (const Step& step : run) out += std::round(step.ns / period_ns);
  return out;
}

/// Where stamps lie, single late ones left aside.
double level_of(std::span<const double> late_ns) {
  return quantile(std::vector<double>(late_ns.begin(), late_ns.end()), 0.25);
}

/// A place between two stamps, and how many before and behind it are compared.
struct Place {
  std::size_t at = 0, before = 0, behind = 0;
  [[nodiscard]] double distance() const { return static_cast<double>(before + behind) / 2; }
  /// Of the scatter of single stamps, in the difference of levels.
  [[nodiscard]] double scatter() const {
    return std::sqrt(1 / static_cast<double>(before) + 1 / static_cast<double>(behind));
  }
};

std::vector<Place> places_of(std::size_t stamps, std::size_t most) {
  const std::size_t fewest = std::clamp<std::size_t>(stamps / 2, 1, 3);
  std::vector<Place> out;
  for (std::size_t i = fewest; i + fewest <= stamps;) {
    out.push_back({i, std::min(i, most), std::min(stamps - i, most)});
    const bool near_an_end = i < most || i + most > stamps;
    i += near_an_end ? 1 : std::max<std::size_t>(1, most / 8);  // few of so many matter little
  }
  return out;
}

/// By how much the levels before and behind a place differ at most, beyond how they usually do (the
/// line is steeper where samples are missing) and what scatter does.
double largest_jump(std::span<const double> late_ns, std::size_t most) {
  constexpr double sure = 5;
  std::vector<double> jumps_ns, slopes_ns, deviations_ns;
  const std::vector<Place> places = places_of(late_ns.size(), most);
  for (const Place& p : places) {
    const double level_ns = level_of(late_ns.subspan(p.at - p.before, p.before));
    jumps_ns.push_back(level_of(late_ns.subspan(p.at, p.behind)) - level_ns);
    slopes_ns.push_back(jumps_ns.back() / p.distance());
    deviations_ns.push_back(std::abs(late_ns[p.at] - level_ns));
  }
  if (places.empty()) return 0;
  const double slope_ns = quantile(slopes_ns, 0.5);
  const double scatter_ns = sure * quantile(deviations_ns, 0.5);
  double out = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    out = std::max(out, std::abs(jumps_ns[i] - slope_ns * places[i].distance()) -
                            scatter_ns * places[i].scatter());
  return out;
}

}  // namespace

SampledTime& SampledTime::operator+=(const SampledTime& other) {
  ns += other.ns;
  intervals += other.intervals;
  return *this;
}

SampledTime sampled_time(const std::vector<std::int64_t>& t_ns) {
  const std::vector<Run> runs = runs_of(t_ns);
  if (runs.empty()) return {};
  Step all = sum_of(runs);
  if (lost_frames(runs)) {
    constexpr int passes = 2;  // the first is of the usual step, which scatter makes longer
    double period_ns = find_usual(runs).period_ns;
    for (int i = 0; i < passes; ++i) {
      all.samples = whole_periods(runs, period_ns);
      period_ns = all.period_ns();
    }
  }
  return {all.ns, all.samples};
}

double missing_samples(const std::vector<std::int64_t>& t_ns) {
  const std::vector<Run> runs = runs_of(t_ns);
  if (runs.size() != 1) return std::numeric_limits<double>::infinity();
  const std::vector<double> late_ns = compute_lateness(runs).front();
  double out = 0;
  for (const std::size_t most : {32U, 128U})  // many tell more where stamps scatter
    out =
        std::max(out, largest_jump(late_ns, std::clamp<std::size_t>(late_ns.size() / 8, 3, most)));
  return out / sum_of(runs).period_ns();
}

std::vector<std::int64_t> motion_times(const Dataset& dataset, std::size_t i) {
  const std::vector<Phase>& phase = dataset.trials[i].phase;
  const std::vector<std::int64_t>& t_ns = dataset.records[i].t_ns;
  std::vector<std::int64_t> out;
  for (std::size_t k = 0; k < t_ns.size(); ++k)
    if (phase[k] == Phase::motion) out.push_back(t_ns[k]);
  return out.size() < 2 ? t_ns : out;
}

namespace {

/// None where all may have been read at once.
SampledTime taken_time(const std::vector<std::int64_t>& t_ns) {
  const SampledTime own = sampled_time(t_ns);
  const double longest_ns = own.ns < longest_wait_ns ? read_on_ns : shortest_ns;
  return 1e9 * own.period_s() > longest_ns ? own : SampledTime{};
}

}  // namespace

bool can_have_period(const std::vector<std::int64_t>& t_ns, double period_s) {
  const SampledTime own = taken_time(t_ns);
  // A frame that was lost is told from a late one where many stamps are: in few it lengthens the
  // period.
  constexpr double most_untold = 1.25;  // intervals
  const double longer = own.period_s() / period_s - 1.0;
  return own.period_s() == 0 ||
         (longer >= -rate_tolerance &&
          longer <= rate_tolerance + most_untold / std::max(own.intervals, 1.0));
}

double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings) {
  SampledTime all;
  for (const std::vector<std::int64_t>& t_ns : recordings) all += taken_time(t_ns);
  return all.period_s();
}

}  // namespace weft::daemon
