#pragma once
// The CPM-Finger (CySkin) form of the same sensor: the UDP datagrams of its gateway, which listens
// to the sensor's CAN frames. Source: can2wifi2ros and FabricSlide of wngfra
// (docs/reference/device-facts.md, CPM finger).

#include <array>
#include <cstdint>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::taxel::cpm {

inline constexpr std::size_t taxels = 16;
inline constexpr std::uint16_t udp_port = 10240;
inline constexpr std::size_t datagram_size = 32;

/// Taxel index of each position on the wire.
inline constexpr std::array<std::uint8_t, taxels> taxel_at_wire_position{
    11, 15, 14, 12, 9, 13, 8, 10, 6, 7, 4, 5, 2, 0, 3, 1};

using Counts = std::array<std::uint16_t, taxels>;  ///< in taxel index order

/// The gateway's datagram: 16 big-endian words in wire order.
std::array<std::uint8_t, datagram_size> encode_datagram(const Counts& counts);
/// Errors: parse, for any other length than 32.
Result<Counts> decode_datagram(ByteView datagram);

}  // namespace weft::protocols::taxel::cpm
