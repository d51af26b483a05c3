#include "daemon/apps/weft/imprint_features.hpp"

#include <algorithm>
#include <array>
#include <sstream>

#include "classifier/imprint/feature_sets.hpp"
#include "classifier/imprint/imprint_model.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {

namespace ci = classifier::imprint;

Result<std::vector<double>> scales_from(std::string_view text) {
  const auto list = parse_image_csv("scales", std::string(text) + "\n");
  if (!list)
    return fail({.code = Errc::parse,
                 .what = "scales are not numbers",
                 .expected = "numbers such as 1,2,4",
                 .got = std::string(text)});
  return list->data();
}

namespace {

std::vector<std::string> strings(std::span<const std::string_view> names) {
  return {names.begin(), names.end()};
}

// Kind at the position of a name, which must be present.
template <class Kind>
Kind kind_named(std::span<const std::string_view> names, std::string_view name) {
  return static_cast<Kind>(std::ranges::find(names, name) - names.begin());
}

}  // namespace

void EdgeChoice::apply_to(ci::ScaleOptions& scales) const {
  scales.noise = kind_named<ci::NoiseForm>(ci::noise_names, noise);
  scales.orientation = kind_named<ci::OrientationSpread>(ci::orientation_names, orientation);
}

void add_edge_options(CLI::App& command, EdgeChoice& choice) {
  add_keyword(command, "--noise", choice.noise, strings(ci::noise_names),
              "convert third differences of imprints to gradient noise, or leave them as is");
  add_keyword(command, "--orientation", choice.orientation, strings(ci::orientation_names),
              "compute the spread of orientations of imprints modulo pi, or of the angle");
}

Result<ci::FeaturePlan> feature_plan_from(const std::string& scales, const std::string& kinds,
                                          const EdgeChoice& edges) {
  ci::FeaturePlan out{std::nullopt, {}, false};
  std::stringstream words(kinds);
  for (std::string word; std::getline(words, word, '+');) {
    if (std::ranges::find(ci::form_names, word) != ci::form_names.end() && !out.scales) {
      auto sigmas = scales_from(scales);
      if (!sigmas) return pass(sigmas.error(), "--scales");
      out.scales.emplace();
      out.scales->sigmas = std::move(*sigmas);
      out.scales->form = kind_named<ci::Form>(ci::form_names, word);
      edges.apply_to(*out.scales);
      if (const auto features = ci::ScaleFeatures::make(*out.scales); !features)
        return pass(features.error(), "--scales");
    } else if (word == "laws3" || word == "laws5") {
      out.laws.push_back(word == "laws3" ? ci::LawsSize::three : ci::LawsSize::five);
    } else if (word == "maps" && !out.maps) {
      out.maps = true;
    } else {
      return fail(
          {.code = Errc::parse,
           .where = "features of imprints",
           .what = "unknown imprint features",
           .expected = "10, 7, steps, extrema, laws3, laws5, maps or a sum such as 10+laws5",
           .got = kinds});
    }
  }
  constexpr std::size_t any_side = 8;  // too small arrays are found on reading
  if (const auto features = ci::PlannedFeatures::make(out, any_side, any_side); !features)
    return pass(features.error(), "features of imprints");
  return out;
}

std::vector<std::string> imprint_groups(const Dataset& dataset,
                                        std::span<const ci::Imprint> imprints) {
  std::vector<std::string> out;
  if (holds_scans(dataset))
    for (const ci::Imprint& one : imprints) out.push_back(one.object);
  else
    for (const classifier::Trial& trial : complete_trials(dataset)) out.push_back(trial.group);
  return out;
}

Result<classifier::FeatureMatrix> imprint_features(const Dataset& dataset,
                                                   const ci::FeaturePlan& plan) {
  const auto imprints = extract_imprints(dataset);
  if (!imprints) return pass(imprints.error());
  auto out = ci::build_matrix(*imprints, plan);
  if (!out) return pass(out.error());
  out->groups = imprint_groups(dataset, *imprints);
  return out;
}

Result<ChosenTrials> load_imprints(const Dataset& dataset, const TrialChoice& choice) {
  auto plan = feature_plan_from(choice.scales, choice.imprint_features, choice.edges);
  if (!plan) return pass(plan.error());
  const bool is_named =
      std::ranges::any_of(std::array{"--imprint-features", "--scales", "--noise", "--orientation"},
                          [&](const char* option) { return choice.given.contains(option); });
  auto features = imprint_features(dataset, is_named ? *plan : ci::with_maps(*plan));
  if (!features) return pass(features.error());
  if (choice.group != recorded_column)
    for (std::size_t r = 0; const classifier::Trial& trial : complete_trials(dataset))
      features->groups[r++] = trial.group;
  ChosenTrials out;
  if (!is_named) {
    out.with_maps = std::move(*features);
    features = select_columns(*out.with_maps, ci::columns_without_maps(*out.with_maps));
  }
  out.imprint_plan = std::move(*plan);
  const auto imprints = extract_imprints(dataset);
  if (!imprints) return pass(imprints.error());
  const ci::Image& first = imprints->front().image;
  out.setup.taxels = first.rows() * first.cols();  // all taxels of an imprint
  out.setup.exploration = imprint_exploration;
  out.strokes = features->size();
  out.features = std::move(*features);
  out.digests = ci::content_digests(*imprints);
  return out;
}

LearningTask learning_task(const ChosenTrials& chosen, classifier::Learner learner,
                           std::size_t cap) {
  if (learner == classifier::Learner::best && chosen.with_maps)
    return {*chosen.with_maps,
            ci::feature_set_candidates(*chosen.with_maps, *chosen.imprint_plan, cap)};
  return {chosen.features, classifier::candidates(learner, cap)};
}

}  // namespace weft::daemon::cli
