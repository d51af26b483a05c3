#include <algorithm>

#include "daemon/analysis/report/core_rows.hpp"
#include "daemon/analysis/report/figures.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

using classifier::Reduction;

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

std::string table_beside_paper(const std::vector<CoreLine>& lines) {
  HtmlTable table(
      {"core", "top four features", "<span class=\"paper\">paper, real fabrics</span>", "features",
       "<span class=\"paper\">paper</span>", "least p", "delta", "C", "gamma", "CV errors"},
      3);
  for (const CoreLine& line : shown_cores(lines, cores_beside_paper))
    table.row(
        {escape(line.a + " vs " + line.b), first_features_html(line), printed_features(line),
         std::to_string(line.info->inputs), printed_inputs(line),
         line.features.empty() ? std::string(no_value) : p_value_html(line.features.front().log_p),
         general(line.info->threshold), general(line.info->c), power_of_two_html(line.info->gamma),
         std::to_string(line.info->cv_errors) + " of " + std::to_string(line.info->train_rows)});
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

}  // namespace

std::string core_section(const ReportInput& input) {
  std::string out;
  for (const ExplorationResult& result : input.results) {
    const classifier::Evaluation* e = result.find(Reduction::pvalue);
    if (e == nullptr) continue;
    const std::vector<CoreLine> lines = core_lines(e->model);
    out += figure(table_beside_paper(lines),
                  "<b>" + escape(result.exploration) +
                      ".</b> Cores of the first split (compare Table III): the paper\u2019s three "
                      "pairs, then those with the most cross-validation errors. " +
                      format_size(lines) +
                      " Lower indices name the feature and the pad, upper ones the phase.",
                  badge_html(input));
  }
  return out.empty() ? out
                     : "<section>\n<h2>What tells two fabrics apart</h2>\n" + out + "</section>\n";
}

}  // namespace weft::daemon
