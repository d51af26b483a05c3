#include "sim/plant/pad_bed.hpp"

#include <cmath>
#include <utility>

namespace weft::sim {

namespace {

constexpr auto offsets_x_m = [] {
  PadBed::Values offsets{};
  for (std::size_t pad = 0; pad < pad_count; ++pad) offsets[pad] = pad_dx_m(pad);
  return offsets;
}();
constexpr auto offsets_y_m = [] {
  PadBed::Values offsets{};
  for (std::size_t pad = 0; pad < pad_count; ++pad) offsets[pad] = pad_dy_m(pad);
  return offsets;
}();

}  // namespace

PadBed::PadBed(const ContactMaterial& material, HeightField field, double skew_rad)
    : law_{material.waviness, 1 / material.law.lambda_m, material.law.pressure_pa,
           std::cos(skew_rad), std::sin(skew_rad)},
      texture_(std::move(field), material.law.lambda_m) {}

void PadBed::remember(int stage, const ContactState& contact) {
  const auto first = static_cast<std::size_t>(stage);
  for (const std::size_t pad : {first, first + std::size_t{pad_timing::stages}}) {
    faces_.x_m[pad] = contact.face_x_m();
    faces_.y_m[pad] = contact.face_y_m();
    faces_.indentation_m[pad] = contact.indentation_m;
    faces_.slope_x[pad] = contact.slope_x;
    faces_.slope_y[pad] = contact.slope_y;
    faces_.load_ratio[pad] = contact.normal_n > 0 ? contact.load_ratio : 0;
  }
}

void PadBed::remember(int stage, const Pose& pose, const ContactState& before,
                      const ContactState& after, double share) {
  const auto on_way = [share](double from, double to) { return from + share * (to - from); };
  const auto first = static_cast<std::size_t>(stage);
  for (const std::size_t pad : {first, first + std::size_t{pad_timing::stages}}) {
    faces_.x_m[pad] = pose.x_m;
    faces_.y_m[pad] = pose.y_m;
    faces_.indentation_m[pad] = on_way(before.indentation_m, after.indentation_m);
    faces_.slope_x[pad] = after.slope_x;
    faces_.slope_y[pad] = after.slope_y;
    faces_.load_ratio[pad] = on_way(before.load_ratio, after.load_ratio);
  }
}

void PadBed::press(int first, int last, Values& pressure_pa) {
  const auto sampled = [&](std::size_t pad) {
    const int stage = static_cast<int>(pad) % pad_timing::stages;
    return stage >= first && stage < last && faces_.load_ratio[pad] > 0;
  };
  std::array<bool, pad_count> touching;
  std::size_t any = pad_count;
  for (std::size_t pad = 0; pad < pad_count; ++pad) {
    touching[pad] = sampled(pad);
    if (touching[pad]) any = pad;
    const int stage = static_cast<int>(pad) % pad_timing::stages;
    if (stage >= first && stage < last) pressure_pa[pad] = 0;
  }
  if (any == pad_count) return;
  Values u_m, v_m, texture, pressed_pa;
  place(law_, faces_, u_m, v_m);
  texture_.responses(u_m, v_m, touching, cursors_, texture);
  compute(law_, faces_, texture, pressed_pa);
  for (std::size_t pad = 0; pad < pad_count; ++pad)
    if (touching[pad]) pressure_pa[pad] = pressed_pa[pad];
}

/// From the face's centre to each pad, and into the yarns' frame.
WEFT_SIM_CLONES void PadBed::place(const Law& law, Faces& faces, Values& u_m, Values& v_m) {
  using simd::Lanes, simd::load, simd::store;
  for (std::size_t i = 0; i < pad_count; i += simd::width) {
    const Lanes x = load(&faces.x_m[i]) + load(&offsets_x_m[i]);
    const Lanes y = load(&faces.y_m[i]) + load(&offsets_y_m[i]);
    store(&u_m[i], law.skew_cos * x + law.skew_sin * y);
    store(&v_m[i], law.skew_cos * y - law.skew_sin * x);
  }
}

WEFT_SIM_CLONES void PadBed::compute(const Law& law, const Faces& faces, const Values& texture,
                                     Values& out_pa) {
  using simd::Lanes, simd::load, simd::store;
  for (std::size_t i = 0; i < pad_count; i += simd::width) {
    const Lanes dx = load(&offsets_x_m[i]), dy = load(&offsets_y_m[i]);
    const Lanes local = load(&faces.indentation_m[i]) + load(&faces.slope_x[i]) * dx +
                        load(&faces.slope_y[i]) * dy +
                        law.waviness.heights_m(load(&faces.x_m[i]) + dx, load(&faces.y_m[i]) + dy);
    const Lanes scale = load(&faces.load_ratio[i]) * law.pressure_pa;
    const Lanes pressure = scale * (simd::exp(local * law.per_lambda) * load(&texture[i]) - 1.0);
    const Lanes above = pressure > 0 ? pressure : Lanes{};
    store(&out_pa[i], above < largest_pad_pressure_pa ? above : simd::all(largest_pad_pressure_pa));
  }
}

}  // namespace weft::sim
