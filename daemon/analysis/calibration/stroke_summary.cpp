#include "daemon/analysis/calibration/stroke_summary.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace weft::daemon::calibration {
namespace {

constexpr std::size_t most_lag = 4;       // samples, between two strokes of a cell
constexpr std::size_t most_partners = 4;  // number of later strokes of its cell with which a stroke
                                          // is compared

using Signals = std::vector<std::vector<double>>;  // [channel][sample]
using ChannelPairs = std::vector<std::pair<std::size_t, std::size_t>>;

std::vector<std::size_t> channels_with_level(const RecordingView& view) {
  std::vector<std::size_t> out;
  for (std::size_t c = 0; c < view.channels; ++c)
    if (std::ranges::all_of(view.strokes,
                            [&](const Stroke& s) { return s.level[c] >= least_level; }))
      out.push_back(c);
  return out;
}

/// Pairs of the used channels by the distance of their places on a square array.
class Neighbourhood {
 public:
  Neighbourhood(const RecordingView& view, const std::vector<std::size_t>& channels)
      : side_(static_cast<std::size_t>(
            std::lround(std::sqrt(static_cast<double>(view.recorded_channels))))) {
    if (side_ < 2 || side_ * side_ != view.recorded_channels) return;
    square = true;
    for (std::size_t b = 0; b < channels.size(); ++b)
      for (std::size_t a = 0; a < b; ++a) add(view, channels, a, b);
  }
  bool square = false;
  ChannelPairs neighbours, far;

 private:
  void add(const RecordingView& view, const std::vector<std::size_t>& channels, std::size_t a,
           std::size_t b) {
    const std::size_t at = view.recorded[channels[a]], to = view.recorded[channels[b]];
    const std::size_t rows = to / side_ - at / side_;
    const std::size_t columns = std::max(to % side_, at % side_) - std::min(to % side_, at % side_);
    if (rows + columns == 1) neighbours.emplace_back(a, b);
    if (std::max(rows, columns) == side_ - 1 && std::min(rows, columns) == 0 && on_corners(at, to))
      far.emplace_back(a, b);
  }
  [[nodiscard]] bool on_corners(std::size_t a, std::size_t b) const {
    const auto corner = [&](std::size_t c) {
      return (c / side_) % (side_ - 1) == 0 && (c % side_) % (side_ - 1) == 0;
    };
    return corner(a) && corner(b);
  }
  std::size_t side_;
};

double mean_correlation(const Signals& signals, const ChannelPairs& pairs) {
  std::vector<double> out;
  for (const auto& [a, b] : pairs) out.push_back(correlation(signals[a], signals[b]));
  return mean(out);
}

double common_share(const Signals& signals) {
  std::vector<double> common(signals.empty() ? 0 : signals[0].size()), variances;
  for (const std::vector<double>& signal : signals) {
    for (std::size_t i = 0; i < common.size(); ++i)
      common[i] += signal[i] / static_cast<double>(signals.size());
    variances.push_back(variance(signal));
  }
  const double own = mean(variances);
  return own > 0 ? variance(common) / own : 0;
}

double median_sd(const Signals& signals) {
  std::vector<double> out;
  for (const std::vector<double>& signal : signals) out.push_back(std::sqrt(variance(signal)));
  return median(std::move(out)).value_or(0);
}

/// Logarithms of the means, minus their mean.
std::vector<double> log_pattern(const std::vector<double>& means) {
  if (std::ranges::any_of(means, [](double m) { return !(m > 0); })) return {};
  std::vector<double> out;
  for (const double m : means) out.push_back(std::log(m));
  const double middle = mean(out);
  for (double& v : out) v -= middle;
  return out;
}

/// z for the used channels.
Signals relative(const Stroke& stroke, const std::vector<std::size_t>& channels) {
  Signals out;
  for (const std::size_t c : channels) {
    out.emplace_back(stroke.counts[c]);
    for (double& v : out.back()) v = v / stroke.level[c] - 1;
  }
  return out;
}

Signals without_lines(const Signals& signals) {
  Signals out;
  for (const std::vector<double>& signal : signals) out.push_back(without_line(signal));
  return out;
}

WindowSummary summarise_window(const Stroke& stroke, const Signals& z, std::size_t first,
                               std::size_t samples, const std::vector<std::size_t>& channels,
                               const Neighbourhood& array) {
  Signals detrended;
  std::vector<double> means;
  for (std::size_t k = 0; k < channels.size(); ++k) {
    detrended.push_back(without_line(Samples(z[k]).subspan(first, samples)));
    means.push_back(mean(Samples(stroke.counts[channels[k]]).subspan(first, samples)));
  }
  return {.modulation = median_sd(detrended),
          .neighbours = mean_correlation(detrended, array.neighbours),
          .far = mean_correlation(detrended, array.far),
          .common_share = common_share(detrended),
          .log_pattern = log_pattern(means)};
}

void add_windows(const Stroke& stroke, const Signals& z, const std::vector<std::size_t>& channels,
                 const Neighbourhood& array, StrokeSummary& out) {
  const auto whole = static_cast<std::size_t>(std::lround(window_mm / stroke.pitch_mm()));
  const std::size_t samples = std::min(whole, stroke.samples());
  if (channels.empty() || samples < least_window_samples) return;
  for (std::size_t first = 0; first + samples <= stroke.samples(); first += samples)
    out.windows.push_back(summarise_window(stroke, z, first, samples, channels, array));
}

double median_drift(const Stroke& stroke, const std::vector<std::size_t>& channels) {
  std::vector<double> out;
  for (const std::size_t c : channels)
    out.push_back(std::abs(slope(stroke.counts[c])) * static_cast<double>(stroke.samples()) /
                  stroke.level[c]);
  return median(std::move(out)).value_or(0);
}

std::array<std::optional<double>, bands> median_bands(const Signals& detrended, double pitch_mm) {
  const auto by_channel = band_rms(detrended, pitch_mm);
  std::array<std::optional<double>, bands> out;
  for (std::size_t band = 0; band < bands; ++band) {
    std::vector<double> values;
    for (const auto& channel : by_channel)
      if (channel[band]) values.push_back(*channel[band]);
    out[band] = median(std::move(values));
  }
  return out;
}

StrokeSummary summarise_stroke(const Stroke& stroke, const std::vector<std::size_t>& channels,
                               const Neighbourhood& array, const Signals& detrended) {
  StrokeSummary out;
  const Signals z = relative(stroke, channels);
  std::vector<double> log_level, jumps;
  for (const std::size_t c : channels) {
    log_level.push_back(std::log(stroke.level[c]));
    jumps.push_back(jump_share(stroke.counts[c]));
    out.level.push_back(stroke.level[c]);
    out.noise.push_back(noise_sd(stroke.counts[c]));
  }
  out.modulation = median_sd(z);
  out.band = median_bands(detrended, stroke.pitch_mm());
  out.level_spread = sample_sd(log_level);
  out.drift = median_drift(stroke, channels);
  out.jumps = mean(jumps);
  add_windows(stroke, z, channels, array, out);
  return out;
}

/// Mean correlation over channels, with b delayed by `lag` samples.
double lagged(const Signals& a, const Signals& b, std::ptrdiff_t lag) {
  const auto late = static_cast<std::size_t>(std::max<std::ptrdiff_t>(lag, 0));
  const auto early = static_cast<std::size_t>(std::max<std::ptrdiff_t>(-lag, 0));
  const std::size_t samples = std::min(a[0].size() - early, b[0].size() - late);
  std::vector<double> out;
  for (std::size_t c = 0; c < a.size(); ++c)
    out.push_back(
        correlation(Samples(a[c]).subspan(early, samples), Samples(b[c]).subspan(late, samples)));
  return mean(out);
}

PairSummary compare(const std::vector<Signals>& detrended, std::size_t first, std::size_t second,
                    double pitch_mm) {
  PairSummary out{first, second, -1, 0};
  if (detrended[first].empty()) return {first, second, 0, 0};
  constexpr auto most = static_cast<std::ptrdiff_t>(most_lag);
  for (std::ptrdiff_t lag = -most; lag <= most; ++lag) {
    const double found = lagged(detrended[first], detrended[second], lag);
    if (found <= out.correlation) continue;
    out.correlation = found;
    out.lag_mm = static_cast<double>(lag) * pitch_mm;
  }
  return out;
}

std::vector<PairSummary> repetition_pairs(const Cell& cell, const RecordingView& view,
                                          const std::vector<Signals>& detrended) {
  std::vector<PairSummary> out;
  for (std::size_t i = 0; i < cell.strokes.size(); ++i)
    for (std::size_t j = i + 1; j < std::min(i + 1 + most_partners, cell.strokes.size()); ++j)
      out.push_back(compare(detrended, cell.strokes[i], cell.strokes[j],
                            view.strokes[cell.strokes[i]].pitch_mm()));
  return out;
}

/// Pairs each stroke with the next one of another fabric under the same conditions, cyclically.
std::vector<PairSummary> control_pairs(const RecordingView& view,
                                       const std::vector<Signals>& detrended) {
  std::vector<PairSummary> out;
  const std::size_t count = view.strokes.size();
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t step = 1; step < count; ++step) {
      const Stroke &own = view.strokes[i], &other = view.strokes[(i + step) % count];
      if (other.cloth == own.cloth || other.conditions != own.conditions) continue;
      out.push_back(compare(detrended, i, (i + step) % count, own.pitch_mm()));
      break;
    }
  return out;
}

