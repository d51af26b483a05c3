#include "sim/devices/digital_registers.hpp"

#include <Eigen/Dense>
#include <algorithm>

namespace weft::sim {

namespace {

using namespace protocols::ati_digital;
using protocols::modbus::ExceptionCode;

constexpr double rated_counts = 10000;
constexpr std::array<float, 6> rating{40, 40, 120, 2, 2, 2};  // SI-40-2, N and N m

/// Serial FT12288, rows Fx Fy Fz Tx Ty Tz, columns gauges 0 to 5 (CAL80: device-facts.md,
/// Sources).
Eigen::Matrix<double, 6, 6> real_pattern() {
  Eigen::Matrix<double, 6, 6> pattern;
  pattern << 0.49669, -0.30752, -0.67526, 31.58401, -0.52567, -32.13403,  //
      0.91512, -37.57532, -0.01988, 17.91305, 0.26027, 18.99891,          //
      18.30062, -0.22759, 18.41379, -0.40968, 18.58899, -0.15117,         //
      0.26910, -0.13463, 32.49482, -0.24474, -32.11057, -0.15796,         //
      -36.63785, 0.16587, 18.24145, -0.39863, 19.10634, 0.16747,          //
      0.78551, -18.83761, 0.00110, -18.39501, -0.10621, -18.71622;
  return pattern;
}

bool writable(std::size_t address) {
  return address <= holding::session_id || address == holding::baud_is_non_volatile ||
         address == holding::baud_index;
}

}  // namespace

Calibration mini40_calibration(const std::string& serial, double counts_per_n,
                               double counts_per_nm) {
  Calibration out;
  out.serial = serial;
  out.part_number = "SI-40-2 (simulated)";
  out.family = "DFT";
  out.time = "2026/01/01 00:00:00";
  out.max_rating = rating;
  out.counts_per_force = static_cast<std::int32_t>(counts_per_n);
  out.counts_per_torque = static_cast<std::int32_t>(counts_per_nm);
  out.gain = {543, 555, 569, 579, 565, 567};
  out.offset = {32380, 33120, 34005, 32990, 33467, 34512};
  const Eigen::Matrix<double, 6, 6> pattern = real_pattern();
  const Eigen::Matrix<double, 6, 6> gauges_per_unit = pattern.inverse();
  for (Eigen::Index i = 0; i < 6; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const double rated = double{rating[row]} * (i < 3 ? counts_per_n : counts_per_nm);
    const double scale = gauges_per_unit.col(i).cwiseAbs().maxCoeff() * rated / rated_counts;
    for (Eigen::Index g = 0; g < 6; ++g)
      out.matrix[row][static_cast<std::size_t>(g)] = static_cast<float>(scale * pattern(i, g));
  }
  return out;
}

DigitalRegisters::DigitalRegisters(const Calibration& calibration, int number,
                                   std::uint16_t status_word) {
  const CalibrationRegisters record = encode(calibration);
  std::copy(record.begin(), record.end(), values_.begin() + calibration_address(number));
  // What is active after power-on is not sourced: the calibration's own values [E].
  std::copy(calibration.gain.begin(), calibration.gain.end(), values_.begin());
  std::copy(calibration.offset.begin(), calibration.offset.end(),
            values_.begin() + holding::active_offset);
  values_[holding::session_id] = 1;
  values_[holding::status] = status_word;
}

DigitalRegisters::Exceptional DigitalRegisters::read_holding(
    std::uint16_t address, std::uint16_t count, protocols::modbus::Registers& out) const {
  if (std::size_t{address} + count > values_.size()) return ExceptionCode::illegal_address;
  out = protocols::modbus::Registers(std::span(values_).subspan(address, count));
  return std::nullopt;
}

DigitalRegisters::Exceptional DigitalRegisters::write(std::uint16_t address,
                                                      std::span<const std::uint16_t> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!writable(address + i)) return ExceptionCode::illegal_address;
    if (address + i == holding::baud_index && values[i] >= bauds.size())
      return ExceptionCode::illegal_value;
  }
  if (locked_) return ExceptionCode::device_failure;
  std::copy(values.begin(), values.end(), values_.begin() + address);
  return std::nullopt;
}

std::uint16_t DigitalRegisters::gain(std::size_t gauge) const {
  return values_[holding::active_gain + gauge];
}

std::uint16_t DigitalRegisters::offset(std::size_t gauge) const {
  return values_[holding::active_offset + gauge];
}

std::uint16_t DigitalRegisters::status() const {
  return values_[holding::status];
}

}  // namespace weft::sim
