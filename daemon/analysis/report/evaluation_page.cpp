#include "daemon/analysis/report/evaluation_page.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/confusion.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t cores_shown = 10;

Blocks accuracy_table(const EvaluationPage& page) {
  const bool without_level = std::ranges::any_of(
      page.learners, [](const EvaluatedLearner& one) { return one.level_removed.has_value(); });
  std::vector<std::string> head{"learner", "accuracy [%]", "95 % interval", "pooled accuracy [%]",
                                "splits"};
  if (without_level) head.emplace_back("level removed [%]");
  HtmlTable table(head);
  std::vector<std::pair<std::string, std::string>> methods;
  for (const EvaluatedLearner& learner : page.learners) {
    const auto& e = learner.evaluation;
    std::vector<std::string> row{
        escape(learner.name) + (learner.chosen.empty() ? ""
                                                       : " <span class=\"dim\">chose " +
                                                             escape(learner.chosen) + "</span>"),
        percent(e.accuracy, 2), percent(e.ci95.low, 2) + " to " + percent(e.ci95.high, 2),
        percent(e.confusion.accuracy(), 2), std::to_string(e.splits.size())};
    if (without_level) row.push_back(format_level_removed(learner.level_removed));
    table.row(row);
    methods.emplace_back(learner.name, e.ci95.method);
  }
  std::string rows;
  for (const paper::Accuracy& row : paper::accuracies)
    rows += " " + std::string(row.exploration) + ": p-value " + percent(row.pvalue, 0) +
            " %, PCA " + percent(row.pca, 0) + " %" +
            (row.all < 0 ? "." : ", all features " + percent(row.all, 0) + " % (section IV-B).");
  return figure(table.finish(),
                "Test trials only. Interval: " + escape(methods_text(methods)) +
                    ". <span class=\"paper\">Paper, other real fabrics, Table IV:" + rows +
                    "</span>",
                report_badge(page.bench));
}

Blocks timing_table(const EvaluationPage& page) {
  HtmlTable table({"learner", "training, with choice and grid search", "test of one trial"});
  for (const EvaluatedLearner& learner : page.learners)
    table.row({escape(learner.name), duration(learner.evaluation.train_s),
               duration(learner.evaluation.test_s_per_sample)});
  const std::string features =
      page.feature_s_per_sample > 0
          ? "Features of one trial: " + duration(page.feature_s_per_sample) + ". "
          : "";
  return figure(table.finish(),
                features +
                    "Wall times on this computer, mean over the splits; one trial at a time on one "
                    "thread. <span class=\"paper\">Paper, Table II: features " +
                    fixed(paper::feature_s_per_sample, 3) + " s, training 0.566 s, test " +
                    fixed(paper::test_s_per_sample, 3) +
                    " s; its training time is very likely the final fit only.</span>",
                report_badge(page.bench));
}

Blocks core_table(const std::vector<CoreLine>& lines) {
  HtmlTable table({"core", "first features", "features", "least p", "C", "gamma", "CV errors"}, 2);
  for (const CoreLine& line : shown_cores(lines, cores_shown)) {
    table.row(
        {escape(line.a + " vs " + line.b), first_features_html(line),
         std::to_string(line.info->inputs),
         line.features.empty() ? std::string(no_value) : p_value_html(line.features.front().log_p),
         general(line.info->c), power_of_two_html(line.info->gamma),
         std::to_string(line.info->cv_errors) + " of " + std::to_string(line.info->train_rows)});
  }
  return table.finish();
}

Blocks core_figures(const EvaluationPage& page) {
  for (const EvaluatedLearner& learner : page.learners) {
    const classifier::FabricModel* cores = learner.evaluation.trained.cores();
    if (cores == nullptr || cores->reduction() != classifier::Reduction::pvalue) continue;
    return figure(
        core_table(core_lines(*cores)),
        "<b>" + escape(learner.name) +
            ".</b> Features chosen by cores in the first split (compare Table III): the "
            "paper\u2019s three pairs if present, then those with the most cross-validation "
            "errors. Subscripts name the feature and the taxel, superscripts the phase.",
        report_badge(page.bench));
  }
  return {};
}

Blocks reliability_table(const EvaluatedLearner& learner) {
  const auto rows = reliability_rows(*learner.evaluation.calibration);
  HtmlTable table(rows.front());
  for (const auto& row : std::span(rows).subspan(1)) table.row(row);
  return paragraph("<b>" + escape(learner.name) + "</b>") + table.finish();
}

