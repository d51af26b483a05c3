#include "recipes/engine/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "recipes/engine/motion.hpp"
#include "recipes/engine/operator_steps.hpp"

namespace weft::recipes {

const PhaseStep& Exploration::step(Phase phase) const {
  for (const PhaseStep& candidate : phases)
    if (candidate.phase == phase) return candidate;
  WEFT_ASSERT(false && "a checked exploration has every phase");
  return phases.front();
}

bool Exploration::slides() const {
  return std::ranges::any_of(phases, [](const PhaseStep& p) { return p.phase == Phase::motion; });
}

const std::vector<Vec2>& Exploration::path_m() const {
  static const std::vector<Vec2> none;
  return slides() ? step(Phase::motion).path_m : none;
}

std::string format_trial(const Plan& plan, std::size_t trial) {
  const TrialSpec& spec = plan.trials[trial];
  return "trial " + std::to_string(spec.index + 1) + " (" + plan.fabrics[spec.fabric] + ", " +
         plan.explorations[spec.exploration].name + ", repetition " +
         std::to_string(spec.repetition) + ")";
}

double move_duration_s(double distance_m, double speed_mps, double acceleration_mps2) {
  const double distance = std::abs(distance_m);
  const double ramps_m = speed_mps * speed_mps / acceleration_mps2;
  if (distance < ramps_m) return 2 * std::sqrt(distance / acceleration_mps2);
  return distance / speed_mps + speed_mps / acceleration_mps2;
}

namespace {

// Estimates of quantities that are unknown before contact. The forecast should be right within a
// few per cent, not to the second. Tests compare it with runs on the simulated bench.
constexpr double cloth_height_m = 1.2e-3;  ///< mean height at first contact
constexpr double seat_travel_m = 0.1e-3;  ///< from first contact until the fabric carries the probe
constexpr double bias_s = 1.0;            ///< settling and averaging of the sensors
constexpr double press_s = 0.8;           ///< force rise, without the dwell
constexpr double release_travel_m = 0.1e-3;  ///< from the set point's z to the end of the slack
/// Confirmation of each move: the last status message and the check of the position.
constexpr double confirm_s = 0.1;

/// Recorded row sizes, docs/reference/dataset.md "Chunks": stamps, counters and values.
constexpr double taxel_row_overhead_bytes = 17;
constexpr double wrench_row_bytes = 37;
constexpr double stage_row_bytes = 28;
constexpr double vibration_value_bytes = 4.8;  // 4, and a fifth for block headers

struct Moves {
  double acceleration_mps2;
  [[nodiscard]] double operator()(double distance_m, double speed_mps) const {
    return move_duration_s(distance_m, speed_mps, acceleration_mps2) + confirm_s;
  }
};

double transfer_s(const Plan& plan, Vec2 from, Vec2 to) {
  const Moves move{plan.limits.max_acceleration_mps2};
  const double longest_m = std::max(std::abs(to.x_m - from.x_m), std::abs(to.y_m - from.y_m));
  return move(longest_m, plan.approach.transfer_speed_mps);
}

Vec2 end_of(const Plan& plan, const TrialSpec& trial) {
  const Exploration& exploration = plan.explorations[trial.exploration];
  const std::vector<Vec2>& path = exploration.path_m();
  return path.empty() ? start_of(plan, trial)
                      : path_leg(exploration, path.size() - 1, trial.place.offset_m).to_m;
}

double recording_s(const Plan& plan, const Exploration& exploration) {
  return exploration.step(Phase::rest).duration_s + exploration.step(Phase::press).duration_s +
         motion_duration_s(exploration, plan.limits.max_acceleration_mps2) +
         exploration.step(Phase::end).duration_s;
}

double bytes_per_second(const RigLimits& limits) {
  const double taxel_row = taxel_row_overhead_bytes + 2 * static_cast<double>(limits.taxels);
  return limits.taxel_rate_hz * taxel_row + limits.wrench_rate_hz * wrench_row_bytes +
         limits.stage_rate_hz() * stage_row_bytes +
         vibration_value_bytes * (3 * limits.acceleration_rate_hz + limits.sound_rate_hz);
}

void widen(Range& range, double value) {
  range.min = std::min(range.min, value);
  range.max = std::max(range.max, value);
}

void widen_by(std::array<Range, axis_count>& envelope, const Plan& plan, Vec2 point_m) {
  const Result<Joints> joints = over(plan.limits, point_m, plan.limits.clearance_m);
  if (!joints) return;
  for (const Axis axis : all_axes) widen(envelope[index(axis)], (*joints)[axis]);
}

/// Parks are given in stage positions.
void widen_by_parks(std::array<Range, axis_count>& envelope, const std::vector<LastStep>& steps) {
  for (const LastStep& step : steps) {
    const auto* const park = std::get_if<ParkStep>(&step);
    if (park == nullptr) continue;
    widen(envelope[index(Axis::x)], park->x_m);
    widen(envelope[index(Axis::y)], park->y_m);
  }
}

std::array<Range, axis_count> compute_envelope(const Plan& plan) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  std::array<Range, axis_count> envelope;
  envelope.fill({inf, -inf});
  std::set<std::pair<std::size_t, std::uint32_t>> seen;
  for (const TrialSpec& trial : plan.trials) {
    if (!seen.emplace(trial.exploration, trial.place.patch).second) continue;
    const Exploration& exploration = plan.explorations[trial.exploration];
    widen_by(envelope, plan, start_of(plan, trial));
    for (std::size_t i = 0; i < exploration.path_m().size(); ++i)
      widen_by(envelope, plan, path_leg(exploration, i, trial.place.offset_m).to_m);
  }
  widen(envelope[index(Axis::z)], lowest_z_m(plan.limits));
  for (const Exploration& exploration : plan.explorations)
    if (const double depth_m = exploration.step(Phase::press).depth_m; depth_m > 0)
      widen(envelope[index(Axis::z)], lowest_z_m(plan.limits) + depth_m);
  for (const auto& steps : {plan.finally.on_success, plan.finally.on_stop, plan.finally.on_fault})
    widen_by_parks(envelope, steps);
  return envelope;
}

std::optional<Range> force_range(const Plan& plan) {
  if (!plan.limits.has_wrench) return std::nullopt;
  Range force{plan.limits.probe_weight_n, plan.limits.probe_weight_n};
  for (const Exploration& exploration : plan.explorations)
    widen(force, exploration.step(Phase::press).force_n);
  return force;
}

}  // namespace

