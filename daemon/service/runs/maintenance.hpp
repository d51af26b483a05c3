#pragma once
// Thread of a motion outside a run (retract, park, jog).

#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "daemon/service/runs/run_context.hpp"

namespace weft::daemon::runs {

/// One motion at a time. Thread: the server's.
class MaintenanceExecutor {
 public:
  using OnBegins = std::function<void(const MaintenanceBegin&)>;
  using OnEnded = std::function<void(const Result<MaintenanceSummary>&)>;

  /// `context` must outlive it.
  explicit MaintenanceExecutor(const RunContext& context) : context_(context) {}
  MaintenanceExecutor(const MaintenanceExecutor&) = delete;
  MaintenanceExecutor& operator=(const MaintenanceExecutor&) = delete;
  ~MaintenanceExecutor() { stop(); }

  /// Both callbacks are called on the server's thread; `on_ended` once, after the thread was
  /// joined.
  void begin(const recipes::MaintenanceOrder& order, OnBegins on_begins, OnEnded on_ended);
  /// The active order; empty once its end was reported.
  [[nodiscard]] const std::optional<recipes::MaintenanceOrder>& order() const { return order_; }
  /// Stops the motion. No effect if there is none.
  void give(const GivenOrder& order);
  /// Aborts the motion and waits for its thread; nothing is reported afterwards.
  void stop();

 private:
  const RunContext& context_;
  std::optional<recipes::MaintenanceOrder> order_;
  std::optional<RunOrders> orders_;  ///< of the newest motion
  Result<MaintenanceSummary> result_;
  std::jthread thread_;
};

}  // namespace weft::daemon::runs
