#pragma once
// What is looked for while a scene runs: touch-downs, and the extremes and slips of a stick-slip
// cycle. Both are found between looks by a cubic through values and slopes at both ends.

#include <vector>

namespace weft::daemon {

/// A quantity and its rate at one look.
struct ForceSample {
  double t_s = 0;
  double value = 0;
  double rate = 0;
};

/// Time at which the cubic through two looks crosses zero; they lie on both sides of it.
double crossing_s(const ForceSample& a, const ForceSample& b);

/// Largest or least value of the cubic where its rate changes sign between two looks.
double extreme_between(const ForceSample& a, const ForceSample& b);

class TouchWatch {
 public:
  /// `gap_m` > 0 is above the cloth; `gap_mps` its rate.
  void see(const ForceSample& gap);
  [[nodiscard]] std::vector<double> times_s() && { return std::move(times_s_); }

 private:
  ForceSample last_{-1, -1, 0};
  std::vector<double> times_s_;
};

class CycleWatch {
 public:
  /// Force of the spring and its rate.
  void see(const ForceSample& force);
  [[nodiscard]] double peak_to_peak() const { return high_ > low_ ? high_ - low_ : 0; }
  /// 0 with fewer than three slips.
  [[nodiscard]] double frequency_hz() const;

 private:
  ForceSample last_{-1, 0, 0};
  double low_ = 1e300, high_ = -1e300, first_s_ = 0, last_s_ = 0;
  int slips_ = 0;
};

}  // namespace weft::daemon