double motion_duration_s(const Exploration& exploration, double acceleration_mps2) {
  if (!exploration.slides()) return 0;
  const PhaseStep& motion = exploration.step(Phase::motion);
  const Moves move{acceleration_mps2};
  double total_s = 0;
  for (std::size_t i = 0; i < motion.path_m.size(); ++i)
    total_s += move(path_leg(exploration, i).length_m, motion.speed_mps);
  return total_s;
}

namespace {

/// Additional time of a set point below the weight [s]: up to the stop and down again, or up to the
/// clear height and down to the fabric.
double light_s(const Plan& plan, double force_n, double to_touch_m) {
  const RigLimits& limits = plan.limits;
  if (force_n >= limits.probe_weight_n) return 0;
  const double seat_mps = driven_speed(limits, plan.approach.seat_speed_mps);
  if (force_n > 0) return limits.rest_travel_m * (1 / lighten_speed_mps + 1 / seat_mps);
  return to_touch_m * (1 / plan.approach.transfer_speed_mps + 1 / seat_mps);
}

/// Time until the force is in its band [s]; none if the weight of the probe already is.
double rise_s(const Plan& plan, const PhaseStep& press) {
  const bool in_band = plan.limits.has_wrench &&
                       std::abs(press.force_n - plan.limits.probe_weight_n) < press.force_band_n;
  return in_band ? 0 : press_s;
}

/// A press by depth: down from the rest height and back up.
double depth_s(const Plan& plan, double depth_m) {
  const Moves move{plan.limits.max_acceleration_mps2};
  return 2 * move(depth_m - plan.limits.rest_travel_m, plan.approach.seat_speed_mps);
}

}  // namespace

