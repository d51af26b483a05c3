#include "protocols/ati_digital/calibration.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

#include "protocols/base/time.hpp"

namespace weft::protocols::ati_digital {
namespace {

constexpr std::size_t serial_size = 8, part_number_size = 32, family_size = 4, time_size = 20;

constexpr double newton_per_lbf = 0.45359237 * standard_gravity_mps2;  // exact: NIST SP 811 B.8
constexpr double m_per_inch = 0.0254;

/// SI value of a unit code; 0 for an unknown code.
double newton_per(std::uint8_t unit) {
  constexpr std::array<double, 7> table{0,
                                        newton_per_lbf,
                                        1,
                                        1e3 * newton_per_lbf,
                                        1e3,
                                        standard_gravity_mps2,
                                        1e-3 * standard_gravity_mps2};
  return unit < table.size() ? table[unit] : 0;
}

double newton_metre_per(std::uint8_t unit) {
  constexpr std::array<double, 7> table{0,
                                        newton_per_lbf * m_per_inch,
                                        newton_per_lbf * 12 * m_per_inch,
                                        1,
                                        1e-3,
                                        1e-2 * standard_gravity_mps2,
                                        1e3};
  return unit < table.size() ? table[unit] : 0;
}

class RegisterWriter {
 public:
  explicit RegisterWriter(CalibrationRegisters& out) : out_(&out) {}
  void word(std::uint16_t value) { (*out_)[at_++] = value; }
  void put_u32(std::uint32_t value) {
    word(static_cast<std::uint16_t>(value >> 16));
    word(static_cast<std::uint16_t>(value));
  }
  void number(float value) { put_u32(std::bit_cast<std::uint32_t>(value)); }
  void text(const std::string& text, std::size_t size) {
    const auto at = [&](std::size_t i) {
      return i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0};
    };
    for (std::size_t i = 0; i < size; i += 2)
      word(static_cast<std::uint16_t>(at(i) << 8 | at(i + 1)));
  }

 private:
  CalibrationRegisters* out_;
  std::size_t at_ = 0;
};

/// Invariant: `registers` holds all that the caller reads; there is no bounds check.
class RegisterReader {
 public:
  explicit RegisterReader(std::span<const std::uint16_t> registers) : registers_(registers) {}
  std::uint16_t word() { return registers_[at_++]; }
  std::uint32_t put_u32() {
    const std::uint32_t high = word();
    return high << 16 | word();
  }
  float number() { return std::bit_cast<float>(put_u32()); }
  /// Text up to the first zero, printable characters only, trailing blanks removed.
  std::string text(std::size_t size) {
    std::string out;
    for (std::size_t i = 0; i < size; i += 2) {
      const std::uint16_t pair = word();
      out.push_back(static_cast<char>(pair >> 8));
      out.push_back(static_cast<char>(pair & 0xFF));
    }
    out.resize(std::min(out.find('\0'), out.size()));
    std::replace_if(
        out.begin(), out.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    out.erase(out.find_last_not_of(' ') + 1);
    return out;
  }

 private:
  std::span<const std::uint16_t> registers_;
  std::size_t at_ = 0;
};

tl::unexpected<Error> unusable(const std::string& what, const std::string& expected,
                               const std::string& got) {
  return fail({.code = Errc::range,
               .what = "calibration of the sensor has " + what,
               .expected = expected,
               .got = got,
               .hint = "Choose another calibration number; this one may be an empty slot"});
}

bool usable_row(const std::array<float, gauges>& row) {
  const auto finite = [](float v) { return std::isfinite(v); };
  const auto zero = [](float v) { return v == 0; };
  return std::all_of(row.begin(), row.end(), finite) && !std::all_of(row.begin(), row.end(), zero);
}

}  // namespace

CalibrationRegisters encode(const Calibration& calibration) {
  CalibrationRegisters out{};
  RegisterWriter writer(out);
  writer.text(calibration.serial, serial_size);
  writer.text(calibration.part_number, part_number_size);
  writer.text(calibration.family, family_size);
  writer.text(calibration.time, time_size);
  for (const auto& row : calibration.matrix)
    for (const float value : row) writer.number(value);
  writer.word(static_cast<std::uint16_t>(calibration.force_unit << 8 | calibration.torque_unit));
  for (const float rating : calibration.max_rating) writer.number(rating);
  writer.put_u32(static_cast<std::uint32_t>(calibration.counts_per_force));
  writer.put_u32(static_cast<std::uint32_t>(calibration.counts_per_torque));
  for (const std::uint16_t gain : calibration.gain) writer.word(gain);
  for (const std::uint16_t offset : calibration.offset) writer.word(offset);
  return out;
}

Result<Calibration> decode_calibration(std::span<const std::uint16_t> registers) {
  if (registers.size() != calibration_registers)
    return fail({.code = Errc::parse,
                 .what = "calibration record has the wrong length",
                 .expected = "168 registers",
                 .got = std::to_string(registers.size()) + " registers"});
  RegisterReader reader(registers);
  Calibration out;
  out.serial = reader.text(serial_size);
  out.part_number = reader.text(part_number_size);
  out.family = reader.text(family_size);
  out.time = reader.text(time_size);
  for (auto& row : out.matrix)
    for (float& value : row) value = reader.number();
  const std::uint16_t units = reader.word();
  out.force_unit = static_cast<std::uint8_t>(units >> 8);
  out.torque_unit = static_cast<std::uint8_t>(units);
  for (float& rating : out.max_rating) rating = reader.number();
  out.counts_per_force = static_cast<std::int32_t>(reader.put_u32());
  out.counts_per_torque = static_cast<std::int32_t>(reader.put_u32());
  for (std::uint16_t& gain : out.gain) gain = reader.word();
  for (std::uint16_t& offset : out.offset) offset = reader.word();
  return out;
}

std::array<double, 6> GaugeMatrix::wrench(const std::array<double, gauges>& counts) const {
  std::array<double, 6> out{};
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t g = 0; g < gauges; ++g) out[i] += si_per_count[i][g] * counts[g];
  return out;
}

