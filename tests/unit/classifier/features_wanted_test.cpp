// An answer computes only the features that the model reads; the answer stays the same.

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>

#include "classifier/live/staged_model.hpp"
#include "classifier/model/stored_model.hpp"
#include "tests/unit/classifier/features_support.hpp"
#include "tests/unit/classifier/stored_model.hpp"

namespace weft::classifier::features_wanted_test {
namespace {

using testing::slide;

// Each block alone, and some combinations.
std::vector<BlockSet> masks() {
  std::vector<BlockSet> out{BlockSet{}, BlockSet{Block::norm, Block::range, Block::mode},
                            BlockSet{Block::mean, Block::sh}, BlockSet{Block::skew, Block::hfrq},
                            BlockSet::all()};
  for (const Block block : taxel_blocks) out.push_back({block});
  return out;
}

std::vector<double> copy_of(Result<std::span<const double>> features) {
  REQUIRE(features);
  return {features->begin(), features->end()};
}

void check_masks(const Trial& trial, const FeatureOptions& options) {
  const auto whole = copy_of(FeatureExtractor(options).extract(trial));
  const FeatureLayout layout(trial.taxels, phases_of(trial));
  for (const BlockSet mask : masks()) {
    FeatureExtractor extractor(options, mask);
    const auto some = copy_of(extractor.extract(trial));
    REQUIRE(some.size() == whole.size());
    for (std::size_t k = 0; k < some.size(); ++k) {
      const FeatureInfo& column = layout.columns()[k];
      CAPTURE(column.name, trial.taxels, trial.samples());
      CHECK(some[k] == (column.taxel == 0 || mask.has(column.block) ? whole[k] : 0.0));
    }
  }
}

TEST_CASE("wanted features are the same to the bit, the others 0") {
  for (const std::size_t taxels : {1U, 2U, 3U, 16U, 17U})
    for (const std::size_t motion : {1U, 2U, 3U, 16U, 64U, 131U})
      check_masks(slide(taxels, motion, taxels + motion), {});
  check_masks(slide(16, 90, 1), {SkewOf::signal, Norm::rms, 0.5, SpectrumScale::magnitude});
}

TEST_CASE("so are those of signals that are scaled, constant or far from zero") {
  Trial tiny = slide(2, 40, 1), far = tiny, still = tiny;
  for (double& v : tiny.counts) v *= 0x1p-400;
  for (double& v : far.counts) v = 1e9 + v / 1024;
  for (double& v : still.counts) v = 0.1;
  for (const Trial& trial : {tiny, far, still}) check_masks(trial, {});
}

TEST_CASE("a stream that wants other features at every stage gives what it gives of all") {
  const Trial trial = slide(16, 60, 5);
  FeatureStream some(16), all(16);
  const auto blocks = masks();
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    REQUIRE((some.add(trial.phase[i], trial.row(i)) && all.add(trial.phase[i], trial.row(i))));
    if (all.motion_frames() == 0) continue;
    const BlockSet mask = blocks[i % blocks.size()];
    const auto a = copy_of(some.features(mask)), b = copy_of(all.features());
    const FeatureLayout layout(16, all.phases());
    for (std::size_t k = 0; k < a.size(); ++k)
      if (mask.has(layout.columns()[k].block)) CHECK(a[k] == b[k]);
  }
}

TEST_CASE("a moment that was not requested may overflow") {
  Trial trial = slide(2, 20, 1);
  for (double& v : trial.counts) v *= 1e70;
  CHECK_FALSE(FeatureExtractor().extract(trial));
  CHECK(FeatureExtractor({}, {Block::max}).extract(trial));
  CHECK_FALSE(FeatureExtractor({}, {Block::m5}).extract(trial));
}

std::vector<Learner> learners() {
  std::vector<Learner> out;
  for (const Learner kind : all_learners())
    if (!is_choice(kind) && is_available(kind)) out.push_back(kind);
  return out;
}

StoredModel model_of(const Recipe& recipe) {
  StoredModel out = testing::trained(Learner::lda);
  const auto matrix = build_feature_matrix(testing::cloths(3, 6), {}, 1);
  auto learner = train_recipe(*matrix, recipe, {.trees = 20, .threads = 1});
  REQUIRE(learner);
  out.learner = std::move(*learner);
  return out;
}

void check_same_answers(const StoredModel& stored) {
  const std::vector<Trial> trials = testing::cloths(3, 9);
  const auto answers = classify(stored, trials);
  REQUIRE(answers);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const auto all = extract(trials[i], stored.setup.options);
    REQUIRE(all);
    const auto whole = stored.learner.predict(*all);
    const auto some =
        copy_of(FeatureExtractor(stored.setup.options, used_blocks(stored)).extract(trials[i]));
    const auto masked = stored.learner.predict(some);
    REQUIRE((whole && masked));
    CHECK(masked->score == whole->score);
    CHECK(masked->votes == whole->votes);
    CHECK((*answers)[i].ballot.winner == whole->winner);
  }
}