std::string reliability_line(const EvaluatedLearner& learner) {
  const classifier::CalibrationCheck& check = *learner.evaluation.calibration;
  return "<b>Reliability of " + escape(learner.name) +
         "</b>: " + thousands(check.reliability.trials) + " predictions of " +
         thousands(check.recordings) + " recordings, calibration error " +
         escape(format_calibration(check)) + ". Intervals of bins: " + escape(bin_methods(check)) +
         "; of the error: " + escape(check.calibration_error_ci95.method) + ".";
}

Blocks curve_part(const EvaluationPage& page) {
  if (page.curve.empty()) return {};
  std::vector<std::string> head{"trials per label"};
  for (const CurveValue& value : page.curve.front().values) head.push_back(escape(value.learner));
  HtmlTable table(head);
  for (const CurvePoint& point : page.curve) {
    std::vector<std::string> row{std::to_string(point.trials)};
    for (const CurveValue& value : point.values)
      row.push_back(percent(value.accuracy, 2) + " \u00B1 " + percent(value.deviation, 2));
    table.row(row);
  }
  return figure(picture(learning_curve(page.curve)) + table.finish(),
                "Accuracy [%] and deviation over " + std::to_string(page.curve.front().draws) +
                    " draws of training trials; the test parts are the same.",
                report_badge(page.bench));
}

Blocks groups_part(const EvaluationPage& page) {
  if (page.groups.empty()) return {};
  std::vector<std::string> head{"tested group", "test trials"};
  for (const EvaluatedLearner& learner : page.learners) head.push_back(escape(learner.name));
  HtmlTable table(head);
  for (const GroupLeftOut& group : page.groups) {
    std::vector<std::string> row{escape(group.group), std::to_string(group.trials)};
    for (const double accuracy : group.accuracy) row.push_back(percent(accuracy, 2));
    table.row(row);
  }
  return figure(table.finish(), "Accuracy [%] on each group, trained on all others.",
                report_badge(page.bench));
}

Blocks confusion_part(const EvaluationPage& page) {
  Blocks out;
  for (const EvaluatedLearner& learner : page.learners) {
    const classifier::Confusion& confusion = learner.evaluation.confusion;
    const std::string title = "Confusion matrix, " + learner.name;
    out += figure(confusion_pictures(confusion, title),
                  "<b>" + escape(title) + ".</b> " + thousands(confusion.total()) +
                      " predictions. " + escape(worst_confusions(confusion, 3)),
                  report_badge(page.bench));
  }
  return side_by_side(std::move(out));
}

/// One line with the accuracy of each learner.
Blocks accuracy_lines(const EvaluationPage& page) {
  Blocks out;
  for (const EvaluatedLearner& learner : page.learners) {
    const auto& e = learner.evaluation;
    out += paragraph("<b>" + escape(learner.name) + ": " + percent(e.accuracy) +
                     " %</b> (95 %: " + percent(e.ci95.low) + " to " + percent(e.ci95.high) + ") " +
                     report_badge(page.bench));
  }
  return out;
}

double least_accuracy(const std::vector<CurvePoint>& curve) {
  double least = 1;
  for (const CurvePoint& point : curve)
    for (const CurveValue& value : point.values)
      least = std::min(least, value.accuracy - value.deviation);
  return std::max(0.0, std::floor(least * 20) / 20);
}

chart::Series curve_of(const std::vector<CurvePoint>& curve, std::size_t k) {
  chart::Series out{curve.front().values[k].learner, k, chart::Line::solid};
  for (const CurvePoint& point : curve) {
    const CurveValue& value = point.values[k];
    out.points.push_back({static_cast<double>(point.trials), value.accuracy * 100,
                          (value.accuracy - value.deviation) * 100,
                          std::min(1.0, value.accuracy + value.deviation) * 100});
  }
  return out;
}

/// Reliability diagram; bars below the diagonal in the same panel show the number of answers per
/// bin.
chart::Panel reliability_panel(const EvaluatedLearner& learner) {
  const classifier::CalibrationCheck& check = *learner.evaluation.calibration;
  chart::Panel out{learner.name,
                   {.title = "predicted probability", .low = 0, .high = 1},
                   {.title = "observed accuracy", .low = 0, .high = 1}};
  out.limits = {{.diagonal = true}};
  std::size_t most = 1;
  for (const auto& bin : check.reliability.bins) most = std::max(most, bin.count);
  chart::Series right{{}, 1};
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const classifier::ReliabilityBin& bin = check.reliability.bins[b];
    if (bin.count == 0) continue;
    constexpr double tallest = 0.25;
    const double share = static_cast<double>(bin.count) / static_cast<double>(most);
    out.areas.push_back({bin.low, bin.high, 0, tallest * share, {}, true});
    const classifier::Interval& sure = check.bins[b].observed_ci95;
    right.points.push_back({bin.predicted, bin.observed, sure.low, sure.high});
  }
  out.series = {std::move(right)};
  return out;
}

