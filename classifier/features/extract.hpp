#pragma once
// From a trial to its feature vector: Table I of Khan et al. 2016, section III-C.
//
// Where the paper is silent the choices are those of classifier/README.md (AMB-1 to AMB-11).

#include <memory>
#include <vector>

#include "classifier/features/layout.hpp"
#include "classifier/features/trial.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

enum class SkewOf {
  peaks,  ///< the values of the strict local maxima: the paper's "skewness of the signal peaks"
  signal
};

enum class Norm {
  l2,  ///< root of the sum of squares of the raw counts; grows with the length of the motion
  rms  ///< the same per sample: for data whose motions differ in length
};

enum class SpectrumScale {
  amplitude,  ///< 2 / T x |DFT|: a sinusoid's bin reads its amplitude in counts
  magnitude   ///< |DFT|
};

struct FeatureOptions {
  SkewOf skew = SkewOf::peaks;
  Norm norm = Norm::l2;
  double mode_bin_counts = 1.0;  ///< grid of the mode; raw counts are integers
  SpectrumScale spectrum = SpectrumScale::amplitude;
};

class Spectrum;

/// Extracts one trial after another, keeping the tables that depend on the length of the motion.
/// One object per thread.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(FeatureOptions options = {});
  ~FeatureExtractor();
  FeatureExtractor(FeatureExtractor&&) noexcept;
  FeatureExtractor& operator=(FeatureExtractor&&) noexcept;

  /// Features in the order of FeatureLayout(trial.taxels, phases_of(trial)); all finite.
  /// Refuses: sizes that disagree, no sample in phase M, a NaN or infinite sample (named by its
  /// index and taxel), samples so large that a moment overflows.
  Result<std::vector<double>> extract(const Trial& trial);

 private:
  struct Workspace;
  FeatureOptions options_;
  std::unique_ptr<Workspace> work_;
};

/// The same for a single trial.
Result<std::vector<double>> extract(const Trial& trial, const FeatureOptions& options = {});

}  // namespace weft::classifier
