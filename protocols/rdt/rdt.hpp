#pragma once
// ATI Net F/T "raw data transfer" over UDP port 49152. Multi-byte fields are big-endian.
// Source: netft-cpp, NetFT, netft_rdt_driver and Axia clients; docs/reference/device-facts.md.

#include <array>
#include <cstdint>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/sequence.hpp"

namespace weft::protocols::rdt {

inline constexpr std::uint16_t udp_port = 49152;
inline constexpr std::size_t request_size = 8;
inline constexpr std::size_t record_size = 36;
inline constexpr std::size_t max_records_per_datagram = 40;

enum class RequestCommand : std::uint16_t {
  stop = 0x0000,
  start_single = 0x0001,  ///< not at high speed (ATI's Java library com.atiia.automation.sensors)
  start_realtime = 0x0002,
  start_buffered = 0x0003,  ///< several records per datagram
  start_multi_unit = 0x0004,
  reset_latch = 0x0041,  ///< threshold (condition) latch
  set_bias = 0x0042,     ///< the present reading becomes zero; no reply
};

constexpr bool starts_stream(RequestCommand command) {
  return command >= RequestCommand::start_single && command <= RequestCommand::start_multi_unit;
}

/// Host to sensor, 8 bytes: 0x1234, command, sample count (0 = until stopped).
struct Request {
  RequestCommand command = RequestCommand::stop;
  std::uint32_t sample_count = 0;

  bool operator==(const Request&) const = default;
};

std::array<std::uint8_t, request_size> encode(const Request& request);

/// Errors: parse, for a wrong length or a wrong first word. Unknown commands are returned.
Result<Request> decode_request(ByteView datagram);

/// Sensor to host, 36 bytes. Value = counts / (counts per newton or per newton metre).
struct Record {
  std::uint32_t rdt_sequence = 0;  ///< counts the records sent since the start request
  std::uint32_t ft_sequence = 0;   ///< counts the sensor's own samples
  std::uint32_t status = 0;
  std::array<std::int32_t, 3> force_counts{};
  std::array<std::int32_t, 3> torque_counts{};

  bool operator==(const Record&) const = default;
};

/// Appends 36 bytes. Does not allocate if `out` has enough capacity.
void append(Bytes& out, const Record& record);

/// Errors: parse, unless `bytes` has 36 bytes.
Result<Record> decode_record(ByteView bytes);

/// Number of records in a datagram, 1 to 40. Errors: parse, for any other length.
Result<std::size_t> record_count(ByteView datagram);

/// Bits of Record::status (table of the Net F/T, not of the Axia).
namespace status {
inline constexpr std::uint32_t summary = 1U << 31;
inline constexpr std::uint32_t cpu_or_ram = 1U << 30;
inline constexpr std::uint32_t digital_board = 1U << 29;
inline constexpr std::uint32_t analog_board = 1U << 28;
inline constexpr std::uint32_t sensor_link = 1U << 27;
inline constexpr std::uint32_t saturation = 1U << 17;
inline constexpr std::uint32_t monitor_condition = 1U << 16;
inline constexpr std::uint32_t watchdog = 1U << 14;
inline constexpr std::uint32_t no_serial_data = 1U << 4;
inline constexpr std::uint32_t temperature = 1U << 2;
}  // namespace status

/// The values stay valid with a latched monitor (threshold) condition alone (0x80010000). Any other
/// bit makes them invalid.
constexpr bool values_valid(std::uint32_t status_word) {
  return (status_word & ~(status::summary | status::monitor_condition)) == 0;
}

/// For Record::rdt_sequence.
using SequenceTracker = BasicSequenceTracker<std::uint32_t>;

}  // namespace weft::protocols::rdt
