#pragma once
// Scenes with a closed form that every engine can solve, and the measurement of a run. The engines
// solve far more general problems. Compared are only the error at equal cost and the cost at equal
// error on these scenes. Source: docs/reference/plant.md, Physics engines.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace weft::bench::peers {

/// A mass in contact with a spring and damper gets a step of force.
struct Press {
  double mass_kg = 0.2;
  double stiffness_n_m = 1e4;
  double damping_ratio = 0.1;
  double force_n = 5;
  double duration_s = 2;

  [[nodiscard]] double damping_n_s_m() const {
    return 2 * damping_ratio * std::sqrt(stiffness_n_m * mass_kg);
  }
  [[nodiscard]] double static_m() const { return force_n / stiffness_n_m; }
  /// Indentation at `t_s`, from rest at 0.
  [[nodiscard]] double indentation_m(double t_s) const {
    const double omega = std::sqrt(stiffness_n_m / mass_kg);
    const double root = std::sqrt(1 - damping_ratio * damping_ratio);
    const double phase = omega * root * t_s;
    return static_m() * (1 - std::exp(-damping_ratio * omega * t_s) *
                                 (std::cos(phase) + damping_ratio / root * std::sin(phase)));
  }
};

/// A body pressed down by a constant force and pulled along by a spring: the final friction is mu
/// N.
struct Slide {
  double mass_kg = 0.2;
  double normal_n = 5;
  double friction = 0.2;
  double spring_n_m = 1e4;
  double speed_mps = 2e-3;
  double contact_n_m = 1e5;  ///< stiffness of the contact, for engines that need one
  double duration_s = 2;

  [[nodiscard]] double friction_n() const { return friction * normal_n; }
};

/// Record of a run: time and indentation, or time and spring force.
using Track = std::vector<std::pair<double, double>>;

struct Run {
  std::string setting;   ///< how the engine was configured
  double step_s = 0;     ///< or its accuracy, if the engine chooses its steps
  double error = 0;      ///< relative; for the press the largest, for the slide at the end
  double cpu_per_s = 0;  ///< processor seconds per simulated second, median
  bool compared = true;  ///< false: solves less than the scene requires; shown but not compared
  bool failed = false;   ///< not finite, or wrong by more than ten times the scale
};

struct Engine {
  std::string name;
  std::vector<Run> press, slide;
};

/// Runs `simulate(track)` several times. `error_of` is not part of the measured time.
Run measure(std::string setting, double step_s, double duration_s,
            const std::function<void(Track&)>& simulate,
            const std::function<double(const Track&)>& error_of);

double press_error(const Press& scene, const Track& track);
double slide_error(const Slide& scene, const Track& track);

/// Interval between samples of a run [s]; a shorter one would limit the steps of engines that
/// choose theirs.
inline constexpr double sample_s = 5e-3;

/// Makes steps of `step_s` up to `duration_s` and samples about every five milliseconds.
template <class Step, class Inspect>
void step_through(double step_s, double duration_s, Track& track, const Step& step,
                  const Inspect& inspect) {
  const auto steps = static_cast<std::size_t>(std::llround(duration_s / step_s));
  const auto every = static_cast<std::size_t>(std::max(1LL, std::llround(sample_s / step_s)));
  for (std::size_t i = 1; i <= steps; ++i) {
    step(static_cast<double>(i - 1) * step_s);
    if (i % every == 0) track.emplace_back(static_cast<double>(i) * step_s, inspect());
  }
}

/// The runs of one engine; every program of this folder links one definition.
Engine engine(const Press& press, const Slide& slide);

}  // namespace weft::bench::peers