TEST_CASE("every learner answers as if all features were there") {
  for (const Learner kind : learners())
    for (const View view : {View::plain, View::compressed, View::ranked, View::normal_scores}) {
      CAPTURE(to_string(kind), to_string(view));
      check_same_answers(model_of({kind, 1, view}));
    }
  check_same_answers(model_of({Learner::lda, 20, View::components, 3}));
}

TEST_CASE("cores with few features and shallow trees leave blocks out, others do not") {
  const auto is_all = [](const StoredModel& stored) {
    const auto layout = FeatureLayout(stored.setup.taxels, stored.setup.phases);
    return std::ranges::all_of(layout.columns(), [&](const FeatureInfo& column) {
      return used_blocks(stored).has(column.block);
    });
  };
  CHECK_FALSE(is_all(model_of({Learner::pvalue, 1})));
  CHECK_FALSE(is_all(model_of({Learner::pvalue, 1, View::ranked})));
  CHECK_FALSE(is_all(model_of({Learner::tree, 1})));
  CHECK(is_all(model_of({Learner::pvalue, 1, View::components, 3})));
  for (const Learner kind : {Learner::pca, Learner::all, Learner::lda, Learner::knn})
    CHECK(is_all(model_of({kind, 1})));
}

TEST_CASE("columns of a recipe are named by their place among all") {
  const Recipe recipe{Learner::lda, 20, View::plain, 0, "two", {4, 30}};
  CHECK(model_of(recipe).learner.used_columns() == recipe.columns);
  CHECK(used_blocks(model_of(recipe)) == BlockSet{Block::max, Block::m5});
  Recipe of_cores = recipe;
  of_cores.learner = Learner::pvalue;
  of_cores.cap = 1;
  const StoredModel cores = model_of(of_cores);
  for (const std::size_t column : cores.learner.used_columns())
    CHECK((column == 4 || column == 30));
  check_same_answers(cores);
}

TEST_CASE("with the open-set rule every feature is computed") {
  StoredModel stored = testing::trained(Learner::pvalue, View::plain, true);
  CHECK(used_blocks(stored) == BlockSet::all());
  stored.postprocessing.reset();
  CHECK(used_blocks(stored) != BlockSet::all());
}

TEST_CASE("a live model answers as if all features were there") {
  StagedOptions options;
  options.learner = Learner::pvalue;
  options.training.cap = 1;
  options.training.threads = 1;
  std::vector<Trial> slides;
  for (std::size_t cloth = 0; cloth < 2; ++cloth)
    for (std::size_t i = 0; i < 4; ++i) {
      slides.push_back(slide(2, 80, 10 * cloth + i));
      slides.back().label = "cloth " + std::to_string(cloth);
      slides.back().group = std::to_string(i);
      for (double& v : slides.back().counts) v += 3.0 * static_cast<double>(cloth);
    }
  auto model = train_staged(slides, 40, options);
  REQUIRE(model);
  for (LiveStage& stage : model->stages) {
    stage.model.postprocessing.reset();
    CHECK(used_blocks(stage.model) != BlockSet::all());
  }
  LiveVoter voter(std::make_shared<const StagedModel>(*model));
  std::size_t answered = 0;
  for (std::size_t i = 0; i < slides.front().samples(); ++i) {
    const auto answer = voter.add(slides.front().phase[i], slides.front().row(i));
    REQUIRE(answer);
    if (!*answer) continue;
    const LiveStage& stage = model->stages[answered++];
    const auto all = extract(begun_slide(slides.front(), stage.motion_frames));
    REQUIRE(all);
    CHECK((*answer)->winner == *stage.model.learner.classify(*all));
  }
  CHECK(answered == model->stages.size());
}

}  // namespace
}  // namespace weft::classifier::features_wanted_test
