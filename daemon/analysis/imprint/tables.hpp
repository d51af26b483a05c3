#pragma once
// The tables of Ellis 1986 measured anew on any imprints, with its figures beside ours.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "classifier/imprint/experiments.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/scale_features.hpp"
#include "classifier/learners/linear_rule.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// What Ellis 1986 printed (sections 3.4.1 to 3.4.4): right answers out of 24.

inline constexpr std::size_t ellis_imprints = 24;

/// The paper's sets of scales: 0; 1; 2; 3; 1, 2; 1, 3; 1, 2, 4.
std::vector<std::vector<double>> ellis_scales();

struct TableOptions {
  std::vector<std::vector<double>> scales = ellis_scales();
  std::vector<classifier::imprint::Experiment> experiments{
      classifier::imprint::all_experiments.begin(), classifier::imprint::all_experiments.end()};
  std::vector<classifier::Learner> rules{
      classifier::Learner::perceptron,    classifier::Learner::perceptron_zscore,
      classifier::Learner::least_squares, classifier::Learner::ridge,
      classifier::Learner::all,           classifier::Learner::lda};
  bool laws = true;         ///< also on Laws' energies
  std::size_t threads = 0;  ///< 0: one per core; results do not depend on it
  /// Asked between experiments, from several threads at once; empty: nothing stops it.
  std::function<bool()> stop = {};
};

/// One set of features: scales and form, or Laws' energies.
struct FeatureSet {
  std::vector<double> sigmas;  ///< empty: Laws
  classifier::imprint::Form form{};
  classifier::imprint::LawsSize laws{};
  classifier::SeparabilityOutcome separability;  ///< of all imprints
  /// [experiments x rules]
  std::vector<classifier::imprint::ExperimentOutcome> outcomes;

  /// "1, 2, 4" or "Laws 5 x 5".
  [[nodiscard]] std::string name() const;
};

struct ImprintTables {
  BenchKind bench = BenchKind::unknown;
  std::string dataset;
  std::string sha256;
  std::size_t imprints = 0, classes = 0, objects = 0;
  TableOptions options;
  std::vector<std::size_t> requested;  ///< imprints that each experiment sets aside
  /// Experiments that have no meaning on this data set, and why.
  std::vector<std::pair<std::string, std::string>> left_out;
  std::vector<FeatureSet> sets;

  [[nodiscard]] const classifier::imprint::ExperimentOutcome& outcome(const FeatureSet& set,
                                                                      std::size_t experiment,
                                                                      std::size_t rule) const {
    return set.outcomes[experiment * options.rules.size() + rule];
  }
};

/// Leaves out an experiment that check_rounds() refuses. Errors: a data set that does not hold
/// imprints, an object of two classes, no scales, experiments (that are left) or rules, what the
/// rules refuse; wrong_state where it was stopped.
Result<ImprintTables> measure_tables(const Dataset& dataset, TableOptions options);

/// "18 / 24 (75 %)"; the infinity sign where convergence failed.
std::string cell_text(const classifier::imprint::ExperimentOutcome& outcome);
/// The paper's entry so; a dash where it has none.
std::string paper_text(classifier::imprint::Experiment experiment, const FeatureSet& set);
/// The sentence that tells whose figures stand beside whose.
std::string tables_note(const ImprintTables& tables);

nlohmann::ordered_json tables_json(const ImprintTables& tables);
/// A page with all tables.
std::string tables_html(const ImprintTables& tables);

}  // namespace weft::daemon
