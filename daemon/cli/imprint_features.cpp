#include "daemon/cli/imprint_features.hpp"

#include <algorithm>
#include <memory>
#include <sstream>

#include "classifier/imprint/laws.hpp"
#include "daemon/cli/scale_list.hpp"
#include "daemon/imprint/imprint_dataset.hpp"
#include "daemon/imprint/recorded_imprints.hpp"

namespace weft::daemon::cli {
namespace {

namespace ci = classifier::imprint;

/// What a sum of kinds comes to.
struct ImprintPlan {
  std::vector<std::string> names;
  std::optional<ci::ScaleFeatures> scales;
  std::vector<ci::LawsSize> laws;

  Result<std::vector<double>> extract(const ci::Image& image) {
    std::vector<double> out;
    if (scales) {
      const auto values = scales->extract(image);
      if (!values) return pass(values.error());
      out.assign(values->begin(), values->end());
    }
    for (const ci::LawsSize size : laws) {
      const auto values = ci::laws_energy(image, size);
      if (!values) return pass(values.error());
      out.insert(out.end(), values->begin(), values->end());
    }
    return out;
  }
};

Result<ImprintPlan> plan_of(const std::string& scales, const std::string& kinds) {
  ImprintPlan out;
  std::stringstream words(kinds);
  for (std::string word; std::getline(words, word, '+');) {
    if ((word == "10" || word == "7") && !out.scales) {
      ci::ScaleOptions options;
      auto sigmas = scales_from(scales);
      if (!sigmas) return pass(sigmas.error(), "--scales");
      options.sigmas = std::move(*sigmas);
      options.form = word == "10" ? ci::Form::full : ci::Form::brief;
      auto features = ci::ScaleFeatures::make(options);
      if (!features) return pass(features.error(), "--scales");
      out.names.insert(out.names.end(), features->names().begin(), features->names().end());
      out.scales = std::move(*features);
    } else if (word == "laws3" || word == "laws5") {
      out.laws.push_back(word == "laws3" ? ci::LawsSize::three : ci::LawsSize::five);
      const auto names = ci::laws_names(out.laws.back());
      out.names.insert(out.names.end(), names.begin(), names.end());
    } else {
      return fail(Errc::parse, "no such features of imprints", "--imprint-features",
                  "10, 7, laws3, laws5 or a sum such as 10+laws5", kinds);
    }
  }
  if (out.names.empty())
    return fail(Errc::parse, "no features of imprints", "--imprint-features", "10", kinds);
  // The scales' features come first, whatever the order of the words was.
  if (out.scales) {
    const auto first = std::ranges::find(out.names, out.scales->names().front());
    const auto count = static_cast<std::ptrdiff_t>(out.scales->names().size());
    std::rotate(out.names.begin(), first, first + count);
  }
  return out;
}

}  // namespace

Result<classifier::FeatureMatrix> imprint_features(const Dataset& dataset,
                                                   const std::string& scales,
                                                   const std::string& kinds) {
  const auto imprints = imprints_of(dataset);
  if (!imprints) return pass(imprints.error());
  const auto plan = plan_of(scales, kinds);
  if (!plan) return pass(plan.error());
  const auto make_extract = [&]() -> ci::Extract {
    return [own = std::make_shared<ImprintPlan>(*plan)](const ci::Image& image) {
      return own->extract(image);
    };
  };
  auto out = ci::build_matrix(*imprints, plan->names, make_extract);
  if (!out) return pass(out.error());
  if (holds_scans(dataset)) return out;
  const auto trials = complete_trials(dataset);
  for (std::size_t i = 0; i < trials.size(); ++i) out->groups[i] = trials[i].group;
  return out;
}

double seconds_of_imprint_features(const Dataset& dataset, const std::string& scales,
                                   const std::string& kinds,
                                   const classifier::SecondsNow& seconds_now) {
  constexpr std::size_t timed = 16;
  const auto imprints = imprints_of(dataset);
  auto plan = plan_of(scales, kinds);
  if (!imprints || !plan || imprints->empty()) return 0.0;
  const std::size_t count = std::min(timed, imprints->size());
  double sum_s = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const ci::Image& image = (*imprints)[i].image;
    if (!plan->extract(image)) return 0.0;
    const double began_s = seconds_now();
    if (!plan->extract(image)) return 0.0;
    sum_s += seconds_now() - began_s;
  }
  return sum_s / static_cast<double>(count);
}

}  // namespace weft::daemon::cli
