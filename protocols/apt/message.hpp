#pragma once
// The frame of the Thorlabs APT protocol, both directions. Multi-byte fields are little-endian.
// Source: "APT Controllers Host-Controller Communications Protocol", Issue 16 (APT16), section 3.

#include <cstdint>
#include <optional>

#include "protocols/base/bytes.hpp"
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
  req_enccounter = 0x040A,  ///< APT16's figure prints "11 04": a slip, its heading says 040A
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

/// One byte each. The unit's address has bit 7 clear; on the wire bit 7 of the destination says
/// that data follow the header.
namespace address {
inline constexpr std::uint8_t host = 0x01;
inline constexpr std::uint8_t rack = 0x11;       ///< motherboard of a bay system
inline constexpr std::uint8_t bay_first = 0x21;  ///< bay 0
inline constexpr std::uint8_t bay_last = 0x2A;   ///< bay 9
inline constexpr std::uint8_t usb_unit = 0x50;   ///< T-cube, K-cube, LTS, K10CR1
}  // namespace address
inline constexpr std::uint8_t long_form = 0x80;  ///< bit 7 of the destination

/// Of one family of messages: the REQ id is one above the SET id, the GET id two.
constexpr MessageId plus(MessageId id, int n) {
  return static_cast<MessageId>(static_cast<int>(id) + n);
}

inline constexpr std::size_t header_size = 6;
inline constexpr std::size_t max_data_size = 255;  ///< APT16: no message of the protocol has more

/// One message. With data it has the long form, and the two parameter bytes carry the data length;
/// without data it has the short form.
struct Message {
  MessageId id{};
  std::uint8_t param1 = 0;  ///< short form only; usually the channel
  std::uint8_t param2 = 0;  ///< short form only
  std::uint8_t dest = address::usb_unit;
  std::uint8_t source = address::host;
  Bytes data;  ///< at most max_data_size bytes

  bool operator==(const Message&) const = default;
};

/// Who speaks to whom.
struct Route {
  std::uint8_t dest = address::usb_unit;
  std::uint8_t source = address::host;

  bool operator==(const Route&) const = default;
};

/// Appends a header alone: the whole of a short message.
void append_short(Bytes& out, MessageId id, std::uint8_t param1, std::uint8_t param2, Route route);

/// Appends the header of a long message; the caller appends `data_size` bytes after it.
void append_long_header(Bytes& out, MessageId id, std::size_t data_size, Route route);

/// Appends a whole message. Allocates nothing when `out` has room.
void append(Bytes& out, const Message& message);

Bytes encode(const Message& message);

/// Exactly one message. Errors: parse (cut short, left-over bytes, data of more than 255 bytes).
Result<Message> decode(ByteView bytes);

/// The data length that APT16 gives for an id: nullopt for ids that are unknown or come in several
/// forms, 0 for header-only messages.
std::optional<std::size_t> documented_data_size(MessageId id);

}  // namespace weft::protocols::apt
