#pragma once
// Decides whether the record of one attempt at a trial is good enough for training.

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/api/sample.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

/// Checks the samples of the recorded phases as they arrive. Pure; stores a few numbers per taxel.
class AttemptQualityCheck {
 public:
  AttemptQualityCheck(const recipes::RepeatBad& limits, double taxel_rate_hz,
                      double wrench_rate_hz);

  void begin();
  void check(const Sample& sample);
  /// The recording resumes: samples are due from `now`.
  void resume(TimePoint now);
  /// The recording pauses: a sensor that has been silent for a while has lost the samples due by
  /// `now`. The sample that would report their number arrives outside the recording. A sensor
  /// without any sample in the attempt is not judged: its driver's watchdog reports it.
  void pause(TimePoint now);
  /// First reason why the attempt is bad, in this order: lost samples; taxel by taxel, saturated or
  /// dead; force out of its band. Nothing if it is good. `in_band_fraction`: of phase M.
  [[nodiscard]] std::optional<Error> verdict(double in_band_fraction) const;

 private:
  struct Taxel {
    std::uint16_t last = 0;
    std::uint32_t still = 0, longest_still = 0;  ///< equal frames in a row
    std::uint32_t full = 0;                      ///< frames at the end of the range
  };
  struct Arrived {
    double rate_hz = 0;
    std::uint64_t samples = 0, lost = 0;
    TimePoint due_from = {};  ///< time of the last sample, or of the later resume
    bool waits = false;       ///< for the first sample since the resume
    void add(const Sample& sample);
    [[nodiscard]] std::uint64_t lost_by(TimePoint now) const;
    void pause(TimePoint now);
  };
  void check(const TaxelSample& frame);
  [[nodiscard]] std::optional<Error> lost_samples() const;
  [[nodiscard]] std::optional<Error> bad_taxel() const;

  recipes::RepeatBad limits_;
  std::uint32_t still_frames_;  ///< a taxel with this number of equal frames in a row is dead
  std::vector<Taxel> taxels_;
  Arrived frames_, readings_;
};

}  // namespace weft::daemon
