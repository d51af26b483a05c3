#include "daemon/analysis/design/repetition_study.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "classifier/base/random.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

/// Sorts as the number does.
std::string padded(std::size_t number) {
  const std::string digits = std::to_string(number);
  return std::string(10 - std::min<std::size_t>(10, digits.size()), '0') + digits;
}

/// Numbers and names say nothing of each other, so one kind serves all rows.
std::vector<std::string> recorded_repetitions(const classifier::FeatureMatrix& matrix,
                                              const Dataset& dataset) {
  std::map<std::string_view, std::uint32_t> of_file;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    of_file[dataset.trials[i].file] = dataset.records[i].spec.repetition;
  std::vector<std::string> out;
  for (const std::string& file : matrix.files) {
    const auto found = of_file.find(file);
    if (found == of_file.end() || found->second == 0) return matrix.groups;
    out.push_back(padded(found->second));
  }
  return out;
}

std::vector<std::string> drawn_repetitions(const classifier::FeatureMatrix& matrix,
                                           std::uint64_t seed) {
  std::map<std::string, std::vector<std::size_t>> of_label;
  for (std::size_t i = 0; i < matrix.size(); ++i) of_label[matrix.labels[i]].push_back(i);
  std::vector<std::string> out(matrix.size());
  classifier::RandomEngine engine(seed);
  for (auto& [label, rows] : of_label) {
    classifier::shuffle(rows, engine);
    for (std::size_t k = 0; k < rows.size(); ++k) out[rows[k]] = padded(k + 1);
  }
  return out;
}

/// Sorted names of the groups that have every label.
std::vector<std::string> complete_groups(const classifier::FeatureMatrix& matrix) {
  const std::set<std::string> labels(matrix.labels.begin(), matrix.labels.end());
  std::map<std::string, std::set<std::string>> of_group;
  for (std::size_t i = 0; i < matrix.size(); ++i)
    of_group[matrix.groups[i]].insert(matrix.labels[i]);
  std::vector<std::string> out;
  for (const auto& [name, present] : of_group)
    if (present.size() == labels.size()) out.push_back(name);
  return out;
}

}  // namespace

classifier::FeatureMatrix by_repetition(const classifier::FeatureMatrix& matrix,
                                        const Dataset& dataset, const RepetitionChoice& choice) {
  classifier::FeatureMatrix out = matrix;
  out.groups = choice.strokes ? drawn_repetitions(matrix, choice.seed)
                              : recorded_repetitions(matrix, dataset);
  std::vector<std::string> names = complete_groups(out);
  if (choice.first > 0) names.resize(std::min(names.size(), choice.first));
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < out.size(); ++i)
    if (std::ranges::binary_search(names, out.groups[i])) rows.push_back(i);
  return classifier::select_rows(out, rows);
}

std::string format_repetition_study(const RepetitionStudy& study) {
  const auto& last = study.curve.points.back();
  const auto& f = study.forecast;
  std::string out = std::to_string(study.curve.repetitions) + " repetitions of " +
                    std::to_string(study.curve.fabrics) + " fabrics: " + percent(last.accuracy) +
                    " % told right with each repetition left out in turn (" +
                    percent(last.ci95.low) + " to " + percent(last.ci95.high) + " %). " +
                    std::to_string(f.predict) + " repetitions are expected to measure " +
                    percent(f.accuracy) + " %, with a 95 % prediction interval of " +
                    percent(f.ci95.low) + " to " + percent(f.ci95.high) + " %. ";
  const std::string wanted = percent(f.wanted) + " %";
  if (!f.enough)
    return out + wanted + " is not reached within " + std::to_string(f.most) + " repetitions (" +
           percent(f.reached_share, 0) + " % of the resamples reach it).";
  out += wanted + " is expected from " + std::to_string(*f.enough) + " repetitions on";
  out += f.enough_low ? " (95 %: " + std::to_string(*f.enough_low) + " to " +
                            (f.enough_high ? std::to_string(*f.enough_high)
                                           : "more than " + std::to_string(f.most)) +
                            ")."
                      : ".";
  return out;
}

}  // namespace weft::daemon
