#pragma once
// A bench and the passage of its time: one campaign runs unchanged on all three kinds of bench.

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/loop/timed_loop.hpp"
#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/campaign/supervisor.hpp"
#include "daemon/hardware/link/memory_link.hpp"
#include "daemon/hardware/rig/bench.hpp"
#include "recipes/engine/rig_limits.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// File in the campaign's folder with the monitor's report of a lost host.
inline constexpr const char* monitor_log_name = "monitor.log";

/// State in which the previous session left a simulated bench. Emulated devices end with their
/// session; motion outside a run starts where the run ended. A run itself always starts from the
/// rig file, so that it is repeatable.
struct SimulatedPlace {
  bool is_known = false;
  /// Motor positions, each from its stage's own zero [m, rad].
  std::array<double, recipes::axis_count> position{};
  std::array<bool, recipes::axis_count> homed{};
  recipes::MountFabric mounted;  ///< the fabric on the plate; no name: none
};

// A simulated bench, assembled: virtual time, emulated devices, links between them.

/// Members are destroyed last to first: drivers before links, links before the rig, the loop last.
struct SimulatedBench {
  VirtualLoop loop;
  TimedLoop rig_time{loop};   ///< callbacks of emulators and plant
  TimedLoop host_time{loop};  ///< callbacks of drivers and supervisor
  std::unique_ptr<sim::Rig> rig;
  std::vector<std::unique_ptr<MemoryLink>> far_ends;
  std::unique_ptr<Bench> bench;

  /// `fabrics_json` is the text of the rig file's fabric table.
  static Result<std::unique_ptr<SimulatedBench>> create(const RigFile& rig_file,
                                                        std::string_view fabrics_json,
                                                        std::uint64_t seed);
};

/// Checks that driver and emulator rates agree: they are configured apart, as on a real bench. A
/// mismatch would become a wrong rate in the data set. Errors: invalid_argument.
Status same_rates(const RigFile& rig, const recipes::RigLimits& limits, const sim::Rig& emulated);

/// Text of the fabric table named by the rig file (`simulation.fabrics`, relative to it).
Result<std::string> read_fabrics(const RigFile& rig_file, const std::filesystem::path& rig_path);

/// Wall time of a session by part, as far as it is known.
struct SessionLoad {
  double plant_and_emulators_s = 0;
  double drivers_and_control_s = 0;
  std::uint64_t events = 0;  ///< callbacks of the virtual loop
};

/// Thread-bound. Drivers are destroyed before links, links before the loop.
class BenchSession {
 public:
  virtual ~BenchSession() = default;
  virtual Bench& bench() = 0;
  /// The loop of drivers and supervisor.
  virtual Loop& loop() = 0;
  /// Lets time pass until `done()`. A simulated bench also returns when no event is left.
  virtual void run_until(const std::function<bool()>& done) = 0;
  virtual void mount(const recipes::MountFabric& order, MountDone done) = 0;
  /// Injects a fault into an emulated device, or ends faults. Errors in the order's callback:
  /// unsupported on a real bench; those of sim::Rig::inject() and clear_faults().
  virtual void inject_fault(const FaultOrder& order);
  [[nodiscard]] virtual SessionLoad load() const { return {}; }
  /// True on a bench in real time: nothing may delay the loop then.
  [[nodiscard]] virtual bool real_time() const { return false; }
  /// The emulated bench if it is in this process; its trials can be replayed.
  virtual sim::Rig* plant() { return nullptr; }
  /// After a halt: the probe stays where it is, even if this process dies.
  virtual void forbid_lift() {}
  /// Advice for better timing; empty if there is none.
  [[nodiscard]] virtual std::string advice() const { return {}; }
};

struct SessionRequest {
  const RigFile& rig;
  std::filesystem::path rig_path;  ///< the fabric table is relative to it
  const recipes::RigLimits& limits;
  std::uint64_t seed = 0;  ///< seeds the sensors of a simulated bench
  /// Simulated bench only: written when the session ends. Null: not stored. Outlives the session.
  SimulatedPlace* place = nullptr;
  bool begins_there = false;  ///< start at `place`, if it is known
  /// Bench on ports only: file for the monitor's report if this process is lost, beside standard
  /// error.
  std::filesystem::path monitor_log = {};
};

/// Opens the devices and, by default, homes the stages. Errors: the bench's; wrong_state if
/// stopped; timeout if the bench stops responding.
Status bring_up(BenchSession& session, const StopRequested& stop_requested,
                Homing homing = Homing::all);

/// Creates devices and links without sending any message. Errors: those of the rig file, its fabric
/// table or a port.
Result<std::unique_ptr<BenchSession>> open_session(const SessionRequest& request);

}  // namespace weft::daemon
