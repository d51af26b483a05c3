#pragma once
// Interface of every emulated device to the rig: bytes in, bytes out, time as an argument.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "protocols/base/bytes.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/faults/fault.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

/// Receives the data of a device. Each call is one datagram, or one piece of a stream.
using ByteSink = std::function<void(ByteView)>;

/// Interface of an emulated device. Callers must pass times that never decrease.
class Emulator {
 public:
  virtual ~Emulator() = default;
  /// Bytes from the host: any piece of a stream, or one datagram per call.
  virtual void receive(ByteView bytes, TimePoint now, ByteSink& out) = 0;
  /// Time of the device's next own action. A time in the past means now.
  [[nodiscard]] virtual std::optional<TimePoint> next_wakeup() const = 0;
  /// Carries out due actions; early or late calls are harmless.
  virtual void wake(TimePoint now, ByteSink& out) = 0;

  /// Whether it can rest while no host receives its data: skip_to() then makes up for it.
  [[nodiscard]] virtual bool can_rest() const { return false; }
  /// Continues as if all actions due before `now` had been done, without the work. Allowed only if
  /// can_rest() has been true since the last input.
  virtual void skip_to(TimePoint) {}

  /// Another host has taken over: partial messages and settings of the former host are discarded.
  virtual void meet_new_host() {}

  /// Attaches the fault board (must outlive the emulator).
  void attach_faults(FaultBoard& board) { board_ = &board; }

 protected:
  /// The fault that is active at `now`, or nullptr.
  [[nodiscard]] const Fault* active_fault(FaultKind kind, TimePoint now) const {
    return board_ == nullptr ? nullptr : board_->active(kind, now);
  }
  [[nodiscard]] bool has_faults() const { return board_ != nullptr && !board_->faults().empty(); }
  /// The same, decided by chance for this one message or sample.
  const Fault* firing_fault(FaultKind kind, TimePoint now) {
    return board_ == nullptr ? nullptr : board_->fires(kind, now);
  }
  /// True for the first call in this occurrence of a fault; `done` stores the occurrence.
  static bool once(const Fault* fault, std::optional<TimePoint>& done) {
    if (fault == nullptr || done == fault->from) return false;
    done = fault->from;
    return true;
  }
  /// The value of `present` when the fault began, while the fault lasts; `kept` stores it.
  template <class Value>
  const std::optional<Value>& frozen(FaultKind kind, TimePoint at, const Value& present,
                                     std::optional<Value>& kept) const {
    if (active_fault(kind, at) == nullptr)
      kept.reset();
    else if (!kept)
      kept = present;
    return kept;
  }
  /// Only valid while a fault is active.
  Random& fault_dice() { return board_->dice(); }

 private:
  FaultBoard* board_ = nullptr;
};

/// An emulator for one of many connections to the same device; it only answers.
class ClientEmulator : public Emulator {
 public:
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const final { return std::nullopt; }
  void wake(TimePoint, ByteSink&) final {}
  /// The client asked to close the connection, or sent an unsupported request.
  [[nodiscard]] virtual bool finished() const { return false; }
};

/// Common base of the sensors that send numbered frames by themselves: taxels, vibration, imprints.
class FrameEmulator : public Emulator {
 public:
  /// A sensor without commands ignores received bytes.
  void receive(ByteView, TimePoint now, ByteSink& out) override { wake(now, out); }
  void wake(TimePoint now, ByteSink& out) final;

 protected:
  /// Powered on at `now`. Frames are cut into random pieces of 1 to `largest_chunk_bytes`; 0 sends
  /// them whole.
  FrameEmulator(TimePoint now, std::size_t largest_chunk_bytes, std::uint64_t chunk_seed)
      : power_on_(now), largest_chunk_bytes_(largest_chunk_bytes), chunks_(chunk_seed) {}

  /// Period of the frames that describe the sensor.
  static constexpr Duration description_period = std::chrono::seconds(1);

  /// Carries out the actions that are due at `at`.
  virtual void act(TimePoint at, ByteSink& out) = 0;

  template <class Frame>
  void send(const Frame& frame, TimePoint at, ByteSink& out) {
    buffer_.clear();
    append(buffer_, frame);
    send_buffer(at, out);
  }

  /// A frame of `bytes` is not sent, but the random numbers of its pieces are drawn.
  void pass_over(std::size_t bytes);

  /// Whether a fault suppresses the frame number `number` since power-on.
  [[nodiscard]] bool withheld(std::uint64_t number, TimePoint at) const;
  /// Increment of the frame numbers by faults that begin at `at`.
  [[nodiscard]] std::int64_t number_jump(TimePoint at);
  /// True if a fault restarts the sensor at `at`: its clock begins anew.
  [[nodiscard]] bool restarts(TimePoint at);
  /// Reading of the device's own clock [us] for the time `of`, sent at `at`.
  [[nodiscard]] std::uint32_t clock_us(TimePoint of, TimePoint at) const;

 private:
  void send_buffer(TimePoint at, ByteSink& out);
  [[nodiscard]] std::size_t next_piece() { return 1 + chunks_.bits() % largest_chunk_bytes_; }

  TimePoint power_on_;
  std::size_t largest_chunk_bytes_;
  Random chunks_;
  Bytes buffer_;
  std::optional<TimePoint> jumped_, restarted_;  ///< start of the fault that was applied
};

/// An emulator around another one. Without a wire fault, bytes pass unchanged and at once. On a
/// stream the order of bytes is kept at any delay; datagrams may overtake.
class FaultyWire final : public Emulator {
 public:
  enum class Kind : std::uint8_t { stream, datagram };
  /// `board` must outlive the emulator.
  FaultyWire(std::unique_ptr<Emulator> inner, FaultBoard& board, Kind kind, TimePoint now);

  void receive(ByteView bytes, TimePoint now, ByteSink& out) override;
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  void wake(TimePoint now, ByteSink& out) override;
  void meet_new_host() override { inner_->meet_new_host(); }
  /// Wire faults occur by chance per message: with a fault on the board nothing is skipped.
  [[nodiscard]] bool can_rest() const override { return is_sound() && inner_->can_rest(); }
  void skip_to(TimePoint now) override { inner_->skip_to(now); }

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

  /// No fault on the board and nothing held: the wire has no effect.
  [[nodiscard]] bool is_sound() const { return board_->faults().empty() && held_.empty(); }
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
  std::deque<Held> held_;  ///< by due time, then in the order of sending
  ByteSink* out_ = nullptr;
  ByteSink from_inner_;
};

}  // namespace weft::sim
