#pragma once
// The learners by name, and their trained form on a feature matrix: the cores of Khan et al. 2016,
// the ten classifiers of the paper of 2023, the rules of Ellis 1986, and our own.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learn/feature_view.hpp"
#include "classifier/learners/predictor.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

enum class Learner {
  pvalue,             ///< cores, features with p < delta
  pca,                ///< cores, principal components
  all,                ///< cores, all features
  lda,                ///< shrinkage LDA
  svc,                ///< one multi-class SVC, tuned
  trees,              ///< extremely randomised trees
  nb,                 ///< Gaussian naive Bayes
  knn,                ///< five nearest neighbours
  tree,               ///< one decision tree
  forest,             ///< random forest
  svm,                ///< libsvm with its defaults
  logistic,           ///< multinomial logistic regression
  nn,                 ///< network, one hidden layer
  mlp2,               ///< network, two hidden layers
  xgb,                ///< XGBoost
  xgbrf,              ///< XGBoost's random forest
  perceptron,         ///< Kesler's, on unscaled features
  perceptron_zscore,  ///< Kesler's, on scaled features
  least_squares,      ///< minimum squared error
  ridge,              ///< least_squares with a penalty, by generalised cross-validation
  cores_best,         ///< the cores with the best vote in cross-validation
  best                ///< the best of all in cross-validation
};

std::string_view to_string(Learner learner);
/// A learner by its name, or by a name in the papers or earlier versions: "cores-pca", "RForest",
/// "kesler".
Result<Learner> learner_from(std::string_view text);
/// The same, without the learners that choose between several.
Result<Learner> single_learner_from(std::string_view text);
/// True for one core per pair of labels; false for a choice between several.
constexpr bool is_cores(Learner learner) {
  return learner == Learner::pvalue || learner == Learner::pca || learner == Learner::all;
}
constexpr Learner cores_with(Reduction reduction) {
  if (reduction == Reduction::pca) return Learner::pca;
  return reduction == Reduction::all ? Learner::all : Learner::pvalue;
}
/// True for a choice between several.
constexpr bool is_choice(Learner learner) {
  return learner == Learner::cores_best || learner == Learner::best;
}
/// All learners in the order of the enumeration, including those without a library in this build.
std::vector<Learner> all_learners();
/// False for XGBoost's learners if Weft was built without it, or the library is not installed.
bool is_available(Learner learner);
/// The paper's abbreviation: "RForest", "kNN"; else the learner's name.
std::string_view paper_name(Learner learner);

/// One way to train; never a choice between several.
struct Recipe {
  Learner learner = Learner::pvalue;      ///< not a choice
  std::size_t cap = 20;                   ///< cores with p-value or PCA: the paper's N
  View view = View::plain;                ///< transform of the features, applied first
  std::size_t components = 0;             ///< View::components: upper limit of their number
  std::string features = {};              ///< name of the columns, for reports
  std::vector<std::size_t> columns = {};  ///< of the matrix, ascending; empty: all
  friend bool operator==(const Recipe&, const Recipe&) = default;
};
std::string to_string(const Recipe& recipe);

/// Recipes that a choice tries on features of fabrics, simple ones first. A learner that is not a
/// choice gives one recipe, on standardised features if it needs a common scale.
std::vector<Recipe> candidates(Learner learner, std::size_t cap = 20);

/// Result of a recipe in the cross-validation of the whole learner, vote included, on the training
/// part.
struct RecipeScore {
  Recipe recipe;
  std::size_t errors = 0;  ///< out of `tested`
  /// Trials, each counted once per round. Fewer if the recipe was dropped early because it could
  /// not win, or if a label is never held out (class_folds()). 0: too few rows for folds.
  std::size_t tested = 0;
  std::size_t rounds = 1;  ///< number of rounds with new folds
  double cost_s = 0.0;     ///< of its test, see training_cost()
  double budget_s =
      0.0;  ///< TrainOptions::budget if the recipe exceeds it and was not tried; else 0

  [[nodiscard]] bool skipped() const { return budget_s > 0.0; }
};

/// A trained recipe. Immutable; may be used by several threads.
class TrainedLearner {
 public:
  /// `columns`: columns of `features` for view and predictor; empty: all. `outliers`: see
  /// outliers().
  TrainedLearner(Learner kind, std::vector<std::string> labels, std::vector<std::string> features,
                 FeatureView view, std::shared_ptr<const Predictor> predictor,
                 std::vector<std::size_t> columns = {},
                 std::map<std::string, std::size_t> outliers = {})
      : kind_(kind),
        labels_(std::move(labels)),
        features_(std::move(features)),
        columns_(std::move(columns)),
        outliers_(std::move(outliers)),
        view_(std::move(view)),
        predictor_(std::move(predictor)) {}
  /// Plain cores without a view.
  explicit TrainedLearner(FabricModel cores);

