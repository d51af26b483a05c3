#pragma once
// The learners of the registry (learner.hpp), each with a fit_x(). A learner without a class in a
// header also has a read_x() for the lines of write(); it is null if `in` has a problem. Helper
// functions follow.

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/lanes.hpp"
#include "classifier/learners/predictor.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// The winner has the largest score; the lowest class wins a tie. Refuses non-finite scores.
Result<ClassScores> scores_of(std::vector<double> score, std::string_view learner);

/// A normal distribution per class and feature; priors from the training. Variances are widened by
/// 1e-9 of the largest feature's variance: scikit-learn's GaussianNB.
Result<PredictorPtr> fit_naive_bayes(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_naive_bayes(LineReader& in, std::size_t features, std::size_t classes);

/// Most frequent class among the five nearest training rows (Euclidean distance); the lowest class
/// wins a tie. Equally near rows count in the order of the training.
Result<PredictorPtr> fit_neighbours(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_neighbours(LineReader& in, std::size_t features, std::size_t classes);

/// One tree that tests all features.
Result<PredictorPtr> fit_tree(const TrainingSet& training, const TrainOptions& options);
/// Predicts by the mean of the trees' shares.
Result<PredictorPtr> fit_forest(const TrainingSet& training, const TrainOptions& options);

/// Mean decrease of impurity by each feature, over the trees of a forest; sum 1. The paper ranked
/// its ten features this way.
Result<std::vector<double>> forest_importance(const TrainingSet& training,
                                              const TrainOptions& options);

/// libsvm's C-SVC, one against one, RBF with C = 1 and gamma = 1 / (features x variance of all
/// values): the same as scikit-learn's SVC().
Result<PredictorPtr> fit_svm(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_svm(LineReader& in, std::size_t features, std::size_t classes);

/// A small feed-forward network with `hidden` layers of ReLU and softmax at the end. The loss is
/// the cross entropy with 1e-4 of the squared weights. Adam takes steps of 1e-3 on shuffled batches
/// of 200. It stops after ten passes in a row without a loss 1e-4 below the best, or after 1000
/// passes. This is scikit-learn's MLPClassifier(hidden, max_iter=1000), in single precision.
/// Features should be scaled.
Result<PredictorPtr> fit_network(const TrainingSet& training,
                                 const std::vector<std::size_t>& hidden,
                                 const TrainOptions& options);
PredictorPtr read_network(LineReader& in, std::size_t features, std::size_t classes);

/// Softmax of linear scores. Minimises the sum of the rows' cross entropies plus half the squared
/// weights (C = 1; without the intercepts) by L-BFGS until no slope is above 1e-4: scikit-learn's
/// LogisticRegression(max_iter=1000). liblinear only has one class against the others.
Result<PredictorPtr> fit_logistic(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_logistic(LineReader& in, std::size_t features, std::size_t classes);

/// Extremely randomised trees; options.trees is their number.
Result<PredictorPtr> fit_extra_trees(const TrainingSet& training, const TrainOptions& options);

/// Kesler's perceptron on unscaled and on scaled features; minimum squared error, without and with
/// a penalty. Classes count in the order of their first rows (linear_rule.hpp).
Result<PredictorPtr> fit_perceptron(const TrainingSet& training, const TrainOptions& options);
Result<PredictorPtr> fit_scaled_perceptron(const TrainingSet& training,
                                           const TrainOptions& options);
Result<PredictorPtr> fit_least_squares(const TrainingSet& training, const TrainOptions& options);
Result<PredictorPtr> fit_ridge(const TrainingSet& training, const TrainOptions& options);

/// False if Weft was built without libxgboost-dev or the library is not installed.
bool have_xgboost();

/// XGBClassifier() of XGBoost 1.7 with n_jobs=1: 100 rounds, depth 6, rate 0.3, softprob. Splits
/// come from histograms of 256 bins (`tree_method="hist"`), the library's own default from 2.0 on,
/// not from the exact search of 1.7 for few rows.
Result<PredictorPtr> fit_xgb(const TrainingSet& training, const TrainOptions& options);
/// XGBRFClassifier() in the same way: one round of 100 trees; rows, and features of a node, are
/// drawn at 0.8.
Result<PredictorPtr> fit_xgbrf(const TrainingSet& training, const TrainOptions& options);
/// Reads either kind in the library's own JSON. In a build without the library this is a problem.
PredictorPtr read_boosted(LineReader& in, std::size_t features, std::size_t classes);

// Checks of a stored booster before XGBoost reads it. The library follows the nodes, groups and
// lengths in a file without checks.

/// Trees of each class in the one round of XGBRF; XGB has one tree in each of its rounds.
inline constexpr std::size_t trees_of_forest = 100;

/// The text for XGBoost: each name once, the same numbers. Errors: corrupt for anything but a
/// gbtree of multi:softprob for `features` and `classes` in XGBoost's JSON. Trees must be
/// consistent: it refuses a child that is no node or has two parents, a feature or a class out of
/// range, lists of different lengths, and splits by category.
Result<std::string> checked_booster(std::string_view text, std::size_t features,
                                    std::size_t classes);

// Minimum of a smooth convex function of many variables.

/// Returns the value at `x` and writes the slopes to `slope` (same size as `x`).
using Slopes = std::function<double(const std::vector<double>& x, std::vector<double>& slope)>;

struct MinimumOptions {
  double largest_slope = 1e-4;  ///< stop when no slope is larger
  std::size_t most_steps = 1000;
};

/// Minimises from `x` on, by L-BFGS with ten remembered steps (Nocedal 1980). It halves a step
/// until the value falls enough (Armijo). Returns the end point: at a slope small enough, after
/// `most_steps`, or where no step lowers the value any further, which is the limit of the
/// arithmetic.
std::vector<double> minimum(const Slopes& function, std::vector<double> x,
                            const MinimumOptions& options = {});

// Products of small dense matrices of single precision, for the networks.

/// Columns of a matrix are padded to a multiple of this number.
inline constexpr std::size_t column_step = 16;
constexpr std::size_t padded_columns(std::size_t columns) {
  return (columns + column_step - 1) / column_step * column_step;
}
using AlignedFloats = std::vector<float, simd::LineAllocator<float>>;

/// out [rows x columns] = a [rows x inner] b [inner x columns], row-major. `columns` is a multiple
/// of column_step; rows of `a` are `a_stride` apart. Sums have a fixed order: the same bits on
/// every processor.
void product(const float* a, std::size_t rows, std::size_t inner, std::size_t a_stride,
             const float* b, std::size_t columns, float* out);

}  // namespace weft::classifier
