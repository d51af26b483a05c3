#pragma once
// One emulator on one link and one loop: bytes are fed, answers written, wake-ups kept scheduled.

#include <memory>
#include <optional>

#include "drivers/api/driver.hpp"
#include "drivers/api/timer.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::sim {

/// Callbacks hold it weakly: when its owner drops it, what is still queued does nothing.
class Attachment : public std::enable_shared_from_this<Attachment> {
 public:
  Attachment(std::unique_ptr<Emulator> emulator, Link& link, Loop& loop);
  /// Starts listening and schedules the first wake-up.
  void connect();
  void meet_new_host();
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
};

}  // namespace weft::sim
