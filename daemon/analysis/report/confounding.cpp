#include "daemon/analysis/report/confounding.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "classifier/features/trial.hpp"

namespace weft::daemon {
namespace {

using Mounting = std::pair<std::string_view, std::uint32_t>;  // label, and number of the mounting
                                                              // within it

std::map<std::string_view, Mounting> mountings_by_file(const Dataset& dataset) {
  std::map<std::string_view, Mounting> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    out[dataset.trials[i].file] = {dataset.trials[i].label, dataset.records[i].spec.place.mounting};
  return out;
}

/// Mounting of each row; empty if one is not known.
std::vector<Mounting> mountings_of(const Dataset& dataset, std::span<const std::string> files) {
  const auto by_file = mountings_by_file(dataset);
  std::vector<Mounting> out;
  for (const std::string& file : files) {
    const auto found = by_file.find(classifier::recording_of(std::string_view(file)));
    if (found == by_file.end() || found->second.second == 0) return {};
    out.push_back(found->second);
  }
  return out;
}

}  // namespace

bool shares_mountings(const Dataset& dataset, std::span<const std::string> files,
                      std::span<const classifier::Split> splits) {
  const std::vector<Mounting> of_row = mountings_of(dataset, files);
  if (of_row.empty()) return false;
  return std::ranges::any_of(splits, [&](const classifier::Split& split) {
    std::set<Mounting> trained;
    for (const std::size_t row : split.train) trained.insert(of_row[row]);
    return std::ranges::any_of(split.test,
                               [&](std::size_t row) { return trained.contains(of_row[row]); });
  });
}

}  // namespace weft::daemon
