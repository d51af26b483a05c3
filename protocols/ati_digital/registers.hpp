#pragma once
// Register map of an ATI Digital F/T sensor (0-based Modbus addresses). Source:
// docs/reference/device-facts.md, ATI Digital F/T.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace weft::protocols::ati_digital {

inline constexpr std::uint8_t slave_address = 10;
inline constexpr std::size_t gauges = 6;

namespace holding {
inline constexpr std::uint16_t active_gain = 0x0000;    ///< of gauges 0 to 5
inline constexpr std::uint16_t active_offset = 0x0006;  ///< of gauges 0 to 5
inline constexpr std::uint16_t session_id = 0x000C;
inline constexpr std::uint16_t status = 0x001D;
inline constexpr std::uint16_t baud_is_non_volatile = 0x001E;
inline constexpr std::uint16_t baud_index = 0x001F;
inline constexpr std::uint16_t first_calibration = 0x00E3;
}  // namespace holding

namespace input {
inline constexpr std::uint16_t gauge_counts = 0x0000;  ///< of gauges 0 to 5; from memory, uncertain
inline constexpr std::uint16_t diagnostics = 0x0027;   ///< six readings
}  // namespace input

/// Values of holding::baud_index.
inline constexpr std::array<std::uint32_t, 3> bauds{1250000, 19200, 115200};

inline constexpr int calibrations = 16;
inline constexpr std::uint16_t calibration_stride = 192;
inline constexpr std::size_t calibration_registers = 168;
/// Registers per request of a calibration: one request reads at most 125 registers.
inline constexpr std::array<std::uint16_t, 3> calibration_pieces{64, 64, 40};
/// Address of calibration `number`, 1 to `calibrations`.
constexpr std::uint16_t calibration_address(int number) {
  return static_cast<std::uint16_t>(holding::first_calibration + calibration_stride * (number - 1));
}

/// Data bytes of the two vendor functions.
inline constexpr std::uint8_t unlock = 0xAA;
inline constexpr std::uint8_t lock = 0x18;
inline constexpr std::uint8_t start_stream = 0x55;
inline constexpr std::uint8_t done = 1;  ///< in a reply; any other value is a refusal

/// Number of bytes, of any value, that ends a stream.
inline constexpr std::size_t jam_size = 14;

/// Names of the set bits of the status word: "excitation voltage low, EEPROM".
std::string status_text(std::uint16_t status_word);

}  // namespace weft::protocols::ati_digital
