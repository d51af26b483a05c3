#include "classifier/learn/dense_smo.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "classifier/learn/block.hpp"

namespace weft::classifier {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double least_curvature = 1e-12;  // libsvm's TAU

}  // namespace

void DenseSmo::set_rows(std::span<const int> sign) {
  n_ = sign.size();
  const std::size_t block = n_ <= 16 ? 16 : n_ <= 32 ? 32 : lanes;
  width_ = (n_ + block - 1) / block * block;
  order_.clear();
  start_.assign(7 * width_, 0.0);
  state_.resize(start_.size());
  double* at = state_.data();
  for (double** part : {&y_, &d_, &alpha_, &v_, &bar_, &up_, &low_}) {
    *part = at;
    at += width_;
  }
  place_.resize(n_);
  at_c_.resize(width_);
  // Negative rows first, as libsvm's own positive class: the same order as in SvmTrainer.
  for (const bool positive : {false, true}) {
    for (std::size_t i = 0; i < n_; ++i)
      if ((sign[i] > 0) == positive) order_.push_back(i);
  }
  set_start(sign);
  rounded_.assign(width_ * width_, 0.0);
  coefficient_.assign(n_, 0.0);
}

// All multipliers 0: rows with y = +1 may only move up, the others only down.
void DenseSmo::set_start(std::span<const int> sign) {
  double* const from = start_.data();
  const auto part = [&](const double* of) { return from + (of - state_.data()); };
  std::fill_n(part(y_), width_, 1.0);
  std::fill_n(part(d_), width_, 1.0);
  std::fill_n(part(up_), 2 * width_, -infinity);  // and low_
  for (std::size_t i = 0; i < n_; ++i) {
    const bool first = sign[order_[i]] <= 0;
    part(y_)[i] = first ? 1.0 : -1.0;
    part(first ? up_ : low_)[i] = 0.0;
  }
  std::copy_n(part(y_), width_, part(v_));
}

bool DenseSmo::set_kernel(const double* kernel, std::size_t stride) {
  double* const diagonal = start_.data() + (d_ - state_.data());
  double nothing = 0.0;  // becomes NaN if a value is not finite
  for (std::size_t i = 0; i < n_; ++i) {
    const double* from = kernel + order_[i] * stride;
    double* to = rounded_.data() + i * width_;
    for (std::size_t j = 0; j < n_; ++j) {
      const double k = from[order_[j]];
      nothing += k * 0.0;
      to[j] = static_cast<float>(k);
    }
    diagonal[i] = from[order_[i]];
  }
  return nothing == 0.0;
}

void DenseSmo::begin(double c) {
  c_ = c;
  touched_c_ = unshrunk_ = false;
  active_ = n_;
  kernel_ = rounded_.data();
  std::iota(place_.begin(), place_.end(), std::size_t{0});
  std::copy(start_.begin(), start_.end(), state_.begin());
  std::fill(at_c_.begin(), at_c_.end(), static_cast<unsigned char>(0));
}

// Updates the directions in which row i may still move: up_ has the rows with y = +1 below C and y
// = -1 above 0.
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

