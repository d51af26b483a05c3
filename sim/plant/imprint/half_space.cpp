#include "sim/plant/imprint/half_space.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sim/plant/bounds.hpp"

namespace weft::sim {

namespace {

/// Largest unevenness of the contact, as a share of its depth, per unit of the tolerance.
constexpr double level_per_tolerance = 100;
/// Share of depth and heights together: smaller gaps are rounding.
constexpr double rounding = 1e-14;

std::vector<double> influences(std::size_t rows, std::size_t cols, double spacing_m,
                               double modulus_pa) {
  std::vector<double> kernel;
  kernel.reserve(rows * cols);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < cols; ++c)
      kernel.push_back(love_influence(static_cast<double>(c) * spacing_m,
                                      static_cast<double>(r) * spacing_m, spacing_m) /
                       modulus_pa);
  return kernel;
}

Status check(const HalfSpaceParams& params) {
  return check_limits(
      {{"modulus_pa", "modulus out of range", params.modulus_pa, 1, 1e12, "1 to 1e12 Pa"},
       {"tolerance", "tolerance out of range", params.tolerance, 1e-14, 0.1, "1e-14 to 0.1"},
       {"iteration_limit", "iteration limit out of range",
        static_cast<double>(params.iteration_limit), 1, 1e6, "1 to 1000000", true}});
}

}  // namespace

double love_influence(double x_m, double y_m, double side_m) {
  const double a = side_m / 2;
  // Integral of 1/r over the square, corner by corner: x asinh(y/|x|) + y asinh(x/|y|).
  const auto corner = [](double x, double y) {
    const double along_x = x == 0 ? 0 : x * std::asinh(y / std::abs(x));
    const double along_y = y == 0 ? 0 : y * std::asinh(x / std::abs(y));
    return along_x + along_y;
  };
  return (corner(x_m + a, y_m + a) - corner(x_m - a, y_m + a) - corner(x_m + a, y_m - a) +
          corner(x_m - a, y_m - a)) /
         std::numbers::pi;
}

HalfSpace::HalfSpace(std::size_t rows, std::size_t cols, double spacing_m,
                     const HalfSpaceParams& params)
    : rows_(rows),
      cols_(cols),
      spacing_m_(spacing_m),
      params_(params),
      own_influence_(love_influence(0, 0, spacing_m) / params.modulus_pa),
      influence_(rows, cols, influences(rows, cols, spacing_m, params.modulus_pa)) {}

Result<HalfSpace> HalfSpace::make(std::size_t rows, std::size_t cols, double spacing_m,
                                  const HalfSpaceParams& params) {
  if (auto ok = check_grid(rows, cols, spacing_m); !ok) return pass(ok.error());
  if (auto ok = check(params); !ok) return pass(ok.error());
  return HalfSpace(rows, cols, spacing_m, params);
}

Result<Imprint> HalfSpace::press(const HeightMap& map, double force_n) {
  if (auto ok = sim::check(map); !ok) return pass(ok.error());
  if (auto ok = check_press(force_n); !ok) return pass(ok.error());
  if (map.rows != rows_ || map.cols != cols_ || map.spacing_m != spacing_m_)
    return fail({.code = Errc::range,
                 .where = "map",
                 .what = "size of the map differs from the array",
                 .expected = std::to_string(rows_) + " x " + std::to_string(cols_),
                 .got = std::to_string(map.rows) + " x " + std::to_string(map.cols)});
  Imprint imprint{rows_, cols_, std::vector<double>(map.height_m.size(), 0.0), 0, 0};
  const double load_pa = force_n / map.cell_m2();
  iterations_ = 0;
  if (!(load_pa > 1e-200)) return imprint;  // for smaller loads the squares of gaps would underflow
  if (!solve(map, load_pa))
    return fail({.code = Errc::timeout,
                 .where = "half-space",
                 .what = "contact did not converge",
                 .expected = "a tolerance of " + std::to_string(params_.tolerance),
                 .got = std::to_string(iterations_) + " iterations",
                 .hint = "Raise iteration_limit or tolerance"});
  imprint.pressure_pa = pressure_;
  imprint.indentation_m = mean_gap_m_ + highest_m(map);
  imprint.contact_fraction = loaded_fraction(pressure_);
  return imprint;
}

/// Gap to the surface minus its mean over the contact; returns the sum of squares there.
double HalfSpace::gaps_about_their_mean(const HeightMap& map) {
  influence_.apply(pressure_, gap_);
  double sum = 0, touching = 0;
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    gap_[i] -= map.height_m[i];
    if (pressure_[i] > 0) sum += gap_[i], touching += 1;
  }
  const double mean = sum / touching;
  double squares = 0;
  for (std::size_t i = 0; i < gap_.size(); ++i) {
    gap_[i] -= mean;
    if (pressure_[i] > 0) squares += gap_[i] * gap_[i];
  }
  mean_gap_m_ = mean;
  return squares;
}

