#pragma once
// The paper of 2023 beside what was measured: whether its recipe was run, the averages of its Table
// 1 over the classifiers, what longer windows gain, and the variance that its components explain.
// Pure.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/recording.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"

namespace weft::daemon {

/// "+3.59 %" of 0.0359.
std::string signed_percent(double share);

/// Whether windows are cut, split and reduced as the paper does: 100 at random of each label, a
/// fifth of them tests, three components of figures that are means over the channels, sound S and
/// three others. Its figures stand beside ours only then.
bool is_papers_recipe(std::span<const classifier::vibro::Recording> recordings,
                      const classifier::vibro::ProtocolOptions& protocol,
                      classifier::vibro::Combine combine, std::size_t components);

/// Share of the variance that its three components explain (section 2.3.3); nothing where it prints
/// none.
std::optional<double> papers_explained(classifier::vibro::Family family, double window_s);

/// The nine of its Table 1, in its order, and the ten with both of "NN, a 2-layer MLP" (S8).
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

/// What longer windows gain, 2 s over 1 s, as shares of what 1 s has: over all of its features and
/// models (abstract and section 4). An F-score, and the time of an evaluation.
inline constexpr double papers_f_score_gain = 0.0359, papers_time_gain = 0.2948;

/// Means over the paper's learners of those that were measured on one set of features, of windows
/// of 1 s and 2 s.
struct VibroAverage {
  std::string source;
  double window_s = 0.0;
  classifier::vibro::Family family{};
  classifier::vibro::Protocol protocol{};
  std::size_t learners = 0;
  double f_score = 0.0, accuracy = 0.0;
  double explained = 1.0;   ///< by the components: the same for all learners
  double answer_s = 0.0;    ///< features of a window and the learner
  double classify_s = 0.0;  ///< the learner alone, as the paper times it
  /// What the paper prints, where its recipe was run.
  std::optional<double> papers_f_score = {}, papers_explained = {};
};
/// In the order of the points.
std::vector<VibroAverage> compute_averages(const VibroTradeoff& tradeoff);

/// What windows of 2 s gain over those of 1 s in the means over learners and sets of features: of
/// each source and protocol that has both with the same sets and learners.
struct VibroGain {
  std::string source;
  classifier::vibro::Protocol protocol{};
  bool is_papers = false;  ///< its recipe, all of its learners and sets of features
  double f_score = 0.0;    ///< shares of what 1 s has
  double accuracy = 0.0;
  double answer_s = 0.0, classify_s = 0.0;
  double f_score_points = 0.0;  ///< the difference itself
};
std::vector<VibroGain> compute_gains(const VibroTradeoff& tradeoff,
                                     std::span<const VibroAverage> averages);

/// Of one protocol: {papers_recipe, averages[], gains[]}, the paper's figures under "paper", null
/// where its recipe was not run.
nlohmann::ordered_json averages_json(const VibroTradeoff& tradeoff,
                                     classifier::vibro::Protocol protocol);
/// Both as tables; nothing where nothing was measured.
Blocks average_tables(const VibroTradeoff& tradeoff, const std::string& badge_html);

}  // namespace weft::daemon
