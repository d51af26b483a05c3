#include "daemon/analysis/tradeoff/sim/sim_run.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/analysis/tradeoff/sim/sim_watch.hpp"
#include "daemon/base/text/format.hpp"
#include "sim/plant/algebraic/algebraic_probe.hpp"
#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "sim/plant/modal/vibration.hpp"

namespace weft::daemon {

namespace {

using namespace weft::sim;

constexpr std::uint64_t vibration_seed = 1;

/// a/b where that is a whole number, else 0.
std::size_t whole_ratio(double a, double b) {
  const double ratio = a / b, near = std::round(ratio);
  return near >= 1 && std::abs(ratio - near) < 1e-6 * near ? static_cast<std::size_t>(near) : 0;
}

/// Height of the face above the cloth it will touch.
ForceSample gap_to_cloth(const ContactState& state, double lambda_m, double t_s, double rate_mps) {
  const bool known = state.exponent > -1e8;  // L0 has none off the cloth
  return {t_s, -(known ? state.exponent * lambda_m : state.indentation_m), rate_mps};
}

}  // namespace

std::string format_integrator(const SimSetting& setting) {
  if (setting.level < Level::dynamic) return "none";
  return std::string(sim::to_string(setting.integrator));
}

std::string SimSetting::family() const {
  std::string out(to_string(level));
  if (level < Level::dynamic) return out;
  return out + (integrator == Integrator::tr_bdf2 ? " TR-BDF2" : " " + format_integrator(*this));
}

double SimSetting::step_us() const {
  return level == Level::algebraic ? 0 : std::round(step_s * 1e9) / 1e3;
}

std::string SimSetting::name() const {
  return level == Level::algebraic ? family() : family() + " " + general(step_s * 1e3) + " ms";
}

double guide_force_n(const SimCase& one, const ContactState& state, Level level) {
  if (level < Level::dynamic) return state.friction_n[1];
  return one.dynamics.lateral_stiffness_n_m * state.lag_m[1];
}

Result<SimRunner> SimRunner::make(const SimCase& one, const SimSetting& setting) {
  SimRunner out(one, setting);
  const double sample_s = std::max(one.grid_s, setting.step_s);
  out.stride_ = whole_ratio(sample_s, one.grid_s);
  out.substeps_ = whole_ratio(sample_s, setting.step_s);
  if (!(setting.step_s > 0) || out.stride_ == 0 || out.substeps_ == 0 ||
      whole_ratio(sim_sample_s, sample_s) == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = setting.name(),
                 .what = "a step must divide the time between samples",
                 .expected = general(sim_sample_s) + " s over a whole number",
                 .got = general(setting.step_s) + " s"});
  if (setting.level < Level::dynamic) return out;
  DynamicsParams params = one.dynamics;
  params.step_s = setting.step_s;
  params.integrator = setting.integrator;
  if (Status ok = check(one.geometry, one.mount, one.patch.material, params); !ok)
    return pass(ok.error(), setting.name());
  if (setting.level < Level::modal) return out;
  if (auto made = out.sounding_contact(); !made) return pass(made.error(), setting.name());
  return out;
}

/// `step(state, pose, dt)` once per look.
template <class Step>
SimTrace SimRunner::follow(const Step& step) const {
  const SimCase& one = *case_;
  const std::size_t per_sample = one.grid_points(), points = one.samples * per_sample;
  const double dt_s = one.grid_s * static_cast<double>(stride_);
  const double lambda_m = one.patch.material.law.lambda_m;
  SimTrace out;
  out.samples.reserve(one.samples);
  SimDrive drive(one);
  TouchWatch touch;
  CycleWatch cycle;
  ContactState state = one.start();
  for (std::size_t i = 0; i < points; i += stride_) {
    const ContactState last = state;
    state = step(state, drive.move(i, i + stride_, state.normal_n), dt_s);
    const double t_s = static_cast<double>(i + stride_) * one.grid_s;
    const bool moves = setting_.level >= Level::dynamic;
    const double rate_mps =
        moves ? -state.velocity_mps[2] : (state.indentation_m - last.indentation_m) / -dt_s;
    touch.see(gap_to_cloth(state, lambda_m, t_s, rate_mps));
    if (one.cycles_at(t_s)) {
      const double rate = moves ? -state.velocity_mps[1] * one.dynamics.lateral_stiffness_n_m : 0;
      cycle.see({t_s, guide_force_n(one, state, setting_.level), rate});
    }
    if ((i + stride_) % per_sample == 0) out.samples.push_back(state);
  }
  out.touch_s = std::move(touch).times_s();
  out.cycle = {cycle.peak_to_peak(), cycle.frequency_hz()};
  return out;
}

SimTrace SimRunner::run() const {
  switch (setting_.level) {
    case Level::algebraic:
      return run_algebraic();
    case Level::quasistatic:
      return run_quasistatic();
    case Level::modal:
      return run_modal();
    default:
      return run_dynamic();
  }
}

SimTrace SimRunner::run_algebraic() const {
  const double set_n = case_->loop ? case_->loop->set_n : SimForceLoop{}.set_n;
  const AlgebraicProbe contact(case_->geometry, case_->mount, case_->patch.material, set_n);
  return follow(
      [&](const ContactState& state, const Pose& to, double) { return contact.step(state, to); });
}

SimTrace SimRunner::run_quasistatic() const {
  const ContactModel contact(case_->geometry, case_->mount, case_->patch.material);
  const double count = static_cast<double>(substeps_);
  return follow([&](ContactState state, const Pose& to, double dt_s) {
    const Pose from = state.pose;
    for (std::size_t i = 1; i <= substeps_; ++i) {
      const double share = static_cast<double>(i) / count;
      const Pose pose{.y_m = from.y_m + share * (to.y_m - from.y_m),
                      .z_m = from.z_m + share * (to.z_m - from.z_m)};
      state = contact.step(state, i == substeps_ ? to : pose, dt_s / count);
    }
    return state;
  });
}

DynamicContact SimRunner::dynamic_contact() const {
  DynamicsParams params = case_->dynamics;
  params.step_s = setting_.step_s;
  params.integrator = setting_.integrator;
  return {case_->geometry, case_->mount, case_->patch.material, params};
}

/// Accelerometer and microphone as they come.
Result<SoundingContact> SimRunner::sounding_contact() const {
  return SoundingContact::make(dynamic_contact(), {}, case_->patch.field, case_->patch.skew_rad,
                               vibration_seed, {});
}

SimTrace SimRunner::run_modal() const {
  SoundingContact contact = *sounding_contact();  // make() has tried it
  return follow([&](const ContactState& state, const Pose& to, double dt_s) {
    const ContactState after = contact.advance(state, to, from_seconds(dt_s));
    static_cast<void>(contact.take());
    return after;
  });
}

SimTrace SimRunner::run_dynamic() const {
  const DynamicContact contact = dynamic_contact();
  return follow([&](const ContactState& state, const Pose& to, double dt_s) {
    return contact.step(state, to, dt_s);
  });
}

}  // namespace weft::daemon
