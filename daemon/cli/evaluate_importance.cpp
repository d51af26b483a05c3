#include "daemon/cli/evaluate_importance.hpp"

#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/cli/table.hpp"
#include "daemon/report/format.hpp"

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

// The five by which the paper went on, of its ten figures.
std::vector<std::string> papers_choice() {
  std::vector<std::string> out;
  for (const vibro::Figure figure : vibro::figures_of(vibro::Family::smmrp))
    out.emplace_back(vibro::to_string(figure));
  return out;
}

}  // namespace

Result<std::string> add_importance(const vibro::WindowSet& windows,
                                   std::span<const classifier::Split> splits,
                                   const vibro::PipelineOptions& options, std::size_t repeats,
                                   json& out) {
  const auto weighed = vibro::weigh_features(windows, splits, options, repeats);
  if (!weighed) return pass(weighed.error());
  const std::vector<std::string>& names = windows.matrix.names;
  std::vector<vibro::Importance> by_forest;
  for (const double share : weighed->forest) by_forest.push_back({share, 0.0});
  const auto order = vibro::most_important(weighed->permutation, names.size());
  const auto kept = named(names, vibro::most_important(weighed->permutation, features_kept));
  const auto grown = named(names, vibro::most_important(by_forest, features_kept));
  Table table;
  table.row({"feature", "permuted, accuracy lost %", "+-", "share in a forest %"});
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
  const std::string learner(vibro::to_string(options.method));
  out = {{"learner", learner},       {"repeats", repeats},   {"features", features},
         {"most_permutation", kept}, {"most_forest", grown}, {"paper", papers_choice()}};
  return "Importance by " + learner + ", values of a feature dealt out at random " +
         std::to_string(repeats) + " times among the test windows of each split:\n" + table.text() +
         "  most by permutation " + joined(kept) + "\n  most in a forest    " + joined(grown) +
         "\n  the paper kept      " + joined(papers_choice()) + "\n";
}

}  // namespace weft::daemon::cli
