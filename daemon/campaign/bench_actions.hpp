#pragma once
// Carries out the orders of a machine (campaign, alignment) on a bench and watches them once per
// scan cycle: moves, guarded descents, biases. Checks the guards before every command.

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "daemon/hardware/rig/bench.hpp"
#include "recipes/control/guard_watch.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {

/// Guard inputs that only the caller knows.
struct GuardContext {
  std::optional<TimePoint> deadline;  ///< of the machine's current step
  Duration since_last{};              ///< since the previous cycle
  std::optional<std::uint64_t> free_bytes;
  bool zero_moves = false;  ///< a person touches the plate, or the sensor takes its bias
};

/// Thread-bound to the bench's loop. Reports outcomes as the engine's events, each with the ticket
/// of its order. A command that a driver refuses is reported as a Fault.
class BenchActions {
 public:
  using EventSink = std::function<void(recipes::Event)>;
  BenchActions(const recipes::RigLimits& limits, Loop& loop, Bench& bench, EventSink on_event);

  void begin(const recipes::MoveTo& order);
  void begin(const recipes::BiasSensors& order);
  void begin(const recipes::Descend& order) { begin(ForceWay{order, false}); }
  void begin(const recipes::Ascend& order);
  void end_force_way() { force_way_.reset(); }
  /// Stops all axes and cancels all orders in progress.
  void stop();

  /// Checks all orders in progress, once per cycle.
  void check_all();
  void check_motion();
  /// Error for a timeout: the condition that the engine's step still waits for, and the last
  /// values. Nothing if unknown.
  [[nodiscard]] std::optional<Error> still_awaited() const;
  /// The guard that trips in this cycle, if any.
  std::optional<recipes::GuardTrip> check_guards(const GuardContext& context);

  /// Sends a velocity that expires after recipes::servo_horizon, whatever the cycle rate.
  void drive(StageAxis axis, double velocity);
  void set_still(StageAxis axis);
  /// Ends a cycle: polls z in every cycle and the other stages once per row of stage positions.
  /// Readings that arrive from here on belong to the next cycle.
  void poll(std::uint64_t cycle);

 private:
  void check_force_way();
  void check_bias();
  void check_baseline();
  [[nodiscard]] bool is_touched() const;
  [[nodiscard]] Error no_baseline() const;

  /// A motion command in progress and the number that confirms it.
  struct Awaited {
    StageAxis axis;
    std::uint32_t move_id;  ///< 0: refused, never confirmed
  };
  enum class ZWay : std::uint8_t { none, down, off_the_cloth };
  struct Motion {
    recipes::Ticket ticket;
    std::vector<Awaited> moves;
    ZWay z_way;
  };
  /// A Descend, or an Ascend with the same fields.
  struct ForceWay {
    recipes::Descend order;
    bool up = false;
  };
  struct Biasing {
    recipes::Ticket ticket = 0;
    TimePoint sent_at{};  ///< time of the last request
    int times = 0;        ///< number of requests
    std::optional<TimePoint> quiet_since{};
    WrenchTotal quiet{};  ///< readings since `quiet_since`
    /// Mean of the last cycle that was not quiet [N].
    std::optional<std::array<double, 3>> off_n{};
  };

  void begin(const ForceWay& way);
  void send_bias();
  std::uint32_t command(StageAxis axis, const Command& command);
  /// The newest readings with their times.
  [[nodiscard]] recipes::WatchInput newest() const;
  [[nodiscard]] ZWay z_way(double from, double target) const;
  /// Sets whether the probe may land or lift off, from the present or recent motion of z.
  void check_z_motion(recipes::WatchInput& watched, TimePoint now);

  Loop* loop_;
  Bench* bench_;
  EventSink on_event_;
  Duration period_{};
  recipes::GuardLimits guard_limits_;
  recipes::GuardWatch watch_;
  /// Touch threshold without a force sensor: mean change of the taxels [counts].
  double touch_counts_;
  std::optional<double> touched_z_m_;  ///< at the end of the last descent
  TimePoint can_land_until_{}, can_lift_until_{};
  std::optional<Motion> motion_;
  std::optional<ForceWay> force_way_;
  std::optional<Biasing> biasing_;
};

}  // namespace weft::daemon
