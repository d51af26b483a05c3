#pragma once
// The Mini40 under the plate: contact and plate weight as counts, with quantum, noise, saturation
// and software bias. Values: docs/reference/device-facts.md, Mini40 (SI-40-2).

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
  double plate_mass_kg = 0.3;  ///< constant load on the sensor [E]
  double centre_x_m = 0;       ///< the sensor's axis in the fabric frame
  double centre_y_m = 0;
  double height_m = 0.02;  ///< from the sensor's plane up to the surface of the plate [E]
};

struct FtReading {
  std::array<std::int32_t, 6> counts{};
  bool saturated = false;
};

/// The nearest integer within 32 bits; 0 for NaN.
std::int32_t nearest_count(double counts);

/// Number of the conversion at `t`: the sensor always converts at 7 kHz [S: NETFTCPP].
std::uint32_t conversion_at(TimePoint t);

class FtSensor {
 public:
  FtSensor(const FtSensorParams& params, std::uint64_t seed);

  /// Load of the sensor: contact forces at the contact point, and the weight of the plate.
  [[nodiscard]] Wrench load(const ContactState& contact) const;
  /// One conversion. `sample` is its number and seeds its noise; `fz_off_n` [N] is the shift of the
  /// axial force by faults, before any other step.
  [[nodiscard]] FtReading read(const ContactState& contact, std::uint32_t sample,
                               double fz_off_n = 0) const;
  /// Makes the present reading the bias.
  void bias(const ContactState& contact, std::uint32_t sample, double fz_off_n = 0);
  /// Counts that bias() subtracts.
  [[nodiscard]] std::array<std::int32_t, 6> bias_counts() const;
  void set_bias(const std::array<std::int32_t, 6>& counts);

 private:
  [[nodiscard]] Wrench converted(const ContactState& contact, std::uint32_t sample, double fz_off_n,
                                 bool& saturated) const;

  FtSensorParams params_;
  std::uint64_t seed_;
  bool noisy_;  ///< without noise no random number is drawn
  Wrench bias_{};
};

/// Faults of a force sensor's reading, for any wire.
class ForceEmulator : public Emulator {
 protected:
  /// Drift, bias jump and noise on Fz [N], at the gauges: a later bias removes it.
  double fz_off_n(TimePoint at);
  /// Keeps the values from the start of the fault.
  void hold_if_stuck(FtReading& reading, TimePoint at);
  /// Factor of the counts; 1 without a fault.
  [[nodiscard]] double calibration_factor(TimePoint at) const;

 private:
  std::optional<FtReading> stuck_;
};

}  // namespace weft::sim
