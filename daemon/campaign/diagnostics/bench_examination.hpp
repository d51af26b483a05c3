#pragma once
// Devices spoken to without moving anything: who they are, and how fast and regularly they answer.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/hardware/rig/device.hpp"

namespace weft::daemon {

// What the doctor says: one thing that was looked at.

enum class Severity : std::uint8_t {
  ok,
  warning,  ///< a campaign may run, worse than it could
  problem   ///< a campaign cannot run, or its data would not be trusted
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
  std::string hint;  ///< what to do about it; empty when all is well
};

/// What one device said.
struct DeviceReport {
  std::string name, role, driver, link;
  std::string plugin;     ///< the file of its driver; empty when that is built in
  bool answered = false;  ///< it was opened: the right device, which said who it is
  bool armed = false;     ///< it was seen to work
  DeviceIdentity identity;
  std::optional<Error> error;
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;
  double rate_hz = 0;             ///< of a stream, seen
  double configured_rate_hz = 0;  ///< 0: it sends nothing on its own
  double longest_gap_s = 0;       ///< between two samples of a stream
  double latency_s = 0;           ///< of an answer, median; stages
  double worst_latency_s = 0;
};

/// Lets time pass until `done()`.
using LetPass = std::function<void(const std::function<bool()>& done)>;

/// Opens and arms all devices at once, listens for `listen_s`, asks stages for readings, and closes
/// them. Stages are enabled and never moved. Devices that fail do not hold up the others.
class BenchExamination {
 public:
  struct Patient {
    Device* device;
    DeviceReport* report;  ///< filled; its names are there already
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
