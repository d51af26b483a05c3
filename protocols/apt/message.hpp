#pragma once
// The frame of the Thorlabs APT protocol, both directions. Multi-byte fields are little-endian.
// Source: "APT Controllers Host-Controller Communications Protocol", Issue 16 (APT16), section 3.

#include <cstdint>
#include <optional>

#include "protocols/base/bytes.hpp"
#include "protocols/base/frame_splitter.hpp"
#include "protocols/base/result.hpp"

namespace weft::protocols::apt {

enum class MessageId : std::uint16_t {
  hw_disconnect = 0x0002,
  hw_req_info = 0x0005,
  hw_get_info = 0x0006,
  hw_start_updatemsgs = 0x0011,
  hw_stop_updatemsgs = 0x0012,
  hw_no_flash_programming = 0x0018,
  rack_req_bayused = 0x0060,
  rack_get_bayused = 0x0061,
  hub_req_bayused = 0x0065,
  hub_get_bayused = 0x0066,
  hw_response = 0x0080,
  hw_richresponse = 0x0081,
  mod_set_chanenablestate = 0x0210,
  mod_req_chanenablestate = 0x0211,
  mod_get_chanenablestate = 0x0212,
  mod_set_digoutputs = 0x0213,
  mod_req_digoutputs = 0x0214,
  mod_get_digoutputs = 0x0215,
  mod_identify = 0x0223,
  rack_req_statusbits = 0x0226,
  rack_get_statusbits = 0x0227,
  rack_set_digoutputs = 0x0228,
  rack_req_digoutputs = 0x0229,
  rack_get_digoutputs = 0x0230,
  set_enccounter = 0x0409,
  req_enccounter = 0x040A,  ///< an error; its heading has 040A
  get_enccounter = 0x040B,
  set_poscounter = 0x0410,
  req_poscounter = 0x0411,
  get_poscounter = 0x0412,
  set_velparams = 0x0413,
  req_velparams = 0x0414,
  get_velparams = 0x0415,
  set_jogparams = 0x0416,
  req_jogparams = 0x0417,
  get_jogparams = 0x0418,
  set_limswitchparams = 0x0423,
  req_limswitchparams = 0x0424,
  get_limswitchparams = 0x0425,
  set_powerparams = 0x0426,
  req_powerparams = 0x0427,
  get_powerparams = 0x0428,
  req_statusbits = 0x0429,
  get_statusbits = 0x042A,
  req_adcinputs = 0x042B,
  get_adcinputs = 0x042C,
  set_genmoveparams = 0x043A,
  req_genmoveparams = 0x043B,
  get_genmoveparams = 0x043C,
  set_homeparams = 0x0440,
  req_homeparams = 0x0441,
  get_homeparams = 0x0442,
  move_home = 0x0443,
  move_homed = 0x0444,
  set_moverelparams = 0x0445,
  req_moverelparams = 0x0446,
  get_moverelparams = 0x0447,
  move_relative = 0x0448,
  set_moveabsparams = 0x0450,
  req_moveabsparams = 0x0451,
  get_moveabsparams = 0x0452,
  move_absolute = 0x0453,
  move_velocity = 0x0457,
  move_completed = 0x0464,
  move_stop = 0x0465,
  move_stopped = 0x0466,
  move_jog = 0x046A,
  suspend_endofmovemsgs = 0x046B,
  resume_endofmovemsgs = 0x046C,
  req_statusupdate = 0x0480,
  get_statusupdate = 0x0481,
  req_dcstatusupdate = 0x0490,
  get_dcstatusupdate = 0x0491,
  ack_dcstatusupdate = 0x0492,
  set_dcpidparams = 0x04A0,
  req_dcpidparams = 0x04A1,
  get_dcpidparams = 0x04A2,
  set_potparams = 0x04B0,
  req_potparams = 0x04B1,
  get_potparams = 0x04B2,
  set_avmodes = 0x04B3,
  req_avmodes = 0x04B4,
  get_avmodes = 0x04B5,
  set_buttonparams = 0x04B6,
  req_buttonparams = 0x04B7,
  get_buttonparams = 0x04B8,
  set_eepromparams = 0x04B9,
  set_pmdprofilemode = 0x04E3,
  req_pmdprofilemode = 0x04E4,
  get_pmdprofilemode = 0x04E5,
  set_bowindex = 0x04F4,
  req_bowindex = 0x04F5,
  get_bowindex = 0x04F6,
  set_trigger = 0x0500,
  req_trigger = 0x0501,
  get_trigger = 0x0502,
  set_kcubemmiparams = 0x0520,
  req_kcubemmiparams = 0x0521,
  get_kcubemmiparams = 0x0522,
  set_kcubetrigconfig = 0x0523,
  req_kcubetrigconfig = 0x0524,
  get_kcubetrigconfig = 0x0525,
  set_kcubepostrig = 0x0526,
  req_kcubepostrig = 0x0527,
  get_kcubepostrig = 0x0528,
  set_loopparams = 0x0529,
  req_loopparams = 0x052A,
  get_loopparams = 0x052B,
};

/// One byte each. Bit 7 of a unit's address is clear. On the wire, bit 7 of the destination means
/// that data follow the header.
namespace address {
inline constexpr std::uint8_t host = 0x01;
inline constexpr std::uint8_t rack = 0x11;       ///< motherboard of a bay system
inline constexpr std::uint8_t bay_first = 0x21;  ///< bay 0
inline constexpr std::uint8_t bay_last = 0x2A;   ///< bay 9
inline constexpr std::uint8_t usb_unit = 0x50;   ///< T-cube, K-cube, LTS, K10CR1
}  // namespace address
inline constexpr std::uint8_t long_form = 0x80;  ///< bit 7 of the destination

/// Id of a related message of one family: the REQ id is the SET id plus 1, the GET id plus 2.
constexpr MessageId plus(MessageId id, int n) {
  return static_cast<MessageId>(static_cast<int>(id) + n);
}

inline constexpr std::size_t header_size = 6;
inline constexpr std::size_t max_data_size = 255;  ///< APT16: the maximum of all messages

/// One message. With data it has the long form, and the two parameter bytes carry the data length.
/// Without data it has the short form.
struct Message {
  MessageId id{};
  std::uint8_t param1 = 0;  ///< short form only; usually the channel
  std::uint8_t param2 = 0;  ///< short form only
  std::uint8_t dest = address::usb_unit;
  std::uint8_t source = address::host;
  Bytes data;  ///< at most max_data_size bytes