  [[nodiscard]] const std::vector<std::string>& labels() const { return labels_; }  ///< sorted
  [[nodiscard]] const std::vector<std::string>& feature_names() const { return features_; }
  [[nodiscard]] Learner kind() const { return kind_; }  ///< not a choice
  /// Indices of the used feature_names(); empty: all. A stored learner uses all.
  [[nodiscard]] const std::vector<std::size_t>& columns() const { return columns_; }
  /// Per label: training rows that TrainOptions::outliers left out. Empty if none were searched, or
  /// if the learner was stored, as the file does not have them.
  [[nodiscard]] const std::map<std::string, std::size_t>& outliers() const { return outliers_; }
  [[nodiscard]] const FeatureView& view() const { return view_; }
  /// The predictor; its input is the output of view().
  [[nodiscard]] const Predictor& predictor() const { return *predictor_; }
  /// Shared ownership of predictor().
  [[nodiscard]] std::shared_ptr<const Predictor> share_predictor() const { return predictor_; }
  /// nullptr if the learner has no cores.
  [[nodiscard]] const FabricModel* cores() const { return predictor_->cores(); }
  /// The predictor if it has this type; else nullptr.
  template <class Own>
  [[nodiscard]] const Own* as() const {
    return dynamic_cast<const Own*>(predictor_.get());
  }

  /// Transforms a feature vector for the predictor, with view(). Refuses another length than that
  /// of feature_names(), and non-finite values, with their names.
  [[nodiscard]] Result<std::vector<double>> prepared(std::span<const double> features) const;
  /// Transforms every row; the result has the names of the columns.
  [[nodiscard]] FeatureMatrix prepared(FeatureMatrix matrix) const;

  /// Predicts one row. Refuses what prepared() and the predictor refuse.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const;
  /// Indices of the feature_names() that a prediction depends on, ascending; empty: all. The others
  /// may have any value that prepared() accepts.
  [[nodiscard]] std::vector<std::size_t> used_columns() const;

  /// Returns an index into labels().
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const;

 private:
  Learner kind_;
  std::vector<std::string> labels_;
  std::vector<std::string> features_;
  std::vector<std::size_t> columns_;
  std::map<std::string, std::size_t> outliers_;
  FeatureView view_;
  std::shared_ptr<const Predictor> predictor_;
};

/// Makes a predictor of cores.
PredictorPtr predictor_of(FabricModel cores);

/// Reads the predictor of a learner without cores, for rows of `features` features. Problems are
/// recorded in `in`; the result is then null.
PredictorPtr read_predictor(Learner learner, LineReader& in, std::size_t features,
                            std::size_t classes);

/// The cores that a learner needs, as a task that another process may do; see TaskTrainer.
struct CoreTask {
  Reduction reduction = Reduction::pvalue;
  View view = View::plain;
  std::optional<std::size_t> fold =
      {};  ///< of a choice: index of the fold with the training rows; empty: all rows
  std::size_t components = 0;  ///< number for View::components
};

/// All cores of a task, in the order of all_pairs().
using TaskTrainer = std::function<Result<std::vector<FabricCore>>(const CoreTask& task)>;

/// Trains every `stride`th core of a task, starting at `first`. The result is the same in any
/// process.
Result<std::vector<FabricCore>> train_task(const FeatureMatrix& matrix, const CoreTask& task,
                                           TrainOptions options, std::size_t first = 0,
                                           std::size_t stride = 1);

/// Trains one recipe; it determines options.reduction and options.cap. Refuses what train()
/// refuses.
Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options);

struct ChosenLearner {
  TrainedLearner trained;
  Recipe recipe;
  std::vector<RecipeScore> scores;  ///< of a choice: all candidates, in order; otherwise empty
};

/// Trains the only recipe, or first chooses the one with the fewest errors; the first one wins a
/// tie, so simple ones come first. Errors are counted after the vote, over class_folds() of the
/// training part. With fewer than a hundred trials there are five rounds from five seeds (one if
/// groups are the folds). A candidate is dropped once it has as many errors as a complete one. A
/// candidate is not tried if this build lacks its library, or if it exceeds options.budget
/// (within_budget(); if already the first one does, it is taken untested). Without folds (fewer
/// than two labels with three trials) nothing is tested, every candidate has 0 errors of 0, and the
/// first is taken. All cores come from `trainer`, which must return the result of train_task()
/// (empty: train_task() is called). Everything else is done here. Refuses no candidates.
Result<ChosenLearner> train_best(const FeatureMatrix& matrix, std::span<const Recipe> candidates,
                                 const TrainOptions& options, const TaskTrainer& trainer = {});

/// The same with candidates(learner, options.cap).
Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options, const TaskTrainer& trainer = {});

}  // namespace weft::classifier
