#pragma once
// Motion outside a run on a bench: opens it without homing and without a recorder, carries out one
// order with the guards and the monitor of a run, and closes it.

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
  std::filesystem::path rig;  ///< rig file
  PluginSettings plugins = {};
};

/// Where the stages are before the motion, and how z goes up.
struct MaintenanceBegin {
  recipes::Joints from;
  bool is_relative = false;  ///< z has not been homed: up by at most the clearance
};

struct MaintenanceSummary {
  MaintenanceBegin begin;
  recipes::Joints to = {};  ///< as the stages reported last
  recipes::MaintenanceDone done = {};
};

struct MaintenanceHooks {
  DeviceLogSink device_log;
  /// Before anything moves, on the thread of the motion.
  std::function<void(const MaintenanceBegin&)> begins;
  /// Stop, abort and halt end the motion; other orders are ignored.
  RunOrders* orders = nullptr;
  const BenchPace* pace = nullptr;  ///< of a simulated bench; kept where there are `orders`
  SimulatedPlace* place = nullptr;  ///< of a simulated bench, which begins there and is left there
};

/// Errors: what kept the motion from beginning (open_rig()'s, open_session()'s, bring_up()'s,
/// recipes::plan_maintenance()'s); nothing has moved then. What goes wrong later is in the summary.
Result<MaintenanceSummary> run_maintenance(const MaintenanceRequest& request,
                                           const MaintenanceHooks& hooks);

}  // namespace weft::daemon
