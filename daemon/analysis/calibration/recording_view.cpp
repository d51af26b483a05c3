#include "daemon/analysis/calibration/recording_view.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <tuple>

#include "daemon/analysis/calibration/signal.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double ns_per_s = 1e9;
constexpr double trimmed_s = 0.5;        // removed at both ends, where the stages accelerate
constexpr std::size_t held_samples = 4;  // at a limit; shorter runs are noise
constexpr std::size_t samples_a_glitch = 1000;
constexpr double most_clipped_share = 0.01;  // as a share of a channel's samples
constexpr double least_speed_mps = 1e-5;     // below this the stages do not move

/// A trial and its origin.
struct Source {
  const Dataset* dataset;
  std::size_t number;  // index of the data set
  const classifier::Trial* trial;
  const TrialRecord* record;
};

/// The used samples of phase M.
using Rows = std::vector<std::size_t>;

tl::unexpected<Error> refuse(const Source& source, std::string what, std::string expected = {},
                             std::string got = {}, std::string hint = {}) {
  return fail({.code = Errc::invalid_argument,
               .where = source.trial->file,
               .what = std::move(what),
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = std::move(hint)});
}

Result<std::vector<Source>> complete_sources(std::span<const Dataset> datasets) {
  std::vector<Source> out;
  for (std::size_t d = 0; d < datasets.size(); ++d)
    for (std::size_t i = 0; i < datasets[d].trials.size(); ++i)
      if (datasets[d].records[i].outcome == TrialOutcome::complete)
        out.push_back({&datasets[d], d, &datasets[d].trials[i], &datasets[d].records[i]});
  if (out.empty())
    return fail({.code = Errc::invalid_argument, .what = "no complete trials for the calibration"});
  for (const Source& source : out) {
    if (source.trial->taxels != out.front().trial->taxels)
      return refuse(source, "numbers of channels differ between trials",
                    std::to_string(out.front().trial->taxels), std::to_string(source.trial->taxels),
                    "Calibrate on the recordings of one sensor at a time");
    if (!(source.dataset->info.taxel_rate_hz > 0))
      return refuse(source, "sample rate not known", {}, {},
                    "Import the recordings with --rate-hz");
  }
  return out;
}

Rows samples_of(Phase phase, const classifier::Trial& trial) {
  Rows out;
  for (std::size_t i = 0; i < trial.samples(); ++i)
    if (trial.phase[i] == phase) out.push_back(i);
  return out;
}

Result<Rows> motion_rows(const Source& source) {
  Rows rows = samples_of(Phase::motion, *source.trial);
  if (rows.empty())
    return refuse(source, "no phase M", "samples of a stroke", "none",
                  "Remove the trial from the data set");
  const auto margin = std::min(
      static_cast<std::size_t>(std::lround(trimmed_s * source.dataset->info.taxel_rate_hz)),
      rows.size() / 8);
  rows.erase(rows.end() - static_cast<std::ptrdiff_t>(margin), rows.end());
  rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(margin));
  if (rows.size() < least_samples)
    return refuse(source, "phase M too short",
                  "at least " + std::to_string(least_samples) + " samples without its ends",
                  std::to_string(rows.size()));
  return rows;
}

// Speed.

std::optional<double> factor_speed(const Source& source) {
  const std::vector<std::string>& names = source.dataset->info.factors;
  const auto at = static_cast<std::size_t>(std::ranges::find(names, "speed_mps") - names.begin());
  if (at >= source.record->spec.factors.size()) return std::nullopt;
  return source.record->spec.factors[at];
}

/// Displacement along the named axis between two rows of the stages [m]; 0 if there is no such
/// axis.
double way_m(const Source& source, std::string_view name, std::size_t from, std::size_t to) {
  const std::vector<Axis>& axes = source.dataset->info.axes;
  for (std::size_t k = 0; k < axes.size(); ++k)
    if (axes[k].name == name) {
      const std::vector<std::int32_t>& quanta = source.record->stages.quanta;
      return (static_cast<double>(quanta[to * axes.size() + k]) -
              static_cast<double>(quanta[from * axes.size() + k])) /
             axes[k].quanta_per_unit();
    }
  return 0;
}

