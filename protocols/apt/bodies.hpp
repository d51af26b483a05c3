#pragma once
// The data part of APT messages: one struct per layout, its fields in wire order. fields() is the
// only description of a layout: reading, writing and the size are derived from it.
// Source: APT16 (docs/reference/device-facts.md). Source of panel settings, racks and analogue
// inputs: the Thorlabs document of 9 December 2025.

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "protocols/apt/message.hpp"

/// Lists the fields of a body in wire order, for reading and for writing.
#define WEFT_APT_FIELDS(...)      \
  auto fields() {                 \
    return std::tie(__VA_ARGS__); \
  }                               \
  auto fields() const {           \
    return std::tie(__VA_ARGS__); \
  }

namespace weft::protocols::apt {

/// Zero-padded ASCII on the wire.
template <std::size_t size>
struct Text {
  std::array<std::uint8_t, size> raw{};

  /// Longer text is truncated to `size` bytes.
  static Text from(std::string_view text) {
    Text out;
    for (std::size_t i = 0; i < size && i < text.size(); ++i)
      out.raw[i] = static_cast<std::uint8_t>(text[i]);
    return out;
  }
  /// Up to the first zero; bytes that are not printable ASCII become '?'.
  [[nodiscard]] std::string str() const {
    std::string out;
    for (const std::uint8_t b : raw) {
      if (b == 0) break;
      out += b >= 0x20 && b < 0x7F ? static_cast<char>(b) : '?';
    }
    return out;
  }
  bool operator==(const Text&) const = default;
};

/// HW_GET_INFO, 84 bytes.
struct HardwareInfo {
  std::int32_t serial = 0;
  Text<8> model;
  std::uint16_t hardware_type = 0;  ///< 44 brushless, 45 multi-channel motherboard
  std::uint8_t firmware_minor = 0;
  std::uint8_t firmware_interim = 0;
  std::uint8_t firmware_major = 0;
  std::uint8_t firmware_unused = 0;
  Text<48> notes;
  Text<10> reserved;
  std::uint16_t stage_id = 0;  ///< KDC101/TDC001: 1 none, 6 PRM1-Z8 (see stage_id_of); else 0
  std::uint16_t hardware_version = 0;
  std::uint16_t modification_state = 0;
  std::uint16_t channels = 1;

  WEFT_APT_FIELDS(serial, model, hardware_type, firmware_minor, firmware_interim, firmware_major,
                  firmware_unused, notes, reserved, stage_id, hardware_version, modification_state,
                  channels)
  bool operator==(const HardwareInfo&) const = default;
};

/// HW_RICHRESPONSE, 68 bytes.
struct RichResponse {
  std::uint16_t message_id = 0;  ///< request that it answers; 0 if spontaneous
  std::uint16_t code = 0;
  Text<64> notes;

  WEFT_APT_FIELDS(message_id, code, notes)
  bool operator==(const RichResponse&) const = default;
};

/// One signed count of one channel, 6 bytes: POSCOUNTER, ENCCOUNTER, GENMOVEPARAMS (backlash),
/// MOVERELPARAMS, MOVEABSPARAMS, and the long forms of MOVE_RELATIVE and MOVE_ABSOLUTE.
struct ChannelCounts {
  std::uint16_t channel = 1;
  std::int32_t value_counts = 0;

  WEFT_APT_FIELDS(channel, value_counts)
  bool operator==(const ChannelCounts&) const = default;
};

/// VELPARAMS, 14 bytes.
struct VelocityParams {
  std::uint16_t channel = 1;
  std::int32_t minimum_velocity_counts = 0;
  std::int32_t acceleration_counts = 0;
  std::int32_t maximum_velocity_counts = 0;

  WEFT_APT_FIELDS(channel, minimum_velocity_counts, acceleration_counts, maximum_velocity_counts)
  bool operator==(const VelocityParams&) const = default;
};

enum class JogMode : std::uint16_t { continuous = 1, single_step = 2 };
enum class StopMode : std::uint16_t { immediate = 1, profiled = 2 };

/// JOGPARAMS, 22 bytes.
struct JogParams {
  std::uint16_t channel = 1;
  JogMode mode = JogMode::single_step;
  std::int32_t step_counts = 0;
  std::int32_t minimum_velocity_counts = 0;
  std::int32_t acceleration_counts = 0;
  std::int32_t maximum_velocity_counts = 0;
  StopMode stop_mode = StopMode::profiled;

  WEFT_APT_FIELDS(channel, mode, step_counts, minimum_velocity_counts, acceleration_counts,
                  maximum_velocity_counts, stop_mode)
  bool operator==(const JogParams&) const = default;
};

/// LIMSWITCHPARAMS, 16 bytes. Switches: 1 not fitted, 2 makes, 3 breaks, 4 makes (homing only),
/// 5 breaks (homing only), 6 index; OR 0x80 swaps them. Soft mode: 1 ignore, 2 stop at once,
/// 3 profiled stop; OR 0x80 on rotation stages.
struct LimitSwitchParams {
  std::uint16_t channel = 1;
  std::uint16_t forward_hardware = 2;
  std::uint16_t reverse_hardware = 2;
  std::int32_t forward_soft_counts = 0;
  std::int32_t reverse_soft_counts = 0;
  std::uint16_t soft_mode = 1;

