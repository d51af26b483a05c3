#include "classifier/features/signal_check.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

constexpr double epsilon = 0x1p-52;
constexpr std::size_t fewest_samples = 8;  // fewest samples to detect a clock or a limit
constexpr double same_step_share = 0.95;
constexpr double wrapping_step_share = 0.75;  // if all other steps are equal too
constexpr std::size_t held_samples = 5;       // number of samples in a row at a limit
constexpr std::size_t held_times = 4;         // multiple of the longest run between both limits
constexpr double held_share = 0.01, between_share = 0.05;

// Mean square deviation from a mean that is itself corrected, so a large level loses no digits.
double mean_square_deviation(std::span<const double> samples) {
  const auto n = static_cast<double>(samples.size());
  double mean = 0.0;
  for (const double v : samples) mean += v / n;
  double rest = 0.0;
  for (const double v : samples) rest += (v - mean) / n;
  mean += rest;
  double sum = 0.0, square = 0.0;
  for (const double v : samples) {
    sum += v - mean;
    square += (v - mean) * (v - mean);
  }
  return std::max(0.0, square / n - sum / n * (sum / n));
}

// One sample of each run of equal ones, if all runs but the first and the last have equal length,
// to a sample. Such runs come from a slow clock that is read more often than it ticks.
std::vector<double> without_even_runs(std::span<const double> samples) {
  std::vector<double> out;
  std::vector<std::size_t> lengths;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i == 0 || samples[i] != samples[i - 1]) {
      out.push_back(samples[i]);
      lengths.push_back(0);
    }
    ++lengths.back();
  }
  if (lengths.size() < fewest_samples) return {samples.begin(), samples.end()};
  const auto [least, most] = std::minmax_element(lengths.begin() + 1, lengths.end() - 1);
  return *most > *least + 1 ? std::vector(samples.begin(), samples.end()) : out;
}

// `sign` is 1 or -1; the samples are multiplied by it.
bool does_only_rise(std::span<const double> samples, double sign) {
  if (samples.size() < fewest_samples) return false;
  std::size_t rises = 0, falls = 0, lead = 0;
  double usual = 0.0;  // most frequent step, if most intervals have it (Boyer and Moore 1981)
  const auto step_at = [&](std::size_t i) { return sign * (samples[i] - samples[i - 1]); };
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double step = step_at(i);
    rises += step > 0.0 ? 1 : 0;
    falls += step < 0.0 ? 1 : 0;
    if (lead == 0) usual = step;
    lead += step == usual ? std::size_t{1} : std::size_t(-1);
  }
  const auto intervals = static_cast<double>(samples.size() - 1);
  if (falls == 0 && static_cast<double>(rises) > intervals / 2) return true;
  if (!(usual > 0.0)) return false;
  std::vector<double> others;  // steps at which a counter restarts
  for (std::size_t i = 1; i < samples.size(); ++i)
    if (step_at(i) != usual) others.push_back(step_at(i));
  const double alike = 1.0 - static_cast<double>(others.size()) / intervals;
  const bool wraps = others.size() > 1 && std::ranges::count(others, others.front()) ==
                                              static_cast<std::ptrdiff_t>(others.size());
  return alike >= (wraps ? wrapping_step_share : same_step_share);
}

// Longest run of equal samples at the lower end, at the upper end, and between.
struct Runs {
  std::size_t low = 0, high = 0, between = 0;
  std::size_t at_low = 0, at_high = 0, samples_between = 0;
};

Runs count_runs(std::span<const double> samples, double low, double high) {
  Runs out;
  std::size_t run = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double v = samples[i];
    run = i > 0 && v == samples[i - 1] ? run + 1 : 1;
    std::size_t& longest = v == low ? out.low : v == high ? out.high : out.between;
    longest = std::max(longest, run);
    ++(v == low ? out.at_low : v == high ? out.at_high : out.samples_between);
  }
  return out;
}

bool is_held(std::size_t run, std::size_t at_limit, const Runs& runs, std::size_t samples) {
  const auto n = static_cast<double>(samples);
  return run >= std::max(held_samples, held_times * runs.between) &&
         static_cast<double>(at_limit) >= held_share * n &&
         static_cast<double>(runs.samples_between) >= between_share * n &&
         runs.samples_between >= held_samples;
}

}  // namespace

SignalState check_signal(std::span<const double> samples) {
  SignalState out;
  out.constant = true;
  if (samples.empty()) return out;
  const auto [low, high] = std::ranges::minmax(samples);
  out.low.value = low;
  out.high.value = high;
  out.largest = std::max(std::abs(low), std::abs(high));
  if (low == high) return out;
  out.deviation = std::sqrt(mean_square_deviation(samples));
  out.constant = out.deviation <= 2.0 * epsilon * out.largest;
  if (out.constant) return out;
  out.digits = std::min(SignalState::digits_of_all,
                        std::log10(out.deviation / (out.largest * epsilon / 2.0)));
  const std::vector<double> ticks = without_even_runs(samples);
  out.only_rises = does_only_rise(ticks, 1.0);
  out.only_falls = does_only_rise(ticks, -1.0);
  const Runs runs = count_runs(samples, low, high);
  out.low.held = is_held(runs.low, runs.at_low, runs, samples.size());
  out.high.held = is_held(runs.high, runs.at_high, runs, samples.size());
  return out;
}

}  // namespace weft::classifier