std::optional<double> stage_speed(const Source& source, const Rows& rows) {
  const std::vector<std::int64_t>& stage_ns = source.record->stages.t_ns;
  const auto first = std::ranges::lower_bound(stage_ns, source.record->t_ns[rows.front()]);
  const auto last = std::ranges::upper_bound(stage_ns, source.record->t_ns[rows.back()]);
  if (last - first < 2 || *(last - 1) <= *first) return std::nullopt;
  double way = 0;
  for (auto i = static_cast<std::size_t>(first - stage_ns.begin());
       i + 1 < static_cast<std::size_t>(last - stage_ns.begin()); ++i)
    way += std::hypot(way_m(source, "x", i, i + 1), way_m(source, "y", i, i + 1));
  const double speed = way * ns_per_s / static_cast<double>(*(last - 1) - *first);
  return speed >= least_speed_mps ? std::optional(speed) : std::nullopt;
}

/// "V-10" of "Denim_F120_V-10mmps_0.csv": direction and speed; empty for other names.
std::string direction_and_speed(const std::string& file) {
  const std::size_t end = file.rfind("mmps_");
  const std::size_t from = file.rfind("_V", end);
  if (end == std::string::npos || from == std::string::npos) return {};
  return file.substr(from + 1, end - from - 1);
}

std::optional<double> name_speed(const std::string& file) {
  const std::string word = direction_and_speed(file);
  double speed_mm_s = 0;
  const char* const end = word.data() + word.size();
  if (word.size() < 2 || std::from_chars(word.data() + 1, end, speed_mm_s).ptr != end ||
      !std::isfinite(speed_mm_s) || speed_mm_s == 0)
    return std::nullopt;
  return std::abs(speed_mm_s) / 1e3;
}

Result<double> find_speed(const Source& source, const Rows& rows, const ViewOptions& options) {
  if (options.speed_mps && !(*options.speed_mps > 0 && std::isfinite(*options.speed_mps)))
    return fail({.code = Errc::invalid_argument,
                 .where = "--speed-mm-s",
                 .what = "speed out of range",
                 .expected = "above 0 mm/s",
                 .got = general(*options.speed_mps * 1e3) + " mm/s"});
  std::optional<double> speed = options.speed_mps;
  if (!speed) speed = factor_speed(source);
  if (!speed) speed = stage_speed(source, rows);
  if (!speed) speed = name_speed(source.trial->file);
  if (!speed || !(*speed > 0))
    return refuse(source, "speed of the stroke not known", {}, {},
                  "Give the speed with --speed-mm-s");
  return *speed;
}

// Channels.

struct Channel {
  bool constant = true;
  double clipped_share = 0;
};

/// Calls f(samples of phase M) for each stroke, one channel.
template <class F>
void each_stroke(const std::vector<Source>& sources, const std::vector<Rows>& rows,
                 std::size_t channel, F&& f) {
  std::vector<double> values;
  for (std::size_t s = 0; s < sources.size(); ++s) {
    values.clear();
    for (const std::size_t i : rows[s]) values.push_back(sources[s].trial->row(i)[channel]);
    f(values);
  }
}

/// Samples in runs of at least held_samples at `limit`.
std::size_t count_held(const std::vector<double>& values, double limit) {
  std::size_t held = 0, stay = 0;
  for (const double v : values) {
    stay = v == limit ? stay + 1 : 0;
    held += stay < held_samples ? 0 : stay == held_samples ? held_samples : 1;
  }
  return held;
}

Channel examine(const std::vector<Source>& sources, const std::vector<Rows>& rows,
                std::size_t channel) {
  std::vector<double> all;
  each_stroke(sources, rows, channel, [&](const std::vector<double>& values) {
    all.insert(all.end(), values.begin(), values.end());
  });
  std::ranges::sort(all);
  const std::size_t glitches = std::max(held_samples - 1, all.size() / samples_a_glitch);
  const double low = all[glitches], high = all[all.size() - 1 - glitches];
  std::size_t held = 0;
  each_stroke(sources, rows, channel, [&](const std::vector<double>& values) {
    held += count_held(values, low) + (low < high ? count_held(values, high) : 0);
  });
  return {all.front() == all.back(), static_cast<double>(held) / static_cast<double>(all.size())};
}

