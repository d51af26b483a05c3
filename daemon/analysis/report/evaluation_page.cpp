#include "daemon/analysis/report/evaluation_page.hpp"

#include <algorithm>
#include <numeric>
#include <span>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t cores_shown = 10;

std::string section(std::string_view title, const std::string& body_html) {
  return body_html.empty()
             ? std::string()
             : "<section>\n<h2>" + escape(title) + "</h2>\n" + body_html + "</section>\n";
}

std::string heading(const EvaluationPage& page) {
  std::string out = "<header>" + report_badge(page.bench) + "\n<h1>Evaluation of " +
                    escape(page.dataset) + "</h1>\n</header>\n<dl>";
  for (const auto& [name, value] : page.facts)
    out += "<dt>" + escape(name) + "</dt><dd>" + escape(value) + "</dd>\n";
  return out + "</dl>\n";
}

std::string accuracy_table(const EvaluationPage& page) {
  const bool without_level = std::ranges::any_of(
      page.learners, [](const EvaluatedLearner& one) { return one.level_removed.has_value(); });
  std::vector<std::string> head{"learner", "accuracy [%]", "95 % interval", "of all answers [%]",
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
                "Test trials alone. Interval: " + escape(methods_text(methods)) +
                    ". <span class=\"paper\">The paper, real fabrics of its own, Table IV:" + rows +
                    "</span>",
                report_badge(page.bench));
}

std::string timing_table(const EvaluationPage& page) {
  HtmlTable table({"learner", "training, choice and grid search included", "test of one trial"});
  for (const EvaluatedLearner& learner : page.learners)
    table.row({escape(learner.name), duration(learner.evaluation.train_s),
               duration(learner.evaluation.test_s_per_sample)});
  const std::string features =
      page.feature_s_per_sample > 0
          ? "Features of one trial: " + duration(page.feature_s_per_sample) + ". "
          : "";
  return figure(table.finish(),
                features +
                    "Wall times on this machine, mean over the splits; one trial at a time, on one "
                    "thread. <span class=\"paper\">The paper, Table II: features " +
                    fixed(paper::feature_s_per_sample, 3) + " s, training 0.566 s, test " +
                    fixed(paper::test_s_per_sample, 3) +
                    " s; its training is very likely the final fit alone.</span>",
                report_badge(page.bench));
}

