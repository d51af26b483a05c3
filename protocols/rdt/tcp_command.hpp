#pragma once
// The command port of the Net F/T, TCP 49151: requests of 20 bytes without a fixed first word,
// big-endian. Source: ATI manual 9610-05-Ethernet Axia-09, section 10, and clients of the Axia and
// NETrs, which belong to the same family (docs/reference/device-facts.md, Net F/T command port).

#include <array>
#include <cstdint>
#include <variant>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::rdt {

inline constexpr std::uint16_t tcp_port = 49151;
inline constexpr std::size_t command_size = 20;
inline constexpr std::size_t ft_reply_size = 16;
inline constexpr std::size_t calibration_reply_size = 24;
inline constexpr std::size_t write_reply_size = 4;

enum class TcpCommand : std::uint8_t {
  read_ft = 0,
  read_calibration = 1,
  write_transform = 2,
  write_condition = 3,
};

struct ReadFt {
  std::uint16_t condition_mask = 0;  ///< bit per condition 0 to 15: enabled from then on
  bool bias = false;                 ///< the present reading becomes zero
  bool clear_latch = false;          ///< clears the latch of the threshold conditions

  bool operator==(const ReadFt&) const = default;
};
struct ReadCalibration {
  bool operator==(const ReadCalibration&) const = default;
};
/// A tool transform: origin and orientation of the frame in which the box reports forces.
struct WriteTransform {
  std::uint8_t distance_unit = 3;            ///< 3: mm; others: metres_per()
  std::uint8_t angle_unit = 1;               ///< 1: degrees
  std::array<std::int16_t, 6> hundredths{};  ///< dx dy dz rx ry rz, in 1/100 of those units

  bool operator==(const WriteTransform&) const = default;
};
/// A threshold condition.
struct WriteCondition {
  std::uint8_t index = 0;          ///< 0 to 31
  std::uint8_t axis = 0;           ///< 0 Fx to 5 Tz
  std::uint8_t output_code = 0;    ///< code on the box's other outputs
  std::int8_t comparison = 1;      ///< 1: above the value, -1: below
  std::int16_t compared_with = 0;  ///< counts divided by CalibrationReply::scale

  bool operator==(const WriteCondition&) const = default;
};
using CommandRequest = std::variant<ReadFt, ReadCalibration, WriteTransform, WriteCondition>;

/// Appends 20 bytes.
void append(Bytes& out, const CommandRequest& request);
/// Errors: parse, for a wrong length; unsupported, for another command.
Result<CommandRequest> decode_command(ByteView bytes);

/// Answer to ReadFt. Real value = counts * scale factor / (counts per newton or newton metre).
struct FtReply {
  std::uint16_t status = 0;  ///< the upper half of Record::status
  std::array<std::int16_t, 6> counts{};

  bool operator==(const FtReply&) const = default;
};
/// Answer to ReadCalibration. Units: 2 N, 3 N m; others: device-facts.md, Net F/T command port.
struct CalibrationReply {
  std::uint8_t force_unit = 2;
  std::uint8_t torque_unit = 3;
  std::uint32_t counts_per_force = 0;
  std::uint32_t counts_per_torque = 0;
  std::array<std::uint16_t, 6> scale{};

  bool operator==(const CalibrationReply&) const = default;
};
/// Answer to WriteTransform and WriteCondition.
struct WriteReply {
  TcpCommand command{};
  std::uint8_t error = 0;  ///< 0: accepted

  bool operator==(const WriteReply&) const = default;
};

void append(Bytes& out, const FtReply& reply);
void append(Bytes& out, const CalibrationReply& reply);
void append(Bytes& out, const WriteReply& reply);
/// Errors: parse, for a wrong length or a wrong first word.
Result<FtReply> decode_ft_reply(ByteView bytes);
Result<CalibrationReply> decode_calibration_reply(ByteView bytes);
Result<WriteReply> decode_write_reply(ByteView bytes);

/// Metres (radians) per unit of a WriteTransform: 1 inch, 2 foot, 3 mm, 4 cm, 5 m; 1 degree, 2
/// radian. Errors: unsupported.
Result<double> metres_per(std::uint8_t distance_unit);
Result<double> radians_per(std::uint8_t angle_unit);

}  // namespace weft::protocols::rdt