std::string channel_names(const std::vector<std::size_t>& channels) {
  std::vector<std::string> out;
  for (const std::size_t c : channels) out.push_back(std::to_string(c + 1));
  return (out.size() == 1 ? "channel " : "channels ") + joined(out);
}

/// Fills `view.recorded` with the channels to be used.
Status choose_channels(const std::vector<Source>& sources, const std::vector<Rows>& rows,
                       RecordingView& view) {
  std::vector<std::size_t> constant, clipped;
  for (std::size_t c = 0; c < view.recorded_channels; ++c) {
    const Channel channel = examine(sources, rows, c);
    if (channel.constant)
      constant.push_back(c);
    else if (channel.clipped_share > most_clipped_share)
      clipped.push_back(c);
    else
      view.recorded.push_back(c);
  }
  if (constant.size() == view.recorded_channels)
    return fail(
        {.code = Errc::measurement,
         .what = "no variation: channels 1 to " + std::to_string(constant.size()) + " constant"});
  if (view.recorded.empty() || 2 * clipped.size() > view.recorded_channels)
    return fail({.code = Errc::measurement,
                 .what = "clipped: " + channel_names(clipped) + " of " +
                         std::to_string(view.recorded_channels) + " at a limit of their range",
                 .expected = "at most 1 % of a channel's samples, in half of the channels",
                 .hint = "Record again with less force or gain"});
  if (!constant.empty())
    view.remarks.push_back("Skipped because constant: " + channel_names(constant) + ".");
  if (!clipped.empty())
    view.remarks.push_back(
        "Skipped because clipped in more than 1 % of the samples: " + channel_names(clipped) + ".");
  view.channels = view.recorded.size();
  return {};
}

// Strokes.

std::string conditions_of(const Source& source) {
  std::vector<std::string> parts{source.record->spec.exploration};
  for (const double factor : source.record->spec.factors) parts.push_back(general(factor));
  if (name_speed(source.trial->file)) parts.push_back(direction_and_speed(source.trial->file));
  std::erase(parts, "");
  return joined(parts, " ");
}

/// Mean normal force while the rows were recorded; NaN without rows or wrench.
double mean_force_n(const Source& source, const Rows& rows) {
  if (rows.empty()) return std::numeric_limits<double>::quiet_NaN();
  const WrenchStream& wrench = source.record->wrench;
  const auto first = std::ranges::lower_bound(wrench.t_ns, source.record->t_ns[rows.front()]);
  const auto last = std::ranges::upper_bound(wrench.t_ns, source.record->t_ns[rows.back()]);
  if (first >= last) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> force_n;
  for (auto i = first; i < last; ++i)
    force_n.push_back(wrench.force_n(static_cast<std::size_t>(i - wrench.t_ns.begin()), 2));
  return mean(force_n);
}

/// Forces of the stroke and of phase S before it. A wrench without a positive mean load is ignored.
void add_forces(const Source& source, const Rows& rows, Stroke& stroke) {
  const double force_n = mean_force_n(source, rows);
  if (!(force_n > 0)) return;
  Rows rest = samples_of(Phase::rest, *source.trial);
  std::erase_if(rest, [&](std::size_t i) { return i > rows.front(); });
  stroke.force_n = force_n;
  stroke.rest_force_n = mean_force_n(source, rest);
}

/// 0 without phase S.
double unloaded_level(const classifier::Trial& trial, const Rows& rest, std::size_t channel) {
  std::vector<double> values;
  for (const std::size_t i : rest) values.push_back(trial.row(i)[channel]);
  return median(std::move(values)).value_or(0);
}