  bool operator==(const Message&) const = default;
};

/// Destination and source address of a message.
struct Route {
  std::uint8_t dest = address::usb_unit;
  std::uint8_t source = address::host;

  bool operator==(const Route&) const = default;
};

/// Appends a short message, which is a header only.
void append_short(Bytes& out, MessageId id, std::uint8_t param1, std::uint8_t param2, Route route);

/// Appends the header of a long message; the caller appends `data_size` bytes after it.
void append_long_header(Bytes& out, MessageId id, std::size_t data_size, Route route);

/// Appends a complete message. Does not allocate if `out` has enough capacity.
void append(Bytes& out, const Message& message);

Bytes encode(const Message& message);

/// Decodes exactly one message. Errors: parse (truncated, extra bytes, data of more than 255
/// bytes).
Result<Message> decode(ByteView bytes);

/// Data length of an id in APT16: 0 for header-only messages, nullopt for ids that are unknown or
/// have several forms.
std::optional<std::size_t> documented_data_size(MessageId id);

// Splits a byte stream into APT messages. The protocol has neither a sync byte nor a checksum.
// Therefore a header is accepted only if it is plausible.

/// The end of the link at which a splitter runs.
enum class LineEnd : std::uint8_t {
  host,       ///< accepts only the lengths of APT16, to resynchronise after noise
  controller  ///< accepts any length in a host's header: newer issues have longer bodies
};

/// A header is plausible under three conditions. Exactly one side of its route is a known unit (for
/// a controller: its destination). Its data length is 1 to 255. For ids of APT16 the host also
/// requires the documented form and length. All other bytes are skipped one by one. Unknown ids
/// with a plausible route are returned.
class Splitter : public FrameSplitter {
 public:
  /// Maximum of bytes that next() has not consumed; more than any link delivers in one chunk.
  static constexpr std::size_t capacity = 65536;

