#include "daemon/analysis/calibration/calibration_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr std::string_view page_title = "Calibration of the simulation";
constexpr std::string_view band_name = "band_";
constexpr std::size_t sides = 3;
constexpr std::array<std::string_view, sides> side_names{"recorded", "SIMULATED, estimates",
                                                         "SIMULATED, calibrated"};
constexpr std::array<std::string_view, sides> side_lines{"curve first", "curve limit",
                                                         "curve second"};
constexpr std::size_t histogram_bins = 10;
constexpr double picture_width = 420, picture_height = 250;
const svg::Box picture_area{62, 44, 346, 160};
constexpr double key_step = 140, key_y = 16, title_y = 36;

/// Recordings may be simulated themselves.
std::string sides_badge(const CalibrationSource& source) {
  return "recorded: " + bench_badge(source.bench) + ", beside " + simulated_badge();
}

/// Three lines on one pair of axes: recorded, simulated before and after.
struct Picture {
  std::string title, x_title, y_title;
  std::array<std::vector<svg::Point>, sides> lines;
  bool is_log_x = false, is_log_y = false;
  std::vector<std::string> names{};  ///< of whole numbers along x; empty: a scale
};

svg::Range range_along(const Picture& picture, double svg::Point::*axis, bool is_log) {
  std::vector<double> values;
  for (const auto& line : picture.lines)
    for (const svg::Point& p : line) values.push_back(p.*axis);
  return is_log ? svg::log_range_of(values) : svg::find_range(values);
}

void draw_x_axis(svg::Canvas& canvas, const svg::Axes& axes, const Picture& picture) {
  if (picture.is_log_x) return axes.draw_log_x(canvas, picture.x_title, general);
  if (picture.names.empty()) return axes.draw_x(canvas, picture.x_title, 5);
  const double below = picture_area.y + picture_area.height + 14;
  for (std::size_t i = 0; i < picture.names.size(); ++i)
    canvas.text({axes.x(static_cast<double>(i)), below + (i % 2 == 0 ? 0 : 13)}, picture.names[i],
                "tick", svg::Anchor::middle);
}

void draw_keys(svg::Canvas& canvas) {
  for (std::size_t side = 0; side < sides; ++side) {
    const double x = 12 + key_step * static_cast<double>(side);
    draw_mark(canvas, {x, key_y - 4}, side);
    canvas.text({x + 9, key_y}, side_names[side], "key");
  }
}

std::string svg_of(const Picture& picture) {
  svg::Canvas canvas(picture_width, picture_height,
                     picture.title + ", recorded and SIMULATED before and after");
  draw_keys(canvas);
  canvas.text({picture_area.x, title_y}, picture.title, "row-name");
  svg::Axes axes(picture_area, range_along(picture, &svg::Point::x, picture.is_log_x),
                 range_along(picture, &svg::Point::y, picture.is_log_y));
  axes.x.logarithmic = picture.is_log_x;
  axes.y.logarithmic = picture.is_log_y;
  draw_x_axis(canvas, axes, picture);
  if (picture.is_log_y)
    axes.draw_log_y(canvas, picture.y_title, general);
  else
    axes.draw_y(canvas, picture.y_title, 5);
  for (std::size_t side = 0; side < sides; ++side) {
    std::vector<svg::Point> points;
    for (const svg::Point& p : picture.lines[side]) points.push_back(axes.at(p.x, p.y));
    if (picture.names.empty()) canvas.polyline(points, side_lines[side]);
    for (const svg::Point& p : points) draw_mark(canvas, p, side);
  }
  return canvas.finish();
}

std::array<const RecordingView*, sides> views_of(const CalibrationResult& result) {
  return {&result.real, &result.before, &result.after};
}

