#include <algorithm>
#include <cmath>
#include <functional>

#include "classifier/fabric/model.hpp"
#include "daemon/analysis/report/accuracy_cells.hpp"
#include "daemon/analysis/report/confounding.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"
#include "daemon/pages/plot/svg.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;
using svg::Anchor;
using svg::Axes;
using svg::Canvas;

constexpr double figure_width = 560;  // fits a phone without scrolling

std::string accuracy_table(const std::vector<ExplorationResult>& results) {
  HtmlTable table({"exploration", "p-value selection [%]", "PCA [%]", "all features [%]",
                   "labels shuffled [%]"});
  for (const ExplorationResult& result : results) {
    const auto add = [&](const std::string& what, const std::vector<ReductionResult>& reached,
                         const std::string& shuffled) {
      table.row({escape(result.exploration) + what, accuracy_html(reached, Reduction::pvalue),
                 accuracy_html(reached, Reduction::pca), accuracy_html(reached, Reduction::all),
                 shuffled});
    };
    add(", this run", result.reductions, percent(result.permuted_accuracy));
    if (!result.level_removed.empty())
      add(", levels removed", result.level_removed, std::string(no_value));
  }
  for (const paper::Accuracy& row : paper::accuracies_beside(results))
    table.row(
        {"<span class=\"paper\">" + std::string(row.exploration) + ", paper, real fabrics</span>",
         printed_share_html(row.pvalue), printed_share_html(row.pca), printed_share_html(row.all),
         std::string(no_value)});
  return table.finish();
}

std::string format_split(const classifier::Evaluation& e) {
  return std::to_string(e.splits.size()) + (e.splits.size() == 1 ? " split" : " random splits");
}

/// What a test trial shares with training trials, and what that does not test.
std::string_view repetition_note(Repeated repeated) {
  switch (repeated) {
    case Repeated::unknown:
      return "The data set does not say what of its cloth a trial touched. ";
    case Repeated::touch:
      return "Every repetition retraces the path of the one before on the same mounted piece: "
             "nothing is said about another place of it, another mounting or another piece. The "
             "paper fastened each fabric once (section IV-A); it does not say whether the path was "
             "retraced. ";
    case Repeated::patch:
      return "Every repetition touches another patch of a piece that was mounted once: nothing is "
             "said about another mounting or another piece. ";
    case Repeated::mounting:
      return "The cloth was mounted several times, and trials of one mounting may be on both sides "
             "of a split; all are of one piece. ";
    case Repeated::piece:
      return "A fabric has several pieces, and trials of one may be on both sides of a split: weft "
             "fabric evaluate --group piece asks about pieces that were not trained on. ";
  }
  return {};
}

/// That label and mounting are one, and of how many splits the rows are that show how much.
std::string confounding_note(const ExplorationResult& result) {
  if (!result.confounded) return {};
  std::string out = "Here " + std::string(confounded_with_mounting) + ". ";
  if (!result.level_removed.empty())
    out += "\u201cLevels removed\u201d: each pad minus its mean of phase M, " +
           format_split(result.level_removed.front().evaluation) + ". ";
  return out;
}

std::string format_method(const ReportInput& input, const ExplorationResult& result,
                          const classifier::Evaluation& e) {
  const std::size_t classes = e.confusion.classes();
  std::string out = "<p>Each trial becomes " + thousands(result.features) +
                    " features; one support vector machine per pair of fabrics (" +
                    thousands(classifier::pair_count(classes)) + " cores) votes. Mean over " +
                    format_split(e) + " of the trials into training and test part. ";
  out += repetition_note(repeated_in(input.dataset));
  out += confounding_note(result);
  if (classes > 0)
    out += "With its labels in random order the same method gets " +
           percent(result.permuted_accuracy) + " %, where chance is " +
           percent(1.0 / static_cast<double>(classes)) + " %.";
  return out + "</p>\n";
}

std::string table_caption(const std::vector<ExplorationResult>& results) {
  const std::string ours =
      "Mean accuracy, below it its 95 % interval (" + escape(interval_methods(results)) + ").";
  if (paper::accuracies_beside(results).empty()) return ours;
  return ours +
         " The paper\u2019s figures were measured on real fabrics and are not comparable one to "
         "one; its Table II gives " +
         percent(paper::accuracy_table2, 2) +
         " %. Its 89 % for all features is in the text of section IV-B, which ascribes Figure 9a "
         "to them; the caption of Figure 9 ascribes both matrices to p-value selection.";
}

