#pragma once
// Tail of Student's t distribution, accurate down to the smallest probabilities.

#include <map>
#include <mutex>
#include <utility>

namespace weft::classifier {

/// Natural logarithm of P(|T| > |t|) with `df` > 0 degrees of freedom: I_x(df/2, 1/2) at x = df /
/// (df + t^2). Finite for every finite t; 0 at t = 0; -infinity at infinite t. NaN when t is NaN or
/// df <= 0.
double log_two_sided_p(double t, double df);

/// The same as a probability: relative error below 1e-12 down to 1e-300, then underflow to 0.
double two_sided_p(double t, double df);

/// The t > 0 with two_sided_p(t, df) = p: 0.05 gives the factor of a 95 % interval. NaN unless 0 <
/// p < 1 and df > 0; infinity where no finite t is that unlikely.
double critical_t(double p, double df);

/// Checks whether t is less likely than delta, many times for few pairs (delta, df). Thread: any.
class RareT {
 public:
  /// The limit of one (delta, df), for frequent checks without a lock.
  struct Limit {
    double critical, delta, df;
    /// True if two_sided_p(t, df) < delta; mostly decided without computing p.
    [[nodiscard]] bool passed_by(double t) const;
  };
  [[nodiscard]] Limit limit(double delta, double df) const;

  bool operator()(double t, double df, double delta) const { return limit(delta, df).passed_by(t); }

 private:
  double critical(double delta, double df) const;
  mutable std::mutex mutex_;
  mutable std::map<std::pair<double, double>, double> known_;  // (delta, df) -> critical t
};

}  // namespace weft::classifier
