#pragma once
// The learners of the registry (learner.hpp), each with a fit_x(), and, where its class is
// not in a header, a read_x() of what its write() wrote: null where `in` has a problem. Then what
// they are made of.

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

/// The largest score, the lowest class of several. Refuses scores that are not finite.
Result<ClassScores> scores_of(std::vector<double> score, std::string_view learner);

/// A normal distribution per class and feature, variances widened by 1e-9 of the largest feature's,
/// priors from the training: scikit-learn's GaussianNB.
Result<PredictorPtr> fit_naive_bayes(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_naive_bayes(LineReader& in, std::size_t features, std::size_t classes);

/// Most frequent class among the five training rows that are nearest (Euclid), the lowest of
/// several; equally near ones in the order of the training.
Result<PredictorPtr> fit_neighbours(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_neighbours(LineReader& in, std::size_t features, std::size_t classes);

/// One tree that looks at all features.
Result<PredictorPtr> fit_tree(const TrainingSet& training, const TrainOptions& options);
/// The mean of the trees' shares.
Result<PredictorPtr> fit_forest(const TrainingSet& training, const TrainOptions& options);

/// Mean over the trees of a forest of what each feature took off the impurity; sum 1. This is how
/// the paper ranked its ten features.
Result<std::vector<double>> forest_importance(const TrainingSet& training,
                                              const TrainOptions& options);

/// libsvm's C-SVC, one against one, RBF with C = 1 and gamma = 1 / (features x variance of all
/// values): the same as scikit-learn's SVC().
Result<PredictorPtr> fit_svm(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_svm(LineReader& in, std::size_t features, std::size_t classes);

/// A small feed-forward network with `hidden` layers of ReLU, softmax at the end, cross entropy
/// with 1e-4 of the squared weights, Adam with steps of 1e-3 on shuffled batches of 200, until the
/// loss of ten passes in a row is not 1e-4 below the best, or after 1000 passes: scikit-learn's
/// MLPClassifier(hidden, max_iter=1000), in single precision. Features should be scaled.
Result<PredictorPtr> fit_network(const TrainingSet& training,
                                 const std::vector<std::size_t>& hidden,
                                 const TrainOptions& options);
PredictorPtr read_network(LineReader& in, std::size_t features, std::size_t classes);

/// Softmax of linear scores; minimises the sum of the rows' cross entropies plus half the squared
/// weights (C = 1; not the intercepts) by L-BFGS until no slope is above 1e-4: scikit-learn's
/// LogisticRegression(max_iter=1000). liblinear has one class against the others only.
Result<PredictorPtr> fit_logistic(const TrainingSet& training, const TrainOptions& options);
PredictorPtr read_logistic(LineReader& in, std::size_t features, std::size_t classes);

/// Extremely randomised trees, as many as options.trees.
Result<PredictorPtr> fit_extra_trees(const TrainingSet& training, const TrainOptions& options);

/// Kesler's perceptron on features as they are, and on scaled ones; minimum squared error, without
/// and with a penalty. Classes count in the order of their first rows (linear_rule.hpp).
Result<PredictorPtr> fit_perceptron(const TrainingSet& training, const TrainOptions& options);
Result<PredictorPtr> fit_scaled_perceptron(const TrainingSet& training,
                                           const TrainOptions& options);
Result<PredictorPtr> fit_least_squares(const TrainingSet& training, const TrainOptions& options);
Result<PredictorPtr> fit_ridge(const TrainingSet& training, const TrainOptions& options);

/// False where Weft was built without libxgboost-dev, and where the library is not installed.
bool have_xgboost();

/// XGBClassifier() of XGBoost 1.7 with n_jobs=1: 100 rounds, depth 6, rate 0.3, softprob. Splits
/// are looked for by histograms of 256 bins (`tree_method="hist"`), the library's own default
/// from 2.0 on, not by the exact search that 1.7 takes for few rows.
Result<PredictorPtr> fit_xgb(const TrainingSet& training, const TrainOptions& options);
/// XGBRFClassifier() so: one round of 100 trees, rows and features of a node drawn at 0.8.
Result<PredictorPtr> fit_xgbrf(const TrainingSet& training, const TrainOptions& options);
/// Of either, in the library's own words (JSON). A build without the library is a problem.
PredictorPtr read_boosted(LineReader& in, std::size_t features, std::size_t classes);

// A stored booster, looked over before XGBoost reads it: the library follows the nodes, groups and
// lengths that it finds in a file, wherever they lead.

/// Trees of each class in the one round of XGBRF; XGB has one in each of its rounds.
inline constexpr std::size_t trees_of_forest = 100;

/// The text as XGBoost is to read it: each name once, the same numbers. Refuses (Errc::corrupt)
/// what is no gbtree of multi:softprob for so many features and classes in XGBoost's JSON, and
/// trees that lead nowhere: a child that is no node or has two parents, a feature or a class beyond
/// the last, lists of unlike lengths, splits by category.
Result<std::string> checked_booster(std::string_view text, std::size_t features,
                                    std::size_t classes);

// Minimum of a smooth convex function of many variables.

/// The value at `x`, and the slopes there in `slope` (as many as `x` has).
using Slopes = std::function<double(const std::vector<double>& x, std::vector<double>& slope)>;

struct MinimumOptions {
  double largest_slope = 1e-4;  ///< stop when no slope is larger
  std::size_t most_steps = 1000;
};

/// From `x` on, by L-BFGS with ten remembered steps (Nocedal 1980) and halved steps until the value
/// falls enough (Armijo). Returns where it stopped: at a slope small enough, after `most_steps`, or
/// where no step makes the value fall any more, which is as far as the arithmetic goes.
std::vector<double> minimum(const Slopes& function, std::vector<double> x,
                            const MinimumOptions& options = {});

// Products of small dense matrices of single precision, for the networks.

/// Columns come in so many: rows of matrices are padded to a multiple of it.
inline constexpr std::size_t column_step = 16;
constexpr std::size_t padded_columns(std::size_t columns) {
  return (columns + column_step - 1) / column_step * column_step;
}
using AlignedFloats = std::vector<float, simd::LineAllocator<float>>;

/// out [rows x columns] = a [rows x inner] b [inner x columns], row-major; `columns` a multiple of
/// column_step, rows of `a` `a_stride` apart. Sums in one order: the same bits on every processor.
void product(const float* a, std::size_t rows, std::size_t inner, std::size_t a_stride,
             const float* b, std::size_t columns, float* out);

}  // namespace weft::classifier
