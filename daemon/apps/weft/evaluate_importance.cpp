#include "daemon/apps/weft/evaluate_recordings.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

namespace vibro = classifier::vibro;
using nlohmann::json;

std::vector<std::string> named(const std::vector<std::string>& names,
                               const std::vector<std::size_t>& which) {
  std::vector<std::string> out;
  for (const std::size_t f : which) out.push_back(names[f]);
  return out;
}

// The five of its ten features that the paper selected.
std::vector<std::string> papers_choice() {
  std::vector<std::string> out;
  for (const vibro::FrameFeature figure : vibro::features_of_family(vibro::Family::smmrp))
    out.emplace_back(vibro::to_string(figure));
  return out;
}

// Columns of the paper's five in every channel; empty if one of the five is missing.
std::vector<std::size_t> papers_columns(const std::vector<std::string>& names) {
  std::vector<std::size_t> out;
  const auto chosen = papers_choice();
  for (const std::string& figure : chosen) {
    const std::size_t before = out.size();
    for (std::size_t f = 0; f < names.size(); ++f)
      if (names[f].substr(0, names[f].find('.')) == figure) out.push_back(f);
    if (out.size() == before) return {};
  }
  std::sort(out.begin(), out.end());
  return out;
}

// "STD 5, MEAN 4": how often each was retained.
std::string format_selected(const vibro::Reached& reached, const std::vector<std::string>& names) {
  std::vector<std::pair<std::size_t, std::size_t>> times;  // and column
  for (std::size_t f = 0; f < names.size(); ++f) {
    std::size_t n = 0;
    for (const auto& retained : reached.retained)
      n += std::find(retained.begin(), retained.end(), f) != retained.end() ? 1 : 0;
    if (n > 0) times.emplace_back(n, f);
  }
  std::stable_sort(times.begin(), times.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::string> words;
  for (const auto& [n, f] : times) words.push_back(names[f] + " " + std::to_string(n));
  return joined(words);
}

json reached_json(const vibro::Reached& reached, const std::vector<std::string>& names) {
  json retained = json::array();
  for (const auto& columns : reached.retained) retained.push_back(named(names, columns));
  return {{"accuracy", reached.accuracy},
          {"accuracy_of_splits", reached.split_accuracy},
          {"f_score", reached.f_score},
          {"columns", retained}};
}

void add_row(const std::string& what, const std::string& key, const vibro::Reached& reached,
             const std::vector<std::string>& names, Table& table, json& out) {
  table.row({what, std::to_string(reached.retained.front().size()), percent(reached.accuracy, 2),
             fixed(reached.f_score, 3)});
  out[key] = reached_json(reached, names);
}

// Compares the learner on the selected columns, on the paper's five and on all.
Result<std::string> compare_selection(const vibro::WindowSet& windows,
                                      std::span<const classifier::Split> splits,
                                      const classifier::Recipe& recipe,
                                      const classifier::TrainOptions& options, std::size_t repeats,
                                      json& out) {
  const std::vector<std::string>& names = windows.matrix.names;
  const auto selected =
      vibro::reach_by_selection(windows, splits, recipe, options, features_selected, repeats);
  if (!selected) return pass(selected.error());
  Table table;
  table.row({"trained with", "columns", "windows %", "F-score"});
  add_row("selected in training", "selected", *selected, names, table, out);
  if (const auto columns = papers_columns(names); !columns.empty()) {
    const auto papers = vibro::reach_with(windows, splits, recipe, options, columns);
    if (!papers) return pass(papers.error());
    add_row("the paper's five (SMMRP)", "smmrp", *papers, names, table, out);
  }
  const auto all =
      vibro::reach_with(windows, splits, recipe, options, classifier::numbers_below(names.size()));
  if (!all) return pass(all.error());
  add_row("all", "all", *all, names, table, out);
  return "Selected by permutation of the training windows, in " + std::to_string(splits.size()) +
         " splits: " + format_selected(*selected, names) + "\n" + table.text();
}

}  // namespace

Result<std::string> add_importance(const vibro::WindowSet& windows,
                                   std::span<const classifier::Split> splits,
                                   const classifier::Recipe& recipe,
                                   const classifier::TrainOptions& options, std::size_t repeats,
                                   json& out) {
  const auto weighed = vibro::weigh_features(windows, splits, recipe, options, repeats);
  if (!weighed) return pass(weighed.error());
  const std::vector<std::string>& names = windows.matrix.names;
  std::vector<vibro::Importance> by_forest;
  for (const double share : weighed->forest) by_forest.push_back({share, 0.0});
  const auto order = vibro::most_important(weighed->permutation, names.size(), weighed->forest);
  std::vector<std::string> retained;  // those that cost accuracy
  for (const std::size_t f : order)
    if (retained.size() < features_selected && weighed->permutation[f].mean > 0.0)
      retained.push_back(names[f]);
  const auto grown = named(names, vibro::most_important(by_forest, features_selected));
  Table table;
  table.row({"feature", "accuracy lost by permutation %", "+-", "importance in a forest %"});
  json features = json::array();
  for (const std::size_t f : order) {
    const vibro::Importance& lost = weighed->permutation[f];
    table.row({names[f], percent(lost.mean, 2), percent(lost.deviation, 2),
               percent(weighed->forest[f], 2)});
    features.push_back({{"feature", names[f]},
                        {"permutation", lost.mean},
                        {"permutation_sd", lost.deviation},
                        {"forest", weighed->forest[f]}});
  }
  const std::string learner(classifier::to_string(recipe.learner));
  out = {{"learner", learner},           {"repeats", repeats},   {"features", features},
         {"most_permutation", retained}, {"most_forest", grown}, {"paper", papers_choice()}};
  const auto compared = compare_selection(windows, splits, recipe, options, repeats, out);
  if (!compared) return pass(compared.error());
  return "Importance for " + learner + ", each feature permuted " + std::to_string(repeats) +
         " times among the test windows of each split:\n" + table.text() +
         "  most important by permutation: " +
         (retained.empty() ? "none reduces the accuracy" : joined(retained)) +
         "\n  most important in a forest: " + joined(grown) +
         "\n  selected in the paper: " + joined(papers_choice()) + "\n" + *compared;
}

}  // namespace weft::daemon::cli