std::string core_table(const std::vector<CoreLine>& lines) {
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

std::string core_figures(const EvaluationPage& page) {
  for (const EvaluatedLearner& learner : page.learners) {
    const classifier::FabricModel* cores = learner.evaluation.trained.cores();
    if (cores == nullptr || cores->reduction() != classifier::Reduction::pvalue) continue;
    return figure(core_table(core_lines(*cores)),
                  "<b>" + escape(learner.name) +
                      ".</b> Features that cores chose in the first split (compare Table III): the "
                      "paper\u2019s three pairs where they are here, then those with the most "
                      "cross-validation errors. Lower indices name the feature and the pad, upper "
                      "ones the phase.",
                  report_badge(page.bench));
  }
  return {};
}

std::string reliability_part(const EvaluatedLearner& learner, const EvaluationPage& page) {
  if (!learner.evaluation.calibration) return {};
  const classifier::CalibrationCheck& check = *learner.evaluation.calibration;
  const auto rows = reliability_rows(check);
  HtmlTable table(rows.front());
  for (const auto& row : std::span(rows).subspan(1)) table.row(row);
  const std::string title = "Reliability of " + learner.name;
  return figure(
      "<div class=\"scroll\">" + reliability_figure(check, title) + "</div>\n" + table.finish(),
      "<b>" + escape(title) + ".</b> " + thousands(check.reliability.trials) +
          " answers on test trials of " + thousands(check.recordings) +
          " recordings; nothing of it was learnt from them. Calibration error " +
          escape(format_calibration(check)) +
          ". On the dashed line probabilities mean what they say; below it they are too "
          "bold. Intervals of bins: " +
          escape(bin_methods(check)) +
          "; of the error: " + escape(check.calibration_error_ci95.method) + ".",
      report_badge(page.bench));
}

std::string curve_part(const EvaluationPage& page) {
  if (page.curve.empty()) return {};
  std::vector<std::string> head{"trials of each label"};
  for (const CurveValue& value : page.curve.front().values) head.push_back(escape(value.learner));
  HtmlTable table(head);
  for (const CurvePoint& point : page.curve) {
    std::vector<std::string> row{std::to_string(point.trials)};
    for (const CurveValue& value : point.values)
      row.push_back(percent(value.accuracy, 2) + " \u00B1 " + percent(value.deviation, 2));
    table.row(row);
  }
  return figure(
      "<div class=\"scroll\">" + learning_curve_figure(page.curve) + "</div>\n" + table.finish(),
      "Accuracy [%] and deviation over " + std::to_string(page.curve.front().draws) +
          " draws of training trials; the test parts stay the same.",
      report_badge(page.bench));
}

std::string groups_part(const EvaluationPage& page) {
  if (page.groups.empty()) return {};
  std::vector<std::string> head{"group left out", "test trials"};
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

std::string confusion_part(const EvaluationPage& page) {
  std::string out;
  for (const EvaluatedLearner& learner : page.learners) {
    const classifier::Confusion& confusion = learner.evaluation.confusion;
    const std::string title = "Confusion, " + learner.name;
    out += figure("<div class=\"scroll\">" + confusion_map(confusion, title) + "</div>\n",
                  "<b>" + escape(title) + ".</b> " + thousands(confusion.total()) + " answers. " +
                      escape(worst_confusions(confusion, 3)),
                  report_badge(page.bench));
  }
  return out.empty() ? out : "<div class=\"pair\">\n" + out + "</div>\n";
}

using svg::Anchor;
using svg::Axes;
using svg::Canvas;

constexpr double page_width = 560;

void draw_counts(Canvas& canvas, const Axes& axes, const classifier::Reliability& figures) {
  std::size_t most = 1;
  for (const auto& bin : figures.bins) most = std::max(most, bin.count);
  for (const auto& bin : figures.bins) {
    const double share = static_cast<double>(bin.count) / static_cast<double>(most);
    const double left = axes.x(bin.low) + 2, right = axes.x(bin.high) - 2;
    const double top = axes.y(share);
    canvas.rect({left, top, right - left, axes.y(0) - top}, "bar", 0.5);
    if (bin.count > 0)
      canvas.text({(left + right) / 2, top - 4}, std::to_string(bin.count), "tick", Anchor::middle);
  }
}

void draw_bins(Canvas& canvas, const Axes& axes, const classifier::CalibrationCheck& check) {
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const classifier::ReliabilityBin& bin = check.reliability.bins[b];
    if (bin.count == 0) continue;
    const classifier::Interval& sure = check.bins[b].observed_ci95;
    canvas.line(axes.at(bin.predicted, sure.low), axes.at(bin.predicted, sure.high), "interval");
    canvas.circle(axes.at(bin.predicted, bin.observed), 4.5, "mark");
  }
}

svg::Range accuracy_range(const std::vector<CurvePoint>& curve) {
  std::vector<double> values;
  for (const CurvePoint& point : curve)
    for (const CurveValue& value : point.values) {
      values.push_back((value.accuracy - value.deviation) * 100);
      values.push_back((value.accuracy + value.deviation) * 100);
    }
  svg::Range out = svg::find_range(values);
  out.high = std::min(out.high, 100.5);
  return out;
}

// The points of learner `k`, in pixels.
std::vector<svg::Point> make_points(const Axes& axes, const std::vector<CurvePoint>& curve,
                                    std::size_t k) {
  std::vector<svg::Point> out;
  for (const CurvePoint& point : curve)
    out.push_back(axes.at(static_cast<double>(point.trials), point.values[k].accuracy * 100));
  return out;
}

void draw_learner(Canvas& canvas, const Axes& axes, const std::vector<CurvePoint>& curve,
                  std::size_t k) {
  const std::vector<svg::Point> points = make_points(axes, curve, k);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const CurveValue& value = curve[i].values[k];
    const double low = axes.y((value.accuracy - value.deviation) * 100);
    const double high = axes.y(std::min(1.0, value.accuracy + value.deviation) * 100);
    canvas.line({points[i].x, low}, {points[i].x, high}, "whisker " + mark_class(k));
    if (i > 0) canvas.line(points[i - 1], points[i], "curve " + mark_class(k));
  }
  for (const svg::Point& point : points) draw_mark(canvas, point, k);
}