  explicit Splitter(LineEnd line_end = LineEnd::host)
      : FrameSplitter(capacity), line_end_(line_end) {}

  /// Overwrites `message` with the next complete one and reuses the capacity of its data.
  bool next(Message& message);

 private:
  [[nodiscard]] std::size_t plausible_length(ByteView header) const;

  LineEnd line_end_;
};

// The status word of APT stages (device-facts.md, APT messages). APT16 gives a subset. The other
// bits are from thorlabs-apt-protocol, aptProtocol.h of infn-epics and pylablib.
namespace status {

inline constexpr std::uint32_t forward_limit = 0x00000001;  ///< hardware limit, CW
inline constexpr std::uint32_t reverse_limit = 0x00000002;  ///< hardware limit, CCW
inline constexpr std::uint32_t forward_soft_limit = 0x00000004;
inline constexpr std::uint32_t reverse_soft_limit = 0x00000008;
// The document and observations disagree on which of each pair is forward: use only their union.
inline constexpr std::uint32_t moving_forward = 0x00000010;
inline constexpr std::uint32_t moving_reverse = 0x00000020;
inline constexpr std::uint32_t jogging_forward = 0x00000040;
inline constexpr std::uint32_t jogging_reverse = 0x00000080;
inline constexpr std::uint32_t motor_connected = 0x00000100;
inline constexpr std::uint32_t homing = 0x00000200;
inline constexpr std::uint32_t homed = 0x00000400;
inline constexpr std::uint32_t initialising = 0x00000800;
inline constexpr std::uint32_t tracking = 0x00001000;
inline constexpr std::uint32_t settled = 0x00002000;
inline constexpr std::uint32_t motion_error = 0x00004000;  ///< position error too large
inline constexpr std::uint32_t instrument_error = 0x00008000;
inline constexpr std::uint32_t interlock = 0x00010000;
inline constexpr std::uint32_t over_temperature = 0x00020000;
inline constexpr std::uint32_t bus_voltage_fault = 0x00040000;
inline constexpr std::uint32_t commutation_error = 0x00080000;
inline constexpr std::uint32_t digital_inputs = 0x00F00000;
inline constexpr std::uint32_t overload = 0x01000000;  ///< current limit
inline constexpr std::uint32_t encoder_fault = 0x02000000;
inline constexpr std::uint32_t over_current = 0x04000000;
inline constexpr std::uint32_t supply_current_fault = 0x08000000;
inline constexpr std::uint32_t power_ok = 0x10000000;
inline constexpr std::uint32_t active = 0x20000000;
inline constexpr std::uint32_t error = 0x40000000;
inline constexpr std::uint32_t channel_enabled = 0x80000000;

inline constexpr std::uint32_t any_limit = forward_limit | reverse_limit;
inline constexpr std::uint32_t any_motion =
    moving_forward | moving_reverse | jogging_forward | jogging_reverse | homing;
/// Each of these ends a run. The interlock bit is excluded: its meaning differs per family.
inline constexpr std::uint32_t any_fault =
    motion_error | instrument_error | over_temperature | bus_voltage_fault | commutation_error |
    overload | encoder_fault | over_current | supply_current_fault | error;

}  // namespace status

}  // namespace weft::protocols::apt
