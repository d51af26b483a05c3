#pragma once
// Choices in Table I of Khan et al. 2016 that the paper leaves open.

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

}  // namespace weft::classifier