void add_cells(const RecordingView& view, Summaries& out) {
  std::map<std::pair<std::string, std::string>, std::vector<std::size_t>> cells;
  for (std::size_t s = 0; s < view.strokes.size(); ++s)
    cells[{view.strokes[s].cloth, view.strokes[s].cell}].push_back(s);
  for (auto& [name, strokes] : cells) {
    if (out.cloths.empty() || out.cloths.back() != name.first) out.cloths.push_back(name.first);
    out.cells.push_back({out.cloths.size() - 1, std::move(strokes)});
  }
}

}  // namespace

Summaries summarise(const RecordingView& view) {
  Summaries out;
  out.view = &view;
  out.finest_mm = std::ranges::min(view.strokes, {}, &Stroke::pitch_mm).pitch_mm();
  out.channels = channels_with_level(view);
  if (out.channels.size() < view.channels)
    out.remarks.push_back(std::to_string(view.channels - out.channels.size()) + " of " +
                          std::to_string(view.channels) +
                          " channels skipped: level below 1 count in a stroke.");
  const Neighbourhood array(view, out.channels);
  out.square = array.square;
  std::vector<Signals> detrended;
  for (const Stroke& stroke : view.strokes) {
    detrended.push_back(without_lines(relative(stroke, out.channels)));
    out.strokes.push_back(summarise_stroke(stroke, out.channels, array, detrended.back()));
  }
  add_cells(view, out);
  for (const Cell& cell : out.cells)
    out.repetitions.push_back(repetition_pairs(cell, view, detrended));
  out.controls = control_pairs(view, detrended);
  return out;
}

std::vector<DrawnCell> all_cells(const Summaries& summaries) {
  std::vector<DrawnCell> out;
  for (std::size_t c = 0; c < summaries.cells.size(); ++c)
    out.push_back({c, summaries.cells[c].strokes});
  return out;
}

}  // namespace weft::daemon::calibration
