// The kinds of vote: the cores that they use, and their predictions.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "classifier/vote/vote.hpp"
#include "tests/bench/vote_costs.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::vote_kinds_test {
namespace {

// A core with the constant decision `f`.
FabricCore constant_core(double f) {
  return {{}, Reducer({0}, {{0.0}, {1.0}}, {}), Matrix(0, 1), {}, f};
}

FabricModel constant_model(std::vector<std::string> labels, const std::vector<double>& decision) {
  std::vector<FabricCore> cores;
  for (const double f : decision) cores.push_back(constant_core(f));
  return {std::move(labels), {"x"}, Reduction::all, std::move(cores)};
}

std::string numbered(std::size_t n) {
  return "fabric " + std::to_string(100 + n);
}

// Class c lies at x = c; cores are steps half-way between two classes.
FabricModel ladder(std::size_t classes) {
  std::vector<std::string> labels;
  for (std::size_t c = 0; c < classes; ++c) labels.push_back(numbered(c));
  std::vector<FabricCore> cores;
  for (const auto& [a, b] : all_pairs(classes)) {
    CoreInfo info;
    info.gamma = 0.5;
    Matrix support(2, 1);
    support(0, 0) = static_cast<double>(a);
    support(1, 0) = static_cast<double>(b);
    cores.push_back({info, Reducer({0}, {{0.0}, {1.0}}, {}), std::move(support), {1.0, -1.0}, 0.0});
  }
  return {std::move(labels), {"x"}, Reduction::all, std::move(cores)};
}

TEST_CASE("the place of a pair's core is its place in the list of all pairs") {
  for (const std::size_t classes : {2U, 3U, 17U, 60U}) {
    const std::vector<Pair> pairs = all_pairs(classes);
    for (std::size_t i = 0; i < pairs.size(); ++i)
      CHECK(pair_index(pairs[i].a, pairs[i].b, classes) == i);
  }
}

TEST_CASE("the majority is the model's own vote") {
  const FeatureMatrix matrix = testing::gaussian_classes(4, 6, 4, 2.0, 3);
  const auto model = train(matrix, {});
  REQUIRE(model);
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto ballot = vote(*model, matrix.values.row(r));
    const auto expected = model->classify(matrix.values.row(r));
    REQUIRE(ballot);
    REQUIRE(expected);
    CHECK(ballot->winner == expected->winner);
    CHECK(ballot->votes == expected->votes);
    CHECK(ballot->support == expected->support);
    CHECK(ballot->decision == expected->decision);
    CHECK(ballot->cores == 6);
  }
}

// a beats b narrowly, b beats c widely, c beats a narrowly: one vote each.
TEST_CASE("a tie of votes goes to the largest support, a tie of both to the first label") {
  const double x[] = {0.0};
  const FabricModel circle = constant_model({"a", "b", "c"}, {0.1, -0.1, 2.0});
  CHECK(vote(circle, x, {VoteKind::majority, 20, nullptr})->winner == 1);
  CHECK(vote(circle, x, {VoteKind::soft, 20, nullptr})->winner == 1);
  const FabricModel even = constant_model({"a", "b", "c"}, {0.5, -0.5, 0.5});
  CHECK(vote(even, x, {VoteKind::majority, 20, nullptr})->winner == 0);
  CHECK(vote(even, x, {VoteKind::soft, 20, nullptr})->winner == 0);
}

// a wins both its pairs narrowly, b loses to a narrowly and wins widely against c.
TEST_CASE("the soft vote prefers a wide win to many narrow ones") {
  const double x[] = {0.0};
  const FabricModel model = constant_model({"a", "b", "c"}, {0.01, 0.01, 3.0});
  CHECK(vote(model, x, {VoteKind::majority, 20, nullptr})->winner == 0);
  CHECK(vote(model, x, {VoteKind::soft, 20, nullptr})->winner == 1);
}

