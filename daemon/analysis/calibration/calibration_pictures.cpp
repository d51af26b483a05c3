#include "daemon/analysis/calibration/calibration_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>

#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr std::string_view band_name = "band_";
constexpr std::size_t sides = 3;
constexpr std::array<std::string_view, sides> side_names{"recorded", "SIMULATED, estimates",
                                                         "SIMULATED, calibrated"};
constexpr std::array<chart::Line, sides> side_lines{chart::Line::solid, chart::Line::dashed,
                                                    chart::Line::solid};
constexpr std::size_t histogram_bins = 10;
constexpr double side_step = 0.15;  // horizontal offset between the marks of one name, so that
                                    // equal values are visible

/// Three lines on one pair of axes: recorded, simulated before and after.
struct Picture {
  std::string title, x_title, y_title;
  bool is_log_x = false, is_log_y = false;
  std::array<std::vector<chart::Sample>, sides> lines{};
  std::vector<std::string> names{};  ///< labels of whole numbers along x; empty: a numeric scale
};

chart::Plot plot_of(const Picture& picture) {
  chart::Plot out{picture.title + ", recorded and SIMULATED before and after"};
  out.width = 480;
  out.panel_height = 190;
  chart::Panel panel{picture.title};
  panel.x = {.title = picture.x_title, .logarithmic = picture.is_log_x};
  panel.x.names = picture.names;
  panel.y = {.title = picture.y_title, .logarithmic = picture.is_log_y};
  for (std::size_t side = 0; side < sides; ++side) {
    chart::Series series{std::string(side_names[side]), side};
    if (picture.names.empty()) series.line = side_lines[side];
    series.points = picture.lines[side];
    panel.series.push_back(std::move(series));
  }
  out.panels = {std::move(panel)};
  return out;
}

std::array<const RecordingView*, sides> views_of(const CalibrationResult& result) {
  return {&result.real, &result.before, &result.after};
}

/// Position of a side's mark, for the name at `x`.
double beside(double x, std::size_t side) {
  return x + side_step * (static_cast<double>(side) - 1);
}

/// The three values of a statistic, each at its own x.
void add_statistic(Picture& out, const ComparedStatistic& s, const std::array<double, sides>& x) {
  const Scale scale = s.real.scale;
  out.lines[0].push_back({x[0], s.real.shown, from_scale(s.low, scale), from_scale(s.high, scale)});
  if (s.before) out.lines[1].push_back({x[1], from_scale(*s.before, scale)});
  if (s.after) out.lines[2].push_back({x[2], from_scale(*s.after, scale)});
}

/// Wave number at the start of a band, and rms of that band.
Picture spectrum_of(const CalibrationResult& result, const std::string& cloth) {
  Picture out{"Spectrum of " + cloth, "band from [1/mm]", "rms of the modulation", true, true};
  for (const ComparedStatistic& s : result.statistics) {
    if (s.real.cloth != cloth || !s.real.name.starts_with(band_name)) continue;
    const double from = std::strtod(s.real.name.c_str() + band_name.size(), nullptr);
    add_statistic(out, s, {from, from, from});
  }
  return out;
}

struct NamedStatistic {
  std::string_view statistic, name;
};

/// Statistics over all fabrics, side by side. A name without marks: the statistic is not known.
void add_named(Picture& out, const CalibrationResult& result,
               std::span<const NamedStatistic> wanted) {
  for (const NamedStatistic& one : wanted) {
    const auto x = static_cast<double>(out.names.size());
    out.names.emplace_back(one.name);
    for (const ComparedStatistic& s : result.statistics)
      if (s.real.name == one.statistic && s.real.cloth.empty())
        add_statistic(out, s, {beside(x, 0), beside(x, 1), beside(x, 2)});
  }
}

Picture correlation_picture(const CalibrationResult& result) {
  static constexpr std::array<NamedStatistic, 2> wanted{
      {{"repetition", "same path repeated"}, {"control", "other fabric"}}};
  Picture out{"Correlation of two strokes", {}, "correlation"};
  add_named(out, result, wanted);
  return out;
}

