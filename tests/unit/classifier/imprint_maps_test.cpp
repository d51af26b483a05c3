// Maps of the contact, and the choice between them and texture.

#include <catch2/catch.hpp>
#include <sstream>

#include "classifier/imprint/feature_sets.hpp"
#include "classifier/imprint/imprint_model.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::imprint::imprint_maps_test {
namespace {

TEST_CASE("Pools of 2, 4 and 8 taxels over the sum, worked out by hand") {
  Image image(4, 5);
  image(0, 0) = 6.0;
  image(1, 1) = 2.0;
  image(3, 4) = 8.0;
  const auto maps = contact_maps(image);
  REQUIRE(maps);
  // 2 x 2: the last column's pools have two taxels; 4 x 4: the second has four. 8 x 8 is too large.
  CHECK(*maps ==
        std::vector<double>{8.0 / 4 / 16, 0, 0, 0, 0, 8.0 / 2 / 16, 8.0 / 16 / 16, 8.0 / 4 / 16});
  CHECK(map_names(4, 5) == std::vector<std::string>{"map2.r0c0", "map2.r0c1", "map2.r0c2",
                                                    "map2.r1c0", "map2.r1c1", "map2.r1c2",
                                                    "map4.r0c0", "map4.r0c1"});
  CHECK(map_names(28, 50).size() == 14 * 25 + 7 * 13 + 4 * 7);
  CHECK(map_names(1, 50).empty());
}

TEST_CASE("Maps of a press twice as hard are the same, of nothing zeros, of any count finite") {
  Image image(8, 8), harder(8, 8);
  for (std::size_t i = 0; i < 64; ++i) {
    image.data()[i] = static_cast<double>(i % 7);
    harder.data()[i] = 2.0 * image.data()[i];
  }
  CHECK(*contact_maps(image) == *contact_maps(harder));
  CHECK(*contact_maps(Image(8, 8)) == std::vector<double>(16 + 4 + 1));
  Image odd(8, 8, -1e100);
  odd(0, 0) = 1e100;
  const auto maps = contact_maps(odd);
  REQUIRE(maps);
  for (const double value : *maps) CHECK(std::abs(value) <= 1.0);
  image(3, 3) = std::nan("");
  CHECK_FALSE(contact_maps(image));
}

TEST_CASE("Maps need an array of their size") {
  const FeaturePlan maps{std::nullopt, {}, true};
  CHECK_FALSE(PlannedFeatures::make(maps, 1, 9));
  auto features = PlannedFeatures::make(maps, 4, 4);
  REQUIRE(features);
  CHECK(features->extract(Image(4, 4, 1.0)));
  CHECK_FALSE(features->extract(Image(4, 5, 1.0)));
}

constexpr TaxelGrid grid{12, 12, 0.0, 0};

// The same blob, with the same noise, in one of four corners with equal frequency: only its place
// reveals the class.
std::vector<Imprint> four_places(std::uint64_t seed) {
  RandomEngine engine(seed);
  std::vector<Imprint> out;
  for (std::size_t press = 0; press < 8; ++press)
    for (std::size_t c = 0; c < 4; ++c) {
      Imprint one{Image(12, 12), std::to_string(press) + std::to_string(c),
                  std::string(1, static_cast<char>('a' + c)),
                  std::to_string(press) + std::to_string(c)};
      const std::size_t top = c / 2 * 6 + 1, left = c % 2 * 6 + 1;
      for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t k = 0; k < 4; ++k)
          one.image(top + r, left + k) = 40.0 + static_cast<double>(random_below(engine, 20));
      out.push_back(std::move(one));
    }
  return out;
}

TEST_CASE("A choice selects maps where the place of the contact gives the class, and stores them") {
  const auto imprints = four_places(1);
  const FeaturePlan plan;
  const auto matrix = build_matrix(imprints, with_maps(plan));
  REQUIRE(matrix);
  const auto tried = feature_set_candidates(*matrix, plan, 20);
  CHECK(tried.size() == candidates(Learner::best).size() + 6);
  const auto chosen = train_best(*matrix, tried, {});
  REQUIRE(chosen);
  CHECK(chosen->recipe.features.starts_with("maps"));
  const FeaturePlan stored = chosen_plan(plan, chosen->recipe);
  CHECK(to_string(stored) == chosen->recipe.features);
  const UsedFeatures used = used_features(chosen->trained, *matrix);
  CHECK(used.matrix.names == used.learner.feature_names());
  // Also with the probabilities and the reject rule, which have the same number of features.
  auto postprocessing = fit_postprocessing(used.learner, used.matrix, {});
  REQUIRE(postprocessing);
  std::ostringstream text;
  REQUIRE(save_model(
      ImprintModel{
          used.learner, {grid, stored}, {"simulated", "", "", ""}, std::move(*postprocessing)},
      text));
  std::istringstream in(text.str());
  const auto again = load_model<ImprintSetup>(in);
  REQUIRE(again);
  CHECK(again->setup.features.maps);
  const auto others = four_places(2);
  const auto answers = classify_imprints(*again, grid, others);
  REQUIRE(answers);
  for (std::size_t i = 0; i < others.size(); ++i) {
    CHECK(again->learner.labels()[(*answers)[i].ballot.winner] == others[i].label);
    const auto whole = build_matrix(std::span(others).subspan(i, 1), with_maps(plan));
    REQUIRE(whole);
    CHECK(chosen->trained.classify(whole->values.row(0)).value() == (*answers)[i].ballot.winner);
  }
}

TEST_CASE("An array too small for maps is learnt from its texture") {
  std::vector<Imprint> flat;
  for (std::size_t i = 0; i < 8; ++i)
    flat.push_back({Image(1, 16, static_cast<double>(i)), std::to_string(i), i < 4 ? "a" : "b",
                    std::to_string(i)});
  const auto matrix = build_matrix(flat, with_maps({}));
  REQUIRE(matrix);
  CHECK(feature_set_candidates(*matrix, {}, 20).size() == candidates(Learner::best).size());
}

}  // namespace
}  // namespace weft::classifier::imprint::imprint_maps_test
