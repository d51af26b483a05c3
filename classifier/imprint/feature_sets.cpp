#include "classifier/imprint/feature_sets.hpp"

#include <algorithm>
#include <array>

#include "classifier/fabric/folds.hpp"

namespace weft::classifier::imprint {
namespace {

constexpr std::array learners_of_maps{Learner::lda, Learner::svc, Learner::trees};

Recipe on_columns(Recipe recipe, const std::string& name, std::size_t from, std::size_t to) {
  recipe.features = name;
  for (std::size_t k = from; k < to; ++k) recipe.columns.push_back(k);
  return recipe;
}

FeaturePlan maps_alone() {
  return {std::nullopt, {}, true};
}

}  // namespace

std::string to_string(const FeaturePlan& plan) {
  std::string out = plan.maps ? "+maps" : "";
  if (plan.scales) out += "+" + std::string(to_string(plan.scales->form));
  for (const LawsSize size : plan.laws) out += size == LawsSize::three ? "+laws3" : "+laws5";
  return out.empty() ? out : out.substr(1);
}

FeaturePlan with_maps(FeaturePlan plan) {
  plan.maps = true;
  return plan;
}

std::vector<std::size_t> columns_without_maps(const FeatureMatrix& matrix) {
  const auto first_map = std::ranges::find_if(
      matrix.names, [](const std::string& name) { return name.starts_with(map_prefix); });
  return numbers_below(static_cast<std::size_t>(first_map - matrix.names.begin()));
}

std::vector<Recipe> feature_set_candidates(const FeatureMatrix& matrix, const FeaturePlan& plan,
                                           std::size_t cap) {
  const std::size_t texture = columns_without_maps(matrix).size();
  const std::size_t all = matrix.names.size();
  std::vector<Recipe> out;
  for (const Recipe& recipe : candidates(Learner::best, cap))
    out.push_back(on_columns(recipe, to_string(plan), 0, texture));
  if (texture == all) return out;
  for (const Learner learner : learners_of_maps) {
    out.push_back(on_columns({learner, cap}, to_string(maps_alone()), texture, all));
    out.push_back(on_columns({learner, cap}, to_string(with_maps(plan)), 0, all));
  }
  return out;
}

FeaturePlan chosen_plan(const FeaturePlan& plan, const Recipe& recipe) {
  for (const FeaturePlan& one : {maps_alone(), with_maps(plan)})
    if (recipe.features == to_string(one)) return one;
  return plan;
}

UsedFeatures used_features(const TrainedLearner& learner, const FeatureMatrix& matrix) {
  if (learner.columns().empty()) return {learner, matrix};
  FeatureMatrix own = select_columns(matrix, learner.columns());
  TrainedLearner same(learner.kind(), learner.labels(), own.names, learner.view(),
                      learner.share_predictor());
  return {std::move(same), std::move(own)};
}

}  // namespace weft::classifier::imprint
