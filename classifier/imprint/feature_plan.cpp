#include "classifier/imprint/feature_plan.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

namespace weft::classifier::imprint {

Result<PlannedFeatures> PlannedFeatures::make(const FeaturePlan& plan) {
  PlannedFeatures out;
  if (plan.scales) {
    auto scales = ScaleFeatures::make(*plan.scales);
    if (!scales) return pass(scales.error());
    out.names_ = scales->names();
    out.scales_ = std::move(*scales);
  }
  for (const LawsSize size : plan.laws) {
    if (std::ranges::find(out.laws_, size) != out.laws_.end())
      return fail({.code = Errc::invalid_argument,
                   .where = "laws",
                   .what = "a size of Laws' masks is given twice",
                   .expected = "each once"});
    out.laws_.push_back(size);
    const auto names = laws_names(size);
    out.names_.insert(out.names_.end(), names.begin(), names.end());
  }
  if (out.names_.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "features",
                 .what = "no features of imprints",
                 .expected = "scales, Laws' energies or both",
                 .got = "none"});
  return out;
}

Result<std::vector<double>> PlannedFeatures::extract(const Image& image) {
  std::vector<double> out;
  out.reserve(names_.size());
  if (scales_) {
    const auto values = scales_->extract(image);
    if (!values) return pass(values.error());
    out.assign(values->begin(), values->end());
  }
  for (const LawsSize size : laws_) {
    const auto values = laws_energy(image, size);
    if (!values) return pass(values.error());
    out.insert(out.end(), values->begin(), values->end());
  }
  return out;
}

namespace {

struct Vector {
  std::string_view name;
  std::vector<double> weights;
};

std::vector<Vector> make_vectors(LawsSize size) {
  if (size == LawsSize::three) return {{"L3", {1, 2, 1}}, {"E3", {-1, 0, 1}}, {"S3", {-1, 2, -1}}};
  return {{"L5", {1, 4, 6, 4, 1}},
          {"E5", {-1, -2, 0, 2, 1}},
          {"S5", {-1, 0, 2, 0, -1}},
          {"W5", {-1, 2, 0, -2, 1}},
          {"R5", {1, -4, 6, -4, 1}}};
}

// Down the columns, where the whole mask lies inside.
Image down(const Image& image, std::span<const double> weights) {
  Image out(image.rows() + 1 - weights.size(), image.cols());
  for (std::size_t r = 0; r < out.rows(); ++r)
    for (std::size_t k = 0; k < weights.size(); ++k)
      for (std::size_t c = 0; c < out.cols(); ++c) out(r, c) += weights[k] * image(r + k, c);
  return out;
}

double mean_along(const Image& image, std::span<const double> weights) {
  double sum = 0.0;
  const std::size_t cols = image.cols() + 1 - weights.size();
  for (std::size_t r = 0; r < image.rows(); ++r)
    for (std::size_t c = 0; c < cols; ++c) {
      double value = 0.0;
      for (std::size_t k = 0; k < weights.size(); ++k) value += weights[k] * image(r, c + k);
      sum += std::abs(value);
    }
  return sum / static_cast<double>(image.rows() * cols);
}

}  // namespace

std::vector<std::string> laws_names(LawsSize size) {
  std::vector<std::string> out;
  const auto vectors = make_vectors(size);
  for (const Vector& a : vectors)
    for (const Vector& b : vectors)
      if (&a != &vectors.front() || &b != &vectors.front())
        out.push_back("laws." + std::string(a.name) + std::string(b.name));
  return out;
}

Result<std::vector<double>> laws_energy(const Image& image, LawsSize size) {
  if (auto ok = check(image); !ok) return pass(ok.error());
  const auto vectors = make_vectors(size);
  const std::size_t width = vectors.front().weights.size();
  std::vector<double> out;
  if (image.rows() < width || image.cols() < width) {
    out.assign(vectors.size() * vectors.size() - 1, 0.0);
    return out;
  }
  for (const Vector& a : vectors) {
    const Image lines = down(image, a.weights);
    for (const Vector& b : vectors)
      if (&a != &vectors.front() || &b != &vectors.front())
        out.push_back(mean_along(lines, b.weights));
  }
  return out;
}

}  // namespace weft::classifier::imprint
