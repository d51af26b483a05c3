#pragma once
// Discovery of ATI boxes in a network: one broadcast datagram to UDP port 51000; each box sends a
// datagram to the address named in it, at port 28250. The protocol comes from RTA, the maker of the
// boxes' Ethernet module. Source: ATI's Java demo of the Net F/T and Wireless F/T
// (RTADiscoveryProtocol), and its ports to Python. The protocol's own guide was not available.

#include <array>
#include <cstdint>
#include <string>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::rdt {

inline constexpr std::uint16_t discovery_port = 51000;
inline constexpr std::uint16_t discovery_reply_port = 28250;

using Ipv4 = std::array<std::uint8_t, 4>;
/// Group to which boxes send their replies; boxes of another subnet reach it too.
inline constexpr Ipv4 discovery_group{224, 0, 5, 128};

/// Text, then tagged fields.
struct DiscoveryRequest {
  Ipv4 reply_to = discovery_group;
  /// A box replies after at most (256 - last byte of its address) times this, so that not all reply
  /// at once [ms].
  std::uint8_t delay_ms = 7;

  bool operator==(const DiscoveryRequest&) const = default;
};

struct DiscoveryReply {
  std::string mac;  ///< "00-16-bd-01-02-03"
  Ipv4 address{}, netmask{};
  std::string application, location;  ///< as the box describes itself

  bool operator==(const DiscoveryReply&) const = default;
};

Bytes encode(const DiscoveryRequest& request);
Bytes encode(const DiscoveryReply& reply);

/// Errors: parse, for wrong first bytes, a truncated field, an address that has not four bytes, a
/// missing address, or a reply with an address that is not of a single host. Fields with other tags
/// are ignored.
Result<DiscoveryRequest> decode_discovery_request(ByteView datagram);
Result<DiscoveryReply> decode_discovery_reply(ByteView datagram);

}  // namespace weft::protocols::rdt
