#include "protocols/apt/splitter.hpp"

namespace weft::protocols::apt {
namespace {

constexpr bool is_unit(std::uint8_t a) {
  return a == address::usb_unit || a == address::rack ||
         (a >= address::bay_first && a <= address::bay_last);
}

// APT16's own HW_DISCONNECT example has source 0, hence the second form of a host.
constexpr bool is_host(std::uint8_t a) {
  return a == address::host || a == 0;
}

}  // namespace

/// Length of the message at the front, or no_frame when these six bytes cannot be a header.
std::size_t Splitter::plausible_length(ByteView header) const {
  const bool has_data = (header[4] & long_form) != 0;
  const auto dest = static_cast<std::uint8_t>(header[4] & ~long_form);
  const std::uint8_t source = header[5];
  const bool to_unit = is_unit(dest) && is_host(source);
  const bool to_host = line_end_ == LineEnd::host && dest == address::host && is_unit(source);
  if (!to_unit && !to_host) return no_frame;
  const std::size_t size = has_data ? header[2] | std::size_t{header[3]} << 8 : 0;
  if (has_data && (size == 0 || size > max_data_size)) return no_frame;
  if (line_end_ == LineEnd::controller) return header_size + size;
  const auto id = static_cast<MessageId>(header[0] | header[1] << 8);
  const auto documented = documented_data_size(id);
  if (documented && *documented != size) return no_frame;
  return header_size + size;
}

bool Splitter::next(Message& message) {
  const auto length = [this](ByteView header) { return plausible_length(header); };
  return find(header_size, length, [&](ByteView bytes) {
    const bool has_data = bytes.size() > header_size;
    message.id = static_cast<MessageId>(bytes[0] | bytes[1] << 8);
    message.param1 = has_data ? std::uint8_t{0} : bytes[2];
    message.param2 = has_data ? std::uint8_t{0} : bytes[3];
    message.dest = static_cast<std::uint8_t>(bytes[4] & ~long_form);
    message.source = bytes[5];
    const ByteView data = bytes.subspan(header_size);
    message.data.assign(data.begin(), data.end());
    return true;
  });
}

}  // namespace weft::protocols::apt
