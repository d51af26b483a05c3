#include "sim/plant/plant.hpp"

#include <cmath>

#include "sim/plant/random.hpp"

namespace weft::sim {

Plant::Plant(const PlantParams& params, std::uint64_t rig_seed)
    : params_(params),
      rig_seed_(rig_seed),
      rig_tilt_x_(params.rig_tilt * Random(mix(rig_seed, "tilt x")).gaussian()),
      rig_tilt_y_(params.rig_tilt * Random(mix(rig_seed, "tilt y")).gaussian()),
      model_(params.geometry, params.mount, {}),
      pads_(params.pads, rig_seed) {
  mount(bare_plate(), {});
}

void Plant::mount(const Patch& patch, const Pose& pose) {
  ContactGeometry geometry = params_.geometry;
  geometry.tilt_x += rig_tilt_x_ + patch.tilt_x;
  geometry.tilt_y += rig_tilt_y_ + patch.tilt_y;
  model_ = ContactModel(geometry, params_.mount, patch.material);
  if (params_.level >= Level::dynamic)
    dynamic_.emplace(geometry, params_.mount, patch.material, params_.dynamics);
  texture_ = TextureMap(patch.field, patch.material.law.lambda_m);
  cursors_ = {};
  skew_cos_ = std::cos(patch.skew_rad);
  skew_sin_ = std::sin(patch.skew_rad);
  pads_.reset(mix(rig_seed_, patch.seed), patch.gain_scale);
  pressure_pa_ = {};
  contact_ = {};
  contact_.pose = pose;
  contact_ = model_.step(contact_, pose, 0);
}

void Plant::convert(int stage, std::uint64_t frame) {
  const auto pad = static_cast<std::size_t>(stage);
  convert_pad(pad, frame);
  convert_pad(pad + std::size_t{pad_timing::stages}, frame);
}

void Plant::convert_pad(std::size_t pad, std::uint64_t frame) {
  double pressure = 0;
  if (contact_.normal_n > 0) {
    const double x = contact_.face_x_m() + pad_dx_m(pad), y = contact_.face_y_m() + pad_dy_m(pad);
    const double response = texture_.response(skew_cos_ * x + skew_sin_ * y,
                                              skew_cos_ * y - skew_sin_ * x, cursors_[pad]);
    pressure = model_.pressure_pa(contact_, pad_dx_m(pad), pad_dy_m(pad), response);
  }
  pressure_pa_[pad] = pressure;
  pads_.convert(pad, pressure, frame);
}

}  // namespace weft::sim
