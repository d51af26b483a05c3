#pragma once
// Looks at the frames of the array for what no single frame shows: taxels that stand still or are
// noisy beyond their neighbours, another rate, a clock that runs wrong.

#include <array>
#include <optional>

#include "drivers/api/suspicion.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/taxel/taxel.hpp"

namespace weft::drivers {

/// Pure. Judges one window after another; allocates only for the error.
class FrameWatch {
 public:
  /// `window` zero: it does not look. `has_clock`: frames carry the sensor's own time.
  FrameWatch(double rate_hz, Duration window, bool has_clock)
      : rate_hz_(rate_hz), window_(window), has_clock_(has_clock) {}

  void restart() { from_.reset(); }
  /// `lost`: frames missing before this one. Errors: device, naming the taxel.
  std::optional<Error> check(const protocols::taxel::Frame& frame, std::uint32_t lost,
                             TimePoint arrival);

 private:
  using Counts = std::array<std::uint16_t, protocols::taxel::max_taxels>;
  struct Changes {
    std::uint32_t steps = 0;  ///< frames in which the taxel changed
    double path = 0;          ///< sum of the changes' sizes [counts]
    double largest = 0;       ///< one step is no noise
  };

  void begin(const protocols::taxel::Frame& frame, TimePoint arrival);
  [[nodiscard]] std::optional<Error> evaluate(const protocols::taxel::Frame& frame, double seconds);
  [[nodiscard]] std::optional<Error> check_still(const protocols::taxel::Frame& frame) const;
  [[nodiscard]] std::optional<Error> check_noise(const protocols::taxel::Frame& frame) const;
  [[nodiscard]] std::optional<Error> check_rate(double seconds);
  [[nodiscard]] std::optional<Error> check_clock_drift(const protocols::taxel::Frame& frame,
                                                       double seconds);

  double rate_hz_;
  Duration window_;
  bool has_clock_;
  std::optional<TimePoint> from_;
  std::uint32_t first_us_ = 0;
  Counts last_{};
  std::array<Changes, protocols::taxel::max_taxels> changes_{};
  std::uint32_t frames_ = 0;
  double expected_frames_ = 0;  ///< lost ones included
  Suspicion rate_, clock_;
};

}  // namespace weft::drivers
