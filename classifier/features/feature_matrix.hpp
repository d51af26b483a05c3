#pragma once
// The feature vectors of many trials with what is known about each: the input of training and
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

// From a trial to its feature vector: Table I of Khan et al. 2016, section III-C.
//
// Where the paper is silent the choices are those of classifier/README.md (AMB-1 to AMB-11).

/// Extracts one trial after another, keeping memory and the tables that depend on the length of the
/// motion: no allocation once it has seen trials of the size. One object per thread.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(FeatureOptions options = {}, BlockSet wanted = BlockSet::all())
      : options_(options), wanted_(wanted) {}

  /// Features in the order of FeatureLayout(trial.taxels, phases_of(trial)), all finite; valid
  /// until the next call. Refuses: sizes that disagree, no sample in phase M, a NaN or infinite
  /// sample (named by its index and taxel), samples so large that a moment overflows. `wanted`: see
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
  /// Contiguous part of its recording that a row is of: what folds keep together where a label has
  /// one recording. Empty: recordings have no parts.
  std::vector<std::size_t> parts = {};

  [[nodiscard]] std::size_t size() const { return values.rows(); }
};

/// Beyond it the difference of two features may overflow: about 2.2e307.
inline constexpr double largest_feature = 0x1p1021;

/// Refuses values that are not finite or beyond largest_feature; `where` names the feature.
Status check_feature(double value, const std::string& where);
/// Of a whole vector; the first bad one by its name.
Status check_features(std::span<const double> values, std::span<const std::string> names);

/// The hint where vectors come from elsewhere than the training.
inline constexpr const char* another_sensor = "Was the model trained for another sensor?";

/// Refuses a vector that has not the number of features that something trained, `where`, takes.
Status check_length(std::span<const double> values, std::size_t expected, std::string_view where,
                    std::string_view hint = {});

/// Refuses sizes that disagree and what check_feature() refuses (named by file and feature).
Status check(const FeatureMatrix& matrix);

/// Extracts all trials, on `threads` threads (0: one per core). All must have the same taxels and
/// phases.
Result<FeatureMatrix> build_feature_matrix(std::span<const Trial> trials,
                                           const FeatureOptions& options = {},
                                           std::size_t threads = 0);

/// Place of a label in the sorted list of all, which has it.
std::size_t find_place(std::span<const std::string> sorted, const std::string& label);

/// The columns of `part`, their names after `prefix`, behind those of `whole`, which is empty or
/// has the same rows; labels, groups and files become those of `part`.
void append_columns(const FeatureMatrix& part, const std::string& prefix, FeatureMatrix& whole);

/// The named columns, in the order given.
FeatureMatrix select_columns(const FeatureMatrix& matrix, std::span<const std::size_t> columns);

/// The named rows, in the order given.
FeatureMatrix select_rows(const FeatureMatrix& matrix, std::span<const std::size_t> rows);

}  // namespace weft::classifier
