#include "classifier/learn/dense_smo.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "classifier/learn/block.hpp"

namespace weft::classifier {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double least_curvature = 1e-12;  // libsvm's TAU
constexpr std::size_t iteration_limit = 1'000'000;

}  // namespace

void DenseSmo::set_rows(std::span<const int> sign) {
  n_ = sign.size();
  width_ = (n_ + lanes - 1) / lanes * lanes;
  order_.clear();
  sign_.assign(width_, 1.0);
  // Negative rows first, as libsvm's own positive class: the arrangement of SvmTrainer.
  for (const bool positive : {false, true}) {
    for (std::size_t i = 0; i < n_; ++i) {
      if ((sign[i] > 0) != positive) continue;
      sign_[order_.size()] = positive ? -1.0 : 1.0;
      order_.push_back(i);
    }
  }
  rounded_.assign(n_ * width_, 0.0);
  diagonal_.assign(width_, 1.0);
  coefficient_.assign(n_, 0.0);
}

void DenseSmo::set_kernel(const double* kernel, std::size_t stride) {
  for (std::size_t i = 0; i < n_; ++i) {
    const double* from = kernel + order_[i] * stride;
    double* to = rounded_.data() + i * width_;
    for (std::size_t j = 0; j < n_; ++j) to[j] = static_cast<float>(from[order_[j]]);
    diagonal_[i] = from[order_[i]];
  }
}

void DenseSmo::begin(double c) {
  c_ = c;
  touched_c_ = unshrunk_ = false;
  active_ = n_;
  kernel_ = rounded_.data();
  place_.resize(n_);
  std::iota(place_.begin(), place_.end(), std::size_t{0});
  y_ = v_ = sign_;
  d_ = diagonal_;
  alpha_.assign(width_, 0.0);
  bar_.assign(width_, 0.0);
  at_c_.assign(width_, 0);
  up_.assign(width_, -infinity);
  low_.assign(width_, -infinity);
  for (std::size_t i = 0; i < n_; ++i) bound(i);
}

// Which way row i may still move: up_ holds the rows with y = +1 below C and y = -1 above 0.
WEFT_INLINE void DenseSmo::bound(std::size_t i) {
  const bool at_c = alpha_[i] >= c_;
  const bool at_zero = alpha_[i] <= 0.0;
  at_c_[i] = at_c ? 1 : 0;
  touched_c_ = touched_c_ || at_c;
  const bool grows = !at_c;
  const bool falls = !at_zero || at_c;
  up_[i] = (y_[i] > 0.0 ? grows : falls) ? 0.0 : -infinity;
  low_[i] = (y_[i] > 0.0 ? falls : grows) ? 0.0 : -infinity;
}

// The most violating pair by second order information. Of equals the last counts, as in libsvm,
// which compares with >= and <=.
WEFT_INLINE DenseSmo::Pick DenseSmo::pick(double tolerance) const {
  const std::size_t end = (active_ + lanes - 1) / lanes * lanes;
  const double* v = v_.data();
  const double* up = up_.data();
  const double* low = low_.data();
  const Block none = all(-infinity);
  const Block four = all(lanes);

  Block best = none, best_at = none, at = Block{0, 1, 2, 3};
  for (std::size_t b = 0; b < end; b += lanes, at += four) {
    const Block x = load(v + b) + load(up + b);
    best_at = x >= best ? at : best_at;
    best = larger(x, best);
  }
  const double top = largest(best);
  if (top == -infinity) return {};
  const auto i = static_cast<std::size_t>(largest(best == all(top) ? best_at : none));

  const double* k = row(i);
  const Block top4 = all(top), curvature = all(d_[i]), two = all(2.0), least = all(least_curvature);
  Block lowest = none;
  best = best_at = none;
  at = Block{0, 1, 2, 3};
  for (std::size_t b = 0; b < end; b += lanes, at += four) {
    const Block x = load(v + b), usable = load(low + b);
    const Block difference = top4 - x;
    const Block whole = (curvature + load(d_.data() + b)) - two * load(k + b);
    const Block gain = difference * difference / (whole > 0.0 ? whole : least) + usable;
    const Block merit = difference > 0.0 ? gain : none;
    best_at = merit >= best ? at : best_at;
    best = larger(merit, best);
    lowest = larger(usable - x, lowest);
  }
  const double most = largest(best);
  if (top + largest(lowest) < tolerance || most == -infinity) return {};
  return {i, static_cast<std::size_t>(largest(best == all(most) ? best_at : none)), true};
}

WEFT_INLINE void DenseSmo::set_alpha(std::size_t i, double alpha) {
  const bool was_at_c = at_c_[i] != 0;
  alpha_[i] = alpha;
  bound(i);
  if (was_at_c != (at_c_[i] != 0)) add_to_bar(i, was_at_c ? c_ : -c_);
}

void DenseSmo::add_to_bar(std::size_t i, double weight) {
  const double* k = row(i);
  const double w = weight * y_[i];
  for (std::size_t t = 0; t < n_; ++t) bar_[t] += w * k[t];
}

