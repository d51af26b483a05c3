#pragma once
// Sequential minimal optimisation for small dense problems: the results of libsvm without its
// caches.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"

namespace weft::classifier {

/// Two-class C-SVC on a whole kernel matrix in memory. Follows libsvm 3.x step by step: second
/// order choice of the pair (Fan, Chen and Lin 2005), shrinking, kernel rounded to float. So
/// solutions agree with libsvm's to the last bit, and a grid search that breaks ties by the loss
/// chooses the same point. No allocation after the first problem of a size. One object per thread.
class DenseSmo {
 public:
  /// A tenth of libsvm's own limit.
  static constexpr std::size_t most_steps = 1'000'000;

  DenseSmo() = default;
  DenseSmo(DenseSmo&&) noexcept = default;
  DenseSmo& operator=(DenseSmo&&) noexcept = default;

  /// `sign`: +1 or -1 per row of the problem, in the caller's order; both must occur.
  void set_rows(std::span<const int> sign);

  /// Kernel values between the rows, row i at `kernel + i * stride`. False if one is not finite;
  /// the kernel is then not usable.
  bool set_kernel(const double* kernel, std::size_t stride);

  /// Solves for c > 0 to the stopping tolerance > 0. False if it did not converge within the limit
  /// of steps; the outcome is then not usable. The limit is checked every min(rows, 1000) steps.
  bool solve(double c, double tolerance, std::size_t step_limit = most_steps);

  /// alpha_i y_i per row, in the caller's order; f(x) = sum_i coefficient[i] K(x, row i) + bias.
  [[nodiscard]] std::span<const double> coefficient() const { return {coefficient_.data(), n_}; }
  [[nodiscard]] double bias() const { return bias_; }
  /// True if no multiplier ever reached C: every larger C then has the same solution.
  [[nodiscard]] bool holds_for_larger_c() const { return !touched_c_; }

 private:
  struct Pick {
    std::size_t i = 0, j = 0;
    bool found = false;
  };
  void set_start(std::span<const int> sign);
  void begin(double c);
  Pick pick(double tolerance) const;
  struct Move {
    double i = 0.0, j = 0.0;  // change of y alpha
  };
  struct Walk {
    std::size_t steps = 0;
    bool optimal = false;
  };
  Move move(Pick pair, double v_i, double v_j);
  void step(Pick pair);
  /// Takes up to `most` steps, fewer if the active rows are optimal.
  Walk walk(std::size_t most, double tolerance);
  Walk walk_in_memory(std::size_t most, double tolerance);
  template <std::size_t blocks>
  Walk walk_in_registers(std::size_t most, double tolerance);
  void set_alpha(std::size_t i, double alpha);
  void bound(std::size_t i);
  void add_to_bar(std::size_t i, double weight);
  void shrink(double tolerance);
  [[nodiscard]] bool can_shrink(std::size_t i, double top_up, double top_low) const;
  void unshrink();
  void exchange(std::size_t i, std::size_t j);
  void finish();
  const double* row(std::size_t i) const { return kernel_ + i * width_; }

  std::size_t n_ = 0;
  std::size_t width_ = 0;           // n rounded up to whole vector blocks
  std::vector<std::size_t> order_;  // position in the problem -> caller's row
  // [width x width] kernel as float values; the padding has rows where no row may move
  std::vector<double> rounded_;

  // The current problem; positions change when it shrinks.
  std::vector<double> swapped_;  // copy of rounded_ after the first exchange
  const double* kernel_ = nullptr;
  std::vector<std::size_t> place_;  // current position -> position at the start
  std::vector<double> start_,
      state_;  // [7 x width]: the arrays below, before the first step and now
  double *y_ = nullptr, *d_ = nullptr, *alpha_ = nullptr;
  double* v_ = nullptr;                    // -y times the gradient
  double* bar_ = nullptr;                  // part of v_ from the multipliers at C
  double *up_ = nullptr, *low_ = nullptr;  // 0 if the row may move in that direction, else -inf
  std::vector<unsigned char> at_c_;
  std::size_t active_ = 0;
  double c_ = 0.0;
  bool touched_c_ = false;
  bool unshrunk_ = false;

  std::vector<double> coefficient_;
  double bias_ = 0.0;
};

}  // namespace weft::classifier
