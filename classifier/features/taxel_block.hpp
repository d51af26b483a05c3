#pragma once
// Up to sixteen taxels of a motion side by side: their samples and running sums.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "classifier/base/lanes.hpp"
#include "classifier/features/layout.hpp"
#include "classifier/features/spectrum.hpp"

namespace weft::classifier {

/// Finds the modes of sixteen signals, or two, by counting. It sorts only if the values are too far
/// apart to be counts of a sensor. Keeps its tables between calls.
class ModeFinder {
 public:
  static constexpr std::size_t signals = simd::block_taxels;
  using Values = std::array<double, signals>;

  /// Most frequent value on a grid of `bin` > 0; the smallest of equally frequent ones (as MATLAB's
  /// mode). `rows` [count x width], count >= 1, width 16 or 2; `low` and `high` have the smallest
  /// and largest value of every signal.
  Values find(const double* rows, std::size_t width, std::size_t count, const Values& low,
              const Values& high, double bin);

 private:
  double by_sorting(const double* column, std::size_t width, std::size_t count, double bin);

  std::vector<std::uint32_t> table_;  // one count per value and signal
  std::vector<double> sorted_;
};

/// Memory that the blocks of a trial share, and tables that outlive the trial.
struct BlockTools {
  SpectrumCache spectra;
  ModeFinder modes;
  simd::AlignedDoubles transform;
};

class TaxelBlock {
 public:
  static constexpr std::size_t taxels = simd::block_taxels;
  using PerTaxel = std::array<double, taxels>;
  /// One entry per taxel and block, in the order of `taxel_blocks`.
  using Features = std::array<PerTaxel, taxel_blocks.size()>;

  /// `used`: number of taxels, 1 to 16. One or two are stored alone; more are processed as sixteen.
  explicit TaxelBlock(std::size_t used);

  /// Discards the samples, keeps the memory.
  void clear() { samples_ = 0; }
  [[nodiscard]] std::size_t used() const { return used_; }
  [[nodiscard]] std::size_t samples() const { return samples_; }

  /// Appends `count` finite samples; sample i begins at `counts` + i x `stride`. Allocates only if
  /// the motion is longer than any before.
  void add(const double* counts, std::size_t stride, std::size_t count);

  /// Features of the samples so far, at least one. Features of unused taxels are those of zeros.
  /// Features of blocks that are not `wanted` are undefined, and passes for them alone are skipped.
  [[nodiscard]] Features features(const FeatureOptions& options, BlockTools& tools,
                                  BlockSet wanted = BlockSet::all()) const;

  /// Updated by add(). Sums of counts are exact: below 2^53.
  struct Running {
    alignas(64) PerTaxel low{}, high{}, sum{}, square{};
    /// A strict local maximum is known one sample later, when the signal falls after it last rose.
    alignas(64) PerTaxel last{}, rising{}, peaks{}, peak_sum{};
  };

 private:
  void grow(std::size_t samples);
  void append(const double* counts, std::size_t stride, std::size_t count);
  void add_spectrum(const PerTaxel& mean, const FeatureOptions& options, BlockTools& tools,
                    Features& out) const;
  void shape_of_one(Features& out) const;
  [[nodiscard]] Features features_of_tiny(const FeatureOptions& options, BlockTools& tools,
                                          BlockSet wanted) const;
  [[nodiscard]] PerTaxel modes(const FeatureOptions& options, BlockTools& tools) const;
  [[nodiscard]] bool narrow() const { return width_ < taxels; }

  std::size_t used_;
  std::size_t width_;          // 2 or 16
  simd::AlignedDoubles rows_;  // [capacity x width]
  std::size_t samples_ = 0;
  Running running_;
};

}  // namespace weft::classifier