/// Step along `direction_` that minimises the gaps of the contact.
double HalfSpace::step_length() {
  influence_.apply(direction_, response_);
  double sum = 0, touching = 0;
  for (std::size_t i = 0; i < response_.size(); ++i)
    if (pressure_[i] > 0) sum += response_[i], touching += 1;
  const double mean = sum / touching;
  double along = 0, curvature = 0;
  for (std::size_t i = 0; i < response_.size(); ++i) {
    if (!(pressure_[i] > 0)) continue;
    along += gap_[i] * direction_[i];
    curvature += (response_[i] - mean) * direction_[i];
  }
  return curvature > 0 ? along / curvature : 0;
}

/// Moves the pressures; true if taxels came into contact.
bool HalfSpace::descend(double step) {
  bool joined = false;
  for (std::size_t i = 0; i < pressure_.size(); ++i) {
    if (pressure_[i] > 0) pressure_[i] = std::max(0.0, pressure_[i] - step * direction_[i]);
  }
  for (std::size_t i = 0; i < pressure_.size(); ++i) {
    if (pressure_[i] > 0 || gap_[i] >= 0) continue;
    pressure_[i] = -step * gap_[i];
    joined = joined || pressure_[i] > 0;
  }
  return joined;
}

/// Scales the pressures to the load; returns the share of it that the last pass moved.
double HalfSpace::change_when_scaled_to(double load_pa) {
  double sum = 0;
  for (const double p : pressure_) sum += p;
  const double scale = load_pa / sum;
  double change = 0;
  for (std::size_t i = 0; i < pressure_.size(); ++i) {
    pressure_[i] *= scale;
    change += std::abs(pressure_[i] - before_[i]);
  }
  return change / load_pa;
}

/// Sets the direction and returns the step length along it.
double HalfSpace::aim(double beta) {
  for (std::size_t i = 0; i < direction_.size(); ++i)
    direction_[i] = pressure_[i] > 0 ? gap_[i] + beta * direction_[i] : 0;
  double step = step_length();
  if (step > 0) return step;
  for (std::size_t i = 0; i < direction_.size(); ++i)  // the set of contacts changed: start afresh
    direction_[i] = pressure_[i] > 0 ? gap_[i] : 0;
  step = step_length();
  return step > 0 ? step : lone_step();
}

/// Step length without a direction, for example for one loaded taxel: that of this taxel alone, so
/// that overlapping taxels come into contact. It decreases each time, so that the set of contacts
/// cannot alternate for ever.
double HalfSpace::lone_step() const {
  return 1 / (own_influence_ * iterations_);
}

/// Whether the face penetrates the surface somewhere without contact.
bool HalfSpace::overlaps(double rounding_m) const {
  for (std::size_t i = 0; i < gap_.size(); ++i)
    if (!(pressure_[i] > 0) && gap_[i] < -rounding_m) return true;
  return false;
}

bool HalfSpace::solve(const HeightMap& map, double load_pa) {
  const std::size_t n = map.height_m.size();
  pressure_.assign(n, load_pa / static_cast<double>(n));
  direction_.assign(n, 0.0);
  const auto [low, high] = std::minmax_element(map.height_m.begin(), map.height_m.end());
  double last_squares = 1, decay = 0;
  while (iterations_ < params_.iteration_limit) {
    ++iterations_;
    const double squares = gaps_about_their_mean(map);
    const double beta = last_squares > 0 ? decay * squares / last_squares : 0;
    last_squares = squares;
    const double depth_m = mean_gap_m_ + *high;
    const double rounding_m = rounding * (depth_m + *high - *low);
    const double unlevel_m = std::sqrt(squares / static_cast<double>(n));
    const bool exact = unlevel_m <= rounding_m;  // too even to determine a direction
    if (exact && !overlaps(rounding_m)) return true;
    before_ = pressure_;
    const bool joined = descend(exact ? lone_step() : aim(beta));
    // A pass with little change has converged only if the contact is even too.
    const bool still = change_when_scaled_to(load_pa) <= params_.tolerance && !joined;
    const double level_m = level_per_tolerance * params_.tolerance * depth_m;
    if (still && unlevel_m <= std::max(level_m, rounding_m)) return true;
    decay = joined || still ? 0 : 1;
  }
  return false;
}

}  // namespace weft::sim
