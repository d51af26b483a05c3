#pragma once
// Links over ports of the operating system: serial lines and pseudo-terminals, TCP, UDP.

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "daemon/base/loop/real_loop.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon {

enum class Parity : std::uint8_t { none, even, odd };

/// Duration of `ftdi_start_up`.
inline constexpr Duration ftdi_start_up_time = std::chrono::milliseconds(100);

/// A serial line; eight data bits and one stop bit.
struct SerialSettings {
  std::string
      path;  ///< "/dev/ttyUSB0", "/dev/serial/by-id/...", a pseudo-terminal or a link to one
  std::uint32_t baud = 115200;
  Parity parity = Parity::none;
  bool rts_cts = false;
  /// The start-up of Thorlabs' FTDI chips before the first byte (docs/reference/device-facts.md,
  /// APT line): settle 50 ms, purge both sides, settle 50 ms. Writes wait meanwhile.
  bool ftdi_start_up = false;
};

struct Endpoint {
  std::string host;  ///< name or address
  std::uint16_t port = 0;
};

/// Opens a serial line and locks it before it changes any setting. Real ports open through
/// libserialport. Pseudo-terminals open directly: libserialport cannot
/// (docs/reference/device-facts.md, Serial ports). Errors: not_found (no such port), io
/// (permission), busy, each with a hint; unsupported (the speed, read back, is not the requested
/// one).
Result<std::unique_ptr<Link>> open_serial(RealLoop& loop, const SerialSettings& settings);

/// Connects; gives up after `limit`. Disables Nagle's algorithm. Errors: not_found (name), io,
/// timeout.
Result<std::unique_ptr<Link>> open_tcp(RealLoop& loop, const Endpoint& far_end,
                                       Duration limit = std::chrono::seconds(3));

/// A link to a server that closes its connection after each reply (HTTP/1.0). The first write uses
/// the connection that is made here; each later write makes a new one. The end of a connection is
/// always reported, even after its reply. A caller that has its reply stops listening. Errors:
/// open_tcp()'s, also from write(), which gives up after a second for each address.
Result<std::unique_ptr<Link>> open_requests(RealLoop& loop, const Endpoint& far_end);

/// A datagram link to one far end; datagrams of other senders are not delivered. Silence is not an
/// error: there is no connection that could fail. `local_port`: port for a far end that sends
/// unasked; 0: any. Errors: not_found (name), io.
Result<std::unique_ptr<Link>> open_udp(RealLoop& loop, const Endpoint& far_end,
                                       std::uint16_t local_port = 0);

/// A stream over an open descriptor (a pseudo-terminal's master, a socket). Takes ownership of it.
/// `name` is for error messages.
std::unique_ptr<Link> adopt_stream(RealLoop& loop, int descriptor, std::string name);

}  // namespace weft::daemon
