#pragma once
// A bench and what makes its time pass: one campaign runs unchanged on all three kinds.

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

/// In the campaign's folder: what the monitor reports of a host that was lost.
inline constexpr const char* monitor_log_name = "monitor.log";

/// Where the session before left a simulated bench: the emulated devices end with their session,
/// and motion outside a run begins where the run ended. A run itself always begins from the rig
/// file, so that it is the same each time.
struct SimulatedPlace {
  bool is_known = false;
  std::array<double, recipes::axis_count> position{};  ///< of the motors, each stage's own zero
  std::array<bool, recipes::axis_count> homed{};
  recipes::MountFabric mounted;  ///< what lies on the plate; no fabric: nothing
};

// A simulated bench ready to be driven: virtual time, emulated devices, links between them.

/// Members are destroyed last to first: drivers before links, links before the rig, the loop last.
struct SimulatedBench {
  VirtualLoop loop;
  TimedLoop rig_time{loop};   ///< callbacks of emulators and plant
  TimedLoop host_time{loop};  ///< callbacks of drivers and supervisor
  std::unique_ptr<sim::Rig> rig;
  std::vector<std::unique_ptr<MemoryLink>> far_ends;
  std::unique_ptr<Bench> bench;

  /// `fabrics_json` is the text of the rig file's cloth table.
  static Result<std::unique_ptr<SimulatedBench>> create(const RigFile& rig_file,
                                                        std::string_view fabrics_json,
                                                        std::uint64_t seed);
};

/// Drivers and emulators are configured apart, as they are on a real bench. Refuses rates that
/// disagree before they become a wrong rate in the data set.
Status same_rates(const RigFile& rig, const recipes::RigLimits& limits, const sim::Rig& emulated);

/// Text of the cloth table that the rig file names (`simulation.fabrics`, relative to it).
Result<std::string> read_fabrics(const RigFile& rig_file, const std::filesystem::path& rig_path);

/// Where the wall time of a session went, as far as it can tell.
struct SessionLoad {
  double plant_and_emulators_s = 0;
  double drivers_and_control_s = 0;
  std::uint64_t events = 0;  ///< callbacks of the virtual loop
};

/// Thread-bound. Drivers are gone before links, links before the loop.
class BenchSession {
 public:
  virtual ~BenchSession() = default;
  virtual Bench& bench() = 0;
  /// Of drivers and supervisor.
  virtual Loop& loop() = 0;
  /// Lets time pass until `done()`; on a simulated bench also until nothing is left to happen.
  virtual void run_until(const std::function<bool()>& done) = 0;
  virtual void mount(const recipes::MountFabric& order, MountDone done) = 0;
  /// Lets a fault befall an emulated device, or ends some. Told: unsupported, of a real bench;
  /// sim::Rig::inject()'s and clear_faults()'s.
  virtual void inject_fault(const FaultOrder& order);
  [[nodiscard]] virtual SessionLoad load() const { return {}; }
  /// Whether its time is the world's: then nothing may hold the loop up.
  [[nodiscard]] virtual bool real_time() const { return false; }
  /// The emulated bench, where it is this process's; its trials can be played again.
  virtual sim::Rig* plant() { return nullptr; }
  /// From now on the probe stays where it is, whatever becomes of this process: after a halt.
  virtual void forbid_lift() {}
  /// What would let it keep time better; empty when there is nothing.
  [[nodiscard]] virtual std::string advice() const { return {}; }
};

struct SessionRequest {
  const RigFile& rig;
  std::filesystem::path rig_path;  ///< the cloth table is found relative to it
  const recipes::RigLimits& limits;
  std::uint64_t seed = 0;  ///< of a simulated bench's sensors
  /// Of a simulated bench: written when the session ends. Null: not kept. Outlives the session.
  SimulatedPlace* place = nullptr;
  bool begins_there = false;  ///< at `place`, where it is known
  /// On ports: where the monitor reports the loss of this process, beside standard error.
  std::filesystem::path monitor_log = {};
};

/// Opens the devices and, unless told otherwise, homes the stages. Errors: the bench's; wrong_state
/// when it was stopped; timeout, when the bench fell silent.
Status bring_up(BenchSession& session, const StopRequested& stop_requested,
                Homing homing = Homing::all);

/// Makes devices and links; nothing has been said to a device yet.
/// Errors: what the rig file, its cloth table or a port refuse.
Result<std::unique_ptr<BenchSession>> open_session(const SessionRequest& request);

}  // namespace weft::daemon
