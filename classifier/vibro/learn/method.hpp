#pragma once
// The learners of the 2023 paper and ours behind one interface.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// Parameters are scikit-learn's and XGBoost's defaults, as in the paper ("mostly with default
/// parameters").
enum class Method {
  nb,        ///< Gaussian naive Bayes
  knn,       ///< five nearest neighbours
  tree,      ///< one decision tree (CART, Gini)
  forest,    ///< 1000 such trees on samples with replacement, each split looks at sqrt(F) features
  svm,       ///< libsvm, RBF, C = 1, gamma = 1 / (F variance)
  logistic,  ///< multinomial, L2, C = 1
  nn,        ///< one hidden layer of 100, ReLU, Adam
  mlp2,      ///< two of them (S8)
  xgb,       ///< XGBoost, 100 rounds
  xgbrf,     ///< XGBoost's random forest of 100 trees
  lda,       ///< ours: shrinkage LDA
  cores      ///< ours: the pairwise cores of Khan et al. 2016 on all features
};

/// The paper's abbreviations: "NB", "kNN", "Tree", "RForest", "SVM", "LG", "NN", "MLP2", "XGB",
/// "XGBRF"; then "LDA" and "Cores".
std::string_view to_string(Method method);
Result<Method> method_from(std::string_view text);
/// In the order of the enumeration; with those that this build has no library for.
std::vector<Method> all_methods();
/// Those that are quick to train, so that choosing among them costs little; simple ones first.
std::span<const Method> quick_methods();
/// False for XGBoost's where Weft was built without it.
bool available(Method method);

/// Immutable once trained; may be asked by several threads.
class Classifier {
 public:
  Classifier() = default;
  Classifier(const Classifier&) = delete;
  Classifier& operator=(const Classifier&) = delete;
  virtual ~Classifier() = default;
  /// Class of a row of as many features as the training had, all finite.
  [[nodiscard]] virtual std::size_t classify(std::span<const double> features) const = 0;
  /// What was learnt as lines of a stored model.
  virtual void write(LineWriter& out) const = 0;
};

/// What write() wrote, which answers as the one that wrote it, for rows of `features` numbers.
/// `in` keeps the first problem; null then.
std::unique_ptr<Classifier> read_classifier(Method method, LineReader& in, std::size_t features,
                                            std::size_t classes);

/// Rows with a class each, below `classes`; every class at least once. Rows of an equal `unit`,
/// such as windows of one recording, stay together in the folds on which a learner tunes its
/// parameters; without units each row is its own.
struct Training {
  const Matrix* rows = nullptr;
  std::span<const std::size_t> of_row;
  std::size_t classes = 0;
  std::span<const std::size_t> unit = {};
};

struct MethodOptions {
  std::uint64_t seed = 0;    ///< of tree, forest, nn, mlp2, xgb, xgbrf
  std::size_t trees = 1000;  ///< of the forest
  std::size_t threads = 0;   ///< of the forest; 0: one per core. The same forest with any number
};

/// Refuses: sizes that disagree, fewer than two classes, a class without a row, values that are not
/// finite, and a method that is not available().
Result<std::unique_ptr<Classifier>> fit(Method method, const Training& training,
                                        const MethodOptions& options = {});

}  // namespace weft::classifier::vibro
