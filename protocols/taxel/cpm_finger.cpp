#include "protocols/taxel/cpm_finger.hpp"

#include <string>

namespace weft::protocols::taxel::cpm {

std::array<std::uint8_t, datagram_size> encode_datagram(const Counts& counts) {
  std::array<std::uint8_t, datagram_size> out{};
  for (std::size_t i = 0; i < taxels; ++i) {
    const std::uint16_t word = counts[taxel_at_wire_position[i]];
    out[2 * i] = static_cast<std::uint8_t>(word >> 8);
    out[2 * i + 1] = static_cast<std::uint8_t>(word);
  }
  return out;
}

Result<Counts> decode_datagram(ByteView datagram) {
  if (datagram.size() != datagram_size)
    return fail({.code = Errc::parse,
                 .what = "CPM-Finger datagram has the wrong length",
                 .expected = "32 bytes",
                 .got = std::to_string(datagram.size())});
  BigReader reader(datagram);
  Counts counts{};
  for (const std::uint8_t taxel : taxel_at_wire_position)
    counts[taxel] = reader.read<std::uint16_t>();
  return counts;
}

}  // namespace weft::protocols::taxel::cpm
