// Models at their limits: 1024 taxels, trained, used and stored; two identical fabrics.

#include <catch2/catch.hpp>

#include <sstream>

#include "classifier/model/stored_model.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::extremes_model_test {
namespace {

using testing::gaussian_classes;

constexpr std::size_t many_taxels = 1024;

// Two fabrics x `of_each` trials with all four phases; every eighth taxel of the second is louder.
std::vector<Trial> wide_trials(std::size_t of_each, std::uint64_t seed) {
  constexpr std::string_view phases = "SSPPMMMMMMMEE";
  RandomEngine engine(seed);
  std::vector<Trial> out;
  for (std::size_t i = 0; i < 2 * of_each; ++i) {
    const bool second = i >= of_each;
    Trial trial;
    trial.file = std::to_string(i) + ".csv";
    trial.label = second ? "felt" : "denim";
    trial.taxels = many_taxels;
    for (const char phase : phases) {
      trial.phase.push_back(phase_from_char(phase).value());
      for (std::size_t t = 0; t < many_taxels; ++t)
        trial.counts.push_back(1000.0 + (second && t % 8 == 0 ? 40.0 : 0.0) +
                               static_cast<double>(random_below(engine, 16)));
    }
    out.push_back(std::move(trial));
  }
  return out;
}

TEST_CASE("Extremes: 1024 taxels with all phases are learnt, asked and stored") {
  const auto matrix = build_feature_matrix(wide_trials(4, 1), {}, 1);
  REQUIRE(matrix);
  CHECK(matrix->names.size() == 3 + 12 * many_taxels);
  const std::vector<Trial> requested = wide_trials(3, 2);
  for (const Learner kind :
       {Learner::pvalue, Learner::pca, Learner::all, Learner::lda, Learner::svc, Learner::trees}) {
    INFO(to_string(kind));
    auto learner = train_recipe(*matrix, {kind, 20, View::plain}, {});
    REQUIRE(learner);
    const StoredModel model{std::move(*learner),
                            {many_taxels, {true, true, true}, {}, 0.0, 0.0, 0.028, "M1"},
                            {"simulated", "abc123", "0.1.0", "made up"}};
    std::stringstream file;
    REQUIRE(save_model(model, file));
    const auto again = load_model<FeatureSetup>(file);
    REQUIRE(again);
    for (const Trial& trial : requested) {
      const auto features = extract(trial, model.setup.options);
      REQUIRE(features);
      const auto reply = predict(model.learner, model.postprocessing, *features);
      const auto same = predict(again->learner, again->postprocessing, *features);
      REQUIRE((reply && same));
      CHECK(model.learner.labels()[reply->ballot.winner] == trial.label);
      CHECK(same->ballot.winner == reply->ballot.winner);
      CHECK(same->ballot.decision == reply->ballot.decision);
      for (const double f : reply->ballot.decision) CHECK(std::isfinite(f));
    }
  }
}

// Classes "classa" and "twin" with equal rows, and a third far from both.
FeatureMatrix duplicates_and_another() {
  FeatureMatrix out = gaussian_classes(3, 6, 8, 40.0, 2);
  for (std::size_t r = 0; r < 6; ++r) {
    std::copy(out.values.row(r).begin(), out.values.row(r).end(), out.values.row(6 + r).begin());
    out.labels[6 + r] = "twin";
  }
  return out;
}

TEST_CASE("Extremes: of two identical classes one is answered by the rule for ties, not a third") {
  const FeatureMatrix matrix = duplicates_and_another();  // labels: classa, classc, twin
  constexpr std::size_t first = 0, third = 1, duplicate = 2, duplicate_core = 1;
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    INFO(to_string(r));
    const auto model = train(matrix, {.reduction = r});
    REQUIRE(model);
    REQUIRE(model->pairs()[duplicate_core].b == duplicate);
    const auto votes = testing::votes_on(*model, matrix);
    for (std::size_t row = 0; row < matrix.size(); ++row) {
      const Vote& vote = votes[row];
      for (const double f : vote.decision) CHECK(std::isfinite(f));
      CHECK(std::abs(vote.decision[duplicate_core]) < 1e-9);
      const bool is_third = matrix.labels[row] == "classc";
      CHECK(vote.votes[third] == (is_third ? 2 : 0));
      if (is_third) CHECK(vote.winner == third);
      // A decision of a core above 0 is a vote for the first class, otherwise for the second.
      else
        CHECK(vote.winner == (vote.decision[duplicate_core] > 0.0 ? first : duplicate));
    }
    for (std::size_t row = 0; row < 6; ++row) CHECK(votes[row].decision == votes[6 + row].decision);
  }
  const auto lda = train_recipe(matrix, {Learner::lda, 20, View::plain}, {});
  REQUIRE(lda);
  for (std::size_t row = 0; row < matrix.size(); ++row)  // the lowest of equal discriminants
    CHECK(lda->classify(matrix.values.row(row)).value() ==
          (matrix.labels[row] == "classc" ? third : first));
  const auto trees = train_recipe(matrix, {Learner::trees, 20, View::plain}, {});
  REQUIRE(trees);
  for (std::size_t row = 0; row < matrix.size(); ++row)  // leaves that no split makes pure
    CHECK(trees->classify(matrix.values.row(row)).value() ==
          (matrix.labels[row] == "classc" ? third : first));
}

}  // namespace
}  // namespace weft::classifier::extremes_model_test