Result<GaugeMatrix> gauge_matrix(const Calibration& calibration) {
  const double newton = newton_per(calibration.force_unit);
  const double newton_metre = newton_metre_per(calibration.torque_unit);
  if (newton == 0 || newton_metre == 0)
    return unusable("an unknown unit", "codes 1 to 6",
                    std::to_string(newton == 0 ? calibration.force_unit : calibration.torque_unit));
  if (calibration.counts_per_force <= 0 || calibration.counts_per_torque <= 0)
    return unusable("no scale", "positive counts per unit",
                    std::to_string(calibration.counts_per_force) + " and " +
                        std::to_string(calibration.counts_per_torque));
  GaugeMatrix out;
  out.counts_per_n = calibration.counts_per_force / newton;
  out.counts_per_nm = calibration.counts_per_torque / newton_metre;
  for (std::size_t i = 0; i < 6; ++i) {
    const double rating = calibration.max_rating[i];
    if (!usable_row(calibration.matrix[i]))
      return unusable("an invalid row in its matrix", "six finite numbers, not all zero",
                      "row " + std::to_string(i));
    if (!std::isfinite(rating) || rating <= 0)
      return unusable("an invalid rating", "a positive number", std::to_string(rating));
    out.rating[i] = rating * (i < 3 ? newton : newton_metre);
    for (std::size_t g = 0; g < gauges; ++g)
      out.si_per_count[i][g] =
          double{calibration.matrix[i][g]} / (i < 3 ? out.counts_per_n : out.counts_per_nm);
  }
  return out;
}

std::string status_text(std::uint16_t status_word) {
  constexpr std::array<std::string_view, 16> names{"watchdog",
                                                   "excitation voltage high",
                                                   "excitation voltage low",
                                                   "artificial ground",
                                                   "supply voltage high",
                                                   "supply voltage low",
                                                   "bit 6",
                                                   "EEPROM",
                                                   "invalid configuration",
                                                   "gauge supply high",
                                                   "gauge supply low",
                                                   "thermistor high",
                                                   "thermistor low",
                                                   "gauge converter out of range",
                                                   "bit 14",
                                                   "bit 15"};
  std::string out;
  for (std::size_t bit = 0; bit < names.size(); ++bit)
    if ((status_word >> bit & 1) != 0) out += (out.empty() ? "" : ", ") + std::string(names[bit]);
  return out;
}

}  // namespace weft::protocols::ati_digital
