#pragma once
// The tables of Ellis 1986, measured again on any imprints, with the paper's results beside ours.

#include <array>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "classifier/imprint/experiments.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/imprint/scale_features.hpp"
#include "classifier/learners/linear_rule.hpp"
#include "daemon/pages/document/document.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

// Printed results of Ellis 1986 (sections 3.4.1 to 3.4.4): correct predictions out of 24.

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
  bool laws = true;  ///< also uses Laws' energies
  /// How step edges are measured; each set has its own scales and form.
  classifier::imprint::ScaleOptions edges = {};
  std::size_t threads = 0;  ///< 0: one per core; results do not depend on it
  /// Called between experiments, from several threads at once; empty: never stops.
  std::function<bool()> stop = {};
};

/// The perceptrons used to measure convergence on every set of features.
inline constexpr std::array convergence_rules{classifier::Learner::perceptron,
                                              classifier::Learner::perceptron_zscore};

/// One set of features: scales and form, or Laws' energies.
struct FeatureSet {
  std::vector<double> sigmas;  ///< empty: Laws
  classifier::imprint::Form form{};
  classifier::imprint::LawsSize laws{};
  classifier::SeparabilityOutcome separability;  ///< over all imprints
  /// [experiments x rules]; empty for steps and extrema
  std::vector<classifier::imprint::ExperimentOutcome> outcomes;
  /// Experiment 1/N for each of convergence_rules (section 3.4.6); empty if not measured.
  std::vector<classifier::imprint::ExperimentOutcome> convergence;

  /// "1, 2, 4" or "Laws 5 x 5".
  [[nodiscard]] std::string name() const;
  /// "10" or "Laws".
  [[nodiscard]] std::string_view kind() const;
};

struct ImprintTables {
  BenchKind bench = BenchKind::unknown;
  std::string dataset;
  std::string sha256;
  std::size_t imprints = 0, classes = 0, objects = 0;
  TableOptions options;
  std::vector<std::size_t> requested;  ///< number of imprints that each experiment tests
  /// Experiments that cannot be run on this data set, with the reason.
  std::vector<std::pair<std::string, std::string>> left_out;
  std::vector<FeatureSet> sets;
  std::vector<FeatureSet> partial_sets;    ///< steps or extrema only, for convergence
  std::vector<std::string> files, labels;  ///< per imprint
  chart::Maps pictures;                    ///< the first imprint of each object, up to 42

  [[nodiscard]] const classifier::imprint::ExperimentOutcome& outcome(const FeatureSet& set,
                                                                      std::size_t experiment,
                                                                      std::size_t rule) const {
    return set.outcomes[experiment * options.rules.size() + rule];
  }
};

/// Leaves out an experiment that check_rounds() refuses. Errors: a data set without imprints, an
/// object with two classes; no scales, rules or remaining experiments; those of the rules;
/// wrong_state if stopped.
Result<ImprintTables> measure_tables(const Dataset& dataset, TableOptions options);

/// "2/N (no object pressed twice)".
std::string format_left_out(const ImprintTables& tables);
/// "18 / 24 (75 %)"; the infinity sign if training did not converge.
std::string cell_text(const classifier::imprint::ExperimentOutcome& outcome);
/// The paper's entry in the same form; a dash if it has none.
std::string paper_text(classifier::imprint::Experiment experiment, const FeatureSet& set);
/// "24 of 24, 87 rounds": number of converged trainings, and rounds of the longest. After a
/// training that did not converge, the rest is only run for up to a hundred imprints.
std::string convergence_text(const classifier::imprint::ExperimentOutcome& outcome);

/// An imprint that some rule misclassified on some set of features (section 3.4.5).
struct Misclassified {
  std::size_t row = 0;
  /// [experiment]: number of predictions of each wrong class.
  std::vector<std::map<std::string, std::size_t>> taken_for;
  std::size_t wrong = 0;
};
/// Most often misclassified first. Sets and rules that did not converge make no predictions.
std::vector<Misclassified> list_misclassified(const ImprintTables& tables);
/// Sets and rules that converged in an experiment: the number of predictions per tested imprint.
std::size_t count_answers(const ImprintTables& tables, std::size_t experiment);

/// The paper's result for an experiment on a set of features.
struct PaperEntry {
  enum class Convergence { never, erratic, always } convergence;
  std::size_t correct = 0;  ///< out of ellis_imprints, if `convergence` is always
};
/// Nothing if the paper has no such entry.
std::optional<PaperEntry> paper_entry(classifier::imprint::Experiment experiment,
                                      const FeatureSet& set);

/// A sentence that names the source of each side of the comparison.
std::string tables_note(const ImprintTables& tables);

nlohmann::ordered_json tables_json(const ImprintTables& tables);
/// The page: imprints, confusion matrix, all tables.
Document tables_document(const ImprintTables& tables);

}  // namespace weft::daemon
