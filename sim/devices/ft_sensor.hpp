#pragma once
// The Mini40 under the plate: contact and plate weight as counts, with quantum, noise, saturation
// and software bias. Figures: docs/reference/device-facts.md, Mini40 (SI-40-2).

#include <array>
#include <cstdint>
#include <optional>

#include "protocols/base/time.hpp"
#include "sim/devices/emulator.hpp"
#include "sim/plant/contact.hpp"

namespace weft::sim {

/// Six components: Fx, Fy, Fz [N], Tx, Ty, Tz [N m], in the fabric frame, z down.
using Wrench = std::array<double, 6>;

struct FtSensorParams {
  double counts_per_n = 1e6;
  double counts_per_nm = 1e6;
  Wrench range{40, 40, 120, 2, 2, 2};
  Wrench quantum{0.01, 0.01, 0.02, 0.00025, 0.00025, 0.00025};
  Wrench noise{0.005, 0.005, 0.01, 0.000125, 0.000125, 0.000125};  ///< rms [E]
  double plate_mass_kg = 0.3;                                      ///< what it carries always [E]
  double centre_x_m = 0;  ///< the sensor's axis in the fabric frame
  double centre_y_m = 0;
  double height_m = 0.02;  ///< from the sensor's plane up to the plate's surface [E]
};

struct FtReading {
  std::array<std::int32_t, 6> counts{};
  bool saturated = false;
};

/// The count nearest to it, of those that there are; of what is no number, 0.
std::int32_t nearest_count(double counts);

/// The sensor converts at 7 kHz whatever is sent [S: NETFTCPP]: the number of the conversion at
/// `t`.
std::uint32_t conversion_at(TimePoint t);

class FtSensor {
 public:
  FtSensor(const FtSensorParams& params, std::uint64_t seed);

  /// What the sensor is loaded with: contact forces at the contact point, and the plate's weight.
  [[nodiscard]] Wrench load(const ContactState& contact) const;
  /// One conversion; `sample` numbers it and draws its noise, `fz_off_n` [N] is by how much faults
  /// move the axial force before anything else.
  [[nodiscard]] FtReading read(const ContactState& contact, std::uint32_t sample,
                               double fz_off_n = 0) const;
  /// The present reading becomes zero.
  void bias(const ContactState& contact, std::uint32_t sample, double fz_off_n = 0);
  /// What bias() subtracts, as counts.
  [[nodiscard]] std::array<std::int32_t, 6> bias_counts() const;
  void set_bias(const std::array<std::int32_t, 6>& counts);

 private:
  [[nodiscard]] Wrench converted(const ContactState& contact, std::uint32_t sample, double fz_off_n,
                                 bool& saturated) const;

  FtSensorParams params_;
  std::uint64_t seed_;
  bool noisy_;  ///< without noise no number is drawn
  Wrench bias_{};
};

/// What befalls the reading of a force sensor, whatever wire it is sent on.
class ForceEmulator : public Emulator {
 protected:
  /// Drift, a jump of the bias and noise on Fz [N], as the gauges have it: a bias takes it off.
  double fz_off_n(TimePoint at);
  /// The values stay what they were when the fault began.
  void hold_if_stuck(FtReading& reading, TimePoint at);
  /// What the counts are multiplied by; 1 without a fault.
  [[nodiscard]] double calibration_factor(TimePoint at) const;

 private:
  std::optional<FtReading> stuck_;
};

}  // namespace weft::sim
