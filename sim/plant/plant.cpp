#include "sim/plant/plant.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/plant/bounds.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double rounding = 1e-9;  // of sums of steps
/// Above this change of the exponent between two balances the indentation is too uneven.
constexpr double even_exponent = 0.1;

double worn_share(const Wear& wear, double dose_pa_m) {
  return wear.most * -std::expm1(-dose_pa_m / wear.scale_pa_m);
}

}  // namespace

Status check(const PlantParams& params, const ContactMaterial& material) {
  if (Status s = check(params.geometry, params.mount, material, params.dynamics); !s) return s;
  if (Status s = check(params.pads); !s) return s;
  if (Status s = check_bounds("plant", {{"rig tilt", params.rig_tilt, 0, 1},
                                        {"set point [N]", params.set_point_n, 0, 1e6}});
      !s)
    return s;
  if (params.level < Level::modal) return {};
  if (auto made = Vibration::make(params.vibration, {}, 0); !made) return pass(made.error());
  return {};
}

Plant::Plant(const PlantParams& params, std::uint64_t rig_seed)
    : params_(params),
      rig_seed_(rig_seed),
      rig_tilt_x_(params.rig_tilt * Random(mix(rig_seed, "tilt x")).gaussian()),
      rig_tilt_y_(params.rig_tilt * Random(mix(rig_seed, "tilt y")).gaussian()),
      model_(params.geometry, params.mount, {}),
      pads_(params.pads, rig_seed) {
  Random heights(mix(rig_seed, "pad heights"));
  for (double& height_m : pad_heights_m_)
    height_m = params.pads.height_spread_m * heights.gaussian();
  mount(bare_plate(params.cover), {});
}

PlantMemory Plant::memory() {
  finish_stages();
  balance();
  return {contact_, pads_.state(), dose_pa_m_};
}

void Plant::mount(const Patch& patch, const Pose& pose, TimePoint now, const PlantMemory* memory) {
  finish_stages();
  prepared_ = {};
  ContactGeometry geometry = params_.geometry;
  geometry.tilt_x += rig_tilt_x_ + patch.tilt_x;
  geometry.tilt_y += rig_tilt_y_ + patch.tilt_y;
  wear_ = patch.wear;
  dose_pa_m_ = memory == nullptr ? 0 : memory->dose_pa_m;
  rubbed_to_m_ = {pose.x_m, pose.y_m};
  const ContactMaterial material = worn(patch.material);
  std::array<double, pad_count> heights_m = pad_heights_m_;
  for (std::size_t pad = 0; pad < pad_count; ++pad) heights_m[pad] += patch.pad_height_m[pad];
  model_ = ContactModel(geometry, params_.mount, material);
  if (params_.level == Level::algebraic)
    algebraic_ = Algebraic{{geometry, params_.mount, material, params_.set_point_n},
                           LinearTexture(patch.field),
                           std::cos(patch.skew_rad),
                           std::sin(patch.skew_rad),
                           patch.offset_x_m,
                           patch.offset_y_m,
                           {},
                           heights_m,
                           1 - worn_share(wear_, dose_pa_m_)};
  else if (params_.level >= Level::dynamic)
    dynamic_.emplace(geometry, params_.mount, material, params_.dynamics);
  if (params_.level >= Level::modal) listen(patch, now);
  if (params_.watched.pads) {
    if (patch.mounted != 0 && patch.mounted == mounted_)  // keeps the tiles of texture
      bed_.move(patch.material.waviness, patch.offset_x_m, patch.offset_y_m);
    else
      bed_ =
          PadBed(patch.material, patch.field, patch.skew_rad, patch.offset_x_m, patch.offset_y_m);
    bed_.set_heights(heights_m);
    bed_.set_unworn(1 - worn_share(wear_, dose_pa_m_));
    pads_.reset(mix(rig_seed_, patch.seed), patch.gain_scale);
    if (memory != nullptr) pads_.set_state(memory->pads);
    pads_.touch(mix(rig_seed_, patch.seed), patch.gain_scale, patch.pad_ratio);
  }
  mounted_ = patch.mounted;
  pressure_pa_ = {};
  contact_ = memory == nullptr ? ContactState{} : memory->contact;
  contact_.pose = pose;
  gathered_ = {};
  if (params_.watched.contact)
    contact_ = algebraic_ ? algebraic_->probe.step(contact_, pose) : model_.step(contact_, pose, 0);
}

