#pragma once
// How boxes of ATI are found in a network: one broadcast datagram to UDP port 51000, and a datagram
// of each box to the address that it names, at port 28250. The protocol is of the maker of the
// boxes' Ethernet module (RTA). Source: ATI's Java demo of the Net F/T and Wireless F/T
// (RTADiscoveryProtocol), and its ports to Python; the protocol's own guide could not be read.

#include <array>
#include <cstdint>
#include <string>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::rdt {

inline constexpr std::uint16_t discovery_port = 51000;
inline constexpr std::uint16_t discovery_reply_port = 28250;

using Ipv4 = std::array<std::uint8_t, 4>;
/// Where boxes send their replies: also those that are of another subnet find it.
inline constexpr Ipv4 discovery_group{224, 0, 5, 128};

/// Text, then tagged fields.
struct DiscoveryRequest {
  Ipv4 reply_to = discovery_group;
  /// A box replies after (256 - last byte of its address) times this, at most, so that not all
  /// reply at once [ms].
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

/// Errors: parse, for another beginning, a field that is cut short, an address of other than four
/// bytes, no address at all, or in a reply one that no single host has. Fields with other tags are
/// passed over.
Result<DiscoveryRequest> decode_discovery_request(ByteView datagram);
Result<DiscoveryReply> decode_discovery_reply(ByteView datagram);

}  // namespace weft::protocols::rdt
