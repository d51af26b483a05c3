#include "daemon/report/figures.hpp"
#include "daemon/report/format.hpp"
#include "daemon/report/html.hpp"
#include "daemon/report/paper.hpp"
#include "daemon/report/sections.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

std::string measured(double seconds) {
  return seconds > 0 ? duration(seconds) : "<span class=\"dim\">not measured</span>";
}

std::string printed(double seconds) {
  return "<span class=\"paper\">" + duration(seconds) + "</span>";
}

const paper::TrainingTime* paper_training(std::string_view exploration) {
  for (const paper::TrainingTime& row : paper::training_times)
    if (row.exploration == exploration) return &row;
  return nullptr;
}

void add_reduction(HtmlTable& table, const ExplorationResult& result, Reduction reduction,
                   const std::string& words, double printed_train_s) {
  const classifier::Evaluation* e = result.find(reduction);
  if (e == nullptr) return;
  const bool table2 = result.exploration == "M2" && reduction == Reduction::pvalue;
  table.row({"training, " + words, escape(result.exploration), measured(e->train_s),
             printed_train_s > 0 ? printed(printed_train_s) : std::string(no_value)});
  table.row({"test of one trial, " + words, escape(result.exploration),
             measured(e->test_s_per_sample),
             table2 ? printed(paper::test_s_per_sample) : std::string(no_value)});
}

void add_exploration(HtmlTable& table, const ExplorationResult& result) {
  const paper::TrainingTime* paper_s = paper_training(result.exploration);
  table.row(
      {"features of one trial", escape(result.exploration), measured(result.feature_s_per_sample),
       result.exploration == "M2" ? printed(paper::feature_s_per_sample) : std::string(no_value)});
  add_reduction(table, result, Reduction::pvalue, "p-value",
                paper_s != nullptr ? paper_s->pvalue_s : 0);
  add_reduction(table, result, Reduction::pca, "PCA", paper_s != nullptr ? paper_s->pca_s : 0);
  add_reduction(table, result, Reduction::all, "all features", 0);
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
         "from Table II, which matches M2 in Table IV.";
}

}  // namespace

std::string timing_section(const ReportInput& input) {
  if (input.results.empty()) return {};
  HtmlTable table(
      {"step", "exploration", "this run", "<span class=\"paper\">paper, its own machine</span>"},
      2);
  for (const ExplorationResult& result : input.results) add_exploration(table, result);
  return "<section>\n<h2>How long it takes</h2>\n" +
         figure(table.finish(), caption(input.results.front()),
                badge_html(input.dataset.info.kind)) +
         "</section>\n";
}

}  // namespace weft::daemon
