#pragma once
// Features while the samples arrive: for a live vote before the stroke ends.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/features/layout.hpp"
#include "classifier/features/taxel_block.hpp"
#include "protocols/base/phase.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Accepts one frame after the other and computes the features of the frames so far. They equal
/// those of extract() for a trial of these frames. A frame costs a few nanoseconds per taxel. The
/// features cost one evaluation of Table I on the motion so far, plus new tables if its length is
/// not among the last few. Allocates only for a motion longer than all before, or for such tables.
/// Thread: one at a time.
class FeatureStream {
 public:
  /// Longest motion for this number of taxels: about eight hours at 37 Hz, or three days with one
  /// or two taxels, as their transform is narrower. The transform and its tables then take 0.6 and
  /// 1.2 GB. Longer motions are refused.
  static constexpr std::size_t most_motion_frames(std::size_t taxels) {
    return (taxels <= 2 ? std::size_t{10} : std::size_t{1}) << 20;
  }

  /// taxels >= 1
  explicit FeatureStream(std::size_t taxels, FeatureOptions options = {});

  /// Begins a new trial; keeps memory and tables.
  void restart();

  /// Adds one or more frames: `counts` [frames x taxels], all in `phase`. Frames of Phase::none are
  /// dropped. Refuses incomplete frames, non-finite values (with frame and taxel), and more than
  /// most_motion_frames(). The stream does not change on an error.
  Status add(Phase phase, std::span<const double> counts);

  [[nodiscard]] std::size_t taxels() const { return taxels_; }
  /// Frames of phase M so far.
  [[nodiscard]] std::size_t motion_frames() const { return blocks_.front().samples(); }
  /// Phases around M that have frames so far.
  [[nodiscard]] PhaseSet phases() const;

  /// Features in the order of FeatureLayout(taxels(), phases()); all finite; valid until the next
  /// call of any function. Features of a taxel with a block that is not `wanted` are 0, and work
  /// for them alone is skipped. The other features keep their bits whatever other blocks are
  /// requested. Refuses no frame of phase M, an unusable option, and counts so large that a wanted
  /// moment overflows.
  Result<std::span<const double>> features(BlockSet wanted = BlockSet::all());

 private:
  friend class FeatureExtractor;

  // Sums over all frames of a phase, per taxel.
  struct PadSum {
    std::vector<double> sum, lost;  // per taxel: the sum, and its rounding error
    std::size_t frames = 0;

    void restart(std::size_t taxels);
    void add(const double* counts, std::size_t more);  // more: number of frames
  };

  void add_checked(Phase phase, std::span<const double> counts);
  // Features of the other phases; they come first in the vector.
  struct Lead {
    std::array<double, 3> value{};
    std::size_t count = 0;
  };
  [[nodiscard]] Lead lead() const;
  [[nodiscard]] std::optional<double> compute_mean(const PadSum& phase) const;
  [[nodiscard]] Status check_finite() const;

  std::size_t taxels_;
  FeatureOptions options_;
  PadSum rest_, press_, end_;
  std::vector<TaxelBlock> blocks_;
  BlockTools tools_;
  std::vector<double> features_;
};

/// Refuses a motion of more than FeatureStream::most_motion_frames().
Status check_motion_frames(std::size_t frames, std::size_t taxels);

/// The error of a non-finite value; `what` is "feature" or "sample".
tl::unexpected<Error> not_finite(std::string where, const std::string& what, double got);

/// Index of the first non-finite value, or the number of values.
std::size_t first_not_finite(std::span<const double> values);

}  // namespace weft::classifier
