#pragma once
// Modbus messages ("PDU": function code and data) as numbers, in both directions. Multi-byte fields
// are big-endian. Source: MODBUS Application Protocol 1.1b3 for functions 3, 4, 6 and 16;
// docs/reference/device-facts.md, ATI Digital F/T, for the two ATI functions.

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::modbus {

inline constexpr std::size_t most_read = 125;     ///< registers in one read
inline constexpr std::size_t most_written = 123;  ///< registers in one write
inline constexpr std::size_t longest_pdu = 253;

enum class Function : std::uint8_t {
  read_holding = 0x03,
  read_input = 0x04,
  write_one = 0x06,
  write_many = 0x10,
  vendor_stream = 0x46,  ///< ATI Digital F/T: start streaming
  vendor_lock = 0x6A,    ///< ATI Digital F/T: lock and unlock storage
};

enum class ExceptionCode : std::uint8_t {
  illegal_function = 1,
  illegal_address = 2,
  illegal_value = 3,
  device_failure = 4,
  acknowledge = 5,
  busy = 6,
  gateway_target_silent = 11,  ///< no device behind the gateway has this address
};
/// "illegal data address"; "exception" for codes that are not listed.
std::string_view to_string(ExceptionCode code);

/// Register values without heap allocation; at most `most_read`.
struct Registers {
  std::array<std::uint16_t, most_read> values{};
  std::uint8_t count = 0;

  Registers() = default;
  /// Values beyond `most_read` are dropped.
  explicit Registers(std::span<const std::uint16_t> from);
  [[nodiscard]] std::span<const std::uint16_t> view() const {
    return std::span(values).first(count);
  }
  bool operator==(const Registers&) const = default;
};

/// read_holding or read_input.
struct Read {
  Function function = Function::read_holding;
  std::uint16_t address = 0;
  std::uint16_t count = 1;
  bool operator==(const Read&) const = default;
};
/// The reply equals the request.
struct WriteOne {
  std::uint16_t address = 0;
  std::uint16_t value = 0;
  bool operator==(const WriteOne&) const = default;
};
struct WriteMany {
  std::uint16_t address = 0;
  Registers registers;
  bool operator==(const WriteMany&) const = default;
};
/// vendor_stream or vendor_lock: one byte each way. In a reply 1 means done, any other value
/// refused.
struct Vendor {
  Function function = Function::vendor_stream;
  std::uint8_t data = 0;
  bool operator==(const Vendor&) const = default;
};
using Request = std::variant<Read, WriteOne, WriteMany, Vendor>;

struct ReadReply {
  Function function = Function::read_holding;
  Registers registers;
  bool operator==(const ReadReply&) const = default;
};
struct WroteMany {
  std::uint16_t address = 0;
  std::uint16_t count = 0;
  bool operator==(const WroteMany&) const = default;
};
struct Exception {
  std::uint8_t function = 0;  ///< of the request, without bit 7
  ExceptionCode code = ExceptionCode::illegal_function;
  bool operator==(const Exception&) const = default;
};
using Reply = std::variant<ReadReply, WriteOne, WroteMany, Vendor, Exception>;

/// Appends the PDU.
void append(Bytes& out, const Request& request);
void append(Bytes& out, const Reply& reply);

/// Errors: unsupported (function), range (number of registers), parse (length).
Result<Request> decode_request(ByteView pdu);
Result<Reply> decode_reply(ByteView pdu);

/// Whether `reply` can be the answer to `request`: same function, number of registers and address.
/// An exception answers a request with its function.
bool answers(const Reply& reply, const Request& request);

}  // namespace weft::protocols::modbus
