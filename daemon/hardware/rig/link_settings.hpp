#pragma once
// How a device is reached: the `link` of a rig file's device.

#include <string_view>
#include <variant>

#include "daemon/hardware/link/port_link.hpp"

namespace weft::daemon {

/// Inside this process, to an emulator.
struct MemoryPort {};
struct TcpPort {
  Endpoint end;
};
struct UdpPort {
  Endpoint end;
  /// The host's own port, for a device that sends there unasked; 0: any.
  std::uint16_t local_port = 0;
};

/// Where host and device meet: the host opens it, weft-rig serves it.
using LinkSettings = std::variant<MemoryPort, SerialSettings, TcpPort, UdpPort>;

/// Reads one link: {"kind": "memory" | "serial" | "tcp" | "udp", ...}; nothing or {} is memory.
/// serial: path, baud, parity (none, even, odd), rts_cts, ftdi_start_up; tcp and udp: host, port;
/// udp: local_port. Errors: parse, invalid_argument (kind, key, type) and range, below `where`, a
/// JSON pointer.
Result<LinkSettings> parse_link(std::string_view json, std::string_view where);

/// Opens the host's end. Errors: those of the port; wrong_state for memory, which is not a port.
Result<std::unique_ptr<Link>> open_link(RealLoop& loop, const LinkSettings& settings);

}  // namespace weft::daemon
