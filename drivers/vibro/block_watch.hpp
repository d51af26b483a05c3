#pragma once
// Watches one channel of a vibration sensor: the order of its blocks, and what single blocks do not
// show.

#include <array>
#include <cstdint>

#include "drivers/api/stream_watch.hpp"
#include "protocols/vibro/vibro.hpp"

namespace weft::drivers {

/// Looks for frozen or saturated values, a wrong rate, a wrong clock. Errors: device_data, naming
/// the axis.
class BlockWatch final : public StreamWatch<protocols::vibro::Frame> {
 public:
  /// `window` zero: it does not look. `blocks_hz`: blocks a second. `full_scale_counts`: the
  /// largest count of the channel.
  BlockWatch(Duration window, double blocks_hz, int full_scale_counts);

 private:
  void begin(const protocols::vibro::Frame& block) override;
  void note(const protocols::vibro::Frame& block) override;
  [[nodiscard]] std::optional<Error> check_values(
      const protocols::vibro::Frame& block) const override;

  int full_scale_counts_;
  std::array<std::int16_t, protocols::vibro::axes> first_values_{};
  std::array<bool, protocols::vibro::axes> changed_{};
};

/// Which block is new, how many are missing before it, which came late, and when the sensor has
/// begun anew.
class BlockOrder {
 public:
  enum class Verdict : std::uint8_t { next, late, restarted };
  struct Step {
    Verdict verdict = Verdict::next;
    std::uint32_t lost = 0;  ///< blocks missing right before this one
  };

  void reset() { *this = {}; }

  /// A block that is older than the last one came twice or late, unless its clock is far behind or
  /// a run of such blocks shows that the sensor counts anew: a short one while its clock goes on,
  /// which that of late datagrams does not.
  Step observe(const protocols::vibro::Frame& block) {
    const std::int32_t back_us = seen_ ? static_cast<std::int32_t>(last_us_ - block.device_us) : 0;
    const bool far_back = back_us > latest_us;
    const int restart_after = back_us < 0 ? run_while_clock_runs : run_with_clock_back;
    const SequenceStep step = sequence_.observe(block.sequence);
    const bool older =
        step.event == SequenceEvent::out_of_order || step.event == SequenceEvent::duplicate;
    if (older && !far_back && ++late_in_a_row(block) < restart_after) return {Verdict::late, 0};
    late_run_ = 0;
    seen_ = true;
    last_us_ = block.device_us;
    if (!older && !far_back) return {Verdict::next, step.lost};
    sequence_.reset();
    sequence_.observe(block.sequence);
    return {Verdict::restarted, 0};
  }

 private:
  static constexpr std::int32_t latest_us = 2'000'000;
  static constexpr int run_while_clock_runs = 3;
  static constexpr int run_with_clock_back = 10;

  /// How many late blocks came right before, each the next of the one before.
  int& late_in_a_row(const protocols::vibro::Frame& block) {
    if (block.sequence != static_cast<std::uint16_t>(last_late_ + 1)) late_run_ = 0;
    last_late_ = block.sequence;
    return late_run_;
  }

  protocols::vibro::SequenceTracker sequence_;
  bool seen_ = false;
  std::uint32_t last_us_ = 0;
  std::uint16_t last_late_ = 0;
  int late_run_ = 0;
};

}  // namespace weft::drivers