// Names one below the other, as near to where their lines end as their height allows.
void draw_names(Canvas& canvas, const Axes& axes, const CurvePoint& last) {
  constexpr double height = 15;
  std::vector<double> y;
  for (const CurveValue& value : last.values) y.push_back(axes.y(value.accuracy * 100));
  std::vector<std::size_t> order(y.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return y[k]; });
  for (std::size_t i = 1; i < order.size(); ++i)
    y[order[i]] = std::max(y[order[i]], y[order[i - 1]] + height);
  double bottom = axes.area.y + axes.area.height;
  for (std::size_t i = order.size(); i-- > 0; bottom -= height)
    y[order[i]] = bottom = std::min(y[order[i]], bottom);
  const double x = axes.x(static_cast<double>(last.trials)) + 20;
  for (std::size_t k = 0; k < y.size(); ++k) {
    draw_mark(canvas, {x, y[k]}, k);
    canvas.text({x + 10, y[k] + 4}, last.values[k].learner, "key");
  }
}

}  // namespace

std::vector<std::vector<std::string>> reliability_rows(const classifier::CalibrationCheck& check) {
  std::vector<std::vector<std::string>> out = {
      {"said", "answers", "recordings", "mean said", "right", "95 % interval"}};
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

std::string evaluation_html(const EvaluationPage& page) {
  std::string reliability;
  for (const EvaluatedLearner& learner : page.learners)
    reliability += reliability_part(learner, page);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
         escape(page.dataset) + " (" + escape(to_string(page.bench)) +
         ") \u2013 Weft evaluation</title>\n<style>" + std::string(style_sheet()) +
         std::string(marks_style()) + "</style>\n</head>\n<body>\n<main>\n" + heading(page) +
         section("How often it is right", accuracy_table(page)) +
         section("Each group left out", groups_part(page)) +
         section("What more training trials bring", curve_part(page)) +
         section("What a probability is worth", reliability) +
         section("What tells two fabrics apart", core_figures(page)) +
         section("How long it takes", timing_table(page)) +
         section("What is taken for what", confusion_part(page)) + "</main>\n</body>\n</html>\n";
}

std::string reliability_figure(const classifier::CalibrationCheck& check, std::string_view title) {
  Canvas canvas(page_width, 470, title, "plot narrow");
  const Axes axes({60, 16, page_width - 84, 280}, {0, 1}, {0, 1});
  axes.draw_x(canvas, "probability said", 10);
  axes.draw_y(canvas, "share that was right", 5);
  canvas.line(axes.at(0, 0), axes.at(1, 1), "limit");
  draw_bins(canvas, axes, check);
  const Axes counts({60, 370, page_width - 84, 80}, {0, 1}, {0, 1});
  canvas.line(counts.at(0, 0), counts.at(1, 0), "axis");
  canvas.text({60, 356}, "answers", "key");
  draw_counts(canvas, counts, check.reliability);
  return canvas.finish();
}

std::string learning_curve_figure(const std::vector<CurvePoint>& curve) {
  if (curve.empty()) return {};
  Canvas canvas(page_width, 330, "Accuracy against training trials of each label", "plot narrow");
  const double last = static_cast<double>(curve.back().trials);
  const Axes axes({60, 16, page_width - 170, 256}, {0, last * 1.04}, accuracy_range(curve));
  axes.draw_x(canvas, "training trials of each label", 8);
  axes.draw_y(canvas, "accuracy [%]", 6);
  for (std::size_t k = 0; k < curve.front().values.size(); ++k)
    draw_learner(canvas, axes, curve, k);
  draw_names(canvas, axes, curve.back());
  return canvas.finish();
}

}  // namespace weft::daemon
