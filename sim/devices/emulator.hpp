#pragma once
// Bytes in, bytes out, time as an argument: what every emulated device looks like to the rig.

#include <functional>
#include <optional>

#include "protocols/base/bytes.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/faults/fault.hpp"

namespace weft::sim {

/// Takes what a device sends. Each call is one datagram, or one piece of a stream.
using ByteSink = std::function<void(ByteView)>;

/// Times that a caller passes never decrease.
class Emulator {
 public:
  virtual ~Emulator() = default;
  /// Bytes from the host, in any chunking for streams, one datagram a call otherwise.
  virtual void receive(ByteView bytes, TimePoint now, ByteSink& out) = 0;
  /// When the device wants to act by itself next; may lie in the past, then it is due at once.
  [[nodiscard]] virtual std::optional<TimePoint> next_wakeup() const = 0;
  /// Lets it act; early or late calls do no harm.
  virtual void wake(TimePoint now, ByteSink& out) = 0;

  /// Another host has the place: nothing that the one before left half said or switched off is its.
  virtual void meet_new_host() {}

  /// From now on the device suffers what the board says, which outlives it.
  void attach_faults(FaultBoard& board) { board_ = &board; }

 protected:
  /// The fault that holds at `now`, or nullptr.
  [[nodiscard]] const Fault* active_fault(FaultKind kind, TimePoint now) const {
    return board_ == nullptr ? nullptr : board_->active(kind, now);
  }
  /// The same, thrown for this one message or sample.
  const Fault* firing_fault(FaultKind kind, TimePoint now) {
    return board_ == nullptr ? nullptr : board_->fires(kind, now);
  }
  /// True the first time that this onset of a fault is seen; `done` remembers it.
  static bool once(const Fault* fault, std::optional<TimePoint>& done) {
    if (fault == nullptr || done == fault->from) return false;
    done = fault->from;
    return true;
  }
  /// Only where something struck.
  Random& fault_dice() { return board_->dice(); }

 private:
  FaultBoard* board_ = nullptr;
};

/// An emulator that serves one connection of many to the same device.
class ClientEmulator : public Emulator {
 public:
  /// The client asked for the connection to end, or sent what the port does not serve.
  [[nodiscard]] virtual bool finished() const = 0;
};

}  // namespace weft::sim
