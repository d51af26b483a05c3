#pragma once
// The feature vectors of many trials with their labels, groups and files: input of training and
// evaluation.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/features/feature_stream.hpp"
#include "classifier/features/layout.hpp"
#include "classifier/features/trial.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Turns a trial into its feature vector: Table I of Khan et al. 2016, section III-C.
//
// Where the paper leaves a choice, docs/reference/machine-learning.md has it (AMB-1 to
// AMB-11).

/// Extracts one trial after another. Keeps memory and the tables that depend on the length of the
/// motion. After a trial of the same size it does not allocate. One object per thread.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(FeatureOptions options = {}, BlockSet wanted = BlockSet::all())
      : options_(options), wanted_(wanted) {}

  /// Features in the order of FeatureLayout(trial.taxels, phases_of(trial)), all finite; valid
  /// until the next call. Refuses sizes that disagree, no sample in phase M, a NaN or infinite
  /// sample (with its index and taxel), and samples so large that a moment overflows. `wanted`: see
  /// FeatureStream::features().
  Result<std::span<const double>> extract(const Trial& trial);

 private:
  FeatureOptions options_;
  BlockSet wanted_;
  std::optional<FeatureStream> stream_;
};

/// The same for a single trial.
Result<std::vector<double>> extract(const Trial& trial, const FeatureOptions& options = {});

/// One row per trial. `labels`, `groups` and `files` have one entry per row, `names` one per
/// column.
struct FeatureMatrix {
  std::vector<std::string> names;
  Matrix values;
  std::vector<std::string> labels;
  std::vector<std::string> groups;
  std::vector<std::string> files;
  /// The contiguous part of its recording that each row belongs to. Folds keep parts together where
  /// a label has one recording. Empty: recordings have no parts.
  std::vector<std::size_t> parts = {};

  [[nodiscard]] std::size_t size() const { return values.rows(); }
};

/// Largest magnitude of a feature, about 2.2e307: above it the difference of two may overflow.
inline constexpr double largest_feature = 0x1p1021;

/// Refuses values that are not finite or beyond largest_feature; `where` names the feature.
Status check_feature(double value, const std::string& where);
/// Checks a whole vector; the error names the first bad feature.
Status check_features(std::span<const double> values, std::span<const std::string> names);

/// Hint for vectors that do not come from the training.
inline constexpr const char* another_sensor = "Check that the model was trained for this sensor";

/// Refuses a vector with a length other than `expected`; `where` names the trained object.
Status check_length(std::span<const double> values, std::size_t expected, std::string_view where,
                    std::string_view hint = {});

/// Refuses sizes that disagree and what check_feature() refuses (with file and feature).
Status check(const FeatureMatrix& matrix);

/// Extracts all trials on `threads` threads (0: one per core). All must have the same taxels and
/// phases.
Result<FeatureMatrix> build_feature_matrix(std::span<const Trial> trials,
                                           const FeatureOptions& options = {},
                                           std::size_t threads = 0);

/// Index of a label in the sorted list of all labels; the list must contain it.
std::size_t find_place(std::span<const std::string> sorted, const std::string& label);

/// Appends the columns of `part`, with `prefix` before their names, to `whole`. `whole` is empty or
/// has the same rows. Its labels, groups and files become those of `part`.
void append_columns(const FeatureMatrix& part, const std::string& prefix, FeatureMatrix& whole);

/// The named columns, in the order given.
FeatureMatrix select_columns(const FeatureMatrix& matrix, std::span<const std::size_t> columns);

/// The named rows, in the order given.
FeatureMatrix select_rows(const FeatureMatrix& matrix, std::span<const std::size_t> rows);

}  // namespace weft::classifier
