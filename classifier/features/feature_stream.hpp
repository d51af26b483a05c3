#pragma once
// Features while the samples come in: for a daemon that looks at a slide before it ends.

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

/// Takes one frame after the other and gives the features of what has come so far, the same numbers
/// that extract() gives for a trial of those frames. A frame costs a few nanoseconds per taxel; the
/// features cost one evaluation of Table I on the motion so far, with new tables where its length
/// is not one of the last few. Allocates only when a motion is longer than all before, or for such
/// tables. Not for two threads at once.
class FeatureStream {
 public:
  /// Longest motion of so many taxels: about eight hours at 37 Hz, three days of one or two taxels,
  /// whose transform is narrower. The transform and its tables then take 0.6 and 1.2 GB; longer
  /// ones are refused.
  static constexpr std::size_t most_motion_frames(std::size_t taxels) {
    return (taxels <= 2 ? std::size_t{10} : std::size_t{1}) << 20;
  }

  /// taxels >= 1
  explicit FeatureStream(std::size_t taxels, FeatureOptions options = {});

  /// A new trial; keeps memory and tables.
  void restart();

  /// One frame or several: `counts` [frames x taxels], all in `phase`; frames of Phase::none are
  /// dropped. Refuses incomplete frames, values that are not finite, named by frame and taxel, and
  /// what goes beyond most_motion_frames(); the stream is then as before.
  Status add(Phase phase, std::span<const double> counts);

  [[nodiscard]] std::size_t taxels() const { return taxels_; }
  /// Frames of phase M so far.
  [[nodiscard]] std::size_t motion_frames() const { return blocks_.front().samples(); }
  /// Phases around M that have come so far.
  [[nodiscard]] PhaseSet phases() const;

  /// In the order of FeatureLayout(taxels(), phases()); all finite; valid until the next call of
  /// any function. Features of a taxel whose block is not `wanted` are 0, and what they alone need
  /// is not computed; the others are the same to the bit whatever else is wanted. Refuses: no frame
  /// of phase M yet, an unusable option, counts so large that a moment that is wanted overflows.
  Result<std::span<const double>> features(BlockSet wanted = BlockSet::all());

 private:
  friend class FeatureExtractor;

  // Sums over all frames of a phase, per taxel.
  struct PadSum {
    std::vector<double> sum, lost;  // of each taxel, and what rounding took from it
    std::size_t frames = 0;

    void restart(std::size_t taxels);
    void add(const double* counts, std::size_t more);  // frames
  };

  void add_checked(Phase phase, std::span<const double> counts);
  // Features of the other phases, which come first.
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

/// The error of a value that is not finite; `what` it is: "feature", "sample".
tl::unexpected<Error> not_finite(std::string where, const std::string& what, double got);

/// Index of the first value that is not finite, or the number of values.
std::size_t first_not_finite(std::span<const double> values);

}  // namespace weft::classifier
