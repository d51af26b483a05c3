#pragma once
// Samples that drivers publish: SI values if a calibration exists, otherwise raw counts (with
// counts in the name).

#include <array>
#include <cstdint>
#include <span>
#include <variant>

#include "protocols/base/time.hpp"

namespace weft {

/// One status reading of one stage. Linear axes: metres; rotary axes: radians; both from home.
struct StageSample {
  double position = 0;  ///< [m] or [rad]
  bool moving = false;
  bool homed = false;
  bool limit = false;         ///< a hardware limit switch is active
  std::uint32_t move_id = 0;  ///< number of the last motion command with confirmed completion
};

/// One reading of the force/torque sensor, in the sensor's frame, bias removed by the sensor.
struct WrenchSample {
  std::array<double, 3> force_n{};    ///< Fx, Fy, Fz [N]; +Fz pushes the plate down
  std::array<double, 3> torque_nm{};  ///< Tx, Ty, Tz [N m]
  std::uint32_t status = 0;           ///< the device's status word
  bool valid = true;                  ///< false if the status word marks the values as wrong
};

/// Limits above any real array or block: larger numbers are garbage.
inline constexpr std::uint32_t most_taxels = 16384;
inline constexpr std::uint32_t most_block_values = 65536;

/// One frame of the tactile array.
struct TaxelSample {
  std::span<const std::uint16_t> counts;  ///< one value per taxel; valid during the call only
  std::uint16_t proximity_counts = 0;
  std::uint16_t ambient_counts = 0;
  std::uint32_t device_us = 0;  ///< the sensor's own clock, wraps
};

/// A block of accelerometer readings, evenly spaced in time.
struct AccelerationSample {
  /// [m/s2], [readings x 3]: x y z of the sensor's frame, reading by reading; valid during the call
  /// only. At rest it reads the acceleration that opposes gravity.
  std::span<const double> acceleration_mps2;
  double rate_hz = 0;           ///< readings per second of the sensor's clock
  std::uint32_t device_us = 0;  ///< the sensor's own clock at the first reading, wraps
  std::uint32_t clipped = 0;    ///< values at an end of the sensor's range
};

/// A block of microphone readings, evenly spaced in time.
struct SoundSample {
  std::span<const double> pressure_pa;  ///< [Pa], [readings]; valid during the call only
  double rate_hz = 0;
  std::uint32_t device_us = 0;
  std::uint32_t clipped = 0;
};

struct Sample {
  TimePoint host;              ///< arrival on the host clock
  std::uint32_t sequence = 0;  ///< the device's number; the driver's own if the protocol has none
  std::uint32_t lost = 0;      ///< frames missing right before this one
  std::variant<StageSample, WrenchSample, TaxelSample, AccelerationSample, SoundSample> value;
};

}  // namespace weft
