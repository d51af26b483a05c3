#pragma once
// The learners behind Method: each with a fit_x(), and a read_x() of what its write() wrote.

#include <cstddef>
#include <memory>
#include <vector>

#include "classifier/baseline/learner.hpp"
#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

// One decision tree, and a forest of them, as learners of the 2023 paper.

/// Of one tree that looks at all features.
Result<std::unique_ptr<Classifier>> fit_tree(const Training& training,
                                             const MethodOptions& options);
/// The mean of the trees' shares.
Result<std::unique_ptr<Classifier>> fit_forest(const Training& training,
                                               const MethodOptions& options);

/// What the write() of a tree or a forest wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_trees(LineReader& in, std::size_t features, std::size_t classes);

/// Mean over the trees of a forest of what each feature took off the impurity; sum 1. This is how
/// the paper ranked its ten features.
Result<std::vector<double>> forest_importance(const Training& training,
                                              const MethodOptions& options);

// libsvm with scikit-learn's default parameters.

/// C-SVC, one against one, RBF with C = 1 and gamma = 1 / (features x variance of all values): the
/// same as scikit-learn's SVC().
Result<std::unique_ptr<Classifier>> fit_svm(const Training& training);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_svm(LineReader& in, std::size_t features, std::size_t classes);

// Gaussian naive Bayes and nearest neighbours.

/// A normal distribution per class and feature, variances widened by 1e-9 of the largest feature's,
/// priors from the training: scikit-learn's GaussianNB.
Result<std::unique_ptr<Classifier>> fit_naive_bayes(const Training& training);

/// Most frequent class among the five training rows that are nearest (Euclid), the lowest of
/// several; equally near ones in the order of the training.
Result<std::unique_ptr<Classifier>> fit_neighbours(const Training& training);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_naive_bayes(LineReader& in, std::size_t features,
                                             std::size_t classes);
/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_neighbours(LineReader& in, std::size_t features,
                                            std::size_t classes);

// A small feed-forward network.

/// Layers of ReLU, softmax at the end, cross entropy with 1e-4 of the squared weights, Adam with
/// steps of 1e-3 on shuffled batches of 200, until the loss of ten passes in a row is not 1e-4
/// below the best, or after 1000 passes: scikit-learn's MLPClassifier(hidden, max_iter=1000), in
/// single precision. Features should be scaled.
Result<std::unique_ptr<Classifier>> fit_network(const Training& training,
                                                const std::vector<std::size_t>& hidden,
                                                const MethodOptions& options);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_network(LineReader& in, std::size_t features, std::size_t classes);

// Multinomial logistic regression.

/// Softmax of linear scores; minimises the sum of the rows' cross entropies plus half the squared
/// weights (C = 1; not the intercepts) by L-BFGS until no slope is above 1e-4: scikit-learn's
/// LogisticRegression(max_iter=1000). liblinear has one class against the others only.
Result<std::unique_ptr<Classifier>> fit_logistic(const Training& training);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_logistic(LineReader& in, std::size_t features,
                                          std::size_t classes);

// The learners that tell fabrics apart, on any rows.

/// train_recipe() of `learner` with its own defaults.
Result<std::unique_ptr<Classifier>> fit_fabric(const Training& training, Learner learner,
                                               const MethodOptions& options);

/// What its write() wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_fabric(LineReader& in, std::size_t features, std::size_t classes);

/// False where Weft was built without libxgboost-dev, and where the library is not installed.
bool have_xgboost();

/// XGBClassifier() of XGBoost 1.7 with n_jobs=1: 100 rounds, depth 6, rate 0.3, softprob. Splits
/// are looked for by histograms of 256 bins (`tree_method="hist"`), the library's own default
/// from 2.0 on, not by the exact search that 1.7 takes for few rows.
Result<std::unique_ptr<Classifier>> fit_xgb(const Training& training, const MethodOptions& options);
/// XGBRFClassifier() so: one round of 100 trees, rows and features of a node drawn at 0.8.
Result<std::unique_ptr<Classifier>> fit_xgbrf(const Training& training,
                                              const MethodOptions& options);

/// What the write() of either wrote, in the library's own words (JSON); null where `in` has a
/// problem, which a build without the library is.
std::unique_ptr<Classifier> read_boosted(LineReader& in, std::size_t features, std::size_t classes);

}  // namespace weft::classifier::vibro
