#pragma once
// A core's decision as fast as its arithmetic: everything it reads lies in one piece of memory, in
// the order in which it is read.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/fabric/reducer.hpp"

namespace weft::classifier {

/// f(x) = sum_s coefficient[s] exp(-gamma |project(x) - support[s]|^2) + bias. Immutable.
class PackedCore {
 public:
  /// `support` [support vectors x directions], projected by `reducer`.
  PackedCore(const Reducer& reducer, const Matrix& support, std::span<const double> coefficient,
             double gamma, double bias);

  /// Of one full feature vector. No allocation up to `most_on_stack` columns, directions and
  /// support vectors together.
  [[nodiscard]] double decide(std::span<const double> features) const;

  static constexpr std::size_t most_on_stack = 1024;

 private:
  friend struct PackedView;
  std::vector<std::uint32_t> columns_;
  std::size_t directions_ = 0, vectors_ = 0;
  std::size_t axes_width_ = 0;     // directions rounded up to whole blocks; 0 without axes
  std::size_t support_width_ = 0;  // vectors rounded up to whole blocks
  double gamma_ = 0.0, bias_ = 0.0;
  /// mean and deviation of the columns, axes [columns x width], support [directions x width],
  /// coefficients
  std::vector<double> data_;
};

}  // namespace weft::classifier
