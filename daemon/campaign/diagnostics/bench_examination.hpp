#pragma once
// Examines devices without moving anything: their identity, and the rate and regularity of their
// samples.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/hardware/rig/device.hpp"

namespace weft::daemon {

// Findings of the doctor: one checked item each.

enum class Severity : std::uint8_t {
  ok,
  warning,  ///< a campaign can run, with lower quality
  problem   ///< a campaign cannot run, or its data are not trustworthy
};
constexpr std::string_view to_string(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"ok", "warning", "problem"};
  static_assert(names.size() == static_cast<std::size_t>(Severity::problem) + 1);
  const auto at = static_cast<std::size_t>(severity);
  return at < names.size() ? names[at] : "unknown";
}

struct Diagnosis {
  Severity severity = Severity::ok;
  std::string subject;  ///< "stage.x", "clock"
  std::string what;
  std::string hint;  ///< what to do; empty if all is well
};

/// Result of one device.
struct DeviceReport {
  std::string name, role, driver, link;
  std::string plugin;     ///< the file of its driver; empty for a built-in driver
  bool answered = false;  ///< it was opened: the right device, with its identity
  bool armed = false;     ///< it worked
  DeviceIdentity identity;
  std::optional<Error> error;
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;
  double rate_hz = 0;             ///< measured rate of a stream
  double configured_rate_hz = 0;  ///< 0: it sends nothing unasked
  double longest_gap_s = 0;       ///< between two samples of a stream
  double latency_s = 0;           ///< median answer time; stages only
  double worst_latency_s = 0;
};

/// Lets time pass until `done()`.
using LetPass = std::function<void(const std::function<bool()>& done)>;

/// Opens and arms all devices at once, receives for `listen_s`, polls stages for readings, and
/// closes them. Stages are enabled and never moved. Devices that fail do not delay the others.
class BenchExamination {
 public:
  struct Patient {
    Device* device;
    DeviceReport* report;  ///< result; its names are already set
  };
  BenchExamination(Loop& loop, LetPass let_pass, std::vector<Patient> patients);
  void run(double listen_s);

 private:
  struct Stream {
    std::optional<TimePoint> first, last;
    std::optional<TimePoint> requested;
    std::vector<double> latencies_s;
  };
  void reach(DriverState state, Status (Driver::*call)());
  void listen(double duration_s);
  void poll_stages();
  void record_sample(std::size_t i, const Sample& sample);
  bool await(const std::function<bool()>& done, Duration limit);
  void conclude(std::size_t i);

  Loop* loop_;
  LetPass let_pass_;
  std::vector<Patient> patients_;
  std::vector<Stream> streams_;
  TimerId poll_timer_ = 0;
  bool listening_ = false;
};

}  // namespace weft::daemon
