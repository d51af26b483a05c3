#pragma once
// Bytes in, bytes out, time as an argument: what every emulated device looks like to the rig.

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

  /// Whether it can be left alone while nobody hears it: skip_to() then makes up for it.
  [[nodiscard]] virtual bool can_rest() const { return false; }
  /// Goes on as if it had done all that was due before `now`, without the work. Only where
  /// can_rest() has been true since it was last told anything.
  virtual void skip_to(TimePoint) {}

  /// Another host has the place: nothing that the one before left half said or switched off is its.
  virtual void meet_new_host() {}

  /// From now on the device suffers what the board says, which outlives it.
  void attach_faults(FaultBoard& board) { board_ = &board; }

 protected:
  /// The fault that holds at `now`, or nullptr.
  [[nodiscard]] const Fault* active_fault(FaultKind kind, TimePoint now) const {
    return board_ == nullptr ? nullptr : board_->active(kind, now);
  }
  [[nodiscard]] bool has_faults() const { return board_ != nullptr && !board_->faults().empty(); }
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
  /// What `present` was when the fault began, as long as it holds; `kept` remembers it.
  template <class Value>
  const std::optional<Value>& frozen(FaultKind kind, TimePoint at, const Value& present,
                                     std::optional<Value>& kept) const {
    if (active_fault(kind, at) == nullptr)
      kept.reset();
    else if (!kept)
      kept = present;
    return kept;
  }
  /// Only where something struck.
  Random& fault_dice() { return board_->dice(); }

 private:
  FaultBoard* board_ = nullptr;
};

/// An emulator that serves one connection of many to the same device; it only answers.
class ClientEmulator : public Emulator {
 public:
  [[nodiscard]] std::optional<TimePoint> next_wakeup() const final { return std::nullopt; }
  void wake(TimePoint, ByteSink&) final {}
  /// The client asked for the connection to end, or sent what the port does not serve.
  [[nodiscard]] virtual bool finished() const { return false; }
};

/// What the sensors share that send numbered frames by themselves: taxels, vibration, imprints.
class FrameEmulator : public Emulator {
 public:
  /// A sensor that takes no commands: bytes are ignored.
  void receive(ByteView, TimePoint now, ByteSink& out) override { wake(now, out); }
  void wake(TimePoint now, ByteSink& out) final;

 protected:
  /// Powered on at `now`. Frames are cut into pieces of 1 to `largest_chunk_bytes`, at random; 0
  /// sends them whole.
  FrameEmulator(TimePoint now, std::size_t largest_chunk_bytes, std::uint64_t chunk_seed)
      : power_on_(now), largest_chunk_bytes_(largest_chunk_bytes), chunks_(chunk_seed) {}

  /// Of the frames that say who the sensor is.
  static constexpr Duration description_period = std::chrono::seconds(1);

  /// Does what is due at `at`.
  virtual void act(TimePoint at, ByteSink& out) = 0;

  template <class Frame>
  void send(const Frame& frame, TimePoint at, ByteSink& out) {
    buffer_.clear();
    append(buffer_, frame);
    send_buffer(at, out);
  }

  /// A frame of `bytes` is not sent; what chance has its pieces be is drawn all the same.
  void pass_over(std::size_t bytes);

  /// A fault keeps the frame back that would be the `number`th since power-on.
  [[nodiscard]] bool withheld(std::uint64_t number, TimePoint at) const;
  /// What faults that begin at `at` add to the numbers of frames.
  [[nodiscard]] std::int64_t number_jump(TimePoint at);
  /// True where a fault restarts the sensor at `at`: its clock begins anew.
  [[nodiscard]] bool restarts(TimePoint at);
  /// What the device's own clock shows [us] for the moment `of`, told at `at`.
  [[nodiscard]] std::uint32_t clock_us(TimePoint of, TimePoint at) const;

 private:
  void send_buffer(TimePoint at, ByteSink& out);
  [[nodiscard]] std::size_t next_piece() { return 1 + chunks_.bits() % largest_chunk_bytes_; }

  TimePoint power_on_;
  std::size_t largest_chunk_bytes_;
  Random chunks_;
  Bytes buffer_;
  std::optional<TimePoint> jumped_, restarted_;  ///< onset of the fault that was carried out
};

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
  /// Faults fall by chance on what is sent: with one on the board nothing is skipped.
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

  /// No fault on the board and nothing held: the wire is as good as absent.
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
  std::deque<Held> held_;  ///< by due time; of one instant, in the order in which they were sent
  ByteSink* out_ = nullptr;
  ByteSink from_inner_;
};

}  // namespace weft::sim
