#pragma once
// Watches one channel of a vibration sensor for what single blocks do not show: frozen or saturated
// values, a wrong rate, a wrong clock.

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/api/suspicion.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/vibro/vibro.hpp"

namespace weft::drivers {

/// Pure. Judges one window after another; allocates only for the error.
class BlockWatch {
 public:
  /// `window` zero: it does not look. `blocks_hz`: blocks a second. `full_scale_counts`: the
  /// largest count of the channel.
  BlockWatch(Duration window, double blocks_hz, int full_scale_counts)
      : window_(window), blocks_hz_(blocks_hz), full_scale_counts_(full_scale_counts) {}

  void restart() { from_.reset(); }
  /// `lost`: blocks missing before this one. Errors: device, naming the axis.
  std::optional<Error> check(const protocols::vibro::Frame& block, std::uint32_t lost,
                             TimePoint arrival);

 private:
  void begin(const protocols::vibro::Frame& block, TimePoint arrival);
  void note(const protocols::vibro::Frame& block);
  [[nodiscard]] std::optional<Error> evaluate(const protocols::vibro::Frame& block, double seconds);
  [[nodiscard]] std::optional<Error> check_still(const protocols::vibro::Frame& block) const;
  [[nodiscard]] std::optional<Error> check_rate(double seconds);
  [[nodiscard]] std::optional<Error> check_clock_drift(const protocols::vibro::Frame& block,
                                                       double seconds);

  Duration window_;
  double blocks_hz_;
  int full_scale_counts_;
  std::optional<TimePoint> from_;
  std::uint32_t first_us_ = 0;
  std::array<std::int16_t, protocols::vibro::axes> first_values_{};
  std::array<bool, protocols::vibro::axes> changed_{};
  std::uint32_t blocks_ = 0;
  double expected_blocks_ = 0;  ///< lost ones included
  Suspicion rate_, clock_;
};

}  // namespace weft::drivers
