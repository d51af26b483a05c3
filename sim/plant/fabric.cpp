#include "sim/plant/fabric.hpp"

#include <algorithm>

#include "sim/plant/bounds.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double steepest_surface = 6;  // std(h)/lambda above which e^{h/lambda} means nothing
constexpr double furthest_draw = 3;     // spreads are cut at three standard deviations

/// 1 + spread * N(0, 1), cut, never below 0.1.
double ratio(Random& random, double spread) {
  const double draw = std::clamp(random.gaussian(), -furthest_draw, furthest_draw);
  return std::max(0.1, 1 + spread * draw);
}

Relaxation relaxation_of(const MaterialParams& params, double eta) {
  Relaxation relaxation;
  for (std::size_t i = 0; i < Relaxation::terms; ++i) {
    relaxation.share[i] = params.relaxation_base[i] + params.relaxation_slope[i] * eta;
    relaxation.time_s[i] = params.relaxation_time_s[i];
  }
  return relaxation;
}

SurfaceSpec surface_of(const Fabric& fabric, const MaterialParams& params) {
  return {.warp_pitch_m = fabric.warp_per_m > 0 ? 1 / fabric.warp_per_m : 0,
          .weft_pitch_m = fabric.weft_per_m > 0 ? 1 / fabric.weft_per_m : 0,
          .height_rms_m = params.height_per_roughness * fabric.roughness_m,
          .structure = fabric.structure};
}

void draw_spread(Patch& patch, const TrialSpread& spread, Random random) {
  ContactMaterial& material = patch.material;
  material.law.lambda_m *= ratio(random, spread.lambda);
  material.law.pressure_pa *= ratio(random, spread.pressure);
  material.friction.coefficient *= ratio(random, spread.friction);
  material.thickness_m *= ratio(random, spread.thickness);
  patch.gain_scale = ratio(random, spread.gain);
  patch.tilt_x = spread.tilt * random.gaussian();
  patch.tilt_y = spread.tilt * random.gaussian();
  patch.skew_rad = spread.skew_rad * random.gaussian();
}

}  // namespace

Status check(const MaterialParams& params) {
  const auto& base = params.relaxation_base;
  const auto& slope = params.relaxation_slope;
  const WavinessSpec& waves = params.waviness;
  return check_bounds(
      "cloths", {{"the first relaxation share", base[0], 0, 0.999},
                 {"the second relaxation share", base[1], 0, 0.999},
                 {"the first share per hysteresis", slope[0], 0, 0.999},
                 {"the second share per hysteresis", slope[1], 0, 0.999},
                 {"the first relaxation time in s", params.relaxation_time_s[0], 1e-6, 1e9},
                 {"the second relaxation time in s", params.relaxation_time_s[1], 1e-6, 1e9},
                 {"the hysteresis' length", params.hysteresis_length, 1e-3, 100},
                 {"the friction's exponent", params.friction_exponent, 0, 2},
                 {"the friction's reference load in N", params.friction_reference_n, 1e-6, 1e6},
                 {"the bristles' length in m", params.bristle_length_m, 1e-9, 1},
                 {"the height per roughness", params.height_per_roughness, 0, 100},
                 {"the waviness in m", waves.rms_m, 0, 1e-2},
                 {"the shortest wave in m", waves.shortest_wave_m, 1e-6, 10},
                 {"the longest wave in m", waves.longest_wave_m, waves.shortest_wave_m, 10}});
}

Status check(const TrialSpread& spread) {
  return check_bounds("trial spread", {{"of lambda", spread.lambda, 0, 1},
                                       {"of the pressure", spread.pressure, 0, 1},
                                       {"of the friction", spread.friction, 0, 1},
                                       {"of the gain", spread.gain, 0, 1},
                                       {"of the thickness", spread.thickness, 0, 1},
                                       {"of the tilt", spread.tilt, 0, 1},
                                       {"of the skew in rad", spread.skew_rad, 0, 1}});
}

Result<Patch> cut_patch(const Fabric& fabric, const MaterialParams& params,
                        const TrialSpread& spread, const MaterialSwitches& switches,
                        std::uint64_t patch_seed) {
  if (const Status s = check(params); !s) return pass(s.error(), fabric.name);
  if (const Status s = check(spread); !s) return pass(s.error(), fabric.name);
  const auto law = law_from_kes(fabric.kes);
  if (!law) return pass(law.error(), fabric.name);
  Patch patch;
  patch.fabric = fabric.name;
  patch.seed = mix(mix(0, fabric.name), patch_seed);
  patch.grain_m = fabric.grain_m;
  ContactMaterial& material = patch.material;
  material.law = *law;
  material.thickness_m = fabric.thickness_m;
  if (switches.relaxation) material.relaxation = relaxation_of(params, law->hysteresis);
  material.hysteresis = {switches.hysteresis ? law->hysteresis : 0, params.hysteresis_length};
  material.friction = {switches.friction ? fabric.friction_mean : 0, params.friction_reference_n,
                       params.friction_exponent, params.bristle_length_m};
  if (switches.waviness) material.waviness = Waviness(params.waviness, mix(patch.seed, "waviness"));
  const SurfaceSpec surface = surface_of(fabric, params);
  if (!(surface.height_rms_m < steepest_surface * law->lambda_m))
    return fail({.code = Errc::range,
                 .where = fabric.name,
                 .what = "surface too rough for so stiff a cloth",
                 .expected = "std(h) below 6 lambda"});
  if (switches.texture) patch.field = HeightField(surface, mix(patch.seed, "surface"));
  if (switches.trial_spread) draw_spread(patch, spread, Random(mix(patch.seed, "spread")));
  return patch;
}

Patch bare_plate() {
  Patch patch;
  patch.material.friction.coefficient = 0.15;  // acetate on metal [E]
  return patch;
}

}  // namespace weft::sim