std::string confusion_figure(const ExplorationResult& result, const std::string& badge) {
  const classifier::Evaluation* e = result.find(Reduction::pvalue);
  if (e == nullptr) return {};
  const std::string title = "Confusion matrix " + result.exploration + ", p-value selection";
  return figure("<div class=\"scroll\">" + confusion_map(e->confusion, title) + "</div>\n",
                "<b>" + escape(title) + ".</b> " + thousands(e->confusion.total()) +
                    " test trials summed over " + format_split(*e) + ", " +
                    thousands(e->confusion.correct()) +
                    " correct. Blue: right; orange: wrong; shade: root of the share of its row. " +
                    escape(worst_confusions(e->confusion, 3)),
                badge);
}

std::string_view reduction_text(Reduction reduction) {
  if (reduction == Reduction::pvalue) return "p-value";
  return reduction == Reduction::pca ? "PCA" : "all features";
}

double paper_accuracy(const ExplorationResult& result, Reduction reduction) {
  for (const paper::Accuracy& row : paper::accuracies) {
    if (!paper::is_papers(result, row.exploration)) continue;
    if (reduction == Reduction::pvalue) return row.pvalue;
    return reduction == Reduction::pca ? row.pca : row.all;
  }
  return -1;
}

double accuracy_floor(const std::vector<ExplorationResult>& results) {
  double least = 0.85;
  for (const ExplorationResult& result : results)
    for (const ReductionResult& r : result.reductions)
      least = std::min(least, r.evaluation.ci95.low);
  return std::max(0.0, std::floor(least * 20 - 0.2) / 20);
}

void draw_accuracy(Canvas& canvas, const Axes& axes, double y, const classifier::Evaluation& e) {
  const double low = axes.x(e.ci95.low * 100), high = axes.x(e.ci95.high * 100);
  canvas.line({low, y}, {high, y}, "interval");
  canvas.line({low, y - 4}, {low, y + 4}, "interval");
  canvas.line({high, y - 4}, {high, y + 4}, "interval");
  canvas.circle({axes.x(e.accuracy * 100), y}, 5, "mark");
}

/// Accuracy with its interval for each exploration and reduction; the paper's as hollow diamonds.
std::string accuracy_figure(const std::vector<ExplorationResult>& results) {
  std::size_t rows = 0;
  for (const ExplorationResult& result : results) rows += result.reductions.size();
  const double height =
      26.0 * static_cast<double>(rows) + 10.0 * static_cast<double>(results.size());
  Canvas canvas(figure_width, height + 86, "Accuracy by exploration and reduction", "plot narrow");
  const Axes axes({150, 34, figure_width - 170, height}, {accuracy_floor(results) * 100, 100.5},
                  {0, 1});
  axes.draw_x(canvas, "accuracy [%]", 8);
  double y = axes.area.y + 16;
  for (const ExplorationResult& result : results) {
    for (const ReductionResult& r : result.reductions) {
      canvas.text({140, y + 4},
                  result.exploration + "  " + std::string(reduction_text(r.reduction)), "row-name",
                  Anchor::end);
      const double printed = paper_accuracy(result, r.reduction);
      if (printed >= 0) canvas.diamond({axes.x(printed * 100), y}, 7, "paper-mark");
      draw_accuracy(canvas, axes, y, r.evaluation);
      y += 26;
    }
    y += 10;
  }
  canvas.circle({20, 14}, 5, "mark");
  canvas.text({31, 18}, "this run, with 95 % interval", "key");
  if (!paper::accuracies_beside(results).empty()) {
    canvas.diamond({236, 14}, 7, "paper-mark");
    canvas.text({248, 18}, "printed in the paper, real fabrics", "key");
  }
  return canvas.finish();
}

constexpr std::size_t cores_beside_paper = 7;

std::string printed_features(const CoreLine& line) {
  const paper::Core* core = paper_core(line);
  if (core == nullptr) return std::string(no_value);
  std::string out;
  for (const std::string_view name : core->top)
    if (!name.empty()) out += feature_html(name) + " ";
  return "<span class=\"paper\">" + out + "</span>";
}

std::string printed_inputs(const CoreLine& line) {
  const paper::Core* core = paper_core(line);
  return core == nullptr ? std::string(no_value)
                         : "<span class=\"paper\">" + std::to_string(core->inputs) + "</span>";
}

