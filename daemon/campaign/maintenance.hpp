#pragma once
// Motion outside a run. Opens a bench without homing and recorder, carries out one order, and
// closes it. Guards and monitor are those of a run.

#include <array>
#include <filesystem>
#include <functional>

#include "daemon/campaign/bench_pace.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "recipes/maintenance/maintenance.hpp"

namespace weft::daemon {

struct MaintenanceRequest {
  recipes::MaintenanceOrder order;
  std::filesystem::path rig;
  PluginSettings plugins = {};
};

/// Positions of the stages before the motion, and how z lifts.
struct MaintenanceBegin {
  recipes::Joints from;
  bool is_relative = false;  ///< z has not been homed: it lifts by at most the clearance
};

struct MaintenanceSummary {
  MaintenanceBegin begin;
  recipes::Joints to = {};  ///< last positions reported by the stages
  recipes::MaintenanceDone done = {};
};

struct MaintenanceHooks {
  DeviceLogSink device_log;
  /// Called before anything moves, on the thread of the motion.
  std::function<void(const MaintenanceBegin&)> begins;
  /// Stop, abort and halt end the motion; other orders are ignored.
  RunOrders* orders = nullptr;
  const BenchPace* pace = nullptr;  ///< of a simulated bench; applied only with `orders`
  SimulatedPlace* place = nullptr;  ///< of a simulated bench: start position, updated at the end
};

/// Errors: the reasons why the motion could not start (open_rig()'s, open_session()'s,
/// bring_up()'s, recipes::plan_maintenance()'s); nothing has moved then. Later failures are in the
/// summary.
Result<MaintenanceSummary> run_maintenance(const MaintenanceRequest& request,
                                           const MaintenanceHooks& hooks);

}  // namespace weft::daemon
