#pragma once
// Whether what was recorded of one take of a repetition is good enough to be trained with.

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/api/sample.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

/// Looks at the samples of the recorded phases as they come: pure, and no more than a few numbers a
/// taxel.
class AttemptQualityCheck {
 public:
  AttemptQualityCheck(const recipes::RepeatBad& limits, double taxel_rate_hz,
                      double wrench_rate_hz);

  void begin();
  void check(const Sample& sample);
  /// The recording goes on: samples are due from `now`.
  void resume(TimePoint now);
  /// The recording pauses: a sensor that has been silent for a while has lost what was due by
  /// `now`. The sample that would tell how many comes when nobody looks any more. A sensor that
  /// gave nothing in the whole take is not judged: its driver's watch reports it.
  void pause(TimePoint now);
  /// Why the take is bad, the first of: lost samples; taxel by taxel a saturated one, a dead one;
  /// force out of its band. `in_band_fraction`: of phase M.
  [[nodiscard]] std::optional<Error> verdict(double in_band_fraction) const;

 private:
  struct Taxel {
    std::uint16_t last = 0;
    std::uint32_t still = 0, longest_still = 0;  ///< frames in a row that are the same
    std::uint32_t full = 0;                      ///< frames at the end of the range
  };
  struct Arrived {
    double rate_hz = 0;
    std::uint64_t samples = 0, lost = 0;
    TimePoint due_from = {};  ///< the last sample, or where the recording went on after it
    bool waits = false;       ///< for the first sample since then
    void add(const Sample& sample);
    [[nodiscard]] std::uint64_t lost_by(TimePoint now) const;
    void pause(TimePoint now);
  };
  void check(const TaxelSample& frame);
  [[nodiscard]] std::optional<Error> lost_samples() const;
  [[nodiscard]] std::optional<Error> bad_taxel() const;

  recipes::RepeatBad limits_;
  std::uint32_t still_frames_;  ///< so many equal ones are a dead taxel's
  std::vector<Taxel> taxels_;
  Arrived frames_, readings_;
};

}  // namespace weft::daemon
