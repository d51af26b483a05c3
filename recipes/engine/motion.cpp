#include "recipes/engine/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "recipes/control/servo.hpp"

namespace weft::recipes {
namespace {

/// Uncertainty of the plate's height in the rig file [m].
constexpr double plate_height_tolerance_m = 1e-3;

std::string format_newtons(double force_n) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f N", force_n);
  return text.data();
}

Vec2 sum(Vec2 a, Vec2 b) {
  return {a.x_m + b.x_m, a.y_m + b.y_m};
}

}  // namespace

PathLeg path_leg(const Exploration& exploration, std::size_t leg, Vec2 offset_m) {
  const std::vector<Vec2>& path = exploration.path_m();
  const Vec2 start = sum(exploration.start_m, offset_m);
  const Vec2 from = sum(start, leg == 0 ? Vec2{} : path[leg - 1]);
  const Vec2 to = sum(start, path[leg]);
  return {from, to, std::hypot(to.x_m - from.x_m, to.y_m - from.y_m)};
}

Result<Joints> over(const RigLimits& limits, Vec2 point_m, double clearance_m) {
  return inverse(limits.geometry, {point_m, clearance_m, limits.level.rx_rad, limits.level.ry_rad});
}

Vec2 start_of(const Plan& plan, const TrialSpec& trial) {
  return sum(plan.explorations[trial.exploration].start_m, trial.place.offset_m);
}

Result<Joints> above_start(const Plan& plan, const TrialSpec& trial) {
  return over(plan.limits, start_of(plan, trial), plan.limits.clearance_m);
}

std::vector<AxisMove> transfer(const Plan& plan, const Joints& joints) {
  std::vector<AxisMove> moves;
  for (const Axis axis : all_axes) {
    if (axis == Axis::z || plan.limits.geometry.is_fixed(axis)) continue;
    const double speed =
        is_linear(axis) ? plan.approach.transfer_speed_mps : plan.limits.max_tilt_speed_radps;
    moves.push_back({axis, joints[axis], speed});
  }
  return moves;
}

namespace {

/// Positions of the x and y stages over a point of the fabric.
Result<Vec2> stages_over(const RigLimits& limits, Vec2 point_m) {
  if (!limits.levelled()) return sum(point_m, limits.geometry.origin_m);
  const Result<Joints> joints = over(limits, point_m, limits.clearance_m);
  if (!joints) return pass(joints.error());
  return Vec2{(*joints)[Axis::x], (*joints)[Axis::y]};
}

}  // namespace

Result<std::vector<AxisMove>> leg_moves(const Plan& plan, const PathLeg& leg, double speed_mps) {
  const Result<Vec2> target = stages_over(plan.limits, leg.to_m);
  if (!target) return pass(target.error());
  const double dx = leg.to_m.x_m - leg.from_m.x_m;
  const double dy = leg.to_m.y_m - leg.from_m.y_m;
  std::vector<AxisMove> moves;
  if (dx != 0) moves.push_back({Axis::x, target->x_m, speed_mps * std::abs(dx) / leg.length_m});
  if (dy != 0) moves.push_back({Axis::y, target->y_m, speed_mps * std::abs(dy) / leg.length_m});
  return moves;
}

double lowest_z_m(const RigLimits& limits) {
  return std::min(limits.geometry.surface_z_m + plate_height_tolerance_m + limits.level_rise_m(),
                  limits.geometry.travel[index(Axis::z)].max);
}

double driven_speed(const RigLimits& limits, double speed_mps) {
  return reached_speed(speed_mps, limits.max_acceleration_mps2, order_age(limits.cycle_hz));
}

double touch_speed_mps(const Plan& plan) {
  constexpr double most_run_on_m = 0.1e-3, frames = 2;
  constexpr double stop_s = 0.15;  // from a guard's trip to rest
  const RigLimits& limits = plan.limits;
  const double blind_s = std::max(limits.frozen_taxels_s, limits.most_taxel_age_s()) + stop_s;
  return std::min({plan.approach.speed_mps, most_run_on_m * limits.slowest_taxel_rate_hz() / frames,
                   limits.most_press_depth_m / blind_s});
}

double move_timeout_s(double expected_s) {
  constexpr double grace_s = 5;  // for links and confirmations
  return 2 * expected_s + grace_s;
}

double full_travel_s(const RigLimits& limits, Axis axis, double speed_mps) {
  const double way = limits.geometry.travel[index(axis)].width();
  return is_linear(axis) ? move_duration_s(way, speed_mps, limits.max_acceleration_mps2)
                         : way / limits.max_tilt_speed_radps;
}

double retreat_timeout_s(const Plan& plan) {
  return move_timeout_s(full_travel_s(plan.limits, Axis::z, plan.approach.transfer_speed_mps));
}