  WEFT_APT_FIELDS(channel, forward_hardware, reverse_hardware, forward_soft_counts,
                  reverse_soft_counts, soft_mode)
  bool operator==(const LimitSwitchParams&) const = default;
};

/// POWERPARAMS, 6 bytes: per cent of the full motor current.
struct PowerParams {
  std::uint16_t channel = 1;
  std::uint16_t rest_percent = 0;
  std::uint16_t move_percent = 0;

  WEFT_APT_FIELDS(channel, rest_percent, move_percent)
  bool operator==(const PowerParams&) const = default;
};

/// HOMEPARAMS, 14 bytes. Direction: 1 forward, 2 reverse. Limit switch: 1 reverse, 4 forward.
struct HomeParams {
  std::uint16_t channel = 1;
  std::uint16_t direction = 2;
  std::uint16_t limit_switch = 1;
  std::int32_t velocity_counts = 0;
  std::int32_t offset_counts = 0;

  WEFT_APT_FIELDS(channel, direction, limit_switch, velocity_counts, offset_counts)
  bool operator==(const HomeParams&) const = default;
};

/// GET_STATUSBITS, 6 bytes.
struct StatusBits {
  std::uint16_t channel = 1;
  std::uint32_t bits = 0;

  WEFT_APT_FIELDS(channel, bits)
  bool operator==(const StatusBits&) const = default;
};

/// GET_STATUSUPDATE, and MOVE_COMPLETED and MOVE_STOPPED of steppers; 14 bytes.
struct StatusUpdate {
  std::uint16_t channel = 1;
  std::int32_t position_counts = 0;
  std::int32_t encoder_counts = 0;
  std::uint32_t status_bits = 0;

  WEFT_APT_FIELDS(channel, position_counts, encoder_counts, status_bits)
  bool operator==(const StatusUpdate&) const = default;
};

/// GET_DCSTATUSUPDATE, and MOVE_COMPLETED and MOVE_STOPPED of servos; 14 bytes.
struct DcStatusUpdate {
  std::uint16_t channel = 1;
  std::int32_t position_counts = 0;
  std::int16_t velocity_counts = 0;   ///< sources disagree on the scale: do not use
  std::int16_t motor_current_ma = 0;  ///< newer issues; reserved in APT16
  std::uint32_t status_bits = 0;

  WEFT_APT_FIELDS(channel, position_counts, velocity_counts, motor_current_ma, status_bits)
  bool operator==(const DcStatusUpdate&) const = default;
};

/// BOWINDEX, 4 bytes: 0 trapezoidal, 1 to 18 S-curve.
struct BowIndex {
  std::uint16_t channel = 1;
  std::uint16_t index = 0;

  WEFT_APT_FIELDS(channel, index)
  bool operator==(const BowIndex&) const = default;
};

/// PMDPROFILEMODEPARAMS, 12 bytes: counterpart of BOWINDEX for brushless drives. From memory: the
/// available issue of the APT document lacks it, and it is not tested on hardware.
struct ProfileMode {
  std::uint16_t channel = 1;
  std::uint16_t mode = 0;  ///< 0 trapezoidal, 2 S-curve
  std::uint32_t jerk_counts = 0;
  std::uint32_t reserved = 0;

  WEFT_APT_FIELDS(channel, mode, jerk_counts, reserved)
  bool operator==(const ProfileMode&) const = default;
};

/// GET_ADCINPUTS, 4 bytes: 0 to 32768 for 0 to 5 V. It carries no channel.
struct AdcInputs {
  std::uint16_t input1_counts = 0;
  std::uint16_t input2_counts = 0;  ///< not used

  WEFT_APT_FIELDS(input1_counts, input2_counts)
  bool operator==(const AdcInputs&) const = default;
};

/// RACK_GET_STATUSBITS, 4 bytes: the digital outputs of a rack. It carries no channel.
struct RackStatusBits {
  std::uint32_t bits = 0;

  WEFT_APT_FIELDS(bits)
  bool operator==(const RackStatusBits&) const = default;
};

/// POTPARAMS, 26 bytes: speed of a panel's slider by deflection (0 to 127). velocity1 applies from
/// zero_window on, velocity2 from window1 on, and so forth.
struct PotParams {
  std::uint16_t channel = 1;
  std::uint16_t zero_window = 0;
  std::int32_t velocity1_counts_s = 0;
  std::uint16_t window1 = 0;
  std::int32_t velocity2_counts_s = 0;
  std::uint16_t window2 = 0;
  std::int32_t velocity3_counts_s = 0;
  std::uint16_t window3 = 0;
  std::int32_t velocity4_counts_s = 0;

