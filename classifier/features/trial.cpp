#include "classifier/features/trial.hpp"

#include <cmath>

namespace weft::classifier {
namespace {

// People and other programs number recordings with "#3" themselves.
constexpr std::string_view window_mark = "#w";

// Number of whole samples in a duration; 0 if that is not a plausible number.
std::size_t samples_in(double duration_s, double period_s) {
  const double samples = std::nearbyint(duration_s / period_s);
  return samples >= 1.0 && samples < 1e15 ? static_cast<std::size_t>(samples) : 0;
}

struct Run {
  std::size_t first, samples;
};

// Samples of phase M that follow each other without a pause.
std::vector<Run> motion_runs(const Trial& trial, std::span<const std::size_t> after_pause) {
  std::vector<Run> out;
  bool in_run = false;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    const bool moves = trial.phase[i] == Phase::motion;
    if (moves && (!in_run || std::ranges::binary_search(after_pause, i))) out.push_back({i, 0});
    if (moves) ++out.back().samples;
    in_run = moves;
  }
  return out;
}

Trial one_window(const Trial& trial, Run samples, std::size_t number) {
  Trial out;
  out.file = window_name(trial.file, number);
  out.label = trial.label;
  out.group = trial.group;
  out.taxels = trial.taxels;
  out.phase.assign(samples.samples, Phase::motion);
  const double* const first = trial.row(samples.first).data();
  out.counts.assign(first, first + samples.samples * trial.taxels);
  return out;
}

}  // namespace

std::string window_name(std::string_view recording, std::size_t number) {
  return std::string(recording).append(window_mark) + std::to_string(number);
}

std::string_view recording_of(std::string_view file) {
  const std::size_t mark = file.rfind(window_mark);
  if (mark == std::string_view::npos) return file;
  const std::string_view number = file.substr(mark + window_mark.size());
  const bool numbered =
      !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
  return numbered ? file.substr(0, mark) : file;
}

std::string recording_of(const std::string& file, std::size_t row) {
  const std::string_view name = recording_of(file);
  return name.empty() ? "#" + std::to_string(row) : std::string(name);
}

// Counts stay counts: from whole numbers a whole level is subtracted.
Status without_level(Trial& trial, Phase of) {
  const auto is_whole = [](double count) { return count == std::nearbyint(count); };
  const bool whole = std::ranges::all_of(trial.counts, is_whole);
  const auto samples = std::ranges::count(trial.phase, of);
  if (samples == 0)
    return fail({.code = Errc::not_found,
                 .where = trial.file,
                 .what = "no samples in the phase of the unloaded level"});
  for (std::size_t k = 0; k < trial.taxels; ++k) {
    double sum = 0.0;
    for (std::size_t i = 0; i < trial.samples(); ++i)
      if (trial.phase[i] == of) sum += trial.counts[i * trial.taxels + k];
    const double mean = sum / static_cast<double>(samples);
    const double level = whole ? std::nearbyint(mean) : mean;
    for (std::size_t i = 0; i < trial.samples(); ++i) trial.counts[i * trial.taxels + k] -= level;
  }
  return {};
}

Result<std::vector<Trial>> cut_windows(const Trial& trial, const WindowOptions& options,
                                       std::span<const std::size_t> after_pause) {
  if (trial.counts.size() != trial.samples() * trial.taxels) {
    return fail({.code = Errc::invalid_argument,
                 .where = trial.file,
                 .what = "numbers of samples and phases differ"});
  }
  const std::size_t length = samples_in(options.window_s, options.sample_period_s);
  const double step_s = options.step_s == 0.0 ? options.window_s : options.step_s;
  const std::size_t step = samples_in(step_s, options.sample_period_s);
  if (length == 0 || step == 0) {
    return fail({.code = Errc::invalid_argument,
                 .where = "window",
                 .what = "window or step shorter than one sample",
                 .expected = "at least one sample period",
                 .got = std::to_string(options.window_s) + " s, step " + std::to_string(step_s) +
                        " s at a period of " + std::to_string(options.sample_period_s) + " s"});
  }
  std::vector<Trial> out;
  std::size_t longest = 0;
  for (const Run& run : motion_runs(trial, after_pause)) {
    longest = std::max(longest, run.samples);
    for (std::size_t from = 0; from + length <= run.samples; from += step)
      out.push_back(one_window(trial, {run.first + from, length}, out.size()));
  }
  if (!out.empty()) return out;
  return fail({.code = Errc::range,
               .where = trial.file,
               .what = "uninterrupted motion shorter than one window",
               .expected = "at least " + std::to_string(length) + " samples",
               .got = std::to_string(longest)});
}

}  // namespace weft::classifier
