#pragma once
// Microcontroller of a vibration sensor. From power-on it sends blocks of accelerometer and
// microphone readings and, once a second, a description, without requests. The readings are the
// plant's (level L3).

#include <array>
#include <cstdint>
#include <deque>

#include "protocols/vibro/vibro.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/devices/emulator.hpp"

namespace weft::sim {

/// One channel: its sampling by the plant's converter, and the readings per block.
struct VibroChannelParams {
  std::int64_t period_ns = 0;  ///< of its readings; 0: the sensor has no such channel
  double range = 0;            ///< [m/s2] or [Pa]
  double quantum = 0;          ///< of one count
  std::uint16_t block_readings = 0;
};

struct VibroEmulatorParams {
  VibroChannelParams acceleration, sound;
  std::uint32_t serial = 17000001;
  std::array<std::uint8_t, 3> firmware{1, 2, 3};
  /// Frames are cut into random pieces of 1 to this number of bytes; 0 sends them whole.
  std::size_t largest_chunk_bytes = 0;
  std::uint64_t chunk_seed = 0;
  bool datagrams = false;  ///< each frame is a datagram, not a piece of a stream
};

class VibroEmulator final : public FrameEmulator {
 public:
  /// `bench_plant` must outlive the emulator; its plant must be at level L3 and sample as in
  /// `params`. Powered on at `now`: the first block of a channel is the first whole one.
  VibroEmulator(const VibroEmulatorParams& params, BenchPlant& bench_plant, TimePoint now);

  [[nodiscard]] std::optional<TimePoint> next_wakeup() const override;
  [[nodiscard]] bool can_rest() const override { return true; }
  void skip_to(TimePoint now) override;

 private:
  using Reading = std::array<double, protocols::vibro::axes>;  ///< sound: only the first element
  struct Channel {
    protocols::vibro::Kind kind{};
    VibroChannelParams params;
    std::uint64_t next_block = 0;  ///< number since time zero
    std::uint16_t sequence = 0;
    std::uint64_t first_index = 0;  ///< index of waiting[0]
    std::deque<Reading> waiting;    ///< readings without a gap
    std::optional<std::array<std::int16_t, protocols::vibro::axes>> frozen;

    [[nodiscard]] bool on() const { return params.period_ns > 0; }
    [[nodiscard]] TimePoint due() const;
    [[nodiscard]] std::uint64_t first_of_next() const { return next_block * params.block_readings; }
    /// Drops readings before the next block.
    void drop_old();
  };

  void listen(TimePoint now);
  void act(TimePoint at, ByteSink& out) override;
  void send_description(TimePoint at, ByteSink& out);
  void send_block(Channel& channel, TimePoint at, ByteSink& out);
  void apply_faults(Channel& channel, protocols::vibro::Frame& frame, TimePoint at);
  void apply_number_faults(TimePoint at);

  VibroEmulatorParams params_;
  BenchPlant* bench_plant_;
  TimePoint next_description_;
  std::array<Channel, 2> channels_;
  std::uint16_t descriptions_ = 0;
};

}  // namespace weft::sim
