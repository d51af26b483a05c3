#pragma once
// The tables of Ellis 1986 measured anew on any imprints, with its figures beside ours.

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
  bool laws = true;  ///< also on Laws' energies
  /// How step edges are measured; the scales and the form are those of each set.
  classifier::imprint::ScaleOptions edges = {};
  std::size_t threads = 0;  ///< 0: one per core; results do not depend on it
  /// Asked between experiments, from several threads at once; empty: nothing stops it.
  std::function<bool()> stop = {};
};

/// The perceptrons whose convergence is measured on every set of features.
inline constexpr std::array convergence_rules{classifier::Learner::perceptron,
                                              classifier::Learner::perceptron_zscore};

/// One set of features: scales and form, or Laws' energies.
struct FeatureSet {
  std::vector<double> sigmas;  ///< empty: Laws
  classifier::imprint::Form form{};
  classifier::imprint::LawsSize laws{};
  classifier::SeparabilityOutcome separability;  ///< of all imprints
  /// [experiments x rules]; empty of steps and extrema
  std::vector<classifier::imprint::ExperimentOutcome> outcomes;
  /// 1/N of each of convergence_rules (section 3.4.6); empty where that is not measured.
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
  std::vector<std::size_t> requested;  ///< imprints that each experiment sets aside
  /// Experiments that have no meaning on this data set, and why.
  std::vector<std::pair<std::string, std::string>> left_out;
  std::vector<FeatureSet> sets;
  std::vector<FeatureSet> partial_sets;    ///< steps and extrema alone: convergence only
  std::vector<std::string> files, labels;  ///< of the imprints
  chart::Maps pictures;                    ///< the first imprint of each object, up to 42

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

/// "2/N (no object was pressed twice)".
std::string format_left_out(const ImprintTables& tables);
/// "18 / 24 (75 %)"; the infinity sign where convergence failed.
std::string cell_text(const classifier::imprint::ExperimentOutcome& outcome);
/// The paper's entry so; a dash where it has none.
std::string paper_text(classifier::imprint::Experiment experiment, const FeatureSet& set);
/// "24 of 24, 87 rounds": trainings that converged and the longest of them; trainings after the
/// first that did not converge are made for up to a hundred imprints.
std::string convergence_text(const classifier::imprint::ExperimentOutcome& outcome);

/// An imprint that some rule took for another class on some set of features (section 3.4.5).
struct Misclassified {
  std::size_t row = 0;
  /// By experiment, then by the class that it was taken for: how often.
  std::vector<std::map<std::string, std::size_t>> taken_for;
  std::size_t wrong = 0;
};
/// The most often misclassified first. Sets and rules that did not converge answer nothing.
std::vector<Misclassified> list_misclassified(const ImprintTables& tables);
/// Sets and rules that converged in an experiment: answers about an imprint that it asks about.
std::size_t count_answers(const ImprintTables& tables, std::size_t experiment);

/// What the paper has for an experiment on a set of features.
struct PaperEntry {
  enum class Convergence { never, erratic, always } convergence;
  std::size_t correct = 0;  ///< out of ellis_imprints, where it always converged
};
/// Nothing where it has no such entry.
std::optional<PaperEntry> paper_entry(classifier::imprint::Experiment experiment,
                                      const FeatureSet& set);

/// The sentence that tells whose figures stand beside whose.
std::string tables_note(const ImprintTables& tables);

nlohmann::ordered_json tables_json(const ImprintTables& tables);
/// The page: imprints, right and wrong answers by class, all tables.
Document tables_document(const ImprintTables& tables);

}  // namespace weft::daemon
