#include "classifier/fabric/model.hpp"
#include "daemon/analysis/report/figures.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

std::string ours(const ExplorationResult& result, Reduction reduction) {
  const classifier::Evaluation* e = result.find(reduction);
  if (e == nullptr) return std::string(no_value);
  return percent(e->accuracy, 2) + "<span class=\"interval-text\">" + percent(e->ci95.low, 2) +
         " to " + percent(e->ci95.high, 2) + "</span>";
}

std::string printed_share(double share) {
  return share < 0 ? "<span class=\"dim\">not printed</span>"
                   : "<span class=\"paper\">" + percent(share, 0) + "</span>";
}

std::string accuracy_table(const std::vector<ExplorationResult>& results) {
  HtmlTable table({"exploration", "p-value selection [%]", "PCA [%]", "all features [%]",
                   "labels shuffled [%]"});
  for (const ExplorationResult& result : results)
    table.row({escape(result.exploration) + ", this run", ours(result, Reduction::pvalue),
               ours(result, Reduction::pca), ours(result, Reduction::all),
               percent(result.permuted_accuracy)});
  for (const paper::Accuracy& row : paper::accuracies_beside(results))
    table.row(
        {"<span class=\"paper\">" + std::string(row.exploration) + ", paper, real fabrics</span>",
         printed_share(row.pvalue), printed_share(row.pca), printed_share(row.all),
         std::string(no_value)});
  return table.finish();
}

std::string format_split(const classifier::Evaluation& e) {
  return std::to_string(e.splits.size()) + (e.splits.size() == 1 ? " split" : " random splits");
}

// Simulated trials touch a fresh patch each; what that does not test is said too.
constexpr std::string_view patch_note =
    "Every trial touches another patch of the model cloth, so no test trial repeats a training "
    "trial; all patches of a fabric share its parameters, so nothing is said about another bolt "
    "of it. ";

std::string format_method(const ReportInput& input, const ExplorationResult& result,
                          const classifier::Evaluation& e) {
  const std::size_t classes = e.confusion.classes();
  std::string out = "<p>Each trial becomes " + thousands(result.features) +
                    " features; one support vector machine per pair of fabrics (" +
                    thousands(classifier::pair_count(classes)) + " cores) votes. Mean over " +
                    format_split(e) + " of the trials into training and test part. ";
  if (input.dataset.info.kind == BenchKind::simulated) out += patch_note;
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

}  // namespace

std::string accuracy_section(const ReportInput& input) {
  if (input.results.empty() || input.results.front().reductions.empty()) return {};
  const std::string badge = badge_html(input);
  const ExplorationResult& first = input.results.front();
  const classifier::Evaluation& e = first.reductions.front().evaluation;
  std::string out = "<section>\n<h2>Which fabric was it?</h2>\n" + format_method(input, first, e);
  out += figure("<div class=\"scroll\">" + accuracy_figure(input.results) + "</div>\n",
                "Accuracy by exploration and by how the features of a core are reduced; lines: 95 "
                "% interval (" +
                    escape(e.ci95.method) + ").",
                badge);
  out += figure(accuracy_table(input.results), table_caption(input.results), badge);
  out += "<div class=\"pair\">\n";
  for (const ExplorationResult& result : input.results) out += confusion_figure(result, badge);
  return out + "</div>\n</section>\n";
}

}  // namespace weft::daemon
