#pragma once
// An emulated device that is switched on: between its emulator, the far end of a link and a loop.

#include <memory>
#include <optional>

#include "drivers/api/driver.hpp"
#include "drivers/api/timer.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::sim {

/// One emulator on one link and one loop: bytes are fed, answers written, wake-ups kept scheduled.
/// Callbacks hold it weakly: when its owner drops it, what is still queued does nothing.
class Attachment : public std::enable_shared_from_this<Attachment> {
 public:
  Attachment(std::unique_ptr<Emulator> emulator, Link& link, Loop& loop);
  /// Starts listening and schedules the first wake-up.
  void connect();
  void meet_new_host();
  void set_connected(bool connected);  ///< see Rig
  /// Nobody hears it, and it has no timer.
  [[nodiscard]] bool resting() const { return resting_; }
  /// What it slept through is done.
  void catch_up();
  /// Lets the emulator act now, because something about it has changed.
  void poke() { wake(); }

 private:
  void receive(ByteView bytes);
  void wake();
  void schedule();

  std::unique_ptr<Emulator> emulator_;
  Link* link_;
  Loop* loop_;
  ByteSink sink_;
  std::optional<TimePoint> scheduled_;
  TimerId timer_ = 0;
  bool connected_ = true, resting_ = false;
};

}  // namespace weft::sim