Blocks reliability_section(const EvaluationPage& page) {
  chart::Plot plot{"Reliability of each learner: observed accuracy against predicted probability"};
  plot.columns = 3;
  plot.width = 1000;
  plot.panel_height = 190;
  plot.shared_x = plot.shared_y = true;
  Blocks tables;
  std::vector<std::string> lines;
  for (const EvaluatedLearner& learner : page.learners) {
    if (!learner.evaluation.calibration) continue;
    plot.panels.push_back(reliability_panel(learner));
    tables += reliability_table(learner);
    lines.push_back(reliability_line(learner));
  }
  if (plot.panels.empty()) return {};
  plot.columns = std::min(plot.columns, plot.panels.size());
  if (plot.columns == 1) plot.width = 560;
  return section("Calibration of probabilities",
                 figure(picture(std::move(plot)) + bullet_list(lines),
                        "Predictions on test trials that were not used for training. On the dashed "
                        "line probabilities are calibrated; below it they are too high. Bars at "
                        "the bottom: number of predictions per bin, relative to the largest.",
                        report_badge(page.bench)) +
                     details("As tables", figure(std::move(tables), "The same values by bin.",
                                                 report_badge(page.bench))));
}

}  // namespace

std::vector<std::vector<std::string>> reliability_rows(const classifier::CalibrationCheck& check) {
  std::vector<std::vector<std::string>> out = {
      {"bin", "predictions", "recordings", "predicted", "observed", "95 % interval"}};
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const classifier::ReliabilityBin& bin = check.reliability.bins[b];
    if (bin.count == 0) continue;
    const classifier::Interval& sure = check.bins[b].observed_ci95;
    out.push_back({fixed(bin.low, 1) + " to " + fixed(bin.high, 1), thousands(bin.count),
                   thousands(check.bins[b].recordings), fixed(bin.predicted, 3),
                   fixed(bin.observed, 3), fixed(sure.low, 3) + " to " + fixed(sure.high, 3)});
  }
  return out;
}

std::string bin_methods(const classifier::CalibrationCheck& check) {
  std::vector<std::string> out;
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const std::string& method = check.bins[b].observed_ci95.method;
    if (check.reliability.bins[b].count > 0 && std::ranges::find(out, method) == out.end())
      out.push_back(method);
  }
  return joined(out, "; ");
}

std::string format_level_removed(const std::optional<classifier::Scores>& scores) {
  if (!scores) return "-";
  return percent(scores->accuracy, 2) + ", " + percent(scores->ci95.low, 2) + " to " +
         percent(scores->ci95.high, 2);
}

std::string format_calibration(const classifier::CalibrationCheck& check) {
  return fixed(check.reliability.calibration_error, 3) + " (95 % " +
         fixed(check.calibration_error_ci95.low, 3) + " to " +
         fixed(check.calibration_error_ci95.high, 3) + "), Brier " +
         fixed(check.reliability.brier, 3);
}

Document evaluation_document(const EvaluationPage& page) {
  Document out{"evaluation", "Evaluation of " + page.dataset, std::string(bench_name(page.bench))};
  out.result = section("Accuracy", accuracy_lines(page) + confusion_part(page));
  out.pictures = section("Learning curve", curve_part(page)) + reliability_section(page);
  out.tables = section("Accuracy of each learner", accuracy_table(page)) +
               section("Accuracy by group", groups_part(page)) +
               section("Features that separate two fabrics", core_figures(page)) +
               section("Timing", timing_table(page));
  out.alerts = warnings_of(page.facts);
  out.method = definitions(page.facts);
  return out;
}

chart::Plot learning_curve(const std::vector<CurvePoint>& curve) {
  chart::Plot out{"Accuracy against training trials per label"};
  if (curve.empty()) return out;
  out.width = 720;
  chart::Panel panel{{},
                     {.title = "training trials per label", .low = 0},
                     {.title = "accuracy [%]", .low = least_accuracy(curve) * 100, .high = 100.5}};
  panel.x.high = static_cast<double>(curve.back().trials) * 1.04;
  for (std::size_t k = 0; k < curve.front().values.size(); ++k)
    panel.series.push_back(curve_of(curve, k));
  out.panels = {std::move(panel)};
  return out;
}

}  // namespace weft::daemon
