#pragma once
// Whatever can be trained on a feature matrix and asked for a label: the cores of Khan et al. 2016
// in their variants, and the simple things to compare them with.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "classifier/baseline/multi_class_svc.hpp"
#include "classifier/baseline/shrinkage_lda.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

enum class Learner {
  pvalue,      ///< cores, features with p < delta
  pca,         ///< cores, principal components
  all,         ///< cores, all features
  lda,         ///< shrinkage LDA
  svc,         ///< one multi-class SVC
  cores_best,  ///< the cores whose vote is best in cross-validation
  best         ///< whichever of all is best in cross-validation
};

/// Short names; "cores-pvalue", "cores-pca" and "cores-all" are understood as well.
std::string_view to_string(Learner learner);
Result<Learner> learner_from(std::string_view text);
/// All of them, in the order of the enumeration.
std::vector<Learner> all_learners();

/// One way to train, not a choice between several.
struct Recipe {
  Learner learner = Learner::pvalue;  ///< neither cores_best nor best
  std::size_t cap = 20;               ///< cores with p-value or PCA: the paper's N
  /// Every feature is scaled by all training rows and then compressed, sign(z) log(1 + |z|), before
  /// anything else: moments of contact signals have long tails.
  bool compressed = false;
  friend bool operator==(const Recipe&, const Recipe&) = default;
};
std::string to_string(const Recipe& recipe);

/// How a recipe did in the cross-validation of the whole learner, vote included, on the training
/// part.
struct RecipeScore {
  Recipe recipe;
  std::size_t errors = 0;  ///< out of `tested`
  std::size_t tested = 0;  ///< fewer than all rows: dropped once it could not win any more
};

/// A trained recipe. Immutable; may be used by several threads.
class TrainedLearner {
 public:
  using Machine = std::variant<FabricModel, ShrinkageLda, MultiClassSvc>;
  TrainedLearner(std::vector<std::string> labels, std::optional<Scaler> compression,
                 Machine machine)
      : labels_(std::move(labels)),
        compression_(std::move(compression)),
        machine_(std::move(machine)) {}

  [[nodiscard]] const std::vector<std::string>& labels() const { return labels_; }  ///< sorted
  /// Index into labels().
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const;
  [[nodiscard]] const Machine& machine() const { return machine_; }

 private:
  std::vector<std::string> labels_;
  std::optional<Scaler> compression_;
  Machine machine_;
};

/// options.reduction and options.cap are the recipe's. Refuses what train() refuses.
Result<TrainedLearner> train_recipe(const FeatureMatrix& matrix, const Recipe& recipe,
                                    const TrainOptions& options);

struct ChosenLearner {
  TrainedLearner trained;
  Recipe recipe;
  std::vector<RecipeScore> scores;  ///< of a choice: all candidates; else empty
};

/// Trains `learner`; with `best` or `cores_best` first chooses among its candidates by their errors
/// over class_folds() of the training part, counted after the vote: the first candidate, simple
/// ones first, that is within one standard deviation (root of the count) of the fewest (Breiman et
/// al. 1984, section 3.4.3). A candidate that has as many errors as one that is through is not
/// tried further, which cannot change the choice.
Result<ChosenLearner> train_learner(const FeatureMatrix& matrix, Learner learner,
                                    const TrainOptions& options);

}  // namespace weft::classifier