TEST_CASE("one lost duel is final in a DAG") {
  const double x[] = {0.0};
  // d beats a narrowly, in the first pair; a wins widely against b and c; b beats c and d, c beats
  // d
  const FabricModel model = constant_model({"a", "b", "c", "d"}, {5, 5, -0.1, 1, 1, 1});
  CHECK(vote(model, x)->winner == 0);
  const auto ballot = vote(model, x, {VoteKind::dag, 20, nullptr});
  REQUIRE(ballot);
  CHECK(ballot->winner == 1);
  CHECK(ballot->votes == std::vector<int>{0, 2, 0, 1});
  CHECK(ballot->cores == 3);
  CHECK(ballot->classes.empty());
}

TEST_CASE("a DAG asks exactly one core less than there are classes and finds the middle of each") {
  for (const std::size_t classes : {2U, 3U, 17U, 60U}) {
    const FabricModel model = ladder(classes);
    for (std::size_t c = 0; c < classes; ++c) {
      const double x[] = {static_cast<double>(c)};
      const auto ballot = vote(model, x, {VoteKind::dag, 20, nullptr});
      REQUIRE(ballot);
      CHECK(ballot->cores == classes - 1);
      CHECK(ballot->winner == c);
    }
  }
}

FeatureMatrix sixty_classes(std::size_t per_class, std::uint64_t seed) {
  RandomEngine engine(seed);
  FeatureMatrix out;
  constexpr std::size_t features = 12;
  out.values = Matrix(60 * per_class, features);
  for (std::size_t k = 0; k < features; ++k)
    out.names.push_back(std::string("f").append(std::to_string(k)));
  for (std::size_t r = 0; r < out.values.rows(); ++r) {
    RandomEngine place(r / per_class + 1);  // of the class, the same for every seed
    for (std::size_t k = 0; k < features; ++k)
      out.values(r, k) = 4.0 * testing::normal(place) + testing::normal(engine);
    out.labels.push_back(numbered(r / per_class));
    out.groups.emplace_back("1");
    out.files.push_back(std::to_string(r));
  }
  return out;
}

TEST_CASE("sixty Gaussian classes: every kind of vote asks for the cores that it should") {
  TrainOptions options;
  options.grid = {{8.0}, {0x1p-5}, {0.05}, {0.99}};
  const FeatureMatrix train_part = sixty_classes(4, 11), test_part = sixty_classes(2, 12);
  const auto model = train(train_part, options);
  REQUIRE(model);
  const auto profile = fit_profile(train_part, model->labels());
  REQUIRE(profile);
  const auto costs = compare_votes(*model, *profile, test_part, {}, 10);
  REQUIRE(costs);
  REQUIRE(costs->size() == 4);
  const std::vector<double> cores{1770, 1770, 59, 45};
  for (std::size_t k = 0; k < 4; ++k) {
    INFO(to_string((*costs)[k].kind) << " is right on " << (*costs)[k].correct);
    CHECK((*costs)[k].cores_per_trial == cores[k]);
    CHECK((*costs)[k].trials == 120);
    CHECK((*costs)[k].accuracy > 0.9);
    CHECK((*costs)[k].seconds_per_trial == 0.0);
  }
  CHECK(costs->front().as_majority == 120);
}

TEST_CASE("a short-list of all classes votes as all do, one of a single class is its mean's") {
  const FeatureMatrix matrix = testing::gaussian_classes(5, 6, 4, 1.0, 5);
  const auto model = train(matrix, {});
  REQUIRE(model);
  const auto profile = fit_profile(matrix, model->labels());
  REQUIRE(profile);
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto x = matrix.values.row(r);
    const auto all = vote(*model, x, {VoteKind::shortlist, 99, &*profile});
    const auto one = vote(*model, x, {VoteKind::shortlist, 1, &*profile});
    REQUIRE(all);
    REQUIRE(one);
    CHECK(all->winner == model->classify(x)->winner);
    CHECK(all->cores == 10);
    const auto distance = scaled_distances(profile->mean, profile->deviation, x);
    CHECK(distance[one->winner] == *std::min_element(distance.begin(), distance.end()));
    CHECK(one->cores == 0);
  }
}

