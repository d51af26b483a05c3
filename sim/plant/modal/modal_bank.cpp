#include "sim/plant/modal/modal_bank.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "sim/plant/bounds.hpp"
#include "sim/plant/lanes.hpp"

namespace weft::sim {
namespace {

using simd::Lanes;
constexpr std::size_t lanes = simd::width;

constexpr double largest_force_n = 1e9;
constexpr double smallest_force_n = 1e-100;
// Added to every mode's force [m/s2]: a silent bank then decays to this instead of denormals,
// without a change of the processor's rounding modes. It is negligible.
constexpr double least_force = 1e-30;

constexpr std::size_t per_group(std::size_t channels) {
  return (2 + bank_inputs + 2 * channels) * lanes;
}

double limited(double force_n) {
  const double size = std::abs(force_n);
  if (!(size >= smallest_force_n)) return 0;  // NaN too
  return std::clamp(force_n, -largest_force_n, largest_force_n);
}

/// One sample: advances all modes and sums their contribution to each channel.
template <std::size_t channels>
WEFT_SIM_INLINE void advance_groups(const double* coefficients, double* state, std::size_t groups,
                                    const Force& force, double* out) {
  Lanes sums[channels]{};
  for (std::size_t g = 0; g < groups; ++g) {
    const double* c = coefficients + g * per_group(channels);
    double* w = state + g * 2 * lanes;
    const Lanes turn_re = simd::load(c), turn_im = simd::load(c + lanes);
    const Lanes driven = simd::load(c + 2 * lanes) * force[0] +
                         simd::load(c + 3 * lanes) * force[1] +
                         simd::load(c + 4 * lanes) * force[2] + least_force;
    const Lanes re = simd::load(w), im = simd::load(w + lanes);
    const Lanes next_re = turn_re * re - turn_im * im + driven;
    const Lanes next_im = turn_im * re + turn_re * im;
    simd::store(w, next_re);
    simd::store(w + lanes, next_im);
    const double* weight = c + (2 + bank_inputs) * lanes;
    for (std::size_t k = 0; k < channels; ++k)
      sums[k] += simd::load(weight + 2 * k * lanes) * next_re +
                 simd::load(weight + (2 * k + 1) * lanes) * next_im;
  }
  for (std::size_t k = 0; k < channels; ++k) {
    const Lanes s = sums[k];
    out[k] = (s[0] + s[2]) + (s[1] + s[3]);
  }
}

WEFT_SIM_CLONES void advance_1(const double* c, double* w, std::size_t groups, const Force& force,
                               double* out) {
  advance_groups<1>(c, w, groups, force, out);
}
WEFT_SIM_CLONES void advance_2(const double* c, double* w, std::size_t groups, const Force& force,
                               double* out) {
  advance_groups<2>(c, w, groups, force, out);
}
WEFT_SIM_CLONES void advance_3(const double* c, double* w, std::size_t groups, const Force& force,
                               double* out) {
  advance_groups<3>(c, w, groups, force, out);
}

/// One step of a mode under a piecewise-linear force, with w scaled and rotated so that the weight
/// of the force is 1.
struct ExactMode {
  std::complex<long double> turn;     // e^{s h}
  std::complex<long double> reading;  // acceleration = Im(reading w) + direct f
  long double direct;
};

using Complex = std::complex<long double>;

/// (e^z - 1)/z and its successor (that - 1)/z: by series if the difference would cancel.
Complex mean_of_exp(Complex z) {
  Complex sum = 0, term = 1;
  if (std::abs(z) > 0.5L) return (std::exp(z) - 1.0L) / z;
  for (int n = 2; n < 25; ++n) sum += term, term *= z / static_cast<long double>(n);
  return sum;
}
Complex ramp_of_exp(Complex z) {
  Complex sum = 0, term = 0.5L;
  if (std::abs(z) > 0.5L) return (mean_of_exp(z) - 1.0L) / z;
  for (int n = 3; n < 25; ++n) sum += term, term *= z / static_cast<long double>(n);
  return sum;
}

ExactMode exact(const Mode& mode, double step_s) {
  const long double h = step_s;
  const long double natural = 2 * std::numbers::pi_v<long double> * mode.frequency_hz;
  const long double damped =
      natural * std::sqrt((1.0L - mode.damping_ratio) * (1.0L + mode.damping_ratio));
  const Complex s(-natural * mode.damping_ratio, damped);
  const Complex turn = std::exp(s * h);
  const Complex ramp = h * ramp_of_exp(s * h);          // weight of the force at the end
  const Complex begin = h * mean_of_exp(s * h) - ramp;  // weight of the force at the begin
  const Complex carried = begin / turn;                 // part kept in w for the next step
  const Complex entry = ramp + carried;
  return {turn, s * s * entry / damped, 1 - (s * s * carried).imag() / damped};
}

template <std::size_t n>
bool bounded(const std::array<double, n>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::abs(v) <= 1e9; });
}

