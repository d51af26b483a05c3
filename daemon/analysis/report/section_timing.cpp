#include <functional>

#include "daemon/analysis/report/figures.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

std::string measured(double seconds) {
  return seconds > 0 ? duration(seconds) : "<span class=\"dim\">not measured</span>";
}

// As printed, with the paper's three decimals.
std::string printed(double seconds) {
  return "<span class=\"paper\">" + fixed(seconds, 3) + " s</span>";
}

using Cell = std::function<std::string(const ExplorationResult&)>;

// One column per exploration, then the paper's.
void add_row(HtmlTable& table, const std::vector<ExplorationResult>& results,
             const std::string& name, const Cell& cell, const std::string& paper_html) {
  std::vector<std::string> cells = {name};
  for (const ExplorationResult& result : results) cells.push_back(cell(result));
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
  for (const classifier::FabricCore& core : e.model.cores()) fits += core.info().fits;
  return fits;
}

std::string caption(const ExplorationResult& result) {
  std::string out = "Wall times of this software on this machine";
  const classifier::Evaluation* e = result.find(Reduction::pvalue);
  if (e != nullptr)
    out += ". Training is selection, grid search (" + thousands(total_fits(*e)) +
           " machines solved for p-value) and final fit of all cores, on " +
           std::to_string(result.threads) +
           " threads, mean over the splits; features and test "
           "are one trial at a time on one thread, vote included";
  return out +
         ". <b>The training times are not comparable:</b> the paper\u2019s 0.566 s is 4.2 ms per "
         "core, about one MATLAB fit each, so it is very likely the final fit with parameters "
         "already known, without the grid search that ours includes (our inference; the paper "
         "does not say, nor does it name its machine). The paper\u2019s feature and test times are "
         "from Table II, whose training time is that of M2 in Table IV.";
}

}  // namespace

std::string timing_section(const ReportInput& input) {
  if (input.results.empty()) return {};
  return "<section>\n<h2>How long it takes</h2>\n" +
         figure(timing_table(input.results), caption(input.results.front()), badge_html(input)) +
         "</section>\n";
}

}  // namespace weft::daemon
