#include "daemon/analysis/tradeoff/sim/sim_pads.hpp"

#include <cmath>

#include "sim/plant/algebraic/algebraic_probe.hpp"

namespace weft::daemon {

namespace {

using namespace weft::sim;

constexpr std::uint64_t sensor_seed = 1;

/// Reads every sample with `pressure_pa(state, pad, u_m, v_m)`, the place in the yarns' frame.
template <class Pressure>
void read_with(const SimCase& one, SimTrace& trace, const Pressure& pressure_pa) {
  PadParams params;
  params.noise_counts = params.drift_counts = 0;
  PadArray pads(params, sensor_seed);
  pads.reset(one.patch.seed, one.patch.gain_scale);
  const double skew_cos = std::cos(one.patch.skew_rad), skew_sin = std::sin(one.patch.skew_rad);
  trace.pads.clear();
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    const ContactState& state = trace.samples[i];
    for (std::size_t pad = 0; pad < pad_count; ++pad) {
      const double x = state.face_x_m() + pad_dx_m(pad), y = state.face_y_m() + pad_dy_m(pad);
      const double pa = state.normal_n > 0 ? pressure_pa(state, pad, skew_cos * x + skew_sin * y,
                                                         skew_cos * y - skew_sin * x)
                                           : 0;
      pads.convert(pad, pa, i);
    }
    trace.pads.push_back(pads.counts());
  }
}

}  // namespace

void read_pads(const SimCase& one, Level level, SimTrace& trace) {
  std::array<TextureMap::Cursor, pad_count> cursors{};
  const ContactMaterial& cloth = one.patch.material;
  if (level == Level::algebraic) {
    LinearTexture texture(one.patch.field);
    const AlgebraicProbe contact(one.geometry, one.mount, cloth, SimForceLoop{}.set_n);
    read_with(one, trace, [&](const ContactState& state, std::size_t pad, double u, double v) {
      return contact.pressure_pa(state, pad_dx_m(pad), pad_dy_m(pad),
                                 texture.height_m(u, v, cursors[pad]));
    });
    return;
  }
  TextureMap texture(one.patch.field, cloth.law.lambda_m);
  const ContactModel contact(one.geometry, one.mount, cloth);
  read_with(one, trace, [&](const ContactState& state, std::size_t pad, double u, double v) {
    return contact.pressure_pa(state, pad_dx_m(pad), pad_dy_m(pad),
                               texture.response(u, v, cursors[pad]));
  });
}

}  // namespace weft::daemon
