#include "sim/devices/faults/fault.hpp"

#include <algorithm>
#include <array>

namespace weft::sim {

namespace {

using enum FaultKind;
constexpr std::uint8_t blocks = exposed::taxels | exposed::vibration | exposed::imprint;
constexpr std::uint8_t wrench = exposed::force | exposed::digital;
constexpr std::uint8_t numbered = exposed::force | blocks;
constexpr std::uint8_t sensors = wrench | blocks;

constexpr std::array types{
    FaultType{"drop", drop, exposed::wire, true, 0, "a message is lost"},
    FaultType{"duplicate", duplicate, exposed::datagram, true, 0, "a datagram arrives twice"},
    FaultType{"reorder", reorder, exposed::datagram, true, 0.025,
              "a datagram arrives `amount` s late, after later ones"},
    FaultType{"truncate", truncate, exposed::wire, true, 0, "the end of a message is lost"},
    FaultType{"bit_flip", bit_flip, exposed::wire, true, 0, "one bit of a message is inverted"},
    FaultType{"delay", delay, exposed::wire, false, 0.05, "all bytes arrive `amount` s late"},
    FaultType{"jitter", jitter, exposed::wire, true, 0.02,
              "each message arrives up to `amount` s late"},
    FaultType{"garbage", garbage, exposed::wire, true, 16, "up to `amount` random bytes are added"},
    FaultType{"unplug", unplug, exposed::wire, false, 0,
              "no byte passes and ports hang up until the fault ends"},
    FaultType{"link_stall", link_stall, exposed::wire, false, 0,
              "all bytes are held and arrive at once when the fault ends"},
    FaultType{"merge", merge, exposed::stream, false, 0.05,
              "bytes arrive in groups, one each `amount` s"},
    FaultType{"split", split, exposed::stream, false, 0, "bytes arrive one by one"},
    FaultType{"sequence_jump", sequence_jump, numbered, false, 1000,
              "the sequence numbers jump ahead by `amount`, once"},
    FaultType{"sequence_back", sequence_back, numbered, false, 1000,
              "the sequence numbers jump back by `amount`, once"},
    FaultType{"rate_halved", rate_halved, sensors, false, 0, "the sample rate is halved"},
    FaultType{"silent", silent, sensors, false, 0, "the stream stops"},
    FaultType{"stuck_force", stuck_force, wrench, false, 0, "the values do not change"},
    FaultType{"drift", drift, wrench, false, 0.05, "Fz drifts by `amount` N/s"},
    FaultType{"saturation", saturation, wrench | exposed::vibration, false, 0,
              "Fz (Digital F/T: its gauges) or all vibration readings are at the end of the range; "
              "a status word reports it"},
    FaultType{"absurd_counts", absurd_counts, wrench, true, 0,
              "counts have the largest value of 32 bits, gauges the least of 16 bits"},
    FaultType{"calibration_change", calibration_change, wrench, false, 1.25,
              "counts per newton are `amount` times the configured ones"},
    FaultType{"status_bits", status_bits, wrench, false, 28,
              "bit `amount` of the status word is set, at most its highest bit"},
    FaultType{"threshold_latch", threshold_latch, exposed::force, false, 0,
              "a threshold latches until it is reset"},
    FaultType{"bias_jump", bias_jump, wrench, false, 2, "Fz is shifted by `amount` N"},
    FaultType{"noise", noise, wrench, false, 1, "Fz has extra noise of `amount` N rms"},
    FaultType{"redirected", redirected, exposed::force, false, 0,
              "another client redirects the stream"},
    FaultType{"motor_stall", motor_stall, exposed::stage, false, 0,
              "the motor does not move, the controller keeps trying"},
    FaultType{"lost_steps", lost_steps, exposed::stage, false, 0.2,
              "the share `amount` of all steps is lost"},
    FaultType{"limit_switch", limit_switch, exposed::stage, false, 0,
              "the forward limit switch closes and stops the stage"},
    FaultType{"motion_error", motion_error, exposed::stage, false, 0,
              "status: position error too large"},
    FaultType{"over_temperature", over_temperature, exposed::stage, false, 0,
              "status: over-temperature"},
    FaultType{"disabled", disabled, exposed::stage, false, 0,
              "the channel becomes disabled and stops"},
    FaultType{"silent_status", silent_status, exposed::stage, false, 0, "no status is sent"},
    FaultType{"wrong_reply", wrong_reply, exposed::stage | exposed::digital, false, 0,
              "requests for a status or a register get a wrong reply"},
    FaultType{"late_completion", late_completion, exposed::stage, false, 1,
              "the end of a move is reported `amount` s late"},
    FaultType{"no_completion", no_completion, exposed::stage, false, 0,
              "the end of a move is never reported"},
    FaultType{"wrong_serial", wrong_serial, exposed::stage, false, 1,
              "the serial number is `amount` higher"},
    FaultType{"never_homes", never_homes, exposed::stage, false, 0, "homing never ends"},
    FaultType{"false_home", false_home, exposed::stage, false, 0,
              "homing is reported as done without motion"},
    FaultType{"encoder_frozen", encoder_frozen, exposed::stage, false, 0,
              "the encoder count does not change while the stage moves"},
    FaultType{"overshoot", overshoot, exposed::stage, false, 0.05,
              "moves end `amount` mm or degrees too far"},
    FaultType{"crc_errors", crc_errors, blocks | exposed::digital, true, 0,
              "the check value of a frame, a record or a reply is wrong"},
    FaultType{"dead_pad", dead_pad, exposed::taxels, false, 5, "taxel `amount` keeps its value"},
    FaultType{"noisy_pad", noisy_pad, exposed::taxels, false, 5,
              "taxel `amount` jumps by thousands of counts"},
    FaultType{"saturated_pad", saturated_pad, exposed::taxels, false, 5,
              "taxel `amount` reads 65535"},
    FaultType{"frozen_frame", frozen_frame, blocks, false, 0,
              "all taxels or readings keep their values"},
    FaultType{"half_speed_clock", half_speed_clock, blocks, false, 0,
              "the clock of the sensor runs at half speed"},
    FaultType{"wrong_count", wrong_count, blocks, false, 15,
              "frames have `amount` taxels or readings"},
    FaultType{"restart", restart, blocks, false, 0, "sequence numbers and clock restart once"},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < types.size(); ++i)
    if (static_cast<std::size_t>(types[i].kind) != i) return false;
  return true;
}
static_assert(in_order());

}  // namespace

