#pragma once
// The wire of any emulator, with what can happen to bytes between two ends.

#include <deque>
#include <memory>

#include "sim/devices/emulator.hpp"
#include "sim/devices/faults/fault.hpp"

namespace weft::sim {

/// An emulator around another. Bytes pass unchanged and at once while the board has no wire fault.
/// On a stream what is sent first arrives first, whatever its delay; datagrams may overtake.
class FaultyWire final : public Emulator {
 public:
  enum class Kind : std::uint8_t { stream, datagram };
  /// `board` outlives it.
  FaultyWire(std::unique_ptr<Emulator> inner, FaultBoard& board, Kind kind, TimePoint now);

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;
  void meet_new_host() override { inner_->meet_new_host(); }

 private:
  struct Held {
    TimePoint due;
    bool to_device;
    Bytes bytes;
  };
  struct Way {
    bool to_device;
    TimePoint last_due{};
  };

  void pass(Way& way, ByteView bytes, TimePoint now);
  void damage(const Way& way, Bytes& message, TimePoint now);
  [[nodiscard]] TimePoint due(Way& way, TimePoint now);
  void hold(Held held);
  void release(TimePoint now);
  void deliver(bool to_device, ByteView bytes, TimePoint now);

  std::unique_ptr<Emulator> inner_;
  FaultBoard* board_;
  Kind kind_;
  TimePoint now_;
  Way to_host_{false}, to_device_{true};
  std::deque<Held> held_;  ///< by due time; of one instant, in the order in which they were sent
  ByteSink* out_ = nullptr;
  ByteSink from_inner_;
};

}  // namespace weft::sim