Status check(const Mode& mode, double rate_hz) {
  if (!inside(mode.frequency_hz, 1e-6 * rate_hz, 0.49 * rate_hz))
    return fail({.code = Errc::range,
                 .where = "frequency_hz",
                 .what = "frequency of a mode out of range",
                 .expected = std::to_string(1e-6 * rate_hz) + " to " +
                             std::to_string(0.49 * rate_hz) + " Hz",
                 .got = std::to_string(mode.frequency_hz) + " Hz",
                 .hint = "Raise the rate or remove the mode"});
  if (auto ok = check_limits({{"damping_ratio", "damping ratio out of range", mode.damping_ratio, 0,
                               0.9, "0 to 0.9"}});
      !ok)
    return ok;
  if (!bounded(mode.drive_1_kg) || !bounded(mode.weight))
    return fail({.code = Errc::range,
                 .where = "drive_1_kg, weight",
                 .what = "drive or weight out of range",
                 .expected = "at most 1e9"});
  return {};
}

constexpr double pi = std::numbers::pi;
constexpr double air_kg_m3 = 1.204;  // 20 degrees Celsius, ISO 9613-1
constexpr double highest_share = 0.45;
constexpr std::size_t most_modes = 64;
// (beta_n L)^2 of a clamped-free beam over its first.
constexpr std::array overtones{1.0, 6.26689, 17.54748, 34.38606};

constexpr std::string_view no_structure = "parameter of the structure out of range";

/// Shape of a plate's mode at the point of contact.
double shape(const PlateParams& p, int m, int n) {
  return std::sin(m * pi * p.contact_x) * std::sin(n * pi * p.contact_y);
}

/// Pressure at the microphone per m/s2 of the mode: its volume acceleration over a half sphere.
double radiation(const PlateParams& p, int m, int n) {
  const double area_m2 = 4 * p.length_m * p.width_m / (m * n * pi * pi);
  return air_kg_m3 * area_m2 / (2 * pi * p.microphone_m);
}

}  // namespace

ModalBank::ModalBank(std::size_t modes, std::size_t channels)
    : channels_(channels),
      groups_((modes + lanes - 1) / lanes),
      coefficients_(groups_ * per_group(channels), 0.0),
      state_(groups_ * 2 * lanes, 0.0) {}

Result<ModalBank> ModalBank::make(std::span<const Mode> modes, std::size_t channels,
                                  double rate_hz) {
  if (auto ok = check_limits({{"modes", "number of modes out of range",
                               static_cast<double>(modes.size()), 1, 4096, "1 to 4096", true},
                              {"channels", "number of channels out of range",
                               static_cast<double>(channels), 1, bank_channels, "1 to 3", true},
                              {"rate_hz", "rate out of range", rate_hz, 1, 1e7, "1 to 1e7"}});
      !ok)
    return pass(ok.error());
  ModalBank bank(modes.size(), channels);
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (auto ok = check(modes[i], rate_hz); !ok)
      return pass(ok.error(), "mode " + std::to_string(i));
    bank.set(i, modes[i], 1 / rate_hz);
  }
  return bank;
}

void ModalBank::set(std::size_t index, const Mode& mode, double step_s) {
  const ExactMode m = exact(mode, step_s);
  double* c = coefficients_.data() + index / lanes * per_group(channels_) + index % lanes;
  c[0] = static_cast<double>(m.turn.real());
  c[lanes] = static_cast<double>(m.turn.imag());
  for (std::size_t i = 0; i < bank_inputs; ++i) c[(2 + i) * lanes] = mode.drive_1_kg[i];
  for (std::size_t k = 0; k < channels_; ++k) {
    double* weight = c + (2 + bank_inputs + 2 * k) * lanes;
    weight[0] = static_cast<double>(mode.weight[k] * m.reading.imag());
    weight[lanes] = static_cast<double>(mode.weight[k] * m.reading.real());
    for (std::size_t i = 0; i < bank_inputs; ++i)
      direct_[k][i] += static_cast<double>(mode.weight[k] * m.direct * mode.drive_1_kg[i]);
  }
}

