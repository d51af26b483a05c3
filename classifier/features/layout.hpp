#pragma once
// Names, blocks, taxels and units of the features, in the order of Table I of Khan et al. 2016.

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/features/trial.hpp"

namespace weft::classifier {

// Choices that Table I of Khan et al. 2016 leaves open.

enum class SkewOf {
  peaks,  ///< values of the strict local maxima: the paper's "skewness of the signal peaks"
  signal
};

enum class Norm {
  l2,  ///< root of the sum of squares of the raw counts; grows with the length of the motion
  rms  ///< the same per sample, for data with motions of different length
};

enum class SpectrumScale {
  amplitude,  ///< 2 / T x |DFT|: the bin of a sinusoid is its amplitude in counts
  magnitude   ///< |DFT|
};

struct FeatureOptions {
  SkewOf skew = SkewOf::peaks;
  Norm norm = Norm::l2;
  double mode_bin_counts = 1.0;  ///< grid of the mode; raw counts are integers
  SpectrumScale spectrum = SpectrumScale::amplitude;
};

/// The first three are one number per trial; the others are one per taxel, from phase M.
enum class Block {
  mean_p,   ///< mean of phase P over all taxels
  diff_sp,  ///< mean S - mean P
  diff_pe,  ///< mean P - mean E
  max,
  min,
  mean,
  var,
  norm,
  kurt,
  skew,
  range,
  mode,
  m5,
  hfrq,  ///< largest magnitude of the spectrum, DC excluded
  sh,    ///< sum of the upper half of the spectrum
};

inline constexpr std::array taxel_blocks = {Block::max,  Block::min,  Block::mean, Block::var,
                                            Block::norm, Block::kurt, Block::skew, Block::range,
                                            Block::mode, Block::m5,   Block::hfrq, Block::sh};

/// A set of blocks.
class BlockSet {
 public:
  constexpr BlockSet() = default;  ///< none
  constexpr BlockSet(std::initializer_list<Block> blocks) {
    for (const Block block : blocks) add(block);
  }
  static constexpr BlockSet all() {
    BlockSet out;
    out.bits_ = ~0U;
    return out;
  }

  constexpr void add(Block block) { bits_ |= bit_of(block); }
  [[nodiscard]] constexpr bool has(Block block) const { return (bits_ & bit_of(block)) != 0; }
  /// True if the two sets share a block.
  [[nodiscard]] constexpr bool meets(BlockSet other) const { return (bits_ & other.bits_) != 0; }
  friend bool operator==(const BlockSet&, const BlockSet&) = default;

 private:
  static constexpr std::uint32_t bit_of(Block block) { return 1U << static_cast<unsigned>(block); }

  std::uint32_t bits_ = 0;
};

/// The phases around M that a trial has. M itself is always required.
struct PhaseSet {
  bool rest = false;
  bool press = false;
  bool end = false;
  friend bool operator==(const PhaseSet&, const PhaseSet&) = default;
};

/// The phases that occur in `trial`.
PhaseSet phases_of(const Trial& trial);

/// Description of one column of a feature vector.
struct FeatureInfo {
  std::string name;    ///< "mean.P", "range.M.4"
  std::string symbol;  ///< the paper's notation: "F_mean^P", "F_range^M.4"
  Block block = Block::max;
  std::size_t taxel = 0;  ///< counted from 1 as in the paper; 0 where all taxels are averaged
  std::string_view unit;  ///< "count", "count^2", "count^5" or "1"
};

/// The columns of a feature vector: up to 3 + 12 x taxels. A feature of an unrecorded phase
/// is absent.
class FeatureLayout {
 public:
  FeatureLayout(std::size_t taxels, PhaseSet phases);

  [[nodiscard]] std::size_t size() const { return columns_.size(); }
  [[nodiscard]] std::size_t taxels() const { return taxels_; }
  [[nodiscard]] PhaseSet phases() const { return phases_; }
  [[nodiscard]] const std::vector<FeatureInfo>& columns() const { return columns_; }
  [[nodiscard]] std::vector<std::string> names() const;
  /// Blocks of the numbered columns; all blocks if `columns` is empty.
  [[nodiscard]] BlockSet blocks_of(std::span<const std::size_t> columns) const;

 private:
  std::size_t taxels_;
  PhaseSet phases_;
  std::vector<FeatureInfo> columns_;
};

}  // namespace weft::classifier
