#pragma once
// Weft's own framing between the tactile sensor's microcontroller and the host. No published
// framing exists for this sensor. Layout: README.md of this folder. Little-endian.

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "protocols/base/bytes.hpp"
#include "protocols/base/frame_splitter.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/sequence.hpp"

namespace weft::protocols::taxel {

inline constexpr SyncBytes sync{0xA5, 0x5A};
inline constexpr std::uint8_t version = 1;
inline constexpr std::size_t max_taxels = 64;

/// One scan of all taxels. Does not allocate.
struct Frame {
  std::uint16_t sequence = 0;
  std::uint32_t device_us = 0;    ///< the microcontroller's clock at the end of the scan; wraps
  std::uint8_t taxel_count = 16;  ///< 1 to max_taxels
  std::array<std::uint16_t, max_taxels> counts{};  ///< only the first taxel_count are valid
  std::uint16_t proximity_counts = 0;
  std::uint16_t ambient_counts = 0;

  [[nodiscard]] std::span<const std::uint16_t> taxels() const {
    return std::span(counts).first(taxel_count);
  }
  bool operator==(const Frame&) const = default;
};

/// Bytes of a frame with `taxels` taxels: 48 for 16.
constexpr std::size_t frame_size(std::size_t taxels) {
  return 10 + 2 * taxels + 4 + 2;
}

/// Appends a frame; requires a taxel_count of 1 to max_taxels. Does not allocate if `out` has
/// enough capacity.
void append(Bytes& out, const Frame& frame);

class Splitter : public FrameSplitter {
 public:
  static constexpr std::size_t capacity = 65536;  ///< more than any link delivers in one chunk

  Splitter() : FrameSplitter(capacity) {}
  bool next(Frame& frame);
};

/// For Frame::sequence.
using SequenceTracker = BasicSequenceTracker<std::uint16_t>;

// The CPM-Finger (CySkin) formats of the same sensor: CAN frames, and the UDP datagrams of its
// gateway. Source: can2wifi2ros and FabricSlide of wngfra (docs/reference/device-facts.md, CPM
// finger).
namespace cpm {

inline constexpr std::size_t taxels = 16;
inline constexpr std::uint16_t udp_port = 10240;
inline constexpr std::size_t datagram_size = 32;

/// Taxel index of each position on the wire.
inline constexpr std::array<std::uint8_t, taxels> taxel_at_wire_position{
    11, 15, 14, 12, 9, 13, 8, 10, 6, 7, 4, 5, 2, 0, 3, 1};

using Counts = std::array<std::uint16_t, taxels>;  ///< in taxel index order

/// The gateway's datagram: 16 big-endian words in wire order.
std::array<std::uint8_t, datagram_size> encode_datagram(const Counts& counts);
/// Errors: parse, unless the datagram has 32 bytes.
Result<Counts> decode_datagram(ByteView datagram);

struct CanFrame {
  std::uint16_t id = 0;
  std::uint8_t length = 8;
  std::array<std::uint8_t, 8> data{};

  bool operator==(const CanFrame&) const = default;
};

/// Ids of the four frames that carry four little-endian words each, in wire order.
inline constexpr std::array<std::uint16_t, 4> can_taxel_ids{0x405, 0x407, 0x409, 0x40B};
inline constexpr std::uint16_t can_proximity_id = 0x601;  ///< two words; closes a scan

struct Scan {
  Counts counts{};
  std::uint16_t proximity1_counts = 0;
  std::uint16_t proximity2_counts = 0;

  bool operator==(const Scan&) const = default;
};

/// The five frames of a scan, in the order in which the sensor sends them.
std::array<CanFrame, 5> encode_can(const Scan& scan);

/// Assembles scans. Frames with other ids or lengths are ignored. An incomplete scan is dropped and
/// counted.
class CanAssembler {
 public:
  /// Returns the scan that `frame` completes, if any.
  std::optional<Scan> push(const CanFrame& frame);
  [[nodiscard]] std::uint64_t incomplete_scans() const { return incomplete_scans_; }

 private:
  void store(const CanFrame& frame, std::size_t part);
  std::optional<Scan> finish(const CanFrame& frame);

  Scan scan_;
  std::uint8_t parts_seen_ = 0;  ///< one bit per taxel frame
  std::uint64_t incomplete_scans_ = 0;
};

}  // namespace cpm

}  // namespace weft::protocols::taxel