void Plant::share_tiles(const Plant& other) {
  bed_ = other.bed_;
  mounted_ = other.mounted_;
}

void Plant::listen(const Patch& patch, TimePoint now) {
  VibrationParams vibration_params = params_.vibration;
  vibration_params.rubbing = with_grain(vibration_params.rubbing, patch.grain_m);
  const double cosine = std::cos(patch.skew_rad), sine = std::sin(patch.skew_rad);
  const HeightField there =
      patch.field.shifted(cosine * patch.offset_x_m + sine * patch.offset_y_m,
                          cosine * patch.offset_y_m - sine * patch.offset_x_m);
  auto made = SoundingContact::make(*dynamic_, vibration_params, there, patch.skew_rad,
                                    mix(mix(rig_seed_, "vibration"), patch.seed), now);
  WEFT_ASSERT(made.has_value());  // check() has passed
  sounding_ = std::move(*made);
}

ContactState Plant::peek(const Pose& pose, double dt_s) const {
  if (!params_.watched.contact) {
    ContactState state = contact_;
    state.pose = pose;
    return state;
  }
  if (algebraic_) return algebraic_->probe.step(contact_, pose);
  if (sounding_) return sounding_->peek(contact_, pose, from_seconds(dt_s));
  if (dynamic_) return dynamic_->step(contact_, pose, dt_s);
  return quasistatic(pose, gathered_.moved ? gathered_.dt_s + dt_s : dt_s);
}

void Plant::advance(const Pose& pose, double dt_s) {
  if (sounding_ && params_.watched.contact)
    contact_ = sounding_->advance(contact_, pose, from_seconds(dt_s));
  else if (gathers())
    gather(pose, dt_s);
  else if (params_.watched.contact && params_.level == Level::quasistatic && dt_s >= 0 &&
           dt_s <= params_.quasistatic_step_s)
    model_.advance(contact_, pose, relaxation_over(dt_s));
  else
    contact_ = peek(pose, dt_s);
  if (wear_.most > 0) rub(pose);
}

/// Whether one balance spans several conversions.
bool Plant::gathers() const {
  constexpr double conversion_s = 1e-9 * static_cast<double>(pad_timing::stage_ns);
  return params_.watched.contact && params_.level == Level::quasistatic &&
         params_.quasistatic_step_s >= 2 * conversion_s * (1 - rounding);
}

void Plant::gather(const Pose& pose, double dt_s) {
  if (!(dt_s >= 0 && dt_s <= std::numeric_limits<double>::max()) || !reachable(pose)) return;
  const double most_s = params_.quasistatic_step_s * (1 + rounding);
  if (gathered_.moved && gathered_.dt_s + dt_s > most_s) balance();
  if (dt_s > most_s) {
    contact_ = quasistatic(pose, dt_s);
    return;
  }
  gathered_.dt_s = (gathered_.moved ? gathered_.dt_s : 0) + dt_s;
  gathered_.pose = pose;
  gathered_.moved = true;
}

/// One step over the gathered motion. If the face touches before and after and the indentation is
/// even, each conversion uses its own place and time in between. Otherwise each conversion is
/// balanced.
void Plant::balance() {
  if (!gathered_.moved) return;
  const ContactState before = contact_;
  model_.advance(contact_, gathered_.pose, relaxation_over(gathered_.dt_s));
  const bool touches = before.normal_n > 0 && contact_.normal_n > 0;
  const bool even = std::abs(contact_.exponent - before.exponent) <= even_exponent &&
                    before.slope_x == contact_.slope_x && before.slope_y == contact_.slope_y;
  if (!(touches && even) && gathered_.count > 0) {
    contact_ = before;
    balance_each();
  } else {
    const double per_s = gathered_.dt_s > 0 ? 1 / gathered_.dt_s : 0;
    for (int i = 0; i < gathered_.count; ++i) {
      const auto& [stage, pose, after_s] = gathered_.conversions[static_cast<std::size_t>(i)];
      bed_.remember(stage, pose, before, contact_, after_s * per_s);
    }
  }
  gathered_.moved = false;
  gathered_.count = 0;
}

void Plant::balance_each() {
  double from_s = 0;
  for (int i = 0; i < gathered_.count; ++i) {
    const auto& [stage, pose, after_s] = gathered_.conversions[static_cast<std::size_t>(i)];
    model_.advance(contact_, pose, relaxation_over(after_s - from_s));
    bed_.remember(stage, contact_);
    from_s = after_s;
  }
  if (gathered_.dt_s > from_s || gathered_.pose != contact_.pose)
    model_.advance(contact_, gathered_.pose, relaxation_over(gathered_.dt_s - from_s));
}