/// `beside`: the paper's figures of its three pairs too.
std::string table_of_cores(const std::vector<CoreLine>& lines, bool beside) {
  std::vector<std::string> head{"core", "top four features"};
  if (beside) head.push_back("<span class=\"paper\">paper, real fabrics</span>");
  head.push_back("features");
  if (beside) head.push_back("<span class=\"paper\">paper</span>");
  for (const char* const name : {"least p", "delta", "C", "gamma", "CV errors"})
    head.emplace_back(name);
  HtmlTable table(head, beside ? 3 : 2);
  for (const CoreLine& line : shown_cores(lines, cores_beside_paper, beside)) {
    std::vector<std::string> cells{escape(line.a + " vs " + line.b), first_features_html(line)};
    if (beside) cells.push_back(printed_features(line));
    cells.push_back(std::to_string(line.info->inputs));
    if (beside) cells.push_back(printed_inputs(line));
    cells.insert(
        cells.end(),
        {line.features.empty() ? std::string(no_value) : p_value_html(line.features.front().log_p),
         general(line.info->threshold), general(line.info->c), power_of_two_html(line.info->gamma),
         std::to_string(line.info->cv_errors) + " of " + std::to_string(line.info->train_rows)});
    table.row(cells);
  }
  return table.finish();
}

std::string format_size(const std::vector<CoreLine>& lines) {
  std::vector<std::size_t> inputs;
  for (const CoreLine& line : lines) inputs.push_back(line.info->inputs);
  std::sort(inputs.begin(), inputs.end());
  if (inputs.empty()) return {};
  return "Over all " + thousands(inputs.size()) + " cores: " + std::to_string(inputs.front()) +
         " to " + std::to_string(inputs.back()) + " features, median " +
         std::to_string(inputs[inputs.size() / 2]) + ".";
}

std::string measured(double seconds) {
  return seconds > 0 ? duration(seconds) : "<span class=\"dim\">not measured</span>";
}

// As printed, with the paper's three decimals.
std::string printed(double seconds) {
  return "<span class=\"paper\">" + fixed(seconds, 3) + " s</span>";
}

using Cell = std::function<std::string(const ExplorationResult&)>;

// One column per exploration, then the paper's where it has any of them.
void add_row(HtmlTable& table, const std::vector<ExplorationResult>& results,
             const std::string& name, const Cell& cell, const std::string& paper_html) {
  std::vector<std::string> cells = {name};
  for (const ExplorationResult& result : results) cells.push_back(cell(result));
  if (!paper::accuracies_beside(results).empty())
    cells.push_back(paper_html.empty() ? std::string(no_value) : paper_html);
  table.row(cells);
}

Cell evaluated(Reduction reduction, double classifier::Evaluation::*seconds) {
  return [reduction, seconds](const ExplorationResult& result) {
    const classifier::Evaluation* e = result.find(reduction);
    return e == nullptr ? std::string(no_value) : measured(e->*seconds);
  };
}

std::string printed_training(double paper::TrainingTime::*seconds) {
  std::string out;
  for (const paper::TrainingTime& row : paper::training_times)
    out += (out.empty() ? "" : "; ") + std::string(row.exploration) + " " + printed(row.*seconds);
  return out;
}

std::string timing_table(const std::vector<ExplorationResult>& results) {
  std::vector<std::string> head = {"step"};
  for (const ExplorationResult& result : results)
    head.push_back(escape(result.exploration) + ", this run");
  if (!paper::accuracies_beside(results).empty())
    head.push_back("<span class=\"paper\">paper, its own machine</span>");
  HtmlTable table(head);
  const auto features = [](const ExplorationResult& r) { return measured(r.feature_s_per_sample); };
  add_row(table, results, "features of one trial", features, printed(paper::feature_s_per_sample));
  const auto train_s = &classifier::Evaluation::train_s;
  const auto test_s = &classifier::Evaluation::test_s_per_sample;
  add_row(table, results, "training, p-value", evaluated(Reduction::pvalue, train_s),
          printed_training(&paper::TrainingTime::pvalue_s));
  add_row(table, results, "training, PCA", evaluated(Reduction::pca, train_s),
          printed_training(&paper::TrainingTime::pca_s));
  add_row(table, results, "training, all features", evaluated(Reduction::all, train_s), "");
  add_row(table, results, "test of one trial, p-value", evaluated(Reduction::pvalue, test_s),
          printed(paper::test_s_per_sample));
  add_row(table, results, "test of one trial, PCA", evaluated(Reduction::pca, test_s), "");
  add_row(table, results, "test of one trial, all features", evaluated(Reduction::all, test_s), "");
  return table.finish();
}

