#include "daemon/analysis/report/paper.hpp"

#include <algorithm>

#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

bool same_pair(const CoreLine& line, std::string_view a, std::string_view b) {
  return (line.a == a && line.b == b) || (line.a == b && line.b == a);
}

bool harder(const CoreLine& x, const CoreLine& y) {
  if (x.info->cv_errors != y.info->cv_errors) return x.info->cv_errors > y.info->cv_errors;
  return x.info->cv_loss > y.info->cv_loss;
}

}  // namespace

std::vector<CoreLine> core_lines(const classifier::FabricModel& model) {
  std::vector<CoreLine> out;
  for (std::size_t i = 0; i < model.pairs().size(); ++i) {
    const classifier::FabricCore& core = model.cores()[i];
    CoreLine line{model.labels()[model.pairs()[i].a],
                  model.labels()[model.pairs()[i].b],
                  {},
                  &core.info(),
                  core.coefficient().size()};
    for (const classifier::SelectedFeature& f : core.info().selected)
      line.features.push_back({model.feature_names()[f.column], f.p_value, f.log_p});
    out.push_back(std::move(line));
  }
  return out;
}

const paper::Core* paper_core(const CoreLine& line) {
  for (const paper::Core& core : paper::cores)
    if (same_pair(line, core.a, core.b)) return &core;
  return nullptr;
}

std::string first_features_html(const CoreLine& line) {
  constexpr std::size_t shown = 4;
  std::string out;
  for (std::size_t i = 0; i < std::min(shown, line.features.size()); ++i)
    out += feature_html(line.features[i].name) + " ";
  return out;
}

std::vector<CoreLine> shown_cores(const std::vector<CoreLine>& lines, std::size_t count,
                                  bool papers_first) {
  std::vector<CoreLine> out;
  for (const paper::Core& core : paper::cores)
    if (papers_first)
      std::ranges::copy_if(lines, std::back_inserter(out),
                           [&](const CoreLine& line) { return same_pair(line, core.a, core.b); });
  std::vector<CoreLine> others;
  for (const CoreLine& line : lines)
    if (!papers_first || paper_core(line) == nullptr) others.push_back(line);
  std::stable_sort(others.begin(), others.end(), harder);
  for (const CoreLine& line : others)
    if (out.size() < count) out.push_back(line);
  return out;
}

}  // namespace weft::daemon
