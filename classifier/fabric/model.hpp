#pragma once
// All cores and their vote: the classifier of Khan et al. 2016.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "classifier/fabric/core.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// A core's two classes, as indices into FabricModel::labels(); a < b.
struct Pair {
  std::size_t a = 0;
  std::size_t b = 0;
};

/// All pairs in the order of the cores: (0,1), (0,2) ... (n-2, n-1).
std::vector<Pair> all_pairs(std::size_t classes);
/// Number of pairs.
constexpr std::size_t pair_count(std::size_t classes) {
  return classes * (classes - 1) / 2;
}

/// The vote on one trial.
struct Vote {
  std::size_t winner = 0;  ///< index into FabricModel::labels()
  std::vector<int> votes;  ///< per class
  std::vector<double>
      support;  ///< per class: sum over its cores of tanh(f), with the sign in favour of the class
  std::vector<double> decision;  ///< per core
};

/// Counts the votes of the cores. The winner has the most votes; then the largest support, to 1e-9;
/// then the lowest class (AMB-17). `decision` per pair, finite.
Vote count_votes(std::span<const Pair> pairs, std::vector<double> decision, std::size_t classes);

/// A trained classifier. Immutable; may be used by several threads.
class FabricModel {
 public:
  FabricModel(std::vector<std::string> labels, std::vector<std::string> features,
              Reduction reduction, std::vector<FabricCore> cores);

  [[nodiscard]] const std::vector<std::string>& labels() const { return labels_; }  ///< sorted
  [[nodiscard]] const std::vector<std::string>& feature_names() const { return features_; }
  [[nodiscard]] Reduction reduction() const { return reduction_; }
  [[nodiscard]] const std::vector<Pair>& pairs() const { return pairs_; }
  [[nodiscard]] const std::vector<FabricCore>& cores() const { return cores_; }  ///< one per pair
  /// Cross-validation errors and hinge loss of the chosen grid points, summed over the cores.
  [[nodiscard]] GridScore cross_validation() const;

  /// Votes on one feature vector with columns as feature_names(). Refuses another length and
  /// non-finite values.
  [[nodiscard]] Result<Vote> classify(std::span<const double> features) const;
  /// Decision values [rows x cores]. Each core decides all rows before the next core starts, so it
  /// stays in the cache; a whole large model would not.
  [[nodiscard]] Matrix decisions(const Matrix& rows, std::size_t threads = 0) const;

 private:
  std::vector<std::string> labels_;
  std::vector<std::string> features_;
  Reduction reduction_;
  std::vector<Pair> pairs_;
  std::vector<FabricCore> cores_;
};

/// Trains one core per pair of labels. Refuses fewer than two labels, a label with one trial, and
/// what check() refuses.
Result<FabricModel> train(const FeatureMatrix& matrix, const TrainOptions& options = {});

// ---- the same work in parts, for several processes ----

/// Trains every `stride`th core of all_pairs(), starting at `first` (below `stride`). The matrix
/// and the options must be valid for train().
Result<std::vector<FabricCore>> train_cores(const FeatureMatrix& matrix,
                                            const TrainOptions& options, std::size_t first = 0,
                                            std::size_t stride = 1);

/// All cores, in the order of all_pairs().
using CoreTrainer = std::function<Result<std::vector<FabricCore>>(const TrainOptions& options)>;

/// Like train(), with the cores from one call of `trainer`.
Result<FabricModel> train(const FeatureMatrix& matrix, const TrainOptions& options,
                          const CoreTrainer& trainer);

}  // namespace weft::classifier