std::size_t total_fits(const classifier::Evaluation& e) {
  std::size_t fits = 0;
  for (const classifier::FabricCore& core : e.trained.cores()->cores()) fits += core.info().fits;
  return fits;
}

std::string timing_caption(const std::vector<ExplorationResult>& results) {
  const ExplorationResult& result = results.front();
  std::string out = "Wall times of this software on this machine";
  const classifier::Evaluation* e = result.find(Reduction::pvalue);
  if (e != nullptr)
    out += ". Training is selection, grid search (" + thousands(total_fits(*e)) +
           " machines solved for p-value) and final fit of all cores, on " +
           std::to_string(result.threads) +
           " threads, mean over the splits; features and test "
           "are one trial at a time on one thread, vote included";
  if (paper::accuracies_beside(results).empty()) return out + ".";
  return out +
         ". <b>The training times are not comparable:</b> the paper\u2019s 0.566 s is 4.2 ms per "
         "core, about one MATLAB fit each, so it is very likely the final fit with parameters "
         "already known, without the grid search that ours includes (our inference; the paper "
         "does not say, nor does it name its machine). The paper\u2019s feature and test times are "
         "from Table II, whose training time is that of M2 in Table IV.";
}

std::string headline_html(const ReportInput& input) {
  std::string out;
  for (const Headline& headline : input.headlines)
    out += "<p class=\"headline\"><b>" + escape(headline_text(headline)) + ".</b> " +
           badge_html(input) + "</p>\n";
  return out;
}

std::string other_protocols_html(const ReportInput& input) {
  std::string out = "<ul>\n";
  for (const OtherProtocol& other : other_protocols(true, has_learning_curve(input)))
    out += "<li>" + escape(std::string(other.text)) + "</li>\n";
  return out + "</ul>\n";
}

}  // namespace

std::string accuracy_section(const ReportInput& input) {
  if (input.results.empty() || input.results.front().reductions.empty())
    return input.headlines.empty()
               ? ""
               : "<section>\n<h2>Which one was it?</h2>\n" + headline_html(input) + "</section>\n";
  const std::string badge = badge_html(input);
  const ExplorationResult& first = input.results.front();
  const classifier::Evaluation& e = first.reductions.front().evaluation;
  std::string out = "<section>\n<h2>Which fabric was it?</h2>\n" + headline_html(input) +
                    "<details><summary>Other protocols</summary>\n" + other_protocols_html(input) +
                    format_method(input, first, e);
  out += figure("<div class=\"scroll\">" + accuracy_figure(input.results) + "</div>\n",
                "Accuracy by exploration and by how the features of a core are reduced; lines: 95 "
                "% interval (" +
                    escape(e.ci95.method) + ").",
                badge);
  out += figure(accuracy_table(input.results), table_caption(input.results), badge);
  out += "<div class=\"pair\">\n";
  for (const ExplorationResult& result : input.results) out += confusion_figure(result, badge);
  return out + "</div>\n</details>\n</section>\n";
}

std::string core_section(const ReportInput& input) {
  std::string out;
  for (const ExplorationResult& result : input.results) {
    const classifier::Evaluation* e = result.find(Reduction::pvalue);
    if (e == nullptr) continue;
    const std::vector<CoreLine> lines = core_lines(*e->trained.cores());
    const bool beside = !paper::accuracies_beside(std::vector{result}).empty();
    out +=
        figure(table_of_cores(lines, beside),
               "<b>" + escape(result.exploration) + ".</b> Cores of the first split" +
                   (beside ? " (compare Table III): the paper\u2019s three pairs, then " : ": ") +
                   "those with the most cross-validation errors. " + format_size(lines) +
                   " Lower indices name the feature and the pad, upper ones the phase.",
               badge_html(input));
  }
  return out.empty() ? out
                     : "<section>\n<h2>What tells two fabrics apart</h2>\n" + out + "</section>\n";
}

std::string timing_section(const ReportInput& input) {
  if (input.results.empty()) return {};
  return "<section>\n<h2>How long it takes</h2>\n" +
         figure(timing_table(input.results), timing_caption(input.results), badge_html(input)) +
         "</section>\n";
}

}  // namespace weft::daemon