void ModalBank::advance(std::span<const Force> force_n, std::span<double> out) {
  WEFT_ASSERT(out.size() == force_n.size() * channels_);
  const auto run = channels_ == 1 ? advance_1 : channels_ == 2 ? advance_2 : advance_3;
  for (std::size_t n = 0; n < force_n.size(); ++n) {
    const Force force{limited(force_n[n][0]), limited(force_n[n][1]), limited(force_n[n][2])};
    double* sample = out.data() + n * channels_;
    run(coefficients_.data(), state_.data(), groups_, force, sample);
    for (std::size_t k = 0; k < channels_; ++k)
      sample[k] += direct_[k][0] * force[0] + direct_[k][1] * force[1] + direct_[k][2] * force[2];
  }
}

double plate_frequency_hz(const PlateParams& p, int m, int n) {
  const double bending = p.modulus_pa * p.thickness_m * p.thickness_m /
                         (12 * (1 - p.poisson_ratio * p.poisson_ratio) * p.density_kg_m3);
  const double along = m / p.length_m, across = n / p.width_m;
  return pi / 2 * (along * along + across * across) * std::sqrt(bending);
}

Result<std::vector<Mode>> arm_modes(const ArmParams& params, double rate_hz) {
  if (auto ok =
          check_limits({{"rate_hz", no_structure, rate_hz, 1, 1e7},
                        {"mass_kg", no_structure, params.mass_kg, 1e-4, 1e3},
                        {"fundamental_hz[0]", no_structure, params.fundamental_hz[0], 1e-3, 1e6},
                        {"fundamental_hz[1]", no_structure, params.fundamental_hz[1], 1e-3, 1e6},
                        {"fundamental_hz[2]", no_structure, params.fundamental_hz[2], 1e-3, 1e6},
                        {"damping_ratio", no_structure, params.damping_ratio, 0, 0.9},
                        {"cross_axis", no_structure, params.cross_axis, 0, 1}});
      !ok)
    return pass(ok.error(), "arm");
  std::vector<Mode> modes;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double overtone : overtones) {
      const double frequency = params.fundamental_hz[axis] * overtone;
      if (frequency > highest_share * rate_hz) break;
      Mode mode{frequency, params.damping_ratio, {}, {}};
      mode.drive_1_kg[axis] = 4 / params.mass_kg;
      mode.weight.fill(params.cross_axis);
      mode.weight[axis] = 1;
      modes.push_back(mode);
    }
  if (modes.empty())
    return fail({.code = Errc::range,
                 .where = "arm fundamental_hz",
                 .what = "arm without a mode in the band",
                 .expected = "below " + std::to_string(highest_share * rate_hz) + " Hz",
                 .hint = "Raise the rate"});
  return modes;
}

Result<std::vector<Mode>> plate_modes(const PlateParams& params, double rate_hz) {
  if (auto ok = check_limits({{"rate_hz", no_structure, rate_hz, 1, 1e7},
                              {"length_m", no_structure, params.length_m, 1e-3, 10},
                              {"width_m", no_structure, params.width_m, 1e-3, 10},
                              {"thickness_m", no_structure, params.thickness_m, 1e-5, 0.1},
                              {"modulus_pa", no_structure, params.modulus_pa, 1e6, 1e13},
                              {"density_kg_m3", no_structure, params.density_kg_m3, 1, 1e5},
                              {"poisson_ratio", no_structure, params.poisson_ratio, 0, 0.5},
                              {"damping_ratio", no_structure, params.damping_ratio, 0, 0.9},
                              {"contact_x", no_structure, params.contact_x, 0, 1},
                              {"contact_y", no_structure, params.contact_y, 0, 1},
                              {"microphone_m", no_structure, params.microphone_m, 1e-3, 100}});
      !ok)
    return pass(ok.error(), "plate");
  const double highest = highest_share * rate_hz;
  const double modal_mass =
      params.density_kg_m3 * params.thickness_m * params.length_m * params.width_m / 4;
  std::vector<Mode> modes;
  for (int m = 1; plate_frequency_hz(params, m, 1) <= highest; m += 2)
    for (int n = 1; plate_frequency_hz(params, m, n) <= highest; n += 2) {
      if (modes.size() == most_modes)
        return fail({.code = Errc::range,
                     .where = "plate",
                     .what = "too many modes of the plate in the band",
                     .expected = "at most 64",
                     .hint = "Use a stiffer or smaller plate, or lower the rate"});
      modes.push_back({plate_frequency_hz(params, m, n),
                       params.damping_ratio,
                       {0, 0, shape(params, m, n) / modal_mass},
                       {radiation(params, m, n), 0, 0}});
    }
  if (modes.empty())
    return fail({.code = Errc::range,
                 .where = "plate",
                 .what = "plate without a mode in the band",
                 .expected = "a mode below " + std::to_string(highest) + " Hz",
                 .got = std::to_string(plate_frequency_hz(params, 1, 1)) + " Hz",
                 .hint = "Raise the rate"});
  return modes;
}

}  // namespace weft::sim
