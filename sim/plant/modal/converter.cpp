#include "sim/plant/modal/converter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "sim/plant/bounds.hpp"

namespace weft::sim {

namespace {

constexpr double ns_per_s = 1e9;
// Damping ratios of the two resonances of a fourth-order Butterworth low-pass.
constexpr std::array butterworth{0.9238795325112867, 0.3826834323650898};

Status check(const ConverterParams& params, std::int64_t step_ns) {
  const auto refuse = [](std::string_view what, std::string expected, double value) {
    return fail({.code = Errc::range,
                 .where = std::string(what),
                 .what = "no converter samples like this",
                 .expected = std::move(expected),
                 .got = std::to_string(value)});
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
                                  std::uint64_t seed, std::int64_t first_step) {
  if (auto ok = check(params, step_ns); !ok) return pass(ok.error());
  Converter made(params, params.period_ns / step_ns, seed);
  made.left_ = made.steps_ - first_step % made.steps_;
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

}  // namespace weft::sim