  WEFT_APT_FIELDS(channel, zero_window, velocity1_counts_s, window1, velocity2_counts_s, window2,
                  velocity3_counts_s, window3, velocity4_counts_s)
  bool operator==(const PotParams&) const = default;
};

/// BUTTONPARAMS, 16 bytes. Mode: 1 the buttons of the panel jog, 2 they move to the two positions.
struct ButtonParams {
  std::uint16_t channel = 1;
  std::uint16_t mode = 1;
  std::int32_t position1_counts = 0;
  std::int32_t position2_counts = 0;
  std::uint16_t timeout1_ms = 0;  ///< hold time of a button to store a position or to home
  std::uint16_t timeout2_ms = 0;

  WEFT_APT_FIELDS(channel, mode, position1_counts, position2_counts, timeout1_ms, timeout2_ms)
  bool operator==(const ButtonParams&) const = default;
};

/// KCUBEMMIPARAMS, 28 bytes: the wheel and the display of a K-cube. Mode: 1 velocity, 2 jog, 3 move
/// to the positions. The Thorlabs document of December 2025 adds eight bytes for the BBD30x.
/// K-cubes do not have them.
struct KcubePanelParams {
  std::uint16_t channel = 1;
  std::uint16_t mode = 1;
  std::int32_t maximum_velocity_counts = 0;
  std::int32_t acceleration_counts = 0;
  std::uint16_t direction = 1;  ///< 0 wheel disabled, 1 upwards is forward, 2 upwards is reverse
  std::int32_t position1_counts = 0;
  std::int32_t position2_counts = 0;
  std::uint16_t brightness_percent = 0;
  std::uint16_t dim_after_min = 0;  ///< 0: never
  std::uint16_t dim_level = 0;      ///< 0 to 10

  WEFT_APT_FIELDS(channel, mode, maximum_velocity_counts, acceleration_counts, direction,
                  position1_counts, position2_counts, brightness_percent, dim_after_min, dim_level)
  bool operator==(const KcubePanelParams&) const = default;
};

namespace detail {

template <class Field>
constexpr std::size_t field_size = sizeof(Field);  // Text is an array of bytes: no padding

template <class Field>
void read_field(LittleReader& in, Field& field) {
  if constexpr (std::is_enum_v<Field>)
    field = static_cast<Field>(in.read<std::underlying_type_t<Field>>());
  else
    field = in.read<Field>();
}
template <std::size_t size>
void read_field(LittleReader& in, Text<size>& field) {
  const ByteView raw = in.take(size);
  for (std::size_t i = 0; i < raw.size(); ++i) field.raw[i] = raw[i];
}

template <class Field>
void write_field(LittleWriter& out, const Field& field) {
  if constexpr (std::is_enum_v<Field>)
    out.write(static_cast<std::underlying_type_t<Field>>(field));
  else
    out.write(field);
}
template <std::size_t size>
void write_field(LittleWriter& out, const Text<size>& field) {
  out.put(field.raw);
}

}  // namespace detail

/// Bytes of a body on the wire.
template <class Body>
constexpr std::size_t body_size = []<class... Fields>(std::tuple<Fields&...>*) {
  return (detail::field_size<Fields> + ...);
}(static_cast<decltype(std::declval<Body&>().fields())*>(nullptr));

template <class Body>
void append_body(Bytes& out, const Body& body) {
  LittleWriter writer(out);
  std::apply([&](const auto&... field) { (detail::write_field(writer, field), ...); },
             body.fields());
}

/// Errors: parse, if `data` does not have exactly the size of the layout.
template <class Body>
Result<Body> decode_body(ByteView data) {
  if (data.size() != body_size<Body>)
    return fail({.code = Errc::parse,
                 .what = "APT data length wrong for the message",
                 .expected = std::to_string(body_size<Body>) + " bytes",
                 .got = std::to_string(data.size()) + " bytes"});
  Body body;
  LittleReader reader(data);
  std::apply([&](auto&... field) { (detail::read_field(reader, field), ...); }, body.fields());
  return body;
}

/// Appends a complete long message. Does not allocate if `out` has enough capacity.
template <class Body>
void append_message(Bytes& out, MessageId id, const Body& body, Route route) {
  append_long_header(out, id, body_size<Body>, route);
  append_body(out, body);
}

template <class Body>
Message make_message(MessageId id, const Body& body, Route route) {
  Message message{id, 0, 0, route.dest, route.source, {}};
  append_body(message.data, body);
  return message;
}

static_assert(body_size<HardwareInfo> == 84 && body_size<RichResponse> == 68);
static_assert(body_size<JogParams> == 22 && body_size<StatusUpdate> == 14);
static_assert(body_size<PotParams> == 26 && body_size<ButtonParams> == 16);
static_assert(body_size<KcubePanelParams> == 28);

}  // namespace weft::protocols::apt

#undef WEFT_APT_FIELDS
