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
  constexpr std::string_view what = "converter parameter out of range";
  if (params.period_ns < step_ns || params.period_ns > 3'600'000'000'000 ||
      params.period_ns % step_ns != 0)
    return fail({.code = Errc::range,
                 .where = "period_ns",
                 .what = std::string(what),
                 .expected = "a multiple of " + std::to_string(step_ns) + ", at most 3600000000000",
                 .got = std::to_string(static_cast<double>(params.period_ns))});
  const double nyquist_hz = 0.5 * ns_per_s / static_cast<double>(step_ns);
  if (params.bandwidth_hz != 0)
    if (auto ok = check_limits({{"bandwidth_hz", what, params.bandwidth_hz, 1e-3, nyquist_hz,
                                 "0 or 0.001 to " + std::to_string(nyquist_hz)}});
        !ok)
      return ok;
  if (auto ok = check_limits({{"noise", what, params.noise, 0, 1e6, "0 to 1e6"},
                              {"range", what, params.range, 1e-9, 1e9, "1e-9 to 1e9"}});
      !ok || params.quantum == 0)
    return ok;
  return check_limits({{"quantum", what, params.quantum, params.range * 1e-12, params.range,
                        "0 or 1e-12 to 1 of the range"}});
}

using Wide = long double;  // three more digits if it is wider than double

/// In units of the step, with q = c h/(2 m) and kappa = k h^2/m, the impulse response is
///   G'' + 2 q G' + kappa G = 0, G(0) = 0, G'(0) = 1.
/// All coefficients follow from its values at the end of the step and two integrals over it.
struct Response {
  Wide value;   // G(1)
  Wide slope;   // G'(1)
  Wide rest;    // G'(1) + 2 q G(1), the free motion from x = 1 at rest
  Wide area;    // integral of G(u)
  Wide moment;  // integral of (1 - u) G(u)
};

/// For small q and kappa: power series, no cancellation.
Response by_series(Wide q, Wide kappa) {
  Response r{0, 0, 0, 0, 0};
  Wide before = 0, term = 1;  // coefficients n - 1 and n
  for (int n = 1; n < 40; ++n) {
    const Wide i = n;
    r.value += term;
    r.slope += i * term;
    r.area += term / (i + 1);
    r.moment += term / ((i + 1) * (i + 2));
    const Wide next = -(2 * q * i * term + kappa * before) / (i * (i + 1));
    before = term;
    term = next;
  }
  r.rest = r.slope + 2 * q * r.value;
  return r;
}

/// sin(d)/d for d^2 > 0, sinh(s)/s for d^2 = -s^2 < 0.
Wide sinc_of_square(Wide d2) {
  if (std::abs(d2) < 1e-3L) return 1 - d2 / 6 * (1 - d2 / 20 * (1 - d2 / 42 * (1 - d2 / 72)));
  const Wide d = std::sqrt(std::abs(d2));
  return d2 > 0 ? std::sin(d) / d : std::sinh(d) / d;
}

/// Oscillating or close to critical: kappa is not small, and the differential equation gives the
/// integrals.
Response by_rotation(Wide q, Wide kappa) {
  const Wide d2 = kappa - q * q;
  const Wide decay = std::exp(-q);
  const Wide cosine = d2 > 0 ? std::cos(std::sqrt(d2)) : std::cosh(std::sqrt(-d2));
  Response r{};
  r.value = decay * sinc_of_square(d2);
  r.slope = decay * cosine - q * r.value;
  r.rest = decay * cosine + q * r.value;
  r.area = (1 - r.rest) / kappa;
  r.moment = (1 - r.value - 2 * q * r.area) / kappa;
  return r;
}

/// (e^r - 1)/r and (e^r - 1 - r)/r^2 for r <= 0.
Wide mean_of_exp(Wide r) {
  return r == 0 ? 1 : std::expm1(r) / r;
}
Wide ramp_of_exp(Wide r) {
  if (r < -0.5L) return (mean_of_exp(r) - 1) / r;
  Wide sum = 0, term = 0.5L;
  for (int n = 3; n < 25; ++n) {
    sum += term;
    term *= r / n;
  }
  return sum;
}

/// Two well-separated decays; one may be very slow, or zero without a spring.
Response by_decays(Wide q, Wide kappa) {
  const Wide s = std::sqrt(q * q - kappa);
  const Wide slow = -kappa / (q + s), fast = -(q + s);
  const Wide slow_end = std::exp(slow), fast_end = std::exp(fast);
  return {(slow_end - fast_end) / (2 * s), (slow * slow_end - fast * fast_end) / (2 * s),
          (slow * fast_end - fast * slow_end) / (2 * s),
          (mean_of_exp(slow) - mean_of_exp(fast)) / (2 * s),
          (ramp_of_exp(slow) - ramp_of_exp(fast)) / (2 * s)};
}

Response response(Wide q, Wide kappa) {
  if (q < 0.5L && kappa < 1) return by_series(q, kappa);
  return q * q - kappa > q * q / 4 ? by_decays(q, kappa) : by_rotation(q, kappa);
}

Status check(const Oscillator& oscillator, double step_s) {
  constexpr std::string_view what = "oscillator parameter out of range";
  const Oscillator& o = oscillator;
  if (auto ok = check_limits({{"mass_kg", what, o.mass_kg, 1e-12, 1e9, "1e-12 to 1e9"},
                              {"damping_n_s_m", what, o.damping_n_s_m, 0, 1e12, "0 to 1e12"},
                              {"stiffness_n_m", what, o.stiffness_n_m, 0, 1e15, "0 to 1e15"},
                              {"step_s", what, step_s, 0, 1e6, "0 to 1e6"}});
      !ok)
    return ok;
  const double rate = std::max(o.damping_n_s_m / o.mass_kg, std::sqrt(o.stiffness_n_m / o.mass_kg));
  return check_limits({{"rate times step", what, rate * step_s, 0, 1e9, "at most 1e9"}});
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

Result<OscillatorStep> OscillatorStep::make(const Oscillator& oscillator, double step_s) {
  if (auto ok = check(oscillator, step_s); !ok) return pass(ok.error());
  const Wide h = step_s, m = oscillator.mass_kg;
  const Wide q = h * oscillator.damping_n_s_m / (2 * m);
  const Wide kappa = h * h * oscillator.stiffness_n_m / m;
  const Response r = response(q, kappa);
  const auto row = [](Wide x, Wide v, Wide begin, Wide end) {
    return Row{static_cast<double>(x), static_cast<double>(v), static_cast<double>(begin),
               static_cast<double>(end)};
  };
  OscillatorStep step;
  step.x_ = row(r.rest, h * r.value, h * h / m * (r.area - r.moment), h * h / m * r.moment);
  const Wide back = -h * oscillator.stiffness_n_m / m * r.value;
  step.v_ = row(back, r.slope, h / m * (r.value - r.area), h / m * r.area);
  return step;
}

}  // namespace weft::sim
