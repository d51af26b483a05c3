#pragma once
// The calibration record of an ATI Digital F/T sensor, and the matrix that turns gauge counts into
// a wrench. Source: docs/reference/device-facts.md, ATI Digital F/T (layout), Net F/T command
// port (unit codes).

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "protocols/ati_digital/registers.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::ati_digital {

/// One calibration of the sensor. Matrix rows are Fx Fy Fz Tx Ty Tz, columns the gauges.
struct Calibration {
  std::string serial;       ///< at most 8 characters
  std::string part_number;  ///< at most 32 characters
  std::string family;       ///< at most 4 characters
  std::string time;         ///< date of the calibration, at most 20 characters
  std::array<std::array<float, gauges>, 6> matrix{};
  std::uint8_t force_unit = 2;   ///< code: 1 lbf, 2 N, 3 klbf, 4 kN, 5 kgf, 6 gf
  std::uint8_t torque_unit = 3;  ///< code: 1 lbf-in, 2 lbf-ft, 3 N-m, 4 N-mm, 5 kgf-cm, 6 kN-m
  std::array<float, 6> max_rating{};
  std::int32_t counts_per_force = 1;
  std::int32_t counts_per_torque = 1;
  std::array<std::uint16_t, gauges> gain{};
  std::array<std::uint16_t, gauges> offset{};

  bool operator==(const Calibration&) const = default;
};

using CalibrationRegisters = std::array<std::uint16_t, calibration_registers>;

/// Longer texts are truncated. The record is zero beyond these fields.
CalibrationRegisters encode(const Calibration& calibration);

/// Errors: parse, unless there are 168 registers. Values are not checked: see gauge_matrix().
Result<Calibration> decode_calibration(std::span<const std::uint16_t> registers);

/// wrench = matrix (gauge counts - bias), in N and N m.
struct GaugeMatrix {
  std::array<std::array<double, gauges>, 6> si_per_count{};
  std::array<double, 6> rating{};  ///< greatest magnitude of each component [N, N m]
  double counts_per_n = 1;         ///< scale of the record, for provenance
  double counts_per_nm = 1;

  [[nodiscard]] std::array<double, 6> wrench(const std::array<double, gauges>& counts) const;
};

/// Errors: range, for a matrix that is not finite or has an empty row (an empty slot of the
/// sensor), for a scale or rating that is not positive, and for an unknown unit.
Result<GaugeMatrix> gauge_matrix(const Calibration& calibration);

}  // namespace weft::protocols::ati_digital
