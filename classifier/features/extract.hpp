#pragma once
// From a trial to its feature vector: Table I of Khan et al. 2016, section III-C.
//
// Where the paper is silent the choices are those of classifier/README.md (AMB-1 to AMB-11).

#include <optional>
#include <span>
#include <vector>

#include "classifier/features/feature_stream.hpp"
#include "classifier/features/options.hpp"
#include "classifier/features/trial.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Extracts one trial after another, keeping memory and the tables that depend on the length of the
/// motion: no allocation once it has seen trials of the size. One object per thread.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(FeatureOptions options = {}) : options_(options) {}

  /// Features in the order of FeatureLayout(trial.taxels, phases_of(trial)), all finite; valid
  /// until the next call. Refuses: sizes that disagree, no sample in phase M, a NaN or infinite
  /// sample (named by its index and taxel), samples so large that a moment overflows.
  Result<std::span<const double>> extract(const Trial& trial);

 private:
  FeatureOptions options_;
  std::optional<FeatureStream> stream_;
};

/// The same for a single trial.
Result<std::vector<double>> extract(const Trial& trial, const FeatureOptions& options = {});

}  // namespace weft::classifier