std::span<const FaultType> fault_types() {
  return types;
}

const FaultType* find_fault(std::string_view name) {
  const auto found = std::find_if(types.begin(), types.end(),
                                  [&](const FaultType& type) { return type.name == name; });
  return found == types.end() ? nullptr : &*found;
}

const FaultType& type_of(FaultKind kind) {
  return types[static_cast<std::size_t>(kind)];
}

void FaultBoard::add(const Fault& fault) {
  const bool certain = fault.probability >= 1 || type_of(fault.kind).each_time;
  if (certain || dice_.uniform() < fault.probability) faults_.push_back(fault);
}

void FaultBoard::clear(FaultKind kind) {
  std::erase_if(faults_, [kind](const Fault& fault) { return fault.kind == kind; });
}

const Fault* FaultBoard::active(FaultKind kind, TimePoint now, bool to_device) const {
  for (const Fault& fault : faults_)
    if (fault.kind == kind && fault.to_device == to_device && fault.from <= now &&
        now < fault.until)
      return &fault;
  return nullptr;
}

const Fault* FaultBoard::fires(FaultKind kind, TimePoint now, bool to_device) {
  const Fault* fault = active(kind, now, to_device);
  if (fault == nullptr || fault->probability >= 1) return fault;
  return dice_.uniform() < fault->probability ? fault : nullptr;
}

std::optional<TimePoint> FaultBoard::next_edge(TimePoint now) const {
  std::optional<TimePoint> next;
  for (const Fault& fault : faults_)
    for (const TimePoint edge : {fault.from, fault.until})
      if (edge > now && edge != TimePoint::max() && (!next || edge < *next)) next = edge;
  return next;
}

}  // namespace weft::sim