double trial_duration_s(const Plan& plan, const TrialSpec& trial, Vec2 from_m) {
  const Exploration& exploration = plan.explorations[trial.exploration];
  const RigLimits& limits = plan.limits;
  const Approach& approach = plan.approach;
  const Moves move{limits.max_acceleration_mps2};
  const double down_mps = limits.has_wrench ? approach.speed_mps : touch_speed_mps(plan);
  // A freely hanging probe is lower by the slack.
  const double to_touch_m =
      std::max(0.0, limits.clearance_m - cloth_height_m - limits.slack_m.value_or(0));
  return transfer_s(plan, from_m, start_of(plan, trial)) + bias_s +
         move(to_touch_m, driven_speed(limits, down_mps)) +
         move(seat_travel_m, driven_speed(limits, approach.seat_speed_mps)) +
         move(limits.rest_travel_m, approach.seat_speed_mps) +
         (limits.has_wrench ? light_s(plan, exploration.step(Phase::press).force_n, to_touch_m)
                            : depth_s(plan, exploration.step(Phase::press).depth_m)) +
         rise_s(plan, exploration.step(Phase::press)) + plan.settle.dwell_s +
         recording_s(plan, exploration) +
         move(release_travel_m, driven_speed(limits, approach.seat_speed_mps)) +
         move(limits.rest_travel_m, approach.speed_mps) +
         move(to_touch_m + limits.rest_travel_m, approach.transfer_speed_mps);
}

namespace {

// From the home position down to the clear height, before the first trial.
double clearing_s(const Plan& plan) {
  const Moves move{plan.limits.max_acceleration_mps2};
  return move(plan.limits.clear_z_m(), plan.approach.transfer_speed_mps);
}

/// In stage positions, as parks are given.
Vec2 stages_at(const RigLimits& limits, Vec2 point_m) {
  const Result<Joints> joints = over(limits, point_m, limits.clearance_m);
  return joints ? Vec2{(*joints)[Axis::x], (*joints)[Axis::y]} : Vec2{};
}

// After a complete campaign, from the end of its last trial.
double finally_s(const Plan& plan) {
  Vec2 at = stages_at(plan.limits, end_of(plan, plan.trials.back()));
  double total_s = 0;
  for (const LastStep& step : plan.finally.on_success) {
    if (const auto* const wait = std::get_if<WaitStep>(&step)) {
      total_s += wait->duration_s;
      continue;
    }
    const auto& park = std::get<ParkStep>(step);
    const Vec2 place{park.x_m, park.y_m};
    total_s += transfer_s(plan, at, place);
    at = place;
  }
  return std::min(total_s, plan.finally.budget_s);
}

Vec2 home_point(const Geometry& geometry) {
  return {-geometry.origin_m.x_m, -geometry.origin_m.y_m};
}

}  // namespace

std::vector<double> trial_durations_s(const Plan& plan) {
  std::vector<double> out;
  Vec2 at = home_point(plan.limits.geometry);
  for (const TrialSpec& trial : plan.trials) {
    out.push_back(trial_duration_s(plan, trial, at) + (out.empty() ? clearing_s(plan) : 0));
    at = end_of(plan, trial);
  }
  return out;
}

Forecast forecast(const Plan& plan) {
  Forecast out;
  double total_recorded_s = 0;
  for (const TrialSpec& trial : plan.trials)
    total_recorded_s += recording_s(plan, plan.explorations[trial.exploration]);
  out.finally_s = finally_s(plan);
  out.duration_s = out.finally_s;
  for (const double trial_s : trial_durations_s(plan)) out.duration_s += trial_s;
  for (std::size_t i = 0; i < plan.trials.size(); ++i)
    out.mounts += i == 0 || plan.trials[i].fabric != plan.trials[i - 1].fabric ||
                          plan.trials[i].place.mounting != plan.trials[i - 1].place.mounting
                      ? 1
                      : 0;
  const PeopleForecast people = people_forecast(plan);
  out.people_s = people.people_s;
  out.prompts = people.prompts;
  out.bytes = static_cast<std::uint64_t>(total_recorded_s * bytes_per_second(plan.limits));
  out.envelope = compute_envelope(plan);
  out.fixed = plan.limits.geometry.fixed;
  for (const Axis axis : all_axes) {
    const Range& travel = plan.limits.geometry.travel[index(axis)];
    const Range& used = out.envelope[index(axis)];
    out.margin[index(axis)] = std::min(used.min - travel.min, travel.max - used.max);
  }
  out.force_n = force_range(plan);
  return out;
}

Plan part_on(Plan plan, std::size_t fabric) {
  std::erase_if(plan.trials, [&](const TrialSpec& trial) { return trial.fabric != fabric; });
  for (std::size_t i = 0; i < plan.trials.size(); ++i) plan.trials[i].index = i;
  plan.handover.reset();
  plan.forecast = forecast(plan);
  return plan;
}

}  // namespace weft::recipes