TEST_CASE("distances to class means are L1 in units of the deviation within classes") {
  FeatureMatrix matrix;
  matrix.names = {"u", "v"};
  matrix.values = Matrix(4, 2);
  matrix.labels = {"a", "a", "b", "b"};
  matrix.groups = matrix.files = {"1", "2", "3", "4"};
  const double u[] = {-1, 1, 9, 11}, v[] = {5, 5, 7, 7};
  for (std::size_t r = 0; r < 4; ++r) {
    matrix.values(r, 0) = u[r];
    matrix.values(r, 1) = v[r];
  }
  const auto profile = fit_profile(matrix, std::vector<std::string>{"a", "b"});
  REQUIRE(profile);
  CHECK(profile->deviation[0] == Approx(1.0));
  CHECK(profile->deviation[1] == Approx(1.0));  // constant within classes: the deviation of all
                                                // rows
  const double x[] = {4.0, 5.0};
  const auto distance = scaled_distances(profile->mean, profile->deviation, x);
  CHECK(distance[0] == Approx(2.0));
  CHECK(distance[1] == Approx(4.0));
  CHECK(nearest_classes(*profile, x, 1) == std::vector<std::size_t>{0});
  const double middle[] = {5.0, 6.0};
  CHECK(nearest_classes(*profile, middle, 1) == std::vector<std::size_t>{0});
}

TEST_CASE("what cannot be voted on is refused with a reason") {
  const FabricModel model = ladder(3);
  const double two[] = {1.0, 2.0};
  CHECK(vote(model, two).error().got == "2");
  const double nan[] = {std::numeric_limits<double>::quiet_NaN()};
  CHECK(vote(model, nan).error().where == "x");
  const double x[] = {0.0};
  CHECK_FALSE(vote(model, x, {VoteKind::shortlist, 2, nullptr}));
  ClassProfile other{Matrix(4, 1), {1.0}};
  CHECK_FALSE(vote(model, x, {VoteKind::shortlist, 2, &other}));
  ClassProfile own{Matrix(3, 1), {1.0}};
  CHECK_FALSE(vote(model, x, {VoteKind::shortlist, 0, &own}));
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(vote(constant_model({"a", "b"}, {inf}), x, {VoteKind::dag, 2, nullptr}).error().code ==
        Errc::range);
  CHECK_FALSE(vote_kind_from("loudest"));
  for (const VoteKind kind :
       {VoteKind::majority, VoteKind::soft, VoteKind::dag, VoteKind::shortlist})
    CHECK(vote_kind_from(to_string(kind)).value() == kind);
}

TEST_CASE("votes at the ends of double stay free of NaN") {
  const FabricModel model = ladder(4);
  const ClassProfile profile{Matrix(4, 1), {std::numeric_limits<double>::min()}};
  for (const double value : {1.7e308, -1.7e308, 5e-324, 0.0}) {
    const double x[] = {value};
    for (const VoteKind kind :
         {VoteKind::majority, VoteKind::soft, VoteKind::dag, VoteKind::shortlist}) {
      const auto ballot = vote(model, x, {kind, 2, &profile});
      REQUIRE(ballot);
      for (const double s : ballot->support) CHECK(std::isfinite(s));
    }
    for (const double d : scaled_distances(profile.mean, profile.deviation, x))
      CHECK_FALSE(std::isnan(d));
  }
}

TEST_CASE("votes are compared on trials of known labels only") {
  const FeatureMatrix matrix = testing::gaussian_classes(3, 5, 3, 2.0, 4);
  const auto model = train(matrix, {});
  REQUIRE(model);
  FeatureMatrix unknown_label = matrix;
  unknown_label.labels[2] = "velvet";
  CHECK(compare_votes(*model, {}, unknown_label).error().got == "velvet");
  CHECK_FALSE(compare_votes(*model, {}, FeatureMatrix{matrix.names, {}, {}, {}, {}}));
  CHECK(compare_votes(*model, {}, matrix)->size() == 3);  // no profile, no short-list
  FeatureMatrix renamed = matrix;
  renamed.names[0] = "other";
  CHECK_FALSE(compare_votes(*model, {}, renamed));
}

}  // namespace
}  // namespace weft::classifier::vote_kinds_test
