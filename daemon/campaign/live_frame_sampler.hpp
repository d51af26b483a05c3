#pragma once
// What the sensors and stages say now and said in the last minutes, for who looks on from another
// thread. Never a record: of the samples between two frames only the extremes of the normal force
// are in it.

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

/// The newest of each; what the bench has not said is nothing, or empty.
struct LiveFrame {
  double bench_s = 0;  ///< on the bench's clock
  Phase phase = Phase::none;
  double force_n = 0, force_band_n = 0;  ///< set point of the phase; 0: its force is not regulated
  std::optional<WrenchSample> wrench;
  double least_fz_n = 0, most_fz_n = 0;  ///< since the frame before
  std::optional<recipes::Joints> joints;
  std::vector<std::uint16_t> taxels;  ///< [counts], one value per taxel
  std::vector<double> rest_counts;    ///< mean of each taxel in the newest phase S; empty: none yet
};

/// What one run's bench said, also once the run is over.
struct LiveHistory {
  std::string run;  ///< empty: there was none yet
  std::vector<LiveFrame> rows;
};

/// Two threads use it: one runs the bench and never waits here, the other looks.
class LiveFrameSampler {
 public:
  /// The frame that came since the last, where one did; asks for the next.
  std::optional<LiveFrame> take();
  /// The rows after `after_s`, the oldest first, one every `history_step_s`. Only the last has
  /// taxels: the newest.
  [[nodiscard]] LiveHistory history(double after_s) const;

  static constexpr double history_step_s = 0.2;
  static constexpr std::size_t most_history = 12'000;  ///< 40 minutes of the bench's time

  /// Before the thread of a run's bench begins: what was heard of another run is forgotten.
  void begin(std::string run);
  /// On the bench's thread: the set points of the trial that begins.
  void begin_trial(const recipes::Exploration& exploration);
  /// Likewise: every sample of wrench and taxels, with the phase that it belongs to.
  void on_sample(const Sample& sample, Phase phase);
  /// Likewise, at every event of the bench.
  void show(const Snapshot& seen, TimePoint now);

 private:
  /// What came since some moment.
  struct Gathered {
    std::optional<WrenchSample> wrench;
    double least_fz_n = 0, most_fz_n = 0;
    std::vector<std::uint16_t> taxels;
    void add(const WrenchSample& sample);
  };
  /// Mean of phase S, taxel by taxel.
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
  std::optional<LiveFrame> frame_;  // under the mutex
  std::string run_;                 // likewise
  std::deque<LiveFrame> history_;   // likewise
  LiveFrame newest_taxels_;         // likewise
  // The bench's thread's own:
  Gathered since_frame_, since_row_;
  Rest rest_;
  Phase phase_ = Phase::none;
  std::array<recipes::PhaseStep, 2> regulated_{};  ///< phases P and M of the trial
  std::optional<TimePoint> last_row_;
};

}  // namespace weft::daemon
