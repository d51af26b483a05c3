#pragma once
// What Khan et al. 2016 printed, to stand beside our figures. Measured on real fabrics with other
// devices: beside, never under one heading.

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <vector>

namespace weft::daemon::paper {

inline constexpr std::string_view citation =
    "Khan, Khosravi, Denei, Maiolino, Kasprzak, Mastrogiovanni, Cannata: A Tactile-based Fabric "
    "Learning and Classification Architecture, 2016";

/// Table IV; `all` from the text of section IV-B ("no threshold on the p-value is posed"), which
/// gives M1 only. Shares, 0 to 1; negative: not printed.
struct Accuracy {
  std::string_view exploration;
  double pvalue;
  double pca;
  double all;
};
inline constexpr std::array accuracies = {Accuracy{"M1", 0.98, 0.89, 0.89},
                                          Accuracy{"M2", 0.99, 0.99, -1}};

/// The rows of the explorations that a run has too. Of others, such as a slide of another paper's
/// experiment, this one printed nothing.
template <class Results>
std::vector<Accuracy> accuracies_beside(const Results& results) {
  std::vector<Accuracy> out;
  std::copy_if(accuracies.begin(), accuracies.end(), std::back_inserter(out),
               [&](const Accuracy& row) {
                 return std::any_of(results.begin(), results.end(), [&](const auto& result) {
                   return result.exploration == row.exploration;
                 });
               });
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

/// Table II; 0.566 s is its training time too.
inline constexpr double feature_s_per_sample = 0.017;
inline constexpr double test_s_per_sample = 0.045;
inline constexpr double accuracy_table2 = 0.9887;

/// Table III. Fabric names in lower case as in our recipes, features in our notation.
struct Core {
  std::string_view a;
  std::string_view b;
  std::array<std::string_view, 4> top;  ///< empty where the core has fewer
  int inputs;
};
inline constexpr std::array cores = {
    Core{"knitwear1", "wool", {"range.M.2", "range.M.4", "", ""}, 2},
    Core{"knitwear1", "pile", {"min.M.1", "min.M.2", "min.M.4", "min.M.7"}, 20},
    Core{"flax", "pile", {"norm.M.13", "norm.M.15", "mean.M.15", "Hfrq.M.15"}, 18}};

}  // namespace weft::daemon::paper
