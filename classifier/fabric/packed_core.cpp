#include "classifier/fabric/packed_core.hpp"

#include <array>

#include "classifier/learn/block.hpp"

namespace weft::classifier {
namespace {

std::size_t whole_blocks(std::size_t count) {
  return (count + lanes - 1) / lanes * lanes;
}

// [rows x cols] as [cols x width], the padding zero.
void append_transposed(const Matrix& from, std::size_t width, std::vector<double>& to) {
  for (std::size_t c = 0; c < from.cols(); ++c)
    for (std::size_t r = 0; r < width; ++r) to.push_back(r < from.rows() ? from(r, c) : 0.0);
}

}  // namespace

// Where the parts lie.
struct PackedView {
  const std::uint32_t* column;
  std::size_t columns, directions, vectors, axes_width, support_width;
  const double *mean, *deviation, *axes, *support, *coefficient;
  double gamma, bias;

  explicit PackedView(const PackedCore& core)
      : column(core.columns_.data()),
        columns(core.columns_.size()),
        directions(core.directions_),
        vectors(core.vectors_),
        axes_width(core.axes_width_),
        support_width(core.support_width_),
        mean(core.data_.data()),
        deviation(mean + columns),
        axes(deviation + columns),
        support(axes + columns * axes_width),
        coefficient(support + directions * support_width),
        gamma(core.gamma_),
        bias(core.bias_) {}

  [[nodiscard]] std::size_t scratch() const { return columns + axes_width + support_width; }
};

namespace {

// Sums run over columns and directions in their order, one lane per component or support vector:
// the bits of the plain loops.
WEFT_CLONES("arch=x86-64-v4", "avx2")
double decide_packed(const PackedView& v, const double* features, double* scratch) {
  double* const scaled = scratch;
  for (std::size_t k = 0; k < v.columns; ++k)
    scaled[k] = (features[v.column[k]] - v.mean[k]) / v.deviation[k];
  const double* x = scaled;
  if (v.axes_width > 0) {
    double* const components = scratch + v.columns;
    for (std::size_t c = 0; c < v.axes_width; c += lanes) {
      Block sum = all(0.0);
      for (std::size_t k = 0; k < v.columns; ++k)
        sum += all(scaled[k]) * load(v.axes + k * v.axes_width + c);
      store(components + c, sum);
    }
    x = components;
  }
  double* const kernel = scratch + v.columns + v.axes_width;
  for (std::size_t s = 0; s < v.support_width; s += lanes) {
    Block squared = all(0.0);
    for (std::size_t k = 0; k < v.directions; ++k) {
      const Block d = all(x[k]) - load(v.support + k * v.support_width + s);
      squared += d * d;
    }
    store(kernel + s, exp_block(squared * all(-v.gamma)));
  }
  double f = 0.0;
  for (std::size_t s = 0; s < v.vectors; ++s) f += v.coefficient[s] * kernel[s];
  return f + v.bias;
}

}  // namespace

PackedCore::PackedCore(const Reducer& reducer, const Matrix& support,
                       std::span<const double> coefficient, double gamma, double bias)
    : directions_(reducer.directions()),
      vectors_(support.rows()),
      axes_width_(whole_blocks(reducer.axes().rows())),
      support_width_(whole_blocks(support.rows())),
      gamma_(gamma),
      bias_(bias) {
  for (const std::size_t c : reducer.columns()) columns_.push_back(static_cast<std::uint32_t>(c));
  const Scaler& scaler = reducer.scaler();
  data_.reserve(columns_.size() * (2 + axes_width_) + directions_ * support_width_ + vectors_);
  data_.insert(data_.end(), scaler.mean.begin(), scaler.mean.end());
  data_.insert(data_.end(), scaler.deviation.begin(), scaler.deviation.end());
  append_transposed(reducer.axes(), axes_width_, data_);
  append_transposed(support, support_width_, data_);
  data_.insert(data_.end(), coefficient.begin(), coefficient.end());
}

double PackedCore::decide(std::span<const double> features) const {
  const PackedView view(*this);
  if (view.scratch() > most_on_stack) {
    std::vector<double> scratch(view.scratch());
    return decide_packed(view, features.data(), scratch.data());
  }
  std::array<double, most_on_stack> scratch;  // written before it is read
  return decide_packed(view, features.data(), scratch.data());
}

}  // namespace weft::classifier
