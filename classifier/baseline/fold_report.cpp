#include "classifier/baseline/fold_report.hpp"

#include <algorithm>
#include <vector>

#include "classifier/baseline/class_folds.hpp"
#include "classifier/features/windows.hpp"

namespace weft::classifier {
namespace {

std::string joined(const std::vector<std::string>& parts) {
  constexpr std::size_t most_named = 5;  // of hundreds of labels nobody reads the last
  std::string out;
  for (std::size_t i = 0; i < std::min(parts.size(), most_named); ++i)
    out += (i > 0 ? ", " : "") + parts[i];
  if (parts.size() > most_named)
    out += " and " + std::to_string(parts.size() - most_named) + " more";
  return out;
}

}  // namespace

FoldReport fold_report(const FeatureMatrix& matrix, Learner learner, const TrainOptions& options) {
  const Classes classes = find_classes(matrix);
  const auto rows = rows_by_class(classes.of_row);
  const std::size_t levels = unit_levels(matrix, options.fold_unit).size();
  FoldReport out;
  out.folds = options.folds;
  for (const std::string& file : matrix.files)
    out.windows = out.windows || recording_of(file) != file;
  std::vector<std::size_t> level;
  if (is_cores(learner)) {
    level = units_by_label(matrix, options.fold_unit).level;
  } else {
    ClassFolds folds = class_folds(matrix, options);
    out.none = folds.folds.empty();
    level = std::move(folds.level);
  }
  for (std::size_t c = 0; c < level.size(); ++c) {
    const std::string& label = classes.labels[c];
    if (level[c] == levels) out.untested[label] = rows[c].size();
    if (level[c] == 0 || level[c] == levels || out.none) continue;
    out.finer[label] = level[c] + 1 == levels ? "window" : "recording";
  }
  return out;
}

std::string format_folds(const FoldReport& report) {
  const std::string unit = report.windows ? " windows" : " trials";
  std::vector<std::string> untested;
  for (const auto& [label, rows] : report.untested)
    untested.push_back(report.none ? "label " + label + " has " + std::to_string(rows) + unit
                                   : label + " (" + std::to_string(rows) + unit + ")");
  if (report.none)
    return "none: " + joined(untested) + ", too few for " + std::to_string(report.folds) +
           " folds that train on 2 of each";
  std::map<std::string, std::vector<std::string>> finer;
  for (const auto& [label, by] : report.finer) finer[by].push_back(label);
  std::string out;
  for (const auto& [by, labels] : finer)
    out += (out.empty() ? "" : ", ") + joined(labels) + " dealt by " + by;
  if (!untested.empty()) out += (out.empty() ? "" : ", ") + ("not tested: " + joined(untested));
  return out;
}

}  // namespace weft::classifier
