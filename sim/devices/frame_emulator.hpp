#pragma once
// What the sensors share that send numbered frames by themselves: taxels, vibration, imprints.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "sim/devices/emulator.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

class FrameEmulator : public Emulator {
 public:
  void wake(TimePoint now, ByteSink& out) final;

 protected:
  /// Powered on at `now`. Frames are cut into pieces of 1 to `largest_chunk_bytes`, at random; 0
  /// sends them whole.
  FrameEmulator(TimePoint now, std::size_t largest_chunk_bytes, std::uint64_t chunk_seed)
      : power_on_(now), largest_chunk_bytes_(largest_chunk_bytes), chunks_(chunk_seed) {}

  /// Does what is due at `at`.
  virtual void act(TimePoint at, ByteSink& out) = 0;

  template <class Frame>
  void send(const Frame& frame, TimePoint at, ByteSink& out) {
    buffer_.clear();
    append(buffer_, frame);
    send_buffer(at, out);
  }

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

  TimePoint power_on_;
  std::size_t largest_chunk_bytes_;
  Random chunks_;
  Bytes buffer_;
  std::optional<TimePoint> jumped_, restarted_;  ///< onset of the fault that was carried out
};

}  // namespace weft::sim