/// Wave number, rms of the band that begins there. Recorded: of all fitted strokes.
Picture spectrum_of(const CalibrationResult& result, const std::string& cloth) {
  Picture out{"Spectrum of " + cloth, "band from [1/mm]", "rms of the modulation", {}, true, true};
  for (const ComparedStatistic& s : result.statistics) {
    if (s.real.cloth != cloth || !s.real.name.starts_with(band_name)) continue;
    const double from = std::strtod(s.real.name.c_str() + band_name.size(), nullptr);
    out.lines[0].push_back({from, s.real.shown});
    if (s.before) out.lines[1].push_back({from, from_scale(*s.before, s.real.scale)});
    if (s.after) out.lines[2].push_back({from, from_scale(*s.after, s.real.scale)});
  }
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

Picture modulation_histogram(const CalibrationResult& result) {
  Picture out{"Modulation of strokes", "modulation [%]", "strokes", {}, true, false};
  std::array<std::vector<double>, sides> values;
  std::vector<double> all;
  for (std::size_t side = 0; side < sides; ++side) {
    values[side] = stroke_modulations(*views_of(result)[side]);
    all.insert(all.end(), values[side].begin(), values[side].end());
  }
  const svg::Range range = svg::log_range_of(all);
  const double step = std::log(range.high / range.low) / histogram_bins;
  for (std::size_t side = 0; side < sides; ++side) {
    std::array<double, histogram_bins> counts{};
    for (const double value : values[side]) {
      if (!(value > 0)) continue;
      const double bin = std::clamp(std::log(value / range.low) / step, 0.0, histogram_bins - 1.0);
      ++counts[static_cast<std::size_t>(bin)];
    }
    for (std::size_t b = 0; b < histogram_bins; ++b)
      out.lines[side].push_back(
          {range.low * std::exp(step * (static_cast<double>(b) + 0.5)), counts[b]});
  }
  return out;
}

RecordingView strokes_of(const RecordingView& view, const std::string& cloth) {
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < view.strokes.size(); ++i)
    if (view.strokes[i].cloth == cloth) own.push_back(i);
  return subset(view, own);
}

Picture repetition_picture(const CalibrationResult& result) {
  Picture out{"Correlation of two repetitions of one path", {}, "correlation", {}, false, false};
  for (std::size_t c = 0; c < result.cloths.size(); ++c) {
    out.names.push_back(result.cloths[c].label);
    for (std::size_t side = 0; side < sides; ++side) {
      const RecordingView own = strokes_of(*views_of(result)[side], result.cloths[c].label);
      if (own.strokes.empty()) continue;
      const StatisticSet set = compute_statistics(own);
      if (const Statistic* one = find(set.statistics, "repetition"))
        out.lines[side].push_back({static_cast<double>(c), one->shown});
    }
  }
  return out;
}

std::string pictures(const CalibrationResult& result, const CalibrationSource& source) {
  std::string out = "<section>\n<h2>Signals</h2>\n<div class=\"pair\">\n";
  out += figure(svg_of(modulation_histogram(result)),
                "Strokes by their typical modulation, of the strokes that are simulated.",
                sides_badge(source));
  out += figure(svg_of(repetition_picture(result)),
                "Largest correlation over lags of 4 samples; of the strokes that are simulated. "
                "No mark: no second repetition.",
                sides_badge(source));
  for (const BaseCloth& cloth : result.cloths) {
    const Picture spectrum = spectrum_of(result, cloth.label);
    if (spectrum.lines[0].empty()) continue;
    out +=
        figure(svg_of(spectrum), "Recorded: all fitted strokes of the cloth.", sides_badge(source));
  }
  return out + "</div>\n</section>\n";
}

std::string interval_html(double low, double high) {
  return "<span class=\"interval-text\">" + general(low) + " to " + general(high) + "</span>";
}

std::string parameter_table(const CalibrationResult& result) {
  HtmlTable table({"parameter", "cloth", "standing", "estimate before", "value", "bounds, because"},
                  3);
  for (const CalibratedParameter& p : result.parameters)
    table.row({escape(p.parameter.name), escape(p.parameter.cloth), escape(to_string(p.standing)),
               general(p.parameter.start), general(p.value) + interval_html(p.low, p.high),
               general(p.parameter.low) + " to " + general(p.parameter.high) + ": " +
                   escape(p.parameter.reason)});
  return figure(
      "<div class=\"scroll\">" + table.finish() + "</div>",
      "Calibrated: the interval (95 %) is closed within the bounds. Bounded: on one side. Not "
      "seen: "
      "the recordings say nothing about it, and the estimate stays. Estimated: not fitted.",
      simulated_badge());
}

std::string value_html(const std::optional<double>& value, Scale scale) {
  return value ? general(from_scale(*value, scale)) : std::string(no_value);
}