Error step_timed_out(std::string place, const std::optional<Error>& awaited) {
  if (awaited) return Error(*awaited).in(place);
  return {.code = Errc::timeout,
          .where = std::move(place),
          .what = "step timed out",
          .expected = "an answer before the timer",
          .hint = "Check the log of the devices involved"};
}

Error still_bad(std::string place, std::uint32_t takes, const Error& last) {
  return {.code = Errc::measurement,
          .where = std::move(place) + (last.where.empty() ? "" : ", " + last.where),
          .what = "record rejected in all " + std::to_string(takes) + " attempts: " + last.what,
          .expected = last.expected,
          .got = last.got,
          .hint = last.hint};
}

Error nothing_bears(std::string place) {
  return {.code = Errc::measurement,
          .where = std::move(place),
          .what = "no contact at the lowest height of the probe",
          .expected = "contact above the plate",
          .got = "none",
          .hint =
              "Check that the fabric is mounted, plate.surface_z_mm, and the sign of the force "
              "sensor (without one, probe.touch_counts)"};
}

Error force_not_reached(std::string place, double wanted_n) {
  return {.code = Errc::measurement,
          .where = std::move(place),
          .what = "force not reached at the end of the travel of z",
          .expected = "about " + format_newtons(wanted_n),
          .hint = "Check the force sensor, the mount of the probe and its mass (probe.mass_kg)"};
}

Error not_at_rest(std::string place, Phase phase, double mean_n, double weight_n) {
  const bool ended = phase == Phase::end;
  return {.code = Errc::measurement,
          .where = std::move(place),
          .what = std::string("force in phase ") + (ended ? "E" : "S") +
                  " differs from the weight of the probe",
          .expected = format_newtons(weight_n),
          .got = format_newtons(mean_n),
          .hint =
              "Check probe.slack_mm, probe.rest_travel_mm and probe.mass_kg; the mount may be "
              "outside its slack"};
}

Error rest_out_of_travel(std::string place, double rest_z_m) {
  return {.code = Errc::range,
          .where = std::move(place),
          .what = "rest position outside the travel of z",
          .expected = "within the travel of the stage",
          .got = std::to_string(rest_z_m) + " m",
          .hint = "Check plate.surface_z_mm and probe.rest_travel_mm"};
}

bool is_empty(const Finally& finally) {
  return finally.on_success.empty() && finally.on_stop.empty() && finally.on_fault.empty();
}

const std::vector<LastStep>& steps_after(const Finally& finally, Outcome campaign) {
  if (campaign == Outcome::complete) return finally.on_success;
  return campaign == Outcome::failed ? finally.on_fault : finally.on_stop;
}

std::vector<AxisMove> list_moves(const Plan& plan, const LastStep& step) {
  const auto* const park = std::get_if<ParkStep>(&step);
  if (park == nullptr) return {};
  const double speed = plan.approach.transfer_speed_mps;
  std::vector<AxisMove> moves{{Axis::x, park->x_m, speed}};
  if (!plan.limits.geometry.is_fixed(Axis::y)) moves.push_back({Axis::y, park->y_m, speed});
  return moves;
}

double duration_s(const Plan& plan, const LastStep& step) {
  if (const auto* const wait = std::get_if<WaitStep>(&step)) return wait->duration_s;
  const double speed = plan.approach.transfer_speed_mps;
  return move_timeout_s(std::max(full_travel_s(plan.limits, Axis::x, speed),
                                 full_travel_s(plan.limits, Axis::y, speed)));
}

std::vector<Diagnostic> warnings_about_budget(const Finally& finally) {
  std::vector<Diagnostic> out;
  const auto check_steps = [&](const char* cause, const std::vector<LastStep>& steps) {
    double waits_s = 0;
    for (const LastStep& step : steps)
      if (const auto* const wait = std::get_if<WaitStep>(&step)) waits_s += wait->duration_s;
    if (waits_s >= finally.budget_s)
      out.push_back({child("/finally", cause),
                     "waits use up the budget, so the other final steps are skipped",
                     "less than " + std::to_string(finally.budget_s) + " s",
                     std::to_string(waits_s) + " s", "Raise budget_s or shorten the waits"});
  };
  check_steps("on_success", finally.on_success);
  check_steps("on_stop", finally.on_stop);
  check_steps("on_fault", finally.on_fault);
  return out;
}

Error budget_used_up(std::string place, double budget_s) {
  return {.code = Errc::timeout,
          .where = std::move(place),
          .what = "final steps exceeded their budget",
          .expected = "at most " + std::to_string(budget_s) + " s",
          .hint = "Raise finally.budget_s; the probe is at the clear height"};
}

}  // namespace weft::recipes
