#pragma once
// Newest readings of sensors and stages and those of the last minutes, for a viewer on another
// thread. Not a record: of the samples between two frames it stores only the extremes of the normal
// force.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/hardware/rig/bench.hpp"
#include "drivers/api/sample.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

/// Newest readings. A reading that the bench has not sent yet is nothing, or empty.
struct LiveFrame {
  double bench_s = 0;  ///< on the bench's clock
  Phase phase = Phase::none;
  double force_n = 0, force_band_n = 0;  ///< set point of the phase; 0: force not regulated
  std::optional<WrenchSample> wrench;
  double least_fz_n = 0, most_fz_n = 0;  ///< since the previous frame
  std::optional<recipes::Joints> joints;
  std::vector<std::uint16_t> taxels;  ///< [counts], one value per taxel
  std::vector<double> rest_counts;    ///< mean of each taxel in the newest phase S; empty: none yet
};

/// Readings of one run's bench, available also after the run.
struct LiveHistory {
  std::string run;  ///< empty: no run yet
  std::vector<LiveFrame> rows;
};

/// Used by two threads: one runs the bench and never waits here, the other is the viewer.
class LiveFrameSampler {
 public:
  /// The newest frame, if one came since the last call; requests the next.
  std::optional<LiveFrame> take();
  /// The rows after `after_s`, oldest first, one every `history_step_s`. Only the last has taxels:
  /// the newest.
  [[nodiscard]] LiveHistory history(double after_s) const;

  static constexpr double history_step_s = 0.2;
  static constexpr std::size_t most_history = 12'000;  ///< 40 minutes of the bench's time

  /// Call before the thread of a run's bench starts: clears the readings of the previous run.
  void begin(std::string run);
  /// Bench's thread: stores the set points of the trial that begins.
  void begin_trial(const recipes::Exploration& exploration);
  /// Bench's thread: takes every sample of wrench and taxels with its phase.
  void on_sample(const Sample& sample, Phase phase);
  /// Bench's thread: call at every event of the bench.
  void show(const Snapshot& seen, TimePoint now);

 private:
  /// Readings gathered since some moment.
  struct Gathered {
    std::optional<WrenchSample> wrench;
    double least_fz_n = 0, most_fz_n = 0;
    std::vector<std::uint16_t> taxels;
    void add(const WrenchSample& sample);
  };
  /// Mean of each taxel in phase S.
  class Rest {
   public:
    void add(std::span<const std::uint16_t> counts, bool at_rest);
    void clear() { *this = {}; }
    [[nodiscard]] std::vector<double> means() const;

   private:
    std::vector<double> sums_;
    std::size_t frames_ = 0;
    bool at_rest_ = false;
  };

  [[nodiscard]] LiveFrame make_frame(const Snapshot& seen, TimePoint now, Gathered& gathered) const;

  std::atomic<bool> wanted_ = true;
  mutable std::mutex mutex_;
  std::optional<LiveFrame> frame_;  // guarded by mutex_
  std::string run_;                 // guarded by mutex_
  std::deque<LiveFrame> history_;   // guarded by mutex_
  LiveFrame newest_taxels_;         // guarded by mutex_
  // Used by the bench's thread only:
  Gathered since_frame_, since_row_;
  Rest rest_;
  Phase phase_ = Phase::none;
  std::array<recipes::PhaseStep, 2> regulated_{};  ///< phases P and M of the trial
  std::optional<TimePoint> last_row_;
};

}  // namespace weft::daemon
