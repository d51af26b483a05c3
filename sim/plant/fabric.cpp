#include "sim/plant/fabric.hpp"

#include <algorithm>
#include <cmath>

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

Result<Patch> cut_patch(const Fabric& fabric, const MaterialParams& params,
                        const TrialSpread& spread, const MaterialSwitches& switches,
                        std::uint64_t patch_seed) {
  const auto law = law_from_kes(fabric.kes);
  if (!law) return pass(law.error(), fabric.name);
  Patch patch;
  patch.seed = mix(mix(0, fabric.name), patch_seed);
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
    return fail(Errc::range, "surface too rough for so stiff a cloth", fabric.name,
                "std(h) below 6 lambda");
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