void add_counts(const Source& source, const Rows& rows, const RecordingView& view, Stroke& stroke) {
  const Rows rest = samples_of(Phase::rest, *source.trial);
  stroke.has_rest = !rest.empty();
  for (const std::size_t channel : view.recorded) {
    const double unloaded = unloaded_level(*source.trial, rest, channel);
    std::vector<double>& counts = stroke.counts.emplace_back();
    for (const std::size_t i : rows) counts.push_back(source.trial->row(i)[channel] - unloaded);
    stroke.level.push_back(mean(counts));
  }
}

/// Numbers mountings within a fabric and repetitions within a cell.
class Numbering {
 public:
  void apply(const Source& source, Stroke& stroke) {
    const TrialPlace& place = source.record->spec.place;
    auto& mountings = mountings_[stroke.cloth];
    const auto next = static_cast<std::uint32_t>(mountings.size() + 1);
    stroke.mounting =
        mountings.try_emplace({source.number, place.piece, place.mounting}, next).first->second;
    stroke.patch = place.patch;
    stroke.cell = stroke.cloth + " / " + stroke.conditions + " / mounting " +
                  std::to_string(stroke.mounting) + " / patch " + std::to_string(stroke.patch);
    const std::uint32_t counted = strokes_[stroke.cell]++;
    const std::string& kind = source.dataset->info.source;
    stroke.repetition =
        kind == "campaign" || kind == "fabricslide" ? source.record->spec.repetition : counted;
  }

 private:
  std::map<std::string,
           std::map<std::tuple<std::size_t, std::uint32_t, std::uint32_t>, std::uint32_t>>
      mountings_;
  std::map<std::string, std::uint32_t> strokes_;
};

void add_remarks(const std::vector<Source>& sources, RecordingView& view) {
  const auto any = [&](auto&& holds) { return std::ranges::any_of(sources, holds); };
  std::size_t unloaded = 0;
  for (std::size_t s = 0; s < sources.size(); ++s)
    unloaded +=
        !sources[s].record->wrench.t_ns.empty() && std::isnan(view.strokes[s].force_n) ? 1 : 0;
  if (unloaded > 0)
    view.remarks.push_back("The wrench reads no force above 0 in " + std::to_string(unloaded) +
                           (unloaded == 1 ? " stroke" : " strokes") +
                           ": treated as strokes without a wrench. Load must be positive.");
  if (any([](const Source& s) { return samples_of(Phase::rest, *s.trial).empty(); }))
    view.remarks.emplace_back(
        "Trials without phase S: counts are treated as counts above the unloaded level.");
  if (any([](const Source& s) { return s.record->spec.place.mounting == 0; }))
    view.remarks.emplace_back(
        "Mountings are not recorded: the strokes of a fabric in one file count as one mounting.");
  if (any([](const Source& s) { return s.record->spec.place.patch == 0; }))
    view.remarks.emplace_back(
        "Places on the fabric are not recorded: strokes of one mounting under the same conditions "
        "count as repetitions of one path.");
}

}  // namespace

Result<RecordingView> make_recording_view(std::span<const Dataset> datasets,
                                          const ViewOptions& options) {
  const auto sources = complete_sources(datasets);
  if (!sources) return pass(sources.error());
  std::vector<Rows> rows;
  for (const Source& source : *sources) {
    auto own = motion_rows(source);
    if (!own) return pass(std::move(own).error());
    rows.push_back(*std::move(own));
  }
  RecordingView out;
  out.recorded_channels = sources->front().trial->taxels;
  if (Status ok = choose_channels(*sources, rows, out); !ok) return pass(ok.error());
  Numbering numbering;
  for (std::size_t s = 0; s < sources->size(); ++s) {
    const Source& source = (*sources)[s];
    const auto speed = find_speed(source, rows[s], options);
    if (!speed) return pass(speed.error());
    Stroke& stroke = out.strokes.emplace_back();
    stroke.cloth = source.trial->label;
    stroke.conditions = conditions_of(source);
    stroke.speed_mps = *speed;
    stroke.rate_hz = source.dataset->info.taxel_rate_hz;
    add_forces(source, rows[s], stroke);
    numbering.apply(source, stroke);
    add_counts(source, rows[s], out, stroke);
  }
  add_remarks(*sources, out);
  return out;
}

}  // namespace weft::daemon::calibration
