#include <algorithm>
#include <cmath>
#include <functional>

#include "classifier/fabric/model.hpp"
#include "daemon/analysis/report/accuracy_cells.hpp"
#include "daemon/analysis/report/confounding.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/confusion.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

Blocks accuracy_table(const std::vector<ExplorationResult>& results) {
  HtmlTable table({"exploration", "p-value selection [%]", "PCA [%]", "all features [%]",
                   "shuffled labels [%]"});
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

/// States what test and training trials have in common, and what is therefore not tested.
std::string_view repetition_note(Repeated repeated) {
  switch (repeated) {
    case Repeated::unknown:
      return "The data set does not record which part of the fabric a trial touched. ";
    case Repeated::touch:
      return "Every repetition repeats the same path on the same mounted piece. The accuracy does "
             "not "
             "cover another place, another mounting or another piece. The paper mounted each "
             "fabric "
             "once (section IV-A); it does not state whether the path was repeated. ";
    case Repeated::patch:
      return "Every repetition touches another patch of a piece that was mounted once. The "
             "accuracy "
             "does not cover another mounting or another piece. ";
    case Repeated::mounting:
      return "The fabric was mounted several times. Trials of one mounting may be in both training "
             "and "
             "test; all are of one piece. ";
    case Repeated::piece:
      return "A fabric has several pieces. Trials of one piece may be in both training and test; "
             "weft "
             "fabric evaluate --group piece tests pieces without training trials. ";
  }
  return {};
}

/// States that label and mounting are confounded, and the number of splits in the rows that show
/// the effect.
std::string confounding_note(const ExplorationResult& result) {
  if (!result.confounded) return {};
  std::string out = "Here " + std::string(confounded_with_mounting) + ". ";
  if (!result.level_removed.empty())
    out += "\u201cLevels removed\u201d: each taxel minus its mean of phase M, " +
           format_split(result.level_removed.front().evaluation) + ". ";
  return out;
}

std::string format_method(const ReportInput& input, const ExplorationResult& result,
                          const classifier::Evaluation& e) {
  const std::size_t classes = e.confusion.classes();
  std::string out = "Each trial becomes " + thousands(result.features) +
                    " features; one support vector machine per pair of fabrics (" +
                    thousands(classifier::pair_count(classes)) +
                    " cores) votes. The accuracy is the mean over " + format_split(e) +
                    " of the trials into a training and a test part. ";
  out += repetition_note(repeated_in(input.dataset));
  out += confounding_note(result);
  if (classes > 0)
    out += "With shuffled labels the same method reaches " + percent(result.permuted_accuracy) +
           " %; chance is " + percent(1.0 / static_cast<double>(classes)) + " %.";
  return out;
}

std::string table_caption(const std::vector<ExplorationResult>& results) {
  const std::string ours =
      "Mean accuracy with its 95 % interval below (" + escape(interval_methods(results)) + ").";
  if (paper::accuracies_beside(results).empty()) return ours;
  return ours +
         " The paper\u2019s values were measured on real fabrics and are not directly "
         "comparable. Its Table II gives " +
         percent(paper::accuracy_table2, 2) +
         " %. Its 89 % for all features is in the text of section IV-B, which assigns Figure 9a "
         "to them. The caption of Figure 9 assigns both matrices to p-value selection.";
}

Blocks confusion_figure(const ExplorationResult& result, const std::string& badge) {
  const classifier::Evaluation* e = result.find(Reduction::pvalue);
  if (e == nullptr) return {};
  const std::string title = "Confusion matrix " + result.exploration + ", p-value selection";
  return figure(
      confusion_pictures(e->confusion, title),
      "<b>" + escape(title) + ".</b> " + thousands(e->confusion.total()) +
          " test trials summed over " + format_split(*e) + ", " +
          thousands(e->confusion.correct()) +
          " correct. Blue: right; orange: wrong; shade: square root of the share in the row. " +
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

/// Accuracy with its interval for each exploration and reduction; the paper's values as hollow
/// diamonds.
chart::Rows accuracy_rows(const std::vector<ExplorationResult>& results) {
  chart::Rows out{"Accuracy by exploration and reduction",
                  {.title = "accuracy [%]", .low = accuracy_floor(results) * 100, .high = 100.5},
                  "this run, with 95 % interval"};
  if (!paper::accuracies_beside(results).empty()) out.mark_names = {"paper, real fabrics"};
  for (const ExplorationResult& result : results)
    for (const ReductionResult& r : result.reductions) {
      const double printed = paper_accuracy(result, r.reduction);
      const classifier::Evaluation& e = r.evaluation;
      chart::Row row{result.exploration + "  " + std::string(reduction_text(r.reduction)),
                     e.accuracy * 100, e.ci95.low * 100, e.ci95.high * 100};
      if (printed >= 0) row.marks = {printed * 100};
      out.rows.push_back(std::move(row));
    }
  return out;
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

/// `beside`: also shows the paper's values for its three pairs.
Blocks table_of_cores(const std::vector<CoreLine>& lines, bool beside) {
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

// The paper's value with its three decimals.
std::string printed(double seconds) {
  return "<span class=\"paper\">" + fixed(seconds, 3) + " s</span>";
}

using Cell = std::function<std::string(const ExplorationResult&)>;

// One column per exploration, then the paper's if it covers any of them.
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

Blocks timing_table(const std::vector<ExplorationResult>& results) {
  std::vector<std::string> head = {"step"};
  for (const ExplorationResult& result : results)
    head.push_back(escape(result.exploration) + ", this run");
  if (!paper::accuracies_beside(results).empty())
    head.push_back("<span class=\"paper\">paper, other computer</span>");
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
  std::string out = "Wall times of this software on this computer";
  const classifier::Evaluation* e = result.find(Reduction::pvalue);
  if (e != nullptr)
    out += ". Training includes selection, grid search (" + thousands(total_fits(*e)) +
           " fits for p-value) and the final fit of all cores, on " +
           std::to_string(result.threads) +
           " threads, mean over the splits. Features and test "
           "process one trial at a time on one thread, including the vote";
  if (paper::accuracies_beside(results).empty()) return out + ".";
  return out +
         ". <b>The training times are not comparable:</b> the paper\u2019s 0.566 s is 4.2 ms per "
         "core, about one MATLAB fit each. It is very likely the final fit with known "
         "parameters, without the grid search that Weft includes (our inference; the paper "
         "states neither this nor its computer). The paper\u2019s feature and test times are "
         "from Table II; the training time there is that of M2 in Table IV.";
}

Blocks headline_confusion(const Headline& headline, const std::string& badge) {
  if (!headline.confusion) return {};
  const std::string title = "Confusion matrix " + headline.exploration;
  return figure(confusion_pictures(*headline.confusion, title),
                "<b>" + escape(title) + ".</b> " + thousands(headline.confusion->total()) +
                    " predictions (" + escape(headline.confusion_unit) + "), " +
                    thousands(headline.confusion->correct()) + " correct, " +
                    escape(headline.protocol) + ". " +
                    escape(worst_confusions(*headline.confusion, 3)),
                badge);
}

}  // namespace

Blocks headline_section(const ReportInput& input) {
  Blocks lines, matrices;
  for (const Headline& headline : input.headlines) {
    lines += paragraph("<b>" + escape(headline_text(headline)) + ".</b> " + badge_html(input));
    matrices += headline_confusion(headline, badge_html(input));
  }
  if (matrices.empty())
    for (const ExplorationResult& result : input.results)
      matrices += confusion_figure(result, badge_html(input));
  return section("Result", lines + side_by_side(matrices), "result");
}

Blocks accuracy_pictures(const ReportInput& input) {
  if (input.results.empty() || input.results.front().reductions.empty()) return {};
  const classifier::Evaluation& e = input.results.front().reductions.front().evaluation;
  Blocks matrices;
  if (std::ranges::any_of(input.headlines,
                          [](const Headline& h) { return h.confusion.has_value(); }))
    for (const ExplorationResult& result : input.results)
      matrices += confusion_figure(result, badge_html(input));
  return section("Accuracy over random splits",
                 figure(picture(accuracy_rows(input.results)),
                        "Accuracy by exploration and by feature reduction of the cores. "
                        "Lines: 95 % interval (" +
                            escape(e.ci95.method) +
                            "). <a href=\"#method\">Difference from the "
                            "headline</a>.",
                        badge_html(input)) +
                     details("Confusion matrices of the random splits", side_by_side(matrices)));
}

Blocks accuracy_section(const ReportInput& input) {
  if (input.results.empty() || input.results.front().reductions.empty()) return {};
  return section("Accuracy tables",
                 details("Accuracy over random splits as a table",
                         figure(accuracy_table(input.results), table_caption(input.results),
                                badge_html(input))));
}

Blocks accuracy_method(const ReportInput& input) {
  if (input.results.empty() || input.results.front().reductions.empty()) return {};
  const ExplorationResult& first = input.results.front();
  std::vector<std::string> others;
  for (const OtherProtocol& other : other_protocols(true, has_learning_curve(input)))
    others.push_back(escape(other.text));
  return bullet_list(others) +
         paragraph(format_method(input, first, first.reductions.front().evaluation));
}

Blocks core_section(const ReportInput& input) {
  Blocks out;
  for (const ExplorationResult& result : input.results) {
    const classifier::Evaluation* e = result.find(Reduction::pvalue);
    if (e == nullptr) continue;
    const std::vector<CoreLine> lines = core_lines(*e->trained.cores());
    const bool beside = !paper::accuracies_beside(std::vector{result}).empty();
    out += details(
        "Cores of " + result.exploration,
        figure(table_of_cores(lines, beside),
               "<b>" + escape(result.exploration) + ".</b> Cores of the first split" +
                   (beside ? " (compare Table III): the paper\u2019s three pairs, then " : ": ") +
                   "those with the most cross-validation errors. " + format_size(lines) +
                   " Subscripts name the feature and the taxel, superscripts the phase.",
               badge_html(input)));
  }
  return section("Features that separate two fabrics", std::move(out));
}

Blocks timing_details(const ReportInput& input) {
  if (input.results.empty()) return {};
  return details(
      "Features, training and test",
      figure(timing_table(input.results), timing_caption(input.results), badge_html(input)));
}

}  // namespace weft::daemon
