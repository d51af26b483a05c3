#pragma once
// The status word of APT stages (device-facts.md, APT messages). APT16 gives a subset; the rest
// is from thorlabs-apt-protocol, aptProtocol.h of infn-epics and pylablib.

#include <cstdint>

namespace weft::protocols::apt::status {

inline constexpr std::uint32_t forward_limit = 0x00000001;  ///< hardware limit, CW
inline constexpr std::uint32_t reverse_limit = 0x00000002;  ///< hardware limit, CCW
inline constexpr std::uint32_t forward_soft_limit = 0x00000004;
inline constexpr std::uint32_t reverse_soft_limit = 0x00000008;
// The document and observation disagree on which of each pair is forward: use their union only.
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
/// Any of these ends a run. The interlock bit is not among them: its meaning differs per family.
inline constexpr std::uint32_t any_fault =
    motion_error | instrument_error | over_temperature | bus_voltage_fault | commutation_error |
    overload | encoder_fault | over_current | supply_current_fault | error;

}  // namespace weft::protocols::apt::status
