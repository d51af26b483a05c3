#pragma once
// What the sensors and stages say now, for who looks on from another thread. Never a record: of
// the samples between two looks only the extremes of the normal force are kept.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "daemon/hardware/rig/bench.hpp"
#include "drivers/api/sample.hpp"

namespace weft::daemon {

/// The newest of each; what the bench has not said is nothing, or empty.
struct LiveFrame {
  double bench_s = 0;  ///< on the bench's clock
  std::optional<WrenchSample> wrench;
  double least_fz_n = 0, most_fz_n = 0;  ///< since the frame before
  std::optional<recipes::Joints> joints;
  std::vector<std::uint16_t> taxels;  ///< [counts], one value per taxel
};

/// Two threads use it: one runs the bench and never waits here, the other looks. While nobody does,
/// an event of the bench costs one load of an atomic.
class LiveFrameSampler {
 public:
  /// On the thread that looks: whether frames are wanted from now on.
  void set_active(bool on);
  /// The frame that came since the last, where one did; asks for the next.
  std::optional<LiveFrame> take();

  /// On the bench's thread, before anything else of a run: what was heard of another is forgotten.
  void begin();
  /// Likewise: every sample of wrench and taxels.
  void on_sample(const Sample& sample);
  /// Likewise: hands a frame over where one is wanted.
  void show(const Snapshot& seen, TimePoint now) {
    if (wanted_.load(std::memory_order_relaxed)) handover(seen, now);
  }

 private:
  void handover(const Snapshot& seen, TimePoint now);
  void discard_old_frame();

  std::atomic<bool> on_ = false;
  std::atomic<unsigned> activation_ = 0;  ///< how often somebody began to look
  std::atomic<bool> wanted_ = false;
  std::mutex mutex_;
  std::optional<LiveFrame> frame_;   // under the mutex
  LiveFrame next_;                   // the bench's thread's own
  bool pressed_ = false;             // likewise: next_ has extremes
  unsigned sampled_activation_ = 0;  // likewise: the look that next_ is of
};

}  // namespace weft::daemon
