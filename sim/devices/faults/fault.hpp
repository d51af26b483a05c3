#pragma once
// Faults of a device and its wire: one table of kinds, and one board per device with its active
// faults.

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocols/base/time.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

enum class FaultKind : std::uint8_t {
  // the wire, around any emulator
  drop,
  duplicate,
  reorder,
  truncate,
  bit_flip,
  delay,
  jitter,
  garbage,
  unplug,
  link_stall,
  merge,
  split,
  // sensors that stream
  sequence_jump,
  sequence_back,
  rate_halved,
  silent,
  // the force sensor
  stuck_force,
  drift,
  saturation,
  absurd_counts,
  calibration_change,
  status_bits,
  threshold_latch,
  bias_jump,
  noise,
  redirected,
  // a stage
  motor_stall,
  lost_steps,
  limit_switch,
  motion_error,
  over_temperature,
  disabled,
  silent_status,
  wrong_reply,
  late_completion,
  no_completion,
  wrong_serial,
  never_homes,
  false_home,
  encoder_frozen,
  overshoot,
  // the tactile array
  crc_errors,
  dead_pad,
  noisy_pad,
  saturated_pad,
  frozen_frame,
  half_speed_clock,
  wrong_count,
  restart,
};

/// Devices into which a fault can be injected, one bit each.
namespace exposed {
inline constexpr std::uint8_t stream = 1;    ///< a serial line or TCP
inline constexpr std::uint8_t datagram = 2;  ///< UDP
inline constexpr std::uint8_t force = 4;     ///< a Net F/T box
inline constexpr std::uint8_t stage = 8;
inline constexpr std::uint8_t taxels = 16;
inline constexpr std::uint8_t vibration = 32;
inline constexpr std::uint8_t digital = 64;   ///< a Digital F/T sensor: no numbers, no thresholds
inline constexpr std::uint8_t imprint = 128;  ///< a dense array
inline constexpr std::uint8_t wire = stream | datagram;
}  // namespace exposed

struct FaultType {
  std::string_view name;
  FaultKind kind;
  std::uint8_t whom;
  /// Decided by chance for each message or sample; otherwise once, when the fault is added.
  bool each_time;
  double amount;  ///< default of Fault::amount
  std::string_view does;
};

/// All kinds, in the order of FaultKind.
std::span<const FaultType> fault_types();
/// nullptr for a name that the table does not have.
const FaultType* find_fault(std::string_view name);
const FaultType& type_of(FaultKind kind);

struct Fault {
  FaultKind kind{};
  TimePoint from{};
  TimePoint until = TimePoint::max();
  double probability = 1;
  double amount = 0;
  bool to_device = false;  ///< wire faults: hits data from the host, else from the device
};

/// The faults of one device. Without faults it draws no random number, so the rig behaves the same.
class FaultBoard {
 public:
  explicit FaultBoard(std::uint64_t seed) : dice_(seed) {}

  void add(const Fault& fault);
  void clear(FaultKind kind);
  void clear() { faults_.clear(); }
  [[nodiscard]] std::span<const Fault> faults() const { return faults_; }

  /// The fault of this kind that is active at `now`, or nullptr; wire faults have a direction.
  [[nodiscard]] const Fault* active(FaultKind kind, TimePoint now, bool to_device = false) const;
  /// As above, and chance selected this message or sample.
  const Fault* fires(FaultKind kind, TimePoint now, bool to_device = false);
  /// The next time after `now` at which a fault begins or ends.
  [[nodiscard]] std::optional<TimePoint> next_edge(TimePoint now) const;
  Random& dice() { return dice_; }

 private:
  std::vector<Fault> faults_;
  Random dice_;
};

}  // namespace weft::sim
