#include "classifier/imprint/scale_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

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

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", value);
  return text.data();
}

double largest_of(const Image& image) {
  double largest = 1.0;
  for (const double value : image.data()) largest = std::max(largest, std::abs(value));
  return largest;
}

}  // namespace

std::string_view to_string(Form form) {
  return form == Form::full ? "10" : "7";
}

Result<ScaleFeatures> ScaleFeatures::make(const ScaleOptions& options) {
  if (options.sigmas.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "sigmas",
                 .what = "no scale to extract features at",
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
                     .what = "a scale is given twice",
                     .expected = "each once",
                     .got = short_number(sigma)});
    out.filters_.push_back(std::move(*filter));
    for (const Kind& kind : kinds)
      if (options.form == Form::full || kind.in_short_form)
        out.names_.push_back(std::string(kind.name) + "@" + short_number(sigma));
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
    if (options_.form == Form::full || kinds[k].in_short_form) values_.push_back(all[k]);
}

Result<std::span<const double>> ScaleFeatures::extract(const Image& image) {
  if (auto ok = check(image); !ok) return pass(ok.error());
  values_.clear();
  for (GaussianFilter& filter : filters_) add_scale(image, filter);
  return std::span<const double>(values_);
}

}  // namespace weft::classifier::imprint
