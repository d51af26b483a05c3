#pragma once
// The registers of an emulated ATI Digital F/T sensor. Source: docs/reference/device-facts.md,
// ATI Digital F/T.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "protocols/ati_digital/calibration.hpp"
#include "protocols/modbus/modbus.hpp"

namespace weft::sim {

/// A calibration of a Mini40 SI-40-2 in the pattern of a real Mini40 (CAL80): gauges 0, 2
/// and 4 carry Fz, Tx and Ty, the others Fx, Fy and Tz. The rated load of one axis is 10000 counts
/// of its strongest gauge, so that three axes at once stay inside the converter [E].
protocols::ati_digital::Calibration mini40_calibration(const std::string& serial,
                                                       double counts_per_n, double counts_per_nm);

/// What is read and written. Places that no source tells of read as zero.
class DigitalRegisters {
 public:
  using Exceptional = std::optional<protocols::modbus::ExceptionCode>;

  /// All calibrations but `number` (1 to 16) are empty.
  DigitalRegisters(const protocols::ati_digital::Calibration& calibration, int number,
                   std::uint16_t status_word);

  /// Errors: illegal_address beyond the last calibration.
  Exceptional read_holding(std::uint16_t address, std::uint16_t count,
                           protocols::modbus::Registers& out) const;
  /// Gains, offsets and the speed's registers, while unlocked. Errors: illegal_address,
  /// device_failure while locked [E], illegal_value for a speed that does not exist. Nothing is
  /// written then.
  Exceptional write(std::uint16_t address, std::span<const std::uint16_t> values);
  void lock(bool locked) { locked_ = locked; }

  [[nodiscard]] std::uint16_t gain(std::size_t gauge) const;
  [[nodiscard]] std::uint16_t offset(std::size_t gauge) const;
  [[nodiscard]] std::uint16_t status() const;

  static constexpr std::size_t size = protocols::ati_digital::holding::first_calibration +
                                      std::size_t{protocols::ati_digital::calibrations} *
                                          protocols::ati_digital::calibration_stride;

 private:
  std::array<std::uint16_t, size> values_{};
  bool locked_ = true;
};

}  // namespace weft::sim
