#include "daemon/analysis/tradeoff/sim/sim_run.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/base/text/format.hpp"
#include "sim/plant/algebraic/algebraic_probe.hpp"
#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "sim/plant/modal/vibration.hpp"

namespace weft::daemon {
namespace {

constexpr int bisections = 50;

/// Cubic with given values and slopes at 0 and 1.
struct Cubic {
  double c0, c1, c2, c3;

  Cubic(const ForceSample& a, const ForceSample& b) {
    const double h = b.t_s - a.t_s, rise = b.value - a.value;
    c0 = a.value;
    c1 = a.rate * h;
    c2 = 3 * rise - 2 * a.rate * h - b.rate * h;
    c3 = (a.rate + b.rate) * h - 2 * rise;
  }
  [[nodiscard]] double at(double u) const { return c0 + u * (c1 + u * (c2 + u * c3)); }
  [[nodiscard]] double slope(double u) const { return c1 + u * (2 * c2 + 3 * u * c3); }
};

/// Zero of `f` between 0 and 1.
template <class Function>
double root(const Function& f) {
  double low = 0, high = 1;
  const bool rises = f(0) < 0;
  for (int i = 0; i < bisections; ++i) {
    const double middle = 0.5 * (low + high);
    ((f(middle) < 0) == rises ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

using namespace weft::sim;

constexpr std::uint64_t vibration_seed = 1;

/// a/b if that is a whole number, else 0.
std::size_t whole_ratio(double a, double b) {
  const double ratio = a / b, near = std::round(ratio);
  return near >= 1 && std::abs(ratio - near) < 1e-6 * near ? static_cast<std::size_t>(near) : 0;
}

DynamicsParams dynamics_of(const SimCase& one, const SimSetting& setting) {
  DynamicsParams out = one.dynamics;
  out.step_s = setting.step_s;
  out.integrator = setting.integrator;
  return out;
}

/// Height of the face above the fabric below it.
ForceSample gap_to_cloth(const ContactState& state, double lambda_m, double t_s, double rate_mps) {
  const bool known = state.exponent > -1e8;  // L0 has no exponent off the fabric
  return {t_s, -(known ? state.exponent * lambda_m : state.indentation_m), rate_mps};
}

/// Force of the guide's spring on the probe along y, as a force sensor measures it in stick-slip.
/// Level L1 has no guide; it uses the friction.
double guide_force_n(const SimCase& one, const ContactState& state, Level level) {
  if (level < Level::dynamic) return state.friction_n[1];
  return one.dynamics.lateral_stiffness_n_m * state.lag_m[1];
}

/// Calls `step(state, pose, dt)` once per observation.
template <class Step>
SimTrace follow(const SimRunner& run, const Step& step) {
  const SimCase& one = *run.one;
  const std::size_t per_sample = one.grid_points(), points = one.samples * per_sample;
  const double dt_s = one.grid_s * static_cast<double>(run.stride);
  const double lambda_m = one.patch.material.law.lambda_m;
  SimTrace out;
  out.samples.reserve(one.samples);
  SimDrive drive(one);
  TouchWatch touch;
  CycleWatch cycle;
  ContactState state = one.start();
  for (std::size_t i = 0; i < points; i += run.stride) {
    const ContactState last = state;
    state = step(state, drive.move(i, i + run.stride, state.normal_n), dt_s);
    const double t_s = static_cast<double>(i + run.stride) * one.grid_s;
    const bool moves = run.setting.level >= Level::dynamic;
    const double rate_mps =
        moves ? -state.velocity_mps[2] : (state.indentation_m - last.indentation_m) / -dt_s;
    touch.see(gap_to_cloth(state, lambda_m, t_s, rate_mps));
    if (one.cycles_at(t_s)) {
      const double rate = moves ? -state.velocity_mps[1] * one.dynamics.lateral_stiffness_n_m : 0;
      cycle.see({t_s, guide_force_n(one, state, run.setting.level), rate});
    }
    if ((i + run.stride) % per_sample == 0) out.samples.push_back(state);
  }
  out.touch_s = std::move(touch).times_s();
  out.cycle = {cycle.peak_to_peak(), cycle.frequency_hz()};
  return out;
}

SimTrace run_algebraic(const SimRunner& run) {
  const double set_n = run.one->loop ? run.one->loop->set_n : SimForceLoop{}.set_n;
  const AlgebraicProbe contact(run.one->geometry, run.one->mount, run.one->patch.material, set_n);
  return follow(run, [&](const ContactState& state, const Pose& to, double) {
    return contact.step(state, to);
  });
}

SimTrace run_quasistatic(const SimRunner& run) {
  const ContactModel contact(run.one->geometry, run.one->mount, run.one->patch.material);
  const double count = static_cast<double>(run.substeps);
  return follow(run, [&](ContactState state, const Pose& to, double dt_s) {
    const Pose from = state.pose;
    for (std::size_t i = 1; i <= run.substeps; ++i) {
      const double share = static_cast<double>(i) / count;
      const Pose pose{.y_m = from.y_m + share * (to.y_m - from.y_m),
                      .z_m = from.z_m + share * (to.z_m - from.z_m)};
      state = contact.step(state, i == run.substeps ? to : pose, dt_s / count);
    }
    return state;
  });
}

DynamicContact dynamic_contact(const SimRunner& run) {
  return {run.one->geometry, run.one->mount, run.one->patch.material,
          dynamics_of(*run.one, run.setting)};
}

/// With the default accelerometer and microphone.
Result<SoundingContact> sounding_contact(const SimRunner& run) {
  return SoundingContact::make(dynamic_contact(run), {}, run.one->patch.field,
                               run.one->patch.skew_rad, vibration_seed, {});
}

SimTrace run_modal(const SimRunner& run) {
  SoundingContact contact = *sounding_contact(run);  // cannot fail: make() has tested it
  return follow(run, [&](const ContactState& state, const Pose& to, double dt_s) {
    const ContactState after = contact.advance(state, to, from_seconds(dt_s));
    static_cast<void>(contact.take());
    return after;
  });
}

SimTrace run_dynamic(const SimRunner& run) {
  const DynamicContact contact = dynamic_contact(run);
  return follow(run, [&](const ContactState& state, const Pose& to, double dt_s) {
    return contact.step(state, to, dt_s);
  });
}

}  // namespace

double crossing_s(const ForceSample& a, const ForceSample& b) {
  const Cubic cubic(a, b);
  return a.t_s + (b.t_s - a.t_s) * root([&](double u) { return cubic.at(u); });
}

double extreme_between(const ForceSample& a, const ForceSample& b) {
  const Cubic cubic(a, b);
  return cubic.at(root([&](double u) { return cubic.slope(u); }));
}

void TouchWatch::see(const ForceSample& gap) {
  if (last_.t_s >= 0 && last_.value > 0 && gap.value <= 0)
    times_s_.push_back(crossing_s(last_, gap));
  last_ = gap;
}

void CycleWatch::see(const ForceSample& force) {
  low_ = std::min(low_, force.value);
  high_ = std::max(high_, force.value);
  if (last_.t_s >= 0 && last_.rate * force.rate < 0) {
    const double extreme = extreme_between(last_, force);
    low_ = std::min(low_, extreme);
    high_ = std::max(high_, extreme);
    if (force.rate < 0) {  // a slip: the force of the spring falls
      ForceSample a{last_.t_s, last_.rate, 0}, b{force.t_s, force.rate, 0};
      a.rate = b.rate = (b.value - a.value) / (b.t_s - a.t_s);
      const double at_s = crossing_s(a, b);
      if (slips_++ == 0) first_s_ = at_s;
      last_s_ = at_s;
    }
  }
  last_ = force;
}

double CycleWatch::frequency_hz() const {
  return slips_ >= 3 ? (slips_ - 1) / (last_s_ - first_s_) : 0;
}

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

Result<SimRunner> SimRunner::make(const SimCase& one, const SimSetting& setting) {
  SimRunner out{&one, setting};
  const double sample_s = std::max(one.grid_s, setting.step_s);
  out.stride = whole_ratio(sample_s, one.grid_s);
  out.substeps = whole_ratio(sample_s, setting.step_s);
  if (!(setting.step_s > 0) || out.stride == 0 || out.substeps == 0 ||
      whole_ratio(sim_sample_s, sample_s) == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = setting.name(),
                 .what = "step does not divide the sample period",
                 .expected = general(sim_sample_s) + " s divided by a whole number",
                 .got = general(setting.step_s) + " s"});
  if (setting.level < Level::dynamic) return out;
  if (Status ok = check(one.geometry, one.mount, one.patch.material, dynamics_of(one, setting));
      !ok)
    return pass(ok.error(), setting.name());
  if (setting.level < Level::modal) return out;
  if (auto made = sounding_contact(out); !made) return pass(made.error(), setting.name());
  return out;
}

SimTrace SimRunner::run() const {
  switch (setting.level) {
    case Level::algebraic:
      return run_algebraic(*this);
    case Level::quasistatic:
      return run_quasistatic(*this);
    case Level::modal:
      return run_modal(*this);
    default:
      return run_dynamic(*this);
  }
}

}  // namespace weft::daemon