// The two multipliers move along their constraint and stop at the box.
WEFT_INLINE void DenseSmo::step(Pick pair) {
  const auto [i, j, found] = pair;
  const double* ki = row(i);
  const double* kj = row(j);
  const double whole = d_[i] + d_[j] - 2.0 * ki[j];
  const double bent = whole > 0.0 ? whole : least_curvature;
  const double delta = (v_[i] - v_[j]) / bent;  // in y alpha
  const double old_i = alpha_[i], old_j = alpha_[j];
  double a = old_i + y_[i] * delta;
  double b = old_j - y_[j] * delta;
  if (y_[i] != y_[j]) {
    const double difference = old_i - old_j;
    if (difference > 0.0) {
      if (b < 0.0) b = 0.0, a = difference;
      if (a > c_) a = c_, b = c_ - difference;
    } else {
      if (a < 0.0) a = 0.0, b = -difference;
      if (b > c_) b = c_, a = c_ + difference;
    }
  } else {
    const double sum = old_i + old_j;
    if (sum > c_) {
      if (a > c_) a = c_, b = sum - c_;
      if (b > c_) b = c_, a = sum - c_;
    } else {
      if (b < 0.0) b = 0.0, a = sum;
      if (a < 0.0) a = 0.0, b = sum;
    }
  }
  const Block wi = all(y_[i] * (a - old_i));
  const Block wj = all(y_[j] * (b - old_j));
  double* v = v_.data();
  for (std::size_t t = 0; t < active_; t += lanes)
    store(v + t, load(v + t) - (load(ki + t) * wi + load(kj + t) * wj));
  set_alpha(i, a);
  set_alpha(j, b);
}

bool DenseSmo::can_shrink(std::size_t i, double top_up, double top_low) const {
  if (up_[i] == 0.0 && low_[i] == 0.0) return false;
  return low_[i] == 0.0 ? v_[i] > top_up : -v_[i] > top_low;
}

// Rows at a bound that will most likely stay there leave the problem for a while.
void DenseSmo::shrink(double tolerance) {
  double top_up = -infinity, top_low = -infinity;
  for (std::size_t i = 0; i < active_; ++i) {
    top_up = std::max(top_up, v_[i] + up_[i]);
    top_low = std::max(top_low, low_[i] - v_[i]);
  }
  if (!unshrunk_ && top_up + top_low <= tolerance * 10.0) {
    unshrunk_ = true;
    unshrink();
  }
  for (std::size_t i = 0; i < active_; ++i) {
    if (!can_shrink(i, top_up, top_low)) continue;
    --active_;
    while (active_ > i && can_shrink(active_, top_up, top_low)) --active_;
    if (active_ > i) exchange(i, active_);
  }
  for (std::size_t i = active_; i < n_; ++i) up_[i] = low_[i] = -infinity;
}

// Brings every row back. Gradients of rows that were away are made anew from the multipliers.
void DenseSmo::unshrink() {
  if (active_ == n_) return;
  for (std::size_t j = active_; j < n_; ++j) v_[j] = bar_[j] + y_[j];
  for (std::size_t i = 0; i < active_; ++i) {
    if (up_[i] != 0.0 || low_[i] != 0.0) continue;  // at a bound: 0, or in bar_
    const double* k = row(i);
    const double w = alpha_[i] * y_[i];
    for (std::size_t j = active_; j < n_; ++j) v_[j] -= w * k[j];
  }
  for (std::size_t i = active_; i < n_; ++i) bound(i);
  active_ = n_;
}

void DenseSmo::exchange(std::size_t i, std::size_t j) {
  if (kernel_ == rounded_.data()) {
    swapped_ = rounded_;
    kernel_ = swapped_.data();
  }
  double* k = swapped_.data();
  std::swap_ranges(k + i * width_, k + i * width_ + n_, k + j * width_);
  for (std::size_t r = 0; r < n_; ++r) std::swap(k[r * width_ + i], k[r * width_ + j]);
  for (auto* values : {&y_, &d_, &alpha_, &v_, &bar_, &up_, &low_})
    std::swap((*values)[i], (*values)[j]);
  std::swap(at_c_[i], at_c_[j]);
  std::swap(place_[i], place_[j]);
}

// The bias from the free rows, or the middle of the interval that the rows at bounds leave.
void DenseSmo::finish() {
  double upper = infinity, lower = -infinity, sum = 0.0;
  std::size_t free = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    const double g = -v_[i];
    if (up_[i] == 0.0 && low_[i] == 0.0) {
      ++free;
      sum += g;
    } else if (up_[i] == 0.0) {
      upper = std::min(upper, g);
    } else {
      lower = std::max(lower, g);
    }
  }
  bias_ = free > 0 ? sum / static_cast<double>(free) : (upper + lower) / 2.0;
  for (std::size_t i = 0; i < n_; ++i) {
    const double a = alpha_[i];
    coefficient_[order_[place_[i]]] = a == 0.0 ? 0.0 : -(a * y_[i]);
  }
}

WEFT_FOR_THIS_PROCESSOR bool DenseSmo::solve(double c, double tolerance) {
  begin(c);
  const std::size_t period = std::min<std::size_t>(n_, 1000);
  std::size_t until_shrink = period + 1;
  for (std::size_t iteration = 0; iteration < iteration_limit; ++iteration) {
    if (--until_shrink == 0) {
      until_shrink = period;
      shrink(tolerance);
    }
    Pick pair = pick(tolerance);
    if (!pair.found) {
      unshrink();
      pair = pick(tolerance);
      if (!pair.found) {
        finish();
        return true;
      }
      until_shrink = 1;
    }
    step(pair);
  }
  return false;
}

}  // namespace weft::classifier
