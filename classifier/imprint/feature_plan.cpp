#include "classifier/imprint/feature_plan.hpp"

#include <algorithm>

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

}  // namespace weft::classifier::imprint
