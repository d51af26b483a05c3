#include "daemon/analysis/calibration/calibration_page.hpp"

#include <algorithm>
#include <array>

#include "daemon/analysis/calibration/calibration_pictures.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr std::string_view page_title = "Calibration of the simulation";

/// The recordings may be simulated themselves.
std::string sides_badge(const CalibrationSource& source) {
  return "recorded: " + bench_badge(source.bench) + ", compared with " + simulated_badge();
}

std::string interval_html(double low, double high) {
  if (!(low < high)) return {};
  return "<span class=\"interval-text\">" + general(low) + " to " + general(high) + "</span>";
}

std::string value_html(const std::optional<double>& value, Scale scale) {
  return value ? general(from_scale(*value, scale)) : std::string(no_value);
}

constexpr std::array all_standings{Standing::calibrated, Standing::bounded, Standing::not_seen,
                                   Standing::estimated};

std::string_view words_of(Standing standing) {
  return standing == Standing::not_seen ? "not determined" : to_string(standing);
}

std::string_view explanation_of(Standing standing) {
  switch (standing) {
    case Standing::calibrated:
      return "The recordings give a 95 % interval within the bounds.";
    case Standing::bounded:
      return "The recordings limit the value on one side only.";
    case Standing::not_seen:
      return "The recordings do not limit the value. The estimate is kept.";
    case Standing::estimated:
      return "The value was not fitted, or the recordings give no interval. It is not a "
             "measurement.";
  }
  return {};
}

/// Each standing, with its number of parameters.
Blocks standings(const CalibrationResult& result) {
  std::vector<std::pair<std::string, std::string>> out;
  for (const Standing standing : all_standings) {
    const auto count =
        std::ranges::count(result.parameters, standing, &CalibratedParameter::standing);
    out.emplace_back(std::to_string(count) + " " + std::string(words_of(standing)),
                     explanation_of(standing));
  }
  return definitions(out);
}

Blocks parameter_table(const CalibrationResult& result) {
  HtmlTable table(
      {"parameter", "fabric", "status", "previous estimate", "value", "bounds and reason"}, 3);
  for (const CalibratedParameter& p : result.parameters)
    table.row({escape(p.parameter.name), escape(p.parameter.cloth), escape(words_of(p.standing)),
               general(p.parameter.start), general(p.value) + interval_html(p.low, p.high),
               general(p.parameter.low) + " to " + general(p.parameter.high) + ": " +
                   escape(p.parameter.reason)});
  return figure(standings(result) + table.finish(),
                "Parameters of the simulation, with intervals of 95 %.", simulated_badge());
}

std::string inside_text(const ComparedStatistic& s) {
  if (!s.after || !s.has_interval()) return std::string(no_value);
  return *s.after >= s.low && *s.after <= s.high ? "inside" : "OUTSIDE";
}

Blocks statistic_table(const CalibrationResult& result, const CalibrationSource& source) {
  HtmlTable table({"statistic", "fabric", "use", "recorded", "SIMULATED before", "SIMULATED after",
                   "after, in interval"},
                  3);
  for (const ComparedStatistic& s : result.statistics) {
    const Scale scale = s.real.scale;
    table.row(
        {escape(s.real.name), escape(s.real.cloth), s.is_fitted ? "fitted" : "check only",
         general(s.real.shown) + interval_html(from_scale(s.low, scale), from_scale(s.high, scale)),
         value_html(s.before, scale), value_html(s.after, scale), inside_text(s)});
  }
  return figure(table.finish(),
                "The column \"recorded\" has the 95 % bootstrap interval. A statistic is \"check "
                "only\" if it is derived from others, used by an estimator, or not affected by a "
                "parameter.",
                sides_badge(source));
}

/// check_held_out() leaves the interval empty if too few simulated sets have the statistic.
std::string band_html(const HeldOutStatistic& s) {
  if (!(s.low < s.high)) return "too few simulated sets";
  return general(from_scale(s.low, s.real.scale)) + " to " +
         general(from_scale(s.high, s.real.scale));
}

