#include <algorithm>

#include "daemon/analysis/report/accuracy_cells.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

/// Explains the "best" column and its number of splits, which is smaller than for the others.
std::string best_note(const std::vector<ExplorationResult>& results) {
  std::size_t splits = 0;
  for (const ExplorationResult& result : results)
    if (result.best) splits = std::max(splits, result.best->scores.splits.size());
  if (splits == 0) return {};
  return " \u201cbest\u201d: the learner chosen by cross-validation of the training part, as in "
         "weft fabric train without --learner. Its training is slow, so it uses the first " +
         std::to_string(splits) + " splits only.";
}

}  // namespace

std::string interval_html(const classifier::Scores& e) {
  return percent(e.accuracy, 2) + "<span class=\"interval-text\">" + percent(e.ci95.low, 2) +
         " to " + percent(e.ci95.high, 2) + "</span>";
}

std::string accuracy_html(const std::vector<ReductionResult>& results, Reduction reduction) {
  const classifier::Evaluation* e = find(results, reduction);
  return e == nullptr ? std::string(no_value) : interval_html(*e);
}

std::string printed_share_html(double share) {
  return share < 0 ? "<span class=\"dim\">not printed</span>"
                   : "<span class=\"paper\">" + percent(share, 0) + "</span>";
}

std::vector<RepetitionRow> repetition_rows(const ReportInput& input) {
  std::vector<RepetitionRow> out;
  if (input.beside == nullptr || input.beside->empty() || input.results.empty()) return out;
  // With random splits, several pieces or mountings may be on both sides.
  const Repeated own = repeated_in(input.dataset);
  const bool is_mixed = own == Repeated::mounting || own == Repeated::piece;
  out.push_back(
      {is_mixed ? "this campaign, random splits" : std::string(to_string(own)), &input.results});
  for (const CampaignBeside& one : *input.beside)
    out.push_back({std::string(to_string(one.repeated)), &one.results});
  return out;
}

Blocks repetition_section(const ReportInput& input) {
  const std::vector<RepetitionRow> rows = repetition_rows(input);
  if (rows.empty()) return {};
  HtmlTable table({"new in a test trial", "exploration", "p-value selection [%]", "PCA [%]",
                   "all features [%]", "best [%]", "shuffled labels, p-value [%]",
                   "shuffled labels, best [%]"});
  std::vector<ExplorationResult> all;
  for (const RepetitionRow& row : rows)
    for (const ExplorationResult& result : *row.results) {
      table.row({escape(row.text), escape(result.exploration),
                 accuracy_html(result.reductions, Reduction::pvalue),
                 accuracy_html(result.reductions, Reduction::pca),
                 accuracy_html(result.reductions, Reduction::all),
                 result.best ? interval_html(result.best->scores) : std::string(no_value),
                 percent(result.permuted_accuracy),
                 result.best ? percent(result.best->permuted_accuracy) : std::string(no_value)});
      all.push_back(result);
    }
  for (const paper::Accuracy& row : paper::accuracies_beside(input.results))
    table.row({"<span class=\"paper\">paper, real fabrics</span>",
               "<span class=\"paper\">" + std::string(row.exploration) + "</span>",
               printed_share_html(row.pvalue), printed_share_html(row.pca),
               printed_share_html(row.all), std::string(no_value), std::string(no_value),
               std::string(no_value)});
  std::string text =
      "These campaigns differ in what is new in a test trial: only the touch, the place on the "
      "fabric, the mounting or the piece.";
  if (input.dataset.info.kind == BenchKind::simulated)
    text +=
        " In the plant model a repeated path gives the same texture under each taxel. A new patch "
        "has another part of the same texture. Another piece also differs in stiffness, friction, "
        "thickness and roughness. The sensor and its rate are the same in all rows.";
  return section(
      "Accuracy by what is new in a test trial",
      paragraph(text) +
          figure(table.finish(),
                 "Mean accuracy with its 95 % interval below (" + escape(interval_methods(all)) +
                     "). Compared campaigns are cross-validated by piece or mounting; the rest is "
                     "split at random." +
                     best_note(all),
                 badge_html(input)));
}

}  // namespace weft::daemon
