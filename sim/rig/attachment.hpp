#pragma once
// Connects an emulator that is switched on to the far end of a link and to a loop.

#include <memory>
#include <optional>

#include "drivers/api/driver.hpp"
#include "drivers/api/timer.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::sim {

/// One emulator on one link and one loop: feeds it bytes, writes its answers, schedules its
/// wake-ups. Callbacks hold it weakly: once its owner drops it, queued callbacks do nothing.
class Attachment : public std::enable_shared_from_this<Attachment> {
 public:
  Attachment(std::unique_ptr<Emulator> emulator, Link& link, Loop& loop);
  /// Subscribes to the link and schedules the first wake-up.
  void connect();
  void meet_new_host();
  void set_connected(bool connected);  ///< see Rig
  /// True while no host receives its data and it has no timer.
  [[nodiscard]] bool resting() const { return resting_; }
  /// Makes up for the time that it rested.
  void catch_up();
  /// Wakes the emulator now, because its state or faults have changed.
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
