#include "daemon/analysis/tradeoff/sim/sim_watch.hpp"

#include <algorithm>

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

/// Where `f` changes sign between 0 and 1.
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
    if (force.rate < 0) {  // the spring lets go
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

}  // namespace weft::daemon