Blocks held_out_section(const CalibrationResult& result, const CalibrationSource& source) {
  if (!result.held_out.is_checked()) return {};
  HtmlTable table({"statistic", "fabric", "held out", "95 % of SIMULATED sets", "inside"}, 2);
  for (const HeldOutStatistic& s : result.held_out.statistics)
    table.row({escape(s.real.name), escape(s.real.cloth), general(s.real.shown), band_html(s),
               s.is_inside ? "inside" : "OUTSIDE"});
  return section("Held-out check",
                 figure(table.finish(),
                        "Recordings not used for the fit, and the range of the same strokes "
                        "simulated with other seeds.",
                        sides_badge(source)));
}

Blocks list_of(std::string_view title, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return {};
  std::vector<std::string> items;
  for (const std::string& sentence : sentences) items.push_back(escape(sentence));
  return section(std::string(title), bullet_list(items));
}

Blocks verdict(const HeldOutCheck& check) {
  if (!check.is_checked()) return alarm("Not checked. " + escape(check.why_not));
  const std::string text =
      std::string(check.passes() ? "Passed" : "Failed") + ": " + std::to_string(check.inside) +
      " of " + std::to_string(check.statistics.size()) +
      " statistics of the held-out recordings lie in the 95 % range of the simulated ones "
      "(expected at least 80 %).";
  return check.passes() ? note(text) : alarm(text);
}

std::string held_out_text(const CalibrationResult& result, const CalibrationSource& source) {
  if (!result.held_out.is_checked()) return "nothing";
  return source.held_out_file.empty() ? "part of these files" : source.held_out_file;
}

std::string fitted_text(const CalibrationResult& result) {
  std::vector<std::string> labels;
  for (const BaseCloth& cloth : result.cloths)
    labels.push_back(cloth.label + " (started from " + cloth.taken + ")");
  return joined(labels);
}

std::string strokes_text(const CalibrationResult& result) {
  return std::to_string(result.fitted_strokes) + " fitted, " +
         std::to_string(result.simulated_strokes) + " of them simulated, " +
         std::to_string(result.held_out_strokes) + " held out";
}

std::string software_text(const CalibrationSource& source) {
  return "weft " + source.software + (source.commit.empty() ? "" : ", commit " + source.commit) +
         ", NLopt " + source.nlopt;
}

Blocks provenance(const CalibrationResult& result, const CalibrationSource& source) {
  const Blocks facts = definitions(
      {{"fabrics", fitted_text(result)},
       {"command", source.command},
       {"files", joined(source.files)},
       {"data sets", joined(source.dataset_sha256)},
       {"held out", held_out_text(result, source)},
       {"strokes", strokes_text(result)},
       {"seed", std::to_string(result.seed)},
       {"sum of squares", general(result.cost_before) + " before, " + general(result.cost_after) +
                              " after, over " + std::to_string(result.targets) + " statistics"},
       {"evaluations", std::to_string(result.evaluations)},
       {"software", software_text(source)}});
  return figure(facts, "Data and settings of the fit.", sides_badge(source));
}

constexpr std::string_view not_computed_html =
    "The intraclass correlation of features is not computed here, because it needs the "
    "classifier. The accuracy of a classifier is not computed either: <code>weft fabric "
    "evaluate</code> "
    "trains and tests on the groups of a data set. A passed calibration makes signals similar; it "
    "does not guarantee an accuracy. <code>docs/howto/calibrate-the-simulation.md</code> explains "
    "this "
    "page.";

}  // namespace

Document calibration_document(const CalibrationResult& result, const CalibrationSource& source) {
  Document out{"calibration", std::string(page_title),
               std::string(bench_text(BenchKind::simulated))};
  out.lead_html =
      "Parameters of the simulation, fitted to statistics of recorded signals. No accuracy of a "
      "classifier was used.";
  out.result = verdict(result.held_out);
  out.pictures =
      section("Signals", side_by_side(calibration_pictures(result, sides_badge(source))));
  out.tables = section("Statistics", statistic_table(result, source)) +
               section("Parameters", parameter_table(result)) + held_out_section(result, source) +
               list_of("Parameters that the recordings cannot separate", result.blind_directions) +
               list_of("Remarks", result.remarks);
  out.method = paragraph(std::string(not_computed_html));
  out.provenance = provenance(result, source);
  return out;
}

}  // namespace weft::daemon::calibration