std::string held_out_html(const CalibrationResult& result, const Statistic& like) {
  for (const HeldOutStatistic& s : result.held_out.statistics)
    if (s.real.name == like.name && s.real.cloth == like.cloth)
      return std::string(s.is_inside ? "inside" : "OUTSIDE") + ": " + general(s.real.shown) +
             interval_html(from_scale(s.low, s.real.scale), from_scale(s.high, s.real.scale));
  return std::string(no_value);
}

std::string statistic_table(const CalibrationResult& result, const CalibrationSource& source) {
  HtmlTable table({"statistic", "cloth", "recorded", "SIMULATED before", "SIMULATED after",
                   "fitted", "held out, and where simulated ones lie"},
                  2);
  for (const ComparedStatistic& s : result.statistics) {
    const Scale scale = s.real.scale;
    table.row(
        {escape(s.real.name), escape(s.real.cloth),
         general(s.real.shown) + interval_html(from_scale(s.low, scale), from_scale(s.high, scale)),
         value_html(s.before, scale), value_html(s.after, scale), s.is_fitted ? "yes" : "no",
         held_out_html(result, s.real)});
  }
  return figure("<div class=\"scroll\">" + table.finish() + "</div>",
                "Recorded with its 95 % interval by bootstrap. What is not fitted is derived from "
                "others, or moved by no parameter, and is shown as a check.",
                sides_badge(source));
}

std::string list_of(std::string_view title, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return {};
  std::string out = "<section>\n<h2>" + escape(title) + "</h2>\n<ul>\n";
  for (const std::string& sentence : sentences) out += "<li>" + escape(sentence) + "</li>\n";
  return out + "</ul>\n</section>\n";
}

std::string verdict_html(const HeldOutCheck& check) {
  if (!check.is_checked())
    return "<div class=\"note alarm\"><p>Not checked: too little is recorded to keep a part back. "
           "Name another data set with --held-out.</p></div>\n";
  return "<div class=\"note" + std::string(check.passes() ? "" : " alarm") + "\"><p>" +
         (check.passes() ? "Passes" : "Does not pass") + ": " + std::to_string(check.inside) +
         " of " + std::to_string(check.statistics.size()) +
         " statistics of recordings that were not fitted lie where 95 % of the simulated ones do. "
         "At least 80 % have to.</p></div>\n";
}

std::string provenance_html(const CalibrationResult& result, const CalibrationSource& source) {
  return "<section>\n<h2>How it was made</h2>\n<figure><dl>\n" +
         definition("command", source.command) + definition("files", joined(source.files)) +
         definition("data sets", joined(source.dataset_sha256)) +
         definition("held out",
                    source.held_out_file.empty() ? "part of these files" : source.held_out_file) +
         definition("strokes", std::to_string(result.fitted_strokes) + " fitted, " +
                                   std::to_string(result.simulated_strokes) +
                                   " of them simulated, " +
                                   std::to_string(result.held_out_strokes) + " held out") +
         definition("sum of squares", general(result.cost_before) + " before, " +
                                          general(result.cost_after) + " after, over " +
                                          std::to_string(result.targets) + " statistics") +
         definition("evaluations", std::to_string(result.evaluations)) +
         definition("software", "weft " + source.software +
                                    (source.commit.empty() ? "" : ", commit " + source.commit) +
                                    ", NLopt " + source.nlopt) +
         "</dl></figure>\n</section>\n";
}

}  // namespace

std::string calibration_html(const CalibrationResult& result, const CalibrationSource& source) {
  return page_around(
      page_title,
      "<header>" + simulated_badge() + "\n<h1>" + std::string(page_title) +
          "</h1>\n<p>Parameters of the simulation, fitted to statistics of recorded signals. No "
          "accuracy of a classifier was looked at.</p>\n</header>\n" +
          verdict_html(result.held_out) + pictures(result, source) +
          "<section>\n<h2>Parameters</h2>\n" + parameter_table(result) + "</section>\n" +
          list_of("What the recordings do not tell apart", result.blind_directions) +
          "<section>\n<h2>Statistics</h2>\n" + statistic_table(result, source) + "</section>\n" +
          list_of("Remarks", result.remarks) + provenance_html(result, source));
}

}  // namespace weft::daemon::calibration
