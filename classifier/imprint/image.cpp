#include "classifier/imprint/image.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::imprint {

Status check(const Image& image) {
  const std::size_t taxels = image.rows() * image.cols();
  if (taxels == 0 || taxels > most_taxels)
    return fail({.code = Errc::invalid_argument,
                 .where = "imprint",
                 .what = "number of taxels out of range",
                 .expected = "1 to " + std::to_string(most_taxels),
                 .got = std::to_string(taxels)});
  for (std::size_t r = 0; r < image.rows(); ++r)
    for (std::size_t c = 0; c < image.cols(); ++c)
      if (!(std::abs(image(r, c)) <= largest_count))
        return fail({.code = Errc::range,
                     .where = "row " + std::to_string(r) + ", column " + std::to_string(c),
                     .what = "count out of range",
                     .expected = "finite, magnitude up to 1e100",
                     .got = std::to_string(image(r, c))});
  return {};
}

namespace {

// out = weight x in, then out += weight x (a + b). Pairs are at the same distance, so mirrored
// images have mirrored sums. Loops over plain arrays, which the compiler vectorises.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void scale(const double* in, double weight, std::size_t count, double* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = weight * in[i];
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_pair(const double* a, const double* b, double weight, std::size_t count, double* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] += weight * (a[i] + b[i]);
}

}  // namespace

Result<GaussianFilter> GaussianFilter::make(double sigma) {
  if (!(sigma >= 0.0 && sigma <= largest_sigma))
    return fail({.code = Errc::range,
                 .where = "sigma",
                 .what = "smoothing scale out of range",
                 .expected = "0 to 1000 taxels",
                 .got = std::to_string(sigma)});
  std::vector<double> weights{1.0};
  if (sigma > 0.0) {
    double sum = 1.0;
    const auto radius = static_cast<std::size_t>(std::ceil(4.0 * sigma));
    for (std::size_t i = 1; i <= radius; ++i) {
      const double distance = static_cast<double>(i) / sigma;
      weights.push_back(std::exp(-0.5 * distance * distance));
      sum += 2.0 * weights.back();
    }
    for (double& weight : weights) weight /= sum;
  }
  return GaussianFilter(sigma, std::move(weights));
}

void GaussianFilter::smooth_columns(const Image& in) {
  const std::size_t last = in.rows() - 1;
  between_.assign(in.rows(), in.cols());
  for (std::size_t r = 0; r < in.rows(); ++r) {
    double* const out = between_.row(r).data();
    scale(in.row(r).data(), weights_[0], in.cols(), out);
    for (std::size_t t = 1; t < weights_.size(); ++t)
      add_pair(in.row(r > t ? r - t : 0).data(), in.row(std::min(r + t, last)).data(), weights_[t],
               in.cols(), out);
  }
}

void GaussianFilter::smooth_rows(Image& out) {
  const std::size_t reach = weights_.size() - 1, cols = between_.cols();
  padded_.resize(cols + 2 * reach);
  for (std::size_t r = 0; r < between_.rows(); ++r) {
    const auto row = between_.row(r);
    double* const middle = padded_.data() + reach;
    std::fill(padded_.data(), middle, row.front());
    std::copy(row.begin(), row.end(), middle);
    std::fill(middle + cols, middle + cols + reach, row.back());
    double* const to = out.row(r).data();
    scale(middle, weights_[0], cols, to);
    for (std::size_t t = 1; t <= reach; ++t)
      add_pair(middle - t, middle + t, weights_[t], cols, to);
  }
}

void GaussianFilter::apply(const Image& in, Image& out) {
  if (weights_.size() == 1) {
    out = in;
    return;
  }
  smooth_columns(in);
  out.assign(in.rows(), in.cols());
  smooth_rows(out);
}

}  // namespace weft::classifier::imprint
