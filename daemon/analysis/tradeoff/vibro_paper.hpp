#pragma once
// Comparison with the paper of 2023: whether its recipe was run, the averages of its Table 1 over
// the classifiers, the gain of longer windows, and the variance explained by its components. Pure.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/recording.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"

namespace weft::daemon {

/// "+3.59 %" for 0.0359.
std::string signed_percent(double share);

/// True if windows are cut, split and reduced as in the paper. Per label there are 100 random
/// windows, a fifth of them for testing. The features are means over the channels (sound S and
/// three others), reduced to three components. Only then are the paper's values shown beside ours.
bool is_papers_recipe(std::span<const classifier::vibro::Recording> recordings,
                      const classifier::vibro::ProtocolOptions& protocol,
                      classifier::vibro::Combine combine, std::size_t components);

/// Share of the variance explained by the paper's three components (section 2.3.3); nothing if not
/// printed.
std::optional<double> papers_explained(classifier::vibro::Family family, double window_s);

/// The nine learners of its Table 1, in its order; then ten, with both versions of "NN, a 2-layer
/// MLP" (S8).
std::span<const classifier::Learner> papers_table_learners();
std::span<const classifier::Learner> papers_learners();

/// A line of its Table 1: F-scores in the order of papers_table_learners().
struct PapersRow {
  double window_s = 0.0;
  classifier::vibro::Family family{};
  std::span<const double> f_score;
  double average = 0.0;  ///< as printed
};
std::vector<PapersRow> papers_table_1();

/// Gain of windows of 2 s over 1 s, as a share of the value at 1 s, over all features and models of
/// the paper (abstract and section 4): F-score, and time of an evaluation.
inline constexpr double papers_f_score_gain = 0.0359, papers_time_gain = 0.2948;

/// Means over the paper's learners measured with one set of features, for windows of 1 s and 2 s.
struct VibroAverage {
  std::string source;
  double window_s = 0.0;
  classifier::vibro::Family family{};
  classifier::vibro::Protocol protocol{};
  std::size_t learners = 0;
  double f_score = 0.0, accuracy = 0.0;
  double explained = 1.0;   ///< share of variance explained by the components, equal for all
                            ///< learners
  double answer_s = 0.0;    ///< features of a window plus the learner
  double classify_s = 0.0;  ///< the learner only, as the paper times it
  /// The paper's values, if its recipe was run.
  std::optional<double> papers_f_score = {}, papers_explained = {};
};
/// In the order of the points.
std::vector<VibroAverage> compute_averages(const VibroTradeoff& tradeoff);

/// Gain of windows of 2 s over 1 s, as means over learners and sets of features. Computed for each
/// source and protocol that has both windows with the same sets and learners.
struct VibroGain {
  std::string source;
  classifier::vibro::Protocol protocol{};
  bool is_papers = false;  ///< the paper's recipe, with all its learners and sets of features
  double f_score = 0.0;    ///< as shares of the values at 1 s
  double accuracy = 0.0;
  double answer_s = 0.0, classify_s = 0.0;
  double f_score_points = 0.0;  ///< the difference itself
};
std::vector<VibroGain> compute_gains(const VibroTradeoff& tradeoff,
                                     std::span<const VibroAverage> averages);

/// For one protocol: {papers_recipe, averages[], gains[]}. The paper's values are under "paper",
/// null if its recipe was not run.
nlohmann::ordered_json averages_json(const VibroTradeoff& tradeoff,
                                     classifier::vibro::Protocol protocol);
/// Averages and gains as tables; empty without measurements.
Blocks average_tables(const VibroTradeoff& tradeoff, const std::string& badge_html);

}  // namespace weft::daemon
