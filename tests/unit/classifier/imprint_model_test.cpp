// Models of imprints as files: equal after reading, and refusals.

#include <catch2/catch.hpp>

#include <sstream>

#include "classifier/imprint/imprint_model.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "tests/unit/classifier/damaged_model.hpp"

namespace weft::classifier::imprint::imprint_model_test {
namespace {

constexpr TaxelGrid grid{16, 12, 0.281e-3, 7};

// Stripes of two pitches, and a plain with bumps; whole counts of seven bits, with noise.
std::vector<Imprint> three_textures(std::uint64_t seed, std::size_t of_each = 6) {
  RandomEngine engine(seed);
  std::vector<Imprint> out;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < of_each; ++i) {
      Imprint one{Image(grid.rows, grid.cols), {}, std::string(1, static_cast<char>('a' + c)), {}};
      one.object = one.label + std::to_string(i / 2);
      one.file = one.label + "-" + std::to_string(i);
      for (std::size_t r = 0; r < grid.rows; ++r)
        for (std::size_t k = 0; k < grid.cols; ++k) {
          const bool high = c == 2 ? r % 5 == 2 && k % 5 == 2 : k / (c + 1) % 2 == 0;
          one.image(r, k) = (high ? 80.0 : 20.0) + static_cast<double>(random_below(engine, 9));
        }
      out.push_back(std::move(one));
    }
  return out;
}

ImprintModel trained(Learner learner, const FeaturePlan& plan = {}, bool postprocess = true) {
  const auto imprints = three_textures(1);
  const auto matrix = build_matrix(imprints, plan);
  REQUIRE(matrix);
  const auto chosen = train_learner(*matrix, learner, {});
  REQUIRE(chosen);
  ImprintModel out{chosen->trained, {grid, plan}, {"simulated", "abc", "1.2", "made up"}};
  if (postprocess) {
    auto postprocessing = fit_postprocessing(out.learner, *matrix, {});
    REQUIRE(postprocessing);
    out.postprocessing = std::move(*postprocessing);
  }
  return out;
}

std::string saved(const ImprintModel& model) {
  std::ostringstream out;
  REQUIRE(save_model(model, out));
  return out.str();
}

Result<ImprintModel> loaded(const std::string& text) {
  std::istringstream in(text);
  return load_model<ImprintSetup>(in);
}

void check_same_answers(const ImprintModel& a, const ImprintModel& b) {
  const auto requested = three_textures(77);
  const auto want = classify_imprints(a, grid, requested),
             got = classify_imprints(b, grid, requested);
  REQUIRE((want && got));
  REQUIRE(want->size() == requested.size());
  std::size_t right = 0;
  for (std::size_t i = 0; i < requested.size(); ++i) {
    const Prediction &w = (*want)[i], &g = (*got)[i];
    CHECK(g.ballot.winner == w.ballot.winner);
    CHECK(g.ballot.votes == w.ballot.votes);
    CHECK(g.ballot.decision == w.ballot.decision);
    CHECK(g.probability == w.probability);
    CHECK(g.none_of_these == w.none_of_these);
    right += b.learner.labels()[g.ballot.winner] == requested[i].label ? 1 : 0;
  }
  CHECK(right >= requested.size() - 2);
}

FeaturePlan plan_of(std::vector<double> sigmas, Form form, std::vector<LawsSize> laws) {
  FeaturePlan out{ScaleOptions{}, std::move(laws)};
  out.scales->sigmas = std::move(sigmas);
  out.scales->form = form;
  return out;
}

TEST_CASE("A model of imprints is read as it was written and answers the same") {
  FeaturePlan odd = plan_of({0.0, 1.5}, Form::brief, {LawsSize::five, LawsSize::three});
  odd.scales->noise = NoiseForm::literal;
  odd.scales->orientation = OrientationSpread::linear;
  odd.scales->thresholds = {0.7, 2.1};
  const FeaturePlan laws_alone{std::nullopt, {LawsSize::three}};
  for (const Learner learner :
       {Learner::lda, Learner::svc, Learner::trees, Learner::pvalue, Learner::all})
    for (const FeaturePlan& plan :
         {FeaturePlan{}, odd, laws_alone, plan_of({0.0, 1.0, 2.0}, Form::steps, {}),
          plan_of({0.0, 1.0, 2.0}, Form::extrema, {LawsSize::three}),
          FeaturePlan{std::nullopt, {LawsSize::five, LawsSize::three}, true}})
      for (const bool postprocess : {true, false}) {
        INFO(to_string(learner) << ", aids " << postprocess);
        const ImprintModel model = trained(learner, plan, postprocess);
        const std::string text = saved(model);
        const auto again = loaded(text);
        REQUIRE(again);
        CHECK(saved(*again) == text);
        CHECK(again->provenance.bench == "simulated");
        CHECK(again->learner.feature_names() == model.learner.feature_names());
        CHECK(again->postprocessing.has_value() == postprocess);
        check_same_answers(model, *again);
        const auto old = loaded(classifier::with_checksum("weft-imprint-model 1",
                                                          classifier::testing::older_body(text)));
        REQUIRE(old);
        check_same_answers(model, *old);
      }
}

TEST_CASE("A model file of imprints that is damaged, truncated or of another version is refused") {
  const std::string text = saved(trained(Learner::lda));
  classifier::testing::check_damage_is_refused(text, loaded);
  CHECK(loaded(classifier::with_checksum("weft-recording-model 1", "bench real\n")).error().code ==
        Errc::parse);
  CHECK(loaded("weft-recording-model 1\n").error().code == Errc::corrupt);
}

TEST_CASE("Features that are not those of the plan are not stored") {
  ImprintModel model = trained(Learner::lda);
  model.setup.features.scales->sigmas = {1.0, 2.0};
  std::ostringstream out;
  CHECK(!save_model(model, out));
  CHECK(out.str().empty());
}

TEST_CASE("A model of imprints refuses another array and names both") {
  const ImprintModel model = trained(Learner::lda);
  const auto requested = three_textures(2, 2);
  const auto refused = [&](const TaxelGrid& other) {
    const auto got = classify_imprints(model, other, requested);
    REQUIRE(!got);
    CHECK(got.error().what.find("another array") != std::string::npos);
    CHECK(got.error().expected == "16 x 12 taxels, 0.281 mm apart, counts of 7 bits");
    return got.error().got;
  };
  CHECK(refused({12, 16, 0.281e-3, 7}).starts_with("12 x 16 taxels"));
  CHECK(refused({16, 12, 0.5e-3, 7}).find("0.5 mm") != std::string::npos);
  CHECK(refused({16, 12, 0.281e-3, 8}).find("8 bits") != std::string::npos);
  CHECK(classify_imprints(model, grid, requested));
  CHECK(classify_imprints(model, {16, 12, 36e-3 / 128, 7}, requested));  // the same to 1 %
  CHECK(classify_imprints(model, {16, 12, 0.0, 0}, requested));  // the set does not state its
                                                                 // geometry
}

TEST_CASE("An imprint that its array cannot give is refused by name") {
  const ImprintModel model = trained(Learner::lda);
  auto requested = three_textures(2, 2);
  requested[3].image(4, 5) = 128.0;
  auto got = classify_imprints(model, grid, requested);
  REQUIRE(!got);
  CHECK(got.error().where.find(requested[3].file) != std::string::npos);
  CHECK(got.error().got.find("128") != std::string::npos);
  requested[3].image(4, 5) = -1.0;
  CHECK(!classify_imprints(model, grid, requested));
  requested[3].image = Image(16, 13, 20.0);
  got = classify_imprints(model, grid, requested);
  REQUIRE(!got);
  CHECK(got.error().got.find("16 x 13") != std::string::npos);
}

TEST_CASE("Arrays are the same where nothing that both know differs") {
  CHECK(is_same_grid(grid, grid));
  CHECK(is_same_grid(grid, {16, 12, 0.0, 7}));
  CHECK(is_same_grid({16, 12}, grid));
  CHECK(!is_same_grid(grid, {16, 12, 0.285e-3, 7}));
  CHECK(!is_same_grid(grid, {16, 12, 0.0, 8}));
  CHECK(format_grid({3, 4}) == "3 x 4 taxels, pitch not known, bits of a count not known");
}

}  // namespace
}  // namespace weft::classifier::imprint::imprint_model_test