// The most violating pair by second order information. The last of equal ones counts, as in libsvm,
// which compares with >= and <=.
WEFT_INLINE DenseSmo::Pick DenseSmo::pick(double tolerance) const {
  const std::size_t end = (active_ + lanes - 1) / lanes * lanes;
  const double* v = v_;
  const double* up = up_;
  const double* low = low_;
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
    const Block whole = (curvature + load(d_ + b)) - two * load(k + b);
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

// Moves two multipliers along their constraint within the box; returns the change of y alpha of i
// and of j. v_i and v_j are the values of v there.
WEFT_INLINE DenseSmo::Move DenseSmo::move(Pick pair, double v_i, double v_j) {
  const auto [i, j, found] = pair;
  const double whole = d_[i] + d_[j] - 2.0 * row(i)[j];
  const double bent = whole > 0.0 ? whole : least_curvature;
  const double delta = (v_i - v_j) / bent;  // in y alpha
  const double old_i = alpha_[i], old_j = alpha_[j];
  double a = old_i + y_[i] * delta;
  double b = old_j - y_[j] * delta;
  // Outside the box one of them stops at 0 or C; the other satisfies the constraint.
  const double difference = old_i - old_j, sum = old_i + old_j;
  if (y_[i] != y_[j]) {
    const bool i_first = difference > 0.0;
    if (i_first ? b < 0.0 : a < 0.0)
      a = i_first ? difference : 0.0, b = i_first ? 0.0 : -difference;
    if (i_first ? a > c_ : b > c_) {
      a = i_first ? c_ : c_ + difference;
      b = i_first ? c_ - difference : c_;
    }
  } else {
    const double end = sum > c_ ? c_ : 0.0;  // bound where one of them can stop
    if (sum > c_ ? a > end : a < end) a = end, b = sum - end;
    if (sum > c_ ? b > end : b < end) b = end, a = sum - end;
  }
  const Move out{y_[i] * (a - old_i), y_[j] * (b - old_j)};
  set_alpha(i, a);
  set_alpha(j, b);
  return out;
}

WEFT_INLINE void DenseSmo::step(Pick pair) {
  const double* ki = row(pair.i);
  const double* kj = row(pair.j);
  const auto [i, j] = move(pair, v_[pair.i], v_[pair.j]);
  const Block wi = all(i), wj = all(j);
  double* v = v_;
  for (std::size_t t = 0; t < active_; t += lanes)
    store(v + t, load(v + t) - (load(ki + t) * wi + load(kj + t) * wj));
}

WEFT_INLINE DenseSmo::Walk DenseSmo::walk_in_memory(std::size_t most, double tolerance) {
  for (std::size_t steps = 0; steps < most; ++steps) {
    const Pick pair = pick(tolerance);
    if (!pair.found) return {steps, true};
    step(pair);
  }
  return {most, false};
}

// The same for up to 4 * blocks rows, with v in registers. One copy has the rows that may move up
// (others -inf), one those that may move down (others +inf).
template <std::size_t blocks>
WEFT_INLINE DenseSmo::Walk DenseSmo::walk_in_registers(std::size_t most, double tolerance) {
  const Block none = all(-infinity), least = all(least_curvature), two = all(2.0);
  Block u[blocks], l[blocks], d[blocks];
  for (std::size_t b = 0; b < blocks; ++b) {
    u[b] = load(&v_[b * lanes]) + load(&up_[b * lanes]);
    l[b] = load(&v_[b * lanes]) - load(&low_[b * lanes]);
    d[b] = load(&d_[b * lanes]);
  }
  double low_now[blocks * lanes];
  std::size_t steps = 0;
  bool optimal = false;
  for (; steps < most; ++steps) {
    for (std::size_t b = 0; b < blocks; ++b) store(low_now + b * lanes, l[b]);
    const double top = largest_of(u);
    const std::size_t i = last_equal(u, top);
    const double* ki = row(i);
    const Block top4 = all(top), curvature = all(d_[i]);
    Block gain[blocks];
    Block lowest = none;
    for (std::size_t b = 0; b < blocks; ++b) {
      const Block difference = top4 - l[b];
      const Block whole = (curvature + d[b]) - two * load(ki + b * lanes);
      const Block ratio = difference * difference / (whole > 0.0 ? whole : least);
      gain[b] = difference > 0.0 ? ratio : none;
      lowest = larger(-l[b], lowest);
    }
    const double most_gain = largest_of(gain);
    optimal = top == -infinity || top + largest(lowest) < tolerance || most_gain == -infinity;
    if (optimal) break;
    const std::size_t j = last_equal(gain, most_gain);
    const double* kj = row(j);
    const double v_j = low_now[j];
    const auto [m_i, m_j] = move({i, j, true}, top, v_j);
    const double new_i = top - (ki[i] * m_i + kj[i] * m_j);
    const double new_j = v_j - (ki[j] * m_i + kj[j] * m_j);
    const Block wi = all(m_i), wj = all(m_j);
    const Block up_i = all(new_i + up_[i]), up_j = all(new_j + up_[j]);
    const Block low_i = all(new_i - low_[i]), low_j = all(new_j - low_[j]);
    const BlockBits at_i = all_bits(i), at_j = all_bits(j);
    for (std::size_t b = 0; b < blocks; ++b) {
      const Block change = load(ki + b * lanes) * wi + load(kj + b * lanes) * wj;
      const BlockBits at = lane_numbers(b);
      u[b] = at == at_i ? up_i : at == at_j ? up_j : u[b] - change;
      l[b] = at == at_i ? low_i : at == at_j ? low_j : l[b] - change;
    }
  }
  // Shrunk rows are in neither copy; unshrink() recomputes their v.
  for (std::size_t b = 0; b < blocks; ++b) {
    const Block known = l[b] < infinity ? l[b] : all(0.0);
    store(&v_[b * lanes], u[b] > -infinity ? u[b] : known);
  }
  return {steps, optimal};
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
DenseSmo::Walk DenseSmo::walk(std::size_t most, double tolerance) {
  if (width_ == 16) return walk_in_registers<16 / lanes>(most, tolerance);
  if (width_ == 32) return walk_in_registers<32 / lanes>(most, tolerance);
  return walk_in_memory(most, tolerance);
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

// Brings every row back. Recomputes the gradients of shrunk rows from the multipliers.
void DenseSmo::unshrink() {
  if (active_ == n_) return;
  for (std::size_t j = active_; j < n_; ++j) v_[j] = bar_[j] + y_[j];
  for (std::size_t i = 0; i < active_; ++i) {
    if (up_[i] != 0.0 || low_[i] != 0.0) continue;  // at a bound: 0, or already in bar_
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
  for (double* values : {y_, d_, alpha_, v_, bar_, up_, low_}) std::swap(values[i], values[j]);
  std::swap(at_c_[i], at_c_[j]);
  std::swap(place_[i], place_[j]);
}

// Computes the bias from the free rows, or as the middle of the interval between the rows at
// bounds.
void DenseSmo::finish() {
  double upper = infinity, lower = -infinity, sum = 0.0;
  std::size_t free = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    const double g = -v_[i];
    const bool can_rise = up_[i] == 0.0, is_free = can_rise && low_[i] == 0.0;
    free += is_free ? 1 : 0;
    sum += is_free ? g : 0.0;
    upper = std::min(upper, can_rise && !is_free ? g : infinity);
    lower = std::max(lower, can_rise ? -infinity : g);
  }
  bias_ = free > 0 ? sum / static_cast<double>(free) : (upper + lower) / 2.0;
  for (std::size_t i = 0; i < n_; ++i) {
    const double a = alpha_[i];
    coefficient_[order_[place_[i]]] = a == 0.0 ? 0.0 : -(a * y_[i]);
  }
}

bool DenseSmo::solve(double c, double tolerance, std::size_t step_limit) {
  begin(c);
  const std::size_t period = std::min<std::size_t>(n_, 1000);
  std::size_t steps = 0;
  while (steps < step_limit) {
    Walk walked = walk(period, tolerance);
    steps += walked.steps;
    if (walked.optimal && active_ < n_) {
      unshrink();
      walked = walk(1, tolerance);
      steps += walked.steps;
    }
    if (walked.optimal) {
      finish();
      return true;
    }
    shrink(tolerance);
  }
  return false;
}

}  // namespace weft::classifier
