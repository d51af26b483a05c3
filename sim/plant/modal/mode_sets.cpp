#include "sim/plant/modal/mode_sets.hpp"

#include <cmath>
#include <numbers>
#include <string>

namespace weft::sim {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double air_kg_m3 = 1.204;  // 20 degrees Celsius, ISO 9613-1
constexpr double highest_share = 0.45;
constexpr std::size_t most_modes = 64;
// (beta_n L)^2 of a clamped-free beam over its first.
constexpr std::array overtones{1.0, 6.26689, 17.54748, 34.38606};

Status within(std::string_view what, double value, double low, double high) {
  if (value >= low && value <= high) return {};  // NaN is not
  return fail({.code = Errc::range,
               .where = std::string(what),
               .what = "no structure is made like this",
               .expected = std::to_string(low) + " to " + std::to_string(high),
               .got = std::to_string(value)});
}

struct Bounds {
  std::string_view what;
  double value, low, high;
};
Status within(std::initializer_list<Bounds> all) {
  for (const Bounds& b : all)
    if (auto ok = within(b.what, b.value, b.low, b.high); !ok) return ok;
  return {};
}

/// Shape of a plate's mode at the place of contact.
double shape(const PlateParams& p, int m, int n) {
  return std::sin(m * pi * p.contact_x) * std::sin(n * pi * p.contact_y);
}

/// Pressure at the microphone per m/s2 of the mode: its volume acceleration over a half sphere.
double radiation(const PlateParams& p, int m, int n) {
  const double area_m2 = 4 * p.length_m * p.width_m / (m * n * pi * pi);
  return air_kg_m3 * area_m2 / (2 * pi * p.microphone_m);
}

}  // namespace

double plate_frequency_hz(const PlateParams& p, int m, int n) {
  const double bending = p.modulus_pa * p.thickness_m * p.thickness_m /
                         (12 * (1 - p.poisson_ratio * p.poisson_ratio) * p.density_kg_m3);
  const double along = m / p.length_m, across = n / p.width_m;
  return pi / 2 * (along * along + across * across) * std::sqrt(bending);
}

Result<std::vector<Mode>> arm_modes(const ArmParams& params, double rate_hz) {
  if (auto ok = within({{"rate_hz", rate_hz, 1, 1e7},
                        {"mass_kg", params.mass_kg, 1e-4, 1e3},
                        {"fundamental_hz[0]", params.fundamental_hz[0], 1e-3, 1e6},
                        {"fundamental_hz[1]", params.fundamental_hz[1], 1e-3, 1e6},
                        {"fundamental_hz[2]", params.fundamental_hz[2], 1e-3, 1e6},
                        {"damping_ratio", params.damping_ratio, 0, 0.9},
                        {"cross_axis", params.cross_axis, 0, 1}});
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
                 .what = "the arm has no mode in the band",
                 .expected = "below " + std::to_string(highest_share * rate_hz),
                 .hint = "Raise the rate"});
  return modes;
}

Result<std::vector<Mode>> plate_modes(const PlateParams& params, double rate_hz) {
  if (auto ok = within({{"rate_hz", rate_hz, 1, 1e7},
                        {"length_m", params.length_m, 1e-3, 10},
                        {"width_m", params.width_m, 1e-3, 10},
                        {"thickness_m", params.thickness_m, 1e-5, 0.1},
                        {"modulus_pa", params.modulus_pa, 1e6, 1e13},
                        {"density_kg_m3", params.density_kg_m3, 1, 1e5},
                        {"poisson_ratio", params.poisson_ratio, 0, 0.5},
                        {"damping_ratio", params.damping_ratio, 0, 0.9},
                        {"contact_x", params.contact_x, 0, 1},
                        {"contact_y", params.contact_y, 0, 1},
                        {"microphone_m", params.microphone_m, 1e-3, 100}});
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
                     .what = "the plate has too many modes in the band",
                     .expected = "up to 64",
                     .hint = "Make it stiffer or smaller, or lower the rate"});
      modes.push_back({plate_frequency_hz(params, m, n),
                       params.damping_ratio,
                       {0, 0, shape(params, m, n) / modal_mass},
                       {radiation(params, m, n), 0, 0}});
    }
  if (modes.empty())
    return fail({.code = Errc::range,
                 .where = "plate",
                 .what = "the plate has no mode in the band",
                 .expected = "a mode below " + std::to_string(highest) + " Hz",
                 .got = std::to_string(plate_frequency_hz(params, 1, 1)),
                 .hint = "Raise the rate"});
  return modes;
}

}  // namespace weft::sim
