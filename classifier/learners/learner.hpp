#pragma once
// The learners by name, and what becomes of one that is trained on a feature matrix: the cores of
// Khan et al. 2016, the ten classifiers of the paper of 2023, the rules of Ellis 1986, and ours.

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
  mlp2,               ///< network, two of them
  xgb,                ///< XGBoost
  xgbrf,              ///< its random forest
  perceptron,         ///< Kesler's, on the features as they are
  perceptron_zscore,  ///< on scaled features
  least_squares,      ///< minimum squared error
  ridge,              ///< the same with a penalty, by generalised cross-validation
  cores_best,         ///< the cores whose vote is best in cross-validation
  best                ///< whichever of all is best in cross-validation
};

std::string_view to_string(Learner learner);
/// By its name, or one of the names that the papers and earlier versions have for it: "cores-pca",
/// "RForest", "kesler".
Result<Learner> learner_from(std::string_view text);
/// The same, without the choices between several.
Result<Learner> single_learner_from(std::string_view text);
/// A core per pair of labels; of what chooses between several, false.
constexpr bool is_cores(Learner learner) {
  return learner == Learner::pvalue || learner == Learner::pca || learner == Learner::all;
}
constexpr Learner cores_with(Reduction reduction) {
  if (reduction == Reduction::pca) return Learner::pca;
  return reduction == Reduction::all ? Learner::all : Learner::pvalue;
}
/// A choice between several.
constexpr bool is_choice(Learner learner) {
  return learner == Learner::cores_best || learner == Learner::best;
}
/// All of them, in the order of the enumeration; with those that this build has no library for.
std::vector<Learner> all_learners();
/// False for XGBoost's where Weft was built without it, or the library is not installed.
bool is_available(Learner learner);
/// As the paper that has it abbreviates it: "RForest", "kNN"; else its name.
std::string_view paper_name(Learner learner);

/// One way to train, not a choice between several.
struct Recipe {
  Learner learner = Learner::pvalue;      ///< not a choice
  std::size_t cap = 20;                   ///< cores with p-value or PCA: the paper's N
  View view = View::plain;                ///< of the features, before anything else
  std::size_t components = 0;             ///< View::components: the most of them
  std::string features = {};              ///< name of the columns, for people
  std::vector<std::size_t> columns = {};  ///< of the matrix, ascending; empty: all
  friend bool operator==(const Recipe&, const Recipe&) = default;
};
std::string to_string(const Recipe& recipe);

/// What a choice tries on features of fabrics, simple ones first; of a learner that is not a choice
/// itself alone, on standardised features where it needs a common scale.
std::vector<Recipe> candidates(Learner learner, std::size_t cap = 20);

/// How a recipe did in the cross-validation of the whole learner, vote included, on the training
/// part.
struct RecipeScore {
  Recipe recipe;
  std::size_t errors = 0;  ///< out of `tested`
  /// Trials, each as often as there are rounds; fewer: dropped once it could not win any more, or
  /// of a label that is never held out (class_folds()). 0: rows were too few for folds.
  std::size_t tested = 0;
  std::size_t rounds = 1;  ///< over new folds
  double cost_s = 0.0;     ///< of its test, see training_cost()
  double budget_s = 0.0;   ///< TrainOptions::budget that it exceeds, so it was not tried; 0: it was

  [[nodiscard]] bool skipped() const { return budget_s > 0.0; }
};

/// A trained recipe. Immutable; may be used by several threads.
class TrainedLearner {
 public:
  /// `columns`: those of `features` that view and predictor take; empty: all. `outliers`: see
  /// there.
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
  /// Plain cores.
  explicit TrainedLearner(FabricModel cores);

