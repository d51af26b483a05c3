#include "sim/plant/modal/vibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace weft::sim {

namespace {

constexpr double ns_per_s = 1e9;
// Damping ratios of the two resonances of a fourth-order Butterworth low-pass.
constexpr std::array butterworth{0.9238795325112867, 0.3826834323650898};

bool inside(double value, double low, double high) {
  return value >= low && value <= high;  // NaN is not
}

Status check(const ConverterParams& params, std::int64_t step_ns) {
  const auto refuse = [](std::string_view what, std::string expected, double value) {
    return fail(Errc::range, "no converter samples like this", std::string(what),
                std::move(expected), std::to_string(value));
  };
  if (params.period_ns < step_ns || params.period_ns > 3'600'000'000'000 ||
      params.period_ns % step_ns != 0)
    return refuse("period_ns", "a multiple of " + std::to_string(step_ns) + ", up to an hour",
                  static_cast<double>(params.period_ns));
  const double nyquist_hz = 0.5 * ns_per_s / static_cast<double>(step_ns);
  if (params.bandwidth_hz != 0 && !inside(params.bandwidth_hz, 1e-3, nyquist_hz))
    return refuse("bandwidth_hz", "0 or 0.001 to " + std::to_string(nyquist_hz),
                  params.bandwidth_hz);
  if (!inside(params.noise, 0, 1e6)) return refuse("noise", "0 to 1e6", params.noise);
  if (!inside(params.range, 1e-9, 1e9)) return refuse("range", "1e-9 to 1e9", params.range);
  if (params.quantum != 0 && !inside(params.quantum, params.range * 1e-12, params.range))
    return refuse("quantum", "0 or 1e-12 to 1 of the range", params.quantum);
  return {};
}

double rate_hz(std::int64_t step_ns) {
  return ns_per_s / static_cast<double>(step_ns);
}

}  // namespace

Result<LowPass> LowPass::make(double bandwidth_hz, double step_s) {
  LowPass made;
  const double angular = 2 * std::numbers::pi * bandwidth_hz;
  for (std::size_t i = 0; i < butterworth.size(); ++i) {
    const auto step =
        OscillatorStep::make(Oscillator::resonance(1, angular, butterworth[i]), step_s);
    if (!step) return pass(step.error());
    made.sections_[i] = Section{*step, angular * angular, {}, 0};
  }
  return made;
}

double LowPass::advance(double value) {
  for (auto& section : sections_) {
    const double force = section->square * value;
    section->state = section->step.advance(section->state, section->last, force);
    section->last = force;
    value = section->state.x_m;
  }
  return value;
}

Result<Converter> Converter::make(const ConverterParams& params, std::int64_t step_ns,
                                  std::uint64_t seed) {
  if (auto ok = check(params, step_ns); !ok) return pass(ok.error());
  Converter made(params, params.period_ns / step_ns, seed);
  made.left_ = made.steps_;
  if (params.bandwidth_hz == 0) return made;
  auto low_pass = LowPass::make(params.bandwidth_hz, static_cast<double>(step_ns) / ns_per_s);
  if (!low_pass) return pass(low_pass.error(), "low-pass");
  made.low_pass_ = *low_pass;
  return made;
}

std::optional<double> Converter::advance(double value, double offset) {
  const double filtered = (low_pass_ ? low_pass_->advance(value) : value) + offset;
  if (--left_ > 0) return {};
  left_ = steps_;
  const double noisy = filtered + (params_.noise > 0 ? params_.noise * noise_.gaussian() : 0);
  const double held = std::clamp(noisy, -params_.range, params_.range);
  if (!(params_.quantum > 0)) return held;
  const double most = std::floor(params_.range / params_.quantum);
  return params_.quantum * std::clamp(std::round(held / params_.quantum), -most, most);
}

Result<Vibration::Probe> Vibration::probe(const AccelerometerParams& params, std::int64_t step_ns,
                                          std::uint64_t seed) {
  for (const double g : params.gravity_mps2)
    if (!inside(g, -1e4, 1e4))
      return fail(Errc::range, "no such gravity", "gravity_mps2", "-1e4 to 1e4", std::to_string(g));
  const auto modes = arm_modes(params.arm, rate_hz(step_ns));
  if (!modes) return pass(modes.error());
  auto bank = ModalBank::make(*modes, 3, rate_hz(step_ns));
  if (!bank) return pass(bank.error());
  Probe probe{std::move(*bank), params.gravity_mps2, {}};
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    auto converter = Converter::make(params.converter, step_ns, mix(seed, axis));
    if (!converter) return pass(converter.error());
    probe.axes.push_back(std::move(*converter));
  }
  return probe;
}

Result<Vibration::Sound> Vibration::sound(const MicrophoneParams& params, std::int64_t step_ns,
                                          std::uint64_t seed) {
  const auto modes = plate_modes(params.plate, rate_hz(step_ns));
  if (!modes) return pass(modes.error());
  auto bank = ModalBank::make(*modes, 1, rate_hz(step_ns));
  if (!bank) return pass(bank.error());
  auto converter = Converter::make(params.converter, step_ns, seed);
  if (!converter) return pass(converter.error());
  return Sound{std::move(*bank), std::move(*converter)};
}

Result<Vibration> Vibration::make(const VibrationParams& params, const HeightField& field,
                                  std::uint64_t seed) {
  if (params.step_ns < 1000 || params.step_ns > 100'000'000)
    return fail(Errc::range, "no vibration is stepped like this", "step_ns", "1000 to 100000000",
                std::to_string(params.step_ns));
  auto rubbing = Rubbing::make(params.rubbing, field, mix(seed, "rubbing"));
  if (!rubbing) return pass(rubbing.error(), "rubbing");
  Vibration made(params.step_ns, std::move(*rubbing));
  if (params.accelerometer) {
    auto probe = Vibration::probe(*params.accelerometer, params.step_ns, mix(seed, "probe"));
    if (!probe) return pass(probe.error(), "accelerometer");
    made.probe_ = std::move(*probe);
  }
  if (params.microphone) {
    auto sound = Vibration::sound(*params.microphone, params.step_ns, mix(seed, "microphone"));
    if (!sound) return pass(sound.error(), "microphone");
    made.sound_ = std::move(*sound);
  }
  return made;
}

VibrationSample Vibration::advance(const SlidingContact& at_end) {
  VibrationSample sample;
  if (!probe_ && !sound_) return sample;
  const Force on_plate = rubbing_.advance(at_end);
  if (probe_) {
    const Force on_probe{-on_plate[0], -on_plate[1], -on_plate[2]};
    std::array<double, 3> a{};
    probe_->bank.advance(std::span(&on_probe, 1), a);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto reading = probe_->axes[axis].advance(a[axis], probe_->gravity_mps2[axis]);
      if (!reading) continue;
      if (axis == 0) sample.acceleration_mps2.emplace();
      (*sample.acceleration_mps2)[axis] = *reading;
    }
  }
  if (sound_) {
    double pressure = 0;
    sound_->bank.advance(std::span(&on_plate, 1), std::span(&pressure, 1));
    sample.sound_pa = sound_->converter.advance(pressure);
  }
  return sample;
}

}  // namespace weft::sim
