#pragma once
// Printed results of Khan et al. 2016, for comparison with ours, and our cores in the form of its
// Table III. The paper measured real fabrics with other devices, so its results are shown beside
// ours, never under one heading.

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model.hpp"

namespace weft::daemon::paper {

inline constexpr std::string_view citation =
    "Khan, Khosravi, Denei, Maiolino, Kasprzak, Mastrogiovanni, Cannata: A Tactile-based Fabric "
    "Learning and Classification Architecture, 2016";

inline constexpr std::string_view imprint_citation =
    "Ellis: A Multiple-Scale Measure of Static Tactile Texture, 1986";

/// Table IV. `all` is from the text of section IV-B ("no threshold on the p-value is posed"), which
/// covers M1 only. Shares, 0 to 1; negative: not printed.
struct Accuracy {
  std::string_view exploration;
  double pvalue;
  double pca;
  double all;
};
inline constexpr std::array accuracies = {Accuracy{"M1", 0.98, 0.89, 0.89},
                                          Accuracy{"M2", 0.99, 0.99, -1}};

inline constexpr std::size_t fabrics = 17;
inline constexpr std::size_t trials_of_exploration = 340;  ///< twenty per fabric

/// True if an exploration has the paper's name, number of fabrics and number of trials. Otherwise
/// its results belong to a different task.
template <class Result>
bool is_papers(const Result& result, std::string_view exploration) {
  return result.exploration == exploration && result.trials == trials_of_exploration &&
         !result.reductions.empty() &&
         result.reductions.front().evaluation.confusion.classes() == fabrics;
}

/// The rows for explorations that a run also has.
template <class Results>
std::vector<Accuracy> accuracies_beside(const Results& results) {
  std::vector<Accuracy> out;
  for (const Accuracy& row : accuracies)
    if (std::ranges::any_of(results,
                            [&](const auto& one) { return is_papers(one, row.exploration); }))
      out.push_back(row);
  return out;
}

/// Table IV, "Training time" [s].
struct TrainingTime {
  std::string_view exploration;
  double pvalue_s;
  double pca_s;
};
inline constexpr std::array training_times = {TrainingTime{"M1", 0.525, 0.720},
                                              TrainingTime{"M2", 0.566, 0.956}};

/// Table II; 0.566 s is also its training time.
inline constexpr double feature_s_per_sample = 0.017;
inline constexpr double test_s_per_sample = 0.045;
inline constexpr double accuracy_table2 = 0.9887;

/// Table III. Fabric names in lower case as in our recipes, features in our notation.
struct Core {
  std::string_view a;
  std::string_view b;
  std::array<std::string_view, 4> top;  ///< empty if the core has fewer
  int inputs;
};
inline constexpr std::array cores = {
    Core{"knitwear1", "wool", {"range.M.2", "range.M.4", "", ""}, 2},
    Core{"knitwear1", "pile", {"min.M.1", "min.M.2", "min.M.4", "min.M.7"}, 20},
    Core{"flax", "pile", {"norm.M.13", "norm.M.15", "mean.M.15", "Hfrq.M.15"}, 18}};

}  // namespace weft::daemon::paper

namespace weft::daemon {

struct CoreFeature {
  std::string name;  ///< "range.M.4"
  double p_value = 1;
  double log_p = 0;  ///< natural logarithm, for a p that underflows
};

/// One core of a model with its selected features, best first. a < b in the model's order.
struct CoreLine {
  std::string a;
  std::string b;
  std::vector<CoreFeature> features;
  const classifier::CoreInfo* info = nullptr;
  std::size_t support_vectors = 0;
};

/// All cores, in the model's order; they refer to `model`.
std::vector<CoreLine> core_lines(const classifier::FabricModel& model);

/// The paper's three pairs, if the model has them, then the pairs with the most cross-validation
/// errors (then the greatest loss), at most `count`. Without `papers_first`, by errors only.
std::vector<CoreLine> shown_cores(const std::vector<CoreLine>& lines, std::size_t count,
                                  bool papers_first = true);

/// Its first four features, in the paper's notation.
std::string first_features_html(const CoreLine& line);

/// The printed values for this pair; nullptr if there are none.
const paper::Core* paper_core(const CoreLine& line);

}  // namespace weft::daemon
