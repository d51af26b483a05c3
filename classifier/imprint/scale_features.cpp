#include "classifier/imprint/scale_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace weft::classifier::imprint {
namespace {

struct Kind {
  std::string_view name;
  bool in_short_form;
};
constexpr std::array<Kind, features_per_scale> kinds{{
    {"edges.n", true},
    {"edges.mean", true},
    {"edges.std", true},
    {"edges.ori", false},
    {"min.n", true},
    {"min.mean", false},
    {"min.std", true},
    {"max.n", true},
    {"max.mean", false},
    {"max.std", true},
}};

constexpr std::size_t step_features = 4;  // the first four of the ten

bool is_in(Form form, std::size_t kind) {
  if (form == Form::brief) return kinds.at(kind).in_short_form;
  if (form == Form::full) return true;
  return (kind < step_features) == (form == Form::steps);
}

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", value);
  return text.data();
}

double largest_of(const Image& image) {
  double largest = 0.0;
  for (const double value : image.data()) largest = std::max(largest, std::abs(value));
  return largest;
}

double circular(std::span<const EdgeTaxel> edges) {
  double cosine = 0.0, sine = 0.0;  // sums for twice the angle
  for (const EdgeTaxel& edge : edges) {
    const double x = edge.x / edge.strength, y = edge.y / edge.strength;
    cosine += x * x - y * y;
    sine += 2.0 * x * y;
  }
  // 1 - R from the deviation from the mean direction: R itself cannot separate small spreads from
  // rounding.
  const double middle = 0.5 * std::atan2(sine, cosine);
  const double along_x = std::cos(middle), along_y = std::sin(middle);
  double away = 0.0;
  for (const EdgeTaxel& edge : edges) {
    const double turned = (edge.y * along_x - edge.x * along_y) / edge.strength;
    away += 2.0 * turned * turned;
  }
  const auto n = static_cast<double>(edges.size());
  away = std::min(away / n, 1.0 - 1.0 / n);
  return std::sqrt(-2.0 * std::log1p(-away)) / 2.0;
}

}  // namespace

std::string_view to_string(Form form) {
  return form_names.at(static_cast<std::size_t>(form));
}

Result<ScaleFeatures> ScaleFeatures::make(const ScaleOptions& options) {
  if (options.sigmas.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "sigmas",
                 .what = "no scales selected",
                 .expected = "at least one",
                 .got = "none"});
  if (auto ok = check(options.thresholds); !ok) return pass(ok.error());
  ScaleFeatures out;
  out.options_ = options;
  for (const double sigma : options.sigmas) {
    auto filter = GaussianFilter::make(sigma);
    if (!filter) return pass(filter.error());
    for (const GaussianFilter& other : out.filters_)
      if (other.sigma() == sigma)
        return fail({.code = Errc::invalid_argument,
                     .where = "sigmas",
                     .what = "scale given twice",
                     .expected = "each scale once",
                     .got = short_number(sigma)});
    out.filters_.push_back(std::move(*filter));
    for (std::size_t k = 0; k < kinds.size(); ++k)
      if (is_in(options.form, k))
        out.names_.push_back(std::string(kinds.at(k).name) + "@" + short_number(sigma));
  }
  return out;
}

void ScaleFeatures::add_scale(const Image& image, GaussianFilter& filter) {
  Scratch& s = scratch_;
  filter.apply(image, s.smoothed);
  gradient(s.smoothed, s.gradient);
  const double noise = noise_estimate(s.smoothed, filter.weights(), options_.noise);
  const auto& edges = s.edges.find(s.gradient, noise, largest_of(s.smoothed), options_.thresholds);
  s.strengths.clear();
  for (const EdgeTaxel& edge : edges) s.strengths.push_back(edge.strength);
  find_extrema(s.smoothed, s.extrema);
  const Moments step = moments(s.strengths), low = moments(s.extrema.minima),
                high = moments(s.extrema.maxima);
  const std::array<double, features_per_scale> all{static_cast<double>(edges.size()),
                                                   step.mean,
                                                   step.deviation,
                                                   orientation_spread(edges, options_.orientation),
                                                   static_cast<double>(s.extrema.minima.size()),
                                                   low.mean,
                                                   low.deviation,
                                                   static_cast<double>(s.extrema.maxima.size()),
                                                   high.mean,
                                                   high.deviation};
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (is_in(options_.form, k)) values_.push_back(all[k]);
}

Result<std::span<const double>> ScaleFeatures::extract(const Image& image) {
  if (auto ok = check(image); !ok) return pass(ok.error());
  values_.clear();
  for (GaussianFilter& filter : filters_) add_scale(image, filter);
  return std::span<const double>(values_);
}

void find_extrema(const Image& image, Extrema& out) {
  out.minima.clear();
  out.maxima.clear();
  for (std::size_t r = 1; r + 1 < image.rows(); ++r) {
    const double* const above = image.row(r - 1).data();
    const double* const here = image.row(r).data();
    const double* const below = image.row(r + 1).data();
    for (std::size_t c = 1; c + 1 < image.cols(); ++c) {
      const double ring[] = {above[c - 1], above[c],     above[c + 1], here[c - 1],
                             here[c + 1],  below[c - 1], below[c],     below[c + 1]};
      const double value = here[c];
      const bool low = value<ring[0], high = value> ring[0];
      if (!low && !high) continue;
      bool extreme = true;
      double sum = 0.0;
      for (const double near : ring) {
        extreme = extreme && (low ? value < near : value > near);
        sum += near;
      }
      if (extreme) (low ? out.minima : out.maxima).push_back(std::abs(value - sum / 8.0));
    }
  }
}

Moments moments(std::span<const double> values) {
  if (values.empty()) return {};
  const auto n = static_cast<double>(values.size());
  double sum = 0.0;
  for (const double value : values) sum += value;
  const double mean = sum / n;
  double square = 0.0;
  for (const double value : values) square += (value - mean) * (value - mean);
  return {mean, std::sqrt(square / n)};
}

double orientation_spread(std::span<const EdgeTaxel> edges, OrientationSpread kind) {
  if (edges.size() < 2) return 0.0;
  if (kind == OrientationSpread::circular) return circular(edges);
  std::vector<double> angles;
  for (const EdgeTaxel& edge : edges) angles.push_back(std::atan2(edge.y, edge.x));
  return moments(angles).deviation;
}

}  // namespace weft::classifier::imprint
