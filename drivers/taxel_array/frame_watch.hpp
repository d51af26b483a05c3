#pragma once
// Looks at the frames of the array for taxels that stand still or are noisy beyond their
// neighbours, and at their pace.

#include <array>

#include "drivers/api/stream_watch.hpp"
#include "protocols/taxel/taxel.hpp"

namespace weft::drivers {

/// Errors: device_data, naming the taxel.
class FrameWatch final : public StreamWatch<protocols::taxel::Frame> {
 public:
  /// `window` zero: it does not look. `has_clock`: frames carry the sensor's own time.
  FrameWatch(double rate_hz, Duration window, bool has_clock);

 private:
  using Frame = protocols::taxel::Frame;
  struct Changes {
    std::uint32_t steps = 0;  ///< frames in which the taxel changed
    double path = 0;          ///< sum of the changes' sizes [counts]
    double largest = 0;       ///< one step is no noise
  };

  void begin(const Frame& frame) override;
  void note(const Frame& frame) override;
  [[nodiscard]] std::optional<Error> check_values(const Frame& frame) const override;
  [[nodiscard]] std::optional<Error> check_still(const Frame& frame) const;
  [[nodiscard]] std::optional<Error> check_noise(const Frame& frame) const;

  std::array<std::uint16_t, protocols::taxel::max_taxels> last_{};
  std::array<Changes, protocols::taxel::max_taxels> changes_{};
};

}  // namespace weft::drivers