VibrationReadings Plant::extract_vibration() {
  return sounding_ ? sounding_->take() : VibrationReadings{};
}

ContactState Plant::quasistatic(const Pose& pose, double dt_s) const {
  if (!(dt_s > params_.quasistatic_step_s)) return model_.step(contact_, pose, dt_s);
  const double count = std::ceil(dt_s / params_.quasistatic_step_s * (1 - 1e-12));
  ContactState state = contact_;
  const Pose from = contact_.pose;
  for (double i = 1; i < count; ++i)
    state = model_.step(state, between(from, pose, i / count), dt_s / count);
  return model_.step(state, pose, dt_s / count);
}

const RelaxationStep& Plant::relaxation_over(double dt_s) {
  if (prepared_[0] && prepared_[0]->dt_s == dt_s) return prepared_[0]->relaxation;
  if (prepared_[1] && prepared_[1]->dt_s == dt_s) return prepared_[1]->relaxation;
  std::swap(prepared_[0], prepared_[1]);
  prepared_[0].emplace(PreparedStep{dt_s, {model_.material().relaxation, dt_s}});
  return prepared_[0]->relaxation;
}

void Plant::convert(int stage, std::uint64_t frame) {
  if (!params_.watched.pads) return;
  if (frame != scan_frame_ || stage != scan_last_) finish_stages();
  if (scan_first_ == scan_last_) scan_first_ = stage;
  scan_frame_ = frame;
  scan_last_ = stage + 1;
  if (algebraic_)
    press_linear(stage);
  else if (gathered_.moved)
    gathered_.conversions[static_cast<std::size_t>(gathered_.count++)] = {stage, gathered_.pose,
                                                                          gathered_.dt_s};
  else
    bed_.remember(stage, contact_);
  if (scan_last_ == pad_timing::stages) finish_stages();
}

void Plant::finish_stages() {
  if (scan_first_ == scan_last_) return;
  balance();
  if (!algebraic_) bed_.press(scan_first_, scan_last_, pressure_pa_);
  pads_.convert_stages(pressure_pa_, scan_frame_, scan_first_, scan_last_);
  scan_first_ = scan_last_ = 0;
}

/// Adds the wear since the last step, with the force of the last balance. It has its effect at the
/// next touch.
void Plant::rub(const Pose& pose) {
  const Vector2 at_m{pose.x_m, pose.y_m};
  const double way_m = size(sum(1, at_m, -1, rubbed_to_m_));
  dose_pa_m_ += contact_.normal_n / params_.geometry.face_area_m2() * way_m;
  rubbed_to_m_ = at_m;
}

ContactMaterial Plant::worn(ContactMaterial material) const {
  if (!(wear_.most > 0 && dose_pa_m_ > 0)) return material;
  const double gone_m =
      wear_.most * material.law.lambda_m * std::log1p(dose_pa_m_ / wear_.scale_pa_m);
  material.thickness_m = std::max(material.thickness_m - gone_m, 0.1 * material.thickness_m);
  return material;
}

/// Level L0: pressures of the two pads of a stage, one per chip.
void Plant::press_linear(int stage) {
  const auto first = static_cast<std::size_t>(stage);
  for (const std::size_t pad : {first, first + std::size_t{pad_timing::stages}}) {
    pressure_pa_[pad] = 0;
    if (!(contact_.normal_n > 0)) continue;
    const double dx_m = pad_dx_m(pad), dy_m = pad_dy_m(pad);
    const double x = contact_.face_x_m() + dx_m + algebraic_->offset_x_m,
                 y = contact_.face_y_m() + dy_m + algebraic_->offset_y_m;
    const double u = algebraic_->skew_cos * x + algebraic_->skew_sin * y,
                 v = algebraic_->skew_cos * y - algebraic_->skew_sin * x;
    const double height_m =
        algebraic_->unworn * algebraic_->texture.height_m(u, v, algebraic_->cursors[pad]) +
        algebraic_->pad_heights_m[pad];
    pressure_pa_[pad] = algebraic_->probe.pressure_pa(contact_, dx_m, dy_m, height_m);
  }
}

}  // namespace weft::sim
