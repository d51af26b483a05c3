#pragma once
// What a machine (campaign, alignment) asks of a bench, carried out and watched once per scan
// cycle: moves, guarded descents, zeros, and the guards that stand before every command.

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "daemon/hardware/rig/bench.hpp"
#include "recipes/control/guard_watch.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {

/// What the guards need and only the caller knows.
struct GuardContext {
  std::optional<TimePoint> deadline;  ///< of the machine's step
  Duration since_last{};              ///< cycle
  std::optional<std::uint64_t> free_bytes;
  bool zero_moves = false;  ///< somebody touches the plate, or the sensor takes its zero
};

/// Thread-bound to the bench's loop. Answers are told as the engine's events, each with the ticket
/// of what it answers; a command that a driver refuses is told as a Fault.
class BenchActions {
 public:
  using EventSink = std::function<void(recipes::Event)>;
  BenchActions(const recipes::RigLimits& limits, Loop& loop, Bench& bench, EventSink on_event);

  void begin(const recipes::MoveTo& order);
  void begin(const recipes::BiasSensors& order);
  void begin(const recipes::Descend& order) { begin(ForceWay{order, false}); }
  void begin(const recipes::Ascend& order);
  void end_force_way() { force_way_.reset(); }
  /// All axes stand still, nothing is awaited any more.
  void stop();

  /// One cycle's look at what is under way.
  void check_all();
  void check_motion();
  /// What the engine's step still waits for and what was seen of it, for who gives up; nothing
  /// where that is not known.
  [[nodiscard]] std::optional<Error> still_awaited() const;
  /// What trips a guard in this cycle, if anything.
  std::optional<recipes::GuardTrip> check_guards(const GuardContext& context);

  /// A velocity that ends by itself after recipes::servo_horizon, whatever the rate of the cycle.
  void drive(StageAxis axis, double velocity);
  void set_still(StageAxis axis);
  /// Ends a cycle: asks z for a reading in every one and the other stages once in a row of stage
  /// positions. What the sensors say from now on is the next cycle's.
  void poll(std::uint64_t cycle);

 private:
  void check_force_way();
  void check_bias();
  void check_baseline();
  [[nodiscard]] bool is_touched() const;
  [[nodiscard]] Error no_baseline() const;

  /// A motion command under way and the number that confirms it.
  struct Awaited {
    StageAxis axis;
    std::uint32_t move_id;  ///< 0: refused, it never comes
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
    TimePoint sent_at{};  ///< last
    int times = 0;        ///< it was sent
    std::optional<TimePoint> quiet_since{};
    WrenchTotal quiet{};                           ///< readings since then
    std::optional<std::array<double, 3>> off_n{};  ///< mean of the last cycle that was not quiet
  };

  void begin(const ForceWay& way);
  void send_bias();
  std::uint32_t command(StageAxis axis, const Command& command);
  /// Readings and when they came.
  [[nodiscard]] recipes::WatchInput newest() const;
  [[nodiscard]] ZWay z_way(double from, double target) const;
  /// Whether the probe may land, or be lifted off, by where z goes or went a moment ago.
  void check_z_motion(recipes::WatchInput& watched, TimePoint now);

  Loop* loop_;
  Bench* bench_;
  EventSink on_event_;
  Duration period_{};
  recipes::GuardLimits guard_limits_;
  recipes::GuardWatch watch_;
  double touch_counts_;                ///< without a force sensor: the taxels' mean change
  std::optional<double> touched_z_m_;  ///< at the end of the last way down
  TimePoint can_land_until_{}, can_lift_until_{};
  std::optional<Motion> motion_;
  std::optional<ForceWay> force_way_;
  std::optional<Biasing> biasing_;
};

}  // namespace weft::daemon
