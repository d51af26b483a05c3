#include "sim/devices/ft_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/plant/random.hpp"
#include "sim/plant/round.hpp"

namespace weft::sim {
namespace {

/// Clamped to -range .. range; NaN is no load and gives 0.
double held_to(double range, double value) {
  return std::isnan(value) ? 0 : std::min(std::max(value, -range), range);
}

}  // namespace

std::int32_t nearest_count(double counts) {
  constexpr double lowest = std::numeric_limits<std::int32_t>::min();
  constexpr double highest = std::numeric_limits<std::int32_t>::max();
  if (std::isnan(counts)) return 0;
  return static_cast<std::int32_t>(std::clamp(nearest_whole(counts), lowest, highest));
}

std::uint32_t conversion_at(TimePoint t) {
  constexpr std::int64_t rate_hz = 7000;
  const std::int64_t ns = ns_of(t);
  return static_cast<std::uint32_t>(ns / 1'000'000'000 * rate_hz +
                                    ns % 1'000'000'000 * rate_hz / 1'000'000'000);
}

FtSensor::FtSensor(const FtSensorParams& params, std::uint64_t seed)
    : params_(params),
      seed_(mix(seed, "force/torque noise")),
      noisy_(
          std::any_of(params.noise.begin(), params.noise.end(), [](double n) { return n > 0; })) {}

Wrench FtSensor::load(const ContactState& contact) const {
  const double fx = contact.friction_n[0], fy = contact.friction_n[1], fz = contact.normal_n;
  const double rx = contact.face_x_m() - params_.centre_x_m;
  const double ry = contact.face_y_m() - params_.centre_y_m;
  const double rz = -params_.height_m;  // above the sensor, z counts down
  const double weight_n = params_.plate_mass_kg * standard_gravity_mps2;
  const double lean_rad = contact.pose.rx_rad;  // mostly zero
  return {fx,
          fy - weight_n * (lean_rad == 0 ? lean_rad : std::sin(lean_rad)),
          fz + weight_n * (lean_rad == 0 ? 1 : std::cos(lean_rad)),
          ry * fz - rz * fy,
          rz * fx - rx * fz,
          rx * fy - ry * fx};
}

Wrench FtSensor::converted(const ContactState& contact, std::uint32_t sample, double fz_off_n,
                           bool& saturated) const {
  Wrench wrench = load(contact);
  wrench[2] += fz_off_n;
  Random random(mix(seed_, sample));
  for (std::size_t i = 0; i < wrench.size(); ++i) {
    const double noisy = noisy_ ? wrench[i] + params_.noise[i] * random.gaussian() : wrench[i];
    const double held = held_to(params_.range[i], noisy);
    saturated = saturated || held != noisy;
    const double quantum = params_.quantum[i];
    wrench[i] = quantum > 0 ? quantum * nearest_whole(held / quantum) : held;
  }
  return wrench;
}

FtReading FtSensor::read(const ContactState& contact, std::uint32_t sample, double fz_off_n) const {
  FtReading reading;
  const Wrench wrench = converted(contact, sample, fz_off_n, reading.saturated);
  for (std::size_t i = 0; i < wrench.size(); ++i) {
    const double scale = i < 3 ? params_.counts_per_n : params_.counts_per_nm;
    reading.counts[i] = nearest_count((wrench[i] - bias_[i]) * scale);
  }
  return reading;
}

std::array<std::int32_t, 6> FtSensor::bias_counts() const {
  std::array<std::int32_t, 6> counts{};
  for (std::size_t i = 0; i < counts.size(); ++i)
    counts[i] = nearest_count(bias_[i] * (i < 3 ? params_.counts_per_n : params_.counts_per_nm));
  return counts;
}

void FtSensor::set_bias(const std::array<std::int32_t, 6>& counts) {
  for (std::size_t i = 0; i < counts.size(); ++i)
    bias_[i] = counts[i] / (i < 3 ? params_.counts_per_n : params_.counts_per_nm);
}

void FtSensor::bias(const ContactState& contact, std::uint32_t sample, double fz_off_n) {
  bool saturated = false;
  bias_ = converted(contact, sample, fz_off_n, saturated);
}

double ForceEmulator::fz_off_n(TimePoint at) {
  double off_n = 0;
  if (const Fault* drift = active_fault(FaultKind::drift, at))
    off_n += drift->amount * to_seconds(at - drift->from);
  if (const Fault* jump = active_fault(FaultKind::bias_jump, at)) off_n += jump->amount;
  if (const Fault* noise = firing_fault(FaultKind::noise, at))
    off_n += noise->amount * fault_dice().gaussian();
  return off_n;
}

void ForceEmulator::hold_if_stuck(FtReading& reading, TimePoint at) {
  if (frozen(FaultKind::stuck_force, at, reading, stuck_)) reading = *stuck_;
}

double ForceEmulator::calibration_factor(TimePoint at) const {
  const Fault* changed = active_fault(FaultKind::calibration_change, at);
  return changed == nullptr ? 1 : changed->amount;
}

}  // namespace weft::sim