Picture pattern_picture(const CalibrationResult& result) {
  static constexpr std::array<NamedStatistic, 3> wanted{
      {{"pattern_path", "within a path"},
       {"pattern_patch", "between patches"},
       {"pattern_mounting", "between mountings"}}};
  Picture out{"Spread of the pattern over channels", {}, "sd of ln(level)", false, true};
  add_named(out, result, wanted);
  return out;
}

/// The typical modulation of each stroke [%].
std::vector<double> stroke_modulations(const RecordingView& view) {
  std::vector<double> out;
  for (std::size_t i = 0; i < view.strokes.size(); ++i) {
    const StatisticSet set = compute_statistics(subset(view, {i}));
    if (const Statistic* one = find(set.statistics, "modulation", view.strokes[i].cloth))
      out.push_back(100 * one->shown);
  }
  return out;
}

/// Middle of a bin, and number of values in it; empty without values.
std::vector<chart::Sample> log_histogram(const std::vector<double>& values,
                                         const svg::Range& range) {
  if (values.empty()) return {};
  const double step = std::log(range.high / range.low) / histogram_bins;
  std::array<double, histogram_bins> counts{};
  for (const double value : values) {
    if (!(value > 0)) continue;
    const double bin = std::clamp(std::log(value / range.low) / step, 0.0, histogram_bins - 1.0);
    ++counts[static_cast<std::size_t>(bin)];
  }
  std::vector<chart::Sample> out;
  for (std::size_t b = 0; b < histogram_bins; ++b)
    out.push_back({range.low * std::exp(step * (static_cast<double>(b) + 0.5)), counts[b]});
  return out;
}

Picture modulation_histogram(const CalibrationResult& result) {
  Picture out{"Modulation of strokes", "modulation [%]", "strokes", true, false};
  std::array<std::vector<double>, sides> values;
  std::vector<double> all;
  for (std::size_t side = 0; side < sides; ++side) {
    values[side] = stroke_modulations(*views_of(result)[side]);
    all.insert(all.end(), values[side].begin(), values[side].end());
  }
  const svg::Range range = svg::log_range_of(all);
  for (std::size_t side = 0; side < sides; ++side)
    out.lines[side] = log_histogram(values[side], range);
  return out;
}

Picture repetition_picture(const CalibrationResult& result) {
  Picture out{"Correlation of two repetitions of one path", {}, "correlation"};
  for (std::size_t c = 0; c < result.cloths.size(); ++c) {
    out.names.push_back(result.cloths[c].label);
    for (std::size_t side = 0; side < sides; ++side) {
      const RecordingView own = strokes_of(*views_of(result)[side], result.cloths[c].label);
      if (own.strokes.empty()) continue;
      const StatisticSet set = compute_statistics(own);
      if (const Statistic* one = find(set.statistics, "repetition"))
        out.lines[side].push_back({beside(static_cast<double>(c), side), one->shown});
    }
  }
  return out;
}

}  // namespace

std::vector<CalibrationPicture> draw_calibration(const CalibrationResult& result) {
  std::vector<CalibrationPicture> out;
  const auto add = [&](const std::string& name, const Picture& picture, std::string_view caption) {
    if (!picture.lines[0].empty()) out.push_back({name, plot_of(picture), std::string(caption)});
  };
  constexpr std::string_view all_strokes =
      "Recorded: all fitted strokes with the 95 % interval. SIMULATED: a selection of them.";
  for (const BaseCloth& cloth : result.cloths)
    add("spectrum-" + cloth.label, spectrum_of(result, cloth.label), all_strokes);
  add("modulation", modulation_histogram(result), "Simulated strokes by their typical modulation.");
  add("correlation", correlation_picture(result), all_strokes);
  add("repetition", repetition_picture(result),
      "Largest correlation over lags of 4 samples, for simulated strokes. No mark: no second "
      "repetition.");
  add("pattern", pattern_picture(result), all_strokes);
  return out;
}

Blocks calibration_pictures(const CalibrationResult& result, std::string_view badge_html) {
  Blocks out;
  for (const CalibrationPicture& picture : draw_calibration(result))
    out += figure(weft::daemon::picture(picture.plot), picture.caption, badge_html);
  return out;
}

}  // namespace weft::daemon::calibration
