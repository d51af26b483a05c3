#include "sim/devices/bench_plant.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace weft::sim {

BenchPlant::BenchPlant(const BenchPlantParams& params, std::uint64_t seed)
    : geometry_(params.geometry),
      stages_(params.stages.begin(), params.stages.end()),
      plant_(params.plant, seed),
      patch_(bare_plate(params.plant.cover)),
      listens_(params.plant.level == Level::modal) {
  finished_.counts = plant_.pad_counts();
  plant_.mount(patch_, pose({}));
}

TimePoint BenchPlant::frame_start(std::uint64_t frame) {
  return TimePoint(Duration(static_cast<std::int64_t>(frame) * pad_timing::frame_ns));
}

std::uint64_t BenchPlant::frame_at_or_after(TimePoint t) {
  const std::int64_t ns = std::max<std::int64_t>(ns_of(t), 0);
  return static_cast<std::uint64_t>((ns + pad_timing::frame_ns - 1) / pad_timing::frame_ns);
}

Pose BenchPlant::pose(TimePoint t) {
  const auto at = [&](AxisId axis) { return stages_[index(axis)].carriage(t); };
  const double ry = at(AxisId::ry), arm = geometry_.probe_arm_m;
  if (ry != turned_.ry_rad) turned_ = {ry, std::sin(ry), std::cos(ry)};
  return {.x_m = at(AxisId::x) - geometry_.origin_x_m + arm * turned_.sine,
          .y_m = at(AxisId::y) - geometry_.origin_y_m,
          .z_m = at(AxisId::z) - arm * (1 - turned_.cosine),
          .rx_rad = at(AxisId::rx),
          .ry_rad = ry};
}

void BenchPlant::step_grid() {
  const TimePoint t = next_.time();
  const Pose there = pose(t);
  plant_.advance(there, to_seconds(t - plant_time_));
  if (motion_ && motion_->poses.size() < BenchMotion::most_poses) motion_->poses.push_back(there);
  for (Stage& stage : stages_) stage.settle(t);
  plant_time_ = t;
  if (next_.ends_frame())
    finished_ = {next_.frame, plant_.pad_counts()};
  else
    plant_.convert(next_.stage, next_.frame);
  next_.advance();
}

void BenchPlant::advance_to(TimePoint now) {
  while (next_.time() <= now) step_grid();
}

void BenchPlant::mount(const Patch& patch, TimePoint now, bool same_place) {
  advance_to(now);
  const Pose there = pose(now);
  if (listens_) drain_vibration(there, now);
  std::optional<PlantMemory> memory;
  if (patch.mounted != 0 && patch.mounted == patch_.mounted) {
    memory = plant_.memory();
    if (!same_place) {
      memory->contact = {};
      memory->dose_pa_m = 0;
    }
  }
  plant_.mount(patch, there, now, memory ? &*memory : nullptr);
  patch_ = patch;
  ++mounts_;
  plant_time_ = std::max(plant_time_, now);
  motion_.reset();
  if (record_motion_) motion_ = BenchMotion{patch, memory, there, plant_time_, next_, {}};
}

/// A patch is removed between two points of the grid while the sensors continue: until then they
/// measure vibrations on the old patch.
void BenchPlant::drain_vibration(const Pose& there, TimePoint now) {
  plant_.advance(there, std::max(0.0, to_seconds(now - plant_time_)));
  gather_vibration();
}

void BenchPlant::gather_vibration() {
  VibrationReadings last = plant_.extract_vibration();
  std::ranges::move(last.acceleration, std::back_inserter(gathered_.acceleration));
  std::ranges::move(last.sound, std::back_inserter(gathered_.sound));
}

VibrationReadings BenchPlant::extract_vibration(TimePoint now) {
  advance_to(now);
  gather_vibration();
  return std::exchange(gathered_, {});
}

Stage& BenchPlant::stage(AxisId axis, TimePoint now) {
  advance_to(now);
  return stages_[index(axis)];
}

ContactState BenchPlant::contact(TimePoint now) {
  advance_to(now);
  return plant_.peek(pose(now), std::max(0.0, to_seconds(now - plant_time_)));
}

const PadFrame& BenchPlant::frame(TimePoint now) {
  advance_to(now);
  return finished_;
}

}  // namespace weft::sim
