#pragma once
// Whatever can be trained on a feature matrix and asked for a label: the cores of Khan et al. 2016
// in their variants, and the simple things to compare them with.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "classifier/baseline/multi_class_svc.hpp"
#include "classifier/baseline/shrinkage_lda.hpp"
#include "classifier/baseline/tree_ensemble.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learn/feature_view.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

enum class Learner {
  pvalue,      ///< cores, features with p < delta
  pca,         ///< cores, principal components
  all,         ///< cores, all features
  lda,         ///< shrinkage LDA
  svc,         ///< one multi-class SVC
  trees,       ///< extremely randomised trees
  cores_best,  ///< the cores whose vote is best in cross-validation
  best         ///< whichever of all is best in cross-validation
};

/// Short names; "cores-pvalue", "cores-pca" and "cores-all" are understood as well.
std::string_view to_string(Learner learner);
Result<Learner> learner_from(std::string_view text);
/// A core per pair of labels; of what chooses between several, false.
constexpr bool is_cores(Learner learner) {
  return learner == Learner::pvalue || learner == Learner::pca || learner == Learner::all;
}
/// All of them, in the order of the enumeration.
std::vector<Learner> all_learners();

/// One way to train, not a choice between several.
struct Recipe {
  Learner learner = Learner::pvalue;  ///< neither cores_best nor best
  std::size_t cap = 20;               ///< cores with p-value or PCA: the paper's N
  View view = View::plain;            ///< of the features, before anything else
  friend bool operator==(const Recipe&, const Recipe&) = default;
};
std::string to_string(const Recipe& recipe);

/// How a recipe did in the cross-validation of the whole learner, vote included, on the training
/// part.
struct RecipeScore {
  Recipe recipe;
  std::size_t errors = 0;  ///< out of `tested`
  /// Trials, each as often as there are rounds; fewer: dropped once it could not win any more, or
  /// of a label that is never held out (class_folds()). 0: rows were too few for folds.
  std::size_t tested = 0;
  std::size_t rounds = 1;  ///< over new folds
};

/// A trained recipe: a machine behind one small interface. Immutable; may be used by several
/// threads.
class TrainedLearner {
 public:
  using Machine = std::variant<FabricModel, ShrinkageLda, MultiClassSvc, TreeEnsemble>;
  TrainedLearner(std::vector<std::string> labels, std::vector<std::string> features,
                 FeatureView view, Machine machine)
      : labels_(std::move(labels)),
        features_(std::move(features)),
        view_(std::move(view)),
        machine_(std::move(machine)) {}
  /// Plain cores.
  explicit TrainedLearner(FabricModel cores)
      : TrainedLearner(cores.labels(), cores.feature_names(), FeatureView(), cores) {}

  [[nodiscard]] const std::vector<std::string>& labels() const { return labels_; }  ///< sorted
  [[nodiscard]] const std::vector<std::string>& feature_names() const { return features_; }
  /// One of pvalue, pca, all, lda, svc, trees.
  [[nodiscard]] Learner kind() const;
  [[nodiscard]] const FeatureView& view() const { return view_; }
  [[nodiscard]] const Machine& machine() const { return machine_; }
  /// nullptr where the learner has none.
  [[nodiscard]] const FabricModel* cores() const { return std::get_if<FabricModel>(&machine_); }

  /// A feature vector as the machine takes it, through view(). Refuses another length than
  /// feature_names() has, and values that are not finite, by name.
  [[nodiscard]] Result<std::vector<double>> prepared(std::span<const double> features) const;
  /// Every row so; a matrix with the columns of the training.
  [[nodiscard]] FeatureMatrix prepared(FeatureMatrix matrix) const;

  /// Index into labels().
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const;

 private:
  std::vector<std::string> labels_;
  std::vector<std::string> features_;
  FeatureView view_;
  Machine machine_;
};

/// The cores that a learner needs, as a piece of work: others may do it, see TaskTrainer.
struct CoreTask {
  Reduction reduction = Reduction::pvalue;
  View view = View::plain;
  std::optional<std::size_t> fold = {};  ///< of a choice: its training rows only; empty: all rows
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
  std::vector<RecipeScore> scores;  ///< of a choice: all candidates; else empty
};

/// Trains `learner`; with `best` or `cores_best` first chooses the candidate with the fewest
/// errors, of as many the first, which is the simplest. Errors are counted after the vote, over
/// class_folds() of the training part; below a hundred trials in five rounds from as many seeds
/// (one where groups are the folds). A candidate that has as many errors as one that is through is
/// not tried further. Where there are no folds (fewer than two labels with three trials) nothing is
/// tested, every candidate has 0 errors of 0, and the first is taken: LDA, or of `cores_best` all
/// features.
/// All cores come from `trainer`, which must give what train_task() would (empty: that is asked);
/// everything else is done here.
Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options, const TaskTrainer& trainer = {});

}  // namespace weft::classifier