  [[nodiscard]] const std::vector<std::string>& labels() const { return labels_; }  ///< sorted
  [[nodiscard]] const std::vector<std::string>& feature_names() const { return features_; }
  [[nodiscard]] Learner kind() const { return kind_; }  ///< not a choice
  /// Of feature_names(), those that are used; empty: all. A learner that is stored uses all.
  [[nodiscard]] const std::vector<std::size_t>& columns() const { return columns_; }
  /// Per label, training rows that TrainOptions::outliers left out; empty: none were looked for, or
  /// the learner was stored, which does not tell.
  [[nodiscard]] const std::map<std::string, std::size_t>& outliers() const { return outliers_; }
  [[nodiscard]] const FeatureView& view() const { return view_; }
  /// Takes what view() gives.
  [[nodiscard]] const Predictor& predictor() const { return *predictor_; }
  /// The same to keep.
  [[nodiscard]] std::shared_ptr<const Predictor> share_predictor() const { return predictor_; }
  /// nullptr where the learner has none.
  [[nodiscard]] const FabricModel* cores() const { return predictor_->cores(); }
  /// The predictor where it is one of this type; else nullptr.
  template <class Own>
  [[nodiscard]] const Own* as() const {
    return dynamic_cast<const Own*>(predictor_.get());
  }

  /// A feature vector as the predictor takes it, through view(). Refuses another length than
  /// feature_names() has, and values that are not finite, by name.
  [[nodiscard]] Result<std::vector<double>> prepared(std::span<const double> features) const;
  /// Every row so, with the names of the columns.
  [[nodiscard]] FeatureMatrix prepared(FeatureMatrix matrix) const;

  /// What the predictor says of a row. Refuses what prepared() and the predictor refuse.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const;
  /// Of feature_names(), those that an answer depends on, ascending; empty: all. Others may have
  /// any value that prepared() takes.
  [[nodiscard]] std::vector<std::size_t> used_columns() const;

  /// Index into labels().
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

/// Cores as a predictor.
PredictorPtr predictor_of(FabricModel cores);

/// What a learner without cores has learnt, of rows of so many features. Errors are kept by `in`;
/// null then.
PredictorPtr read_predictor(Learner learner, LineReader& in, std::size_t features,
                            std::size_t classes);

/// The cores that a learner needs, as a piece of work: others may do it, see TaskTrainer.
struct CoreTask {
  Reduction reduction = Reduction::pvalue;
  View view = View::plain;
  std::optional<std::size_t> fold = {};  ///< of a choice: its training rows only; empty: all rows
  std::size_t components = 0;            ///< of View::components
};

/// All cores of a task, in the order of all_pairs().
using TaskTrainer = std::function<Result<std::vector<FabricCore>>(const CoreTask& task)>;

/// Every `stride`th core of a task, from `first` on. The same whoever does it.
Result<std::vector<FabricCore>> train_task(const FeatureMatrix& matrix, const CoreTask& task,
                                           TrainOptions options, std::size_t first = 0,
                                           std::size_t stride = 1);

/// options.reduction and options.cap are the recipe's. Refuses what train() refuses.
Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options);

struct ChosenLearner {
  TrainedLearner trained;
  Recipe recipe;
  std::vector<RecipeScore> scores;  ///< of a choice: all candidates, in order; else empty
};

/// Trains the one recipe; of several first chooses the one with the fewest errors, of as many the
/// first, which should be the simplest. Errors are counted after the vote, over class_folds() of
/// the training part; below a hundred trials in five rounds from as many seeds (one where groups
/// are the folds). A candidate that has as many errors as one that is through is not tried further;
/// one that this build has no library for is not tried, nor one that exceeds options.budget
/// (within_budget(); where already the first does it is taken untested). Where there are no folds
/// (fewer than two labels with three trials) nothing is tested, every candidate has 0 errors of 0,
/// and the first is taken. All cores come from `trainer`, which must give what train_task() would
/// (empty: that is asked); everything else is done here. Refuses no candidates.
Result<ChosenLearner> train_best(const FeatureMatrix& matrix, std::span<const Recipe> candidates,
                                 const TrainOptions& options, const TaskTrainer& trainer = {});

/// The same of candidates(learner, options.cap).
Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options, const TaskTrainer& trainer = {});

}  // namespace weft::classifier
