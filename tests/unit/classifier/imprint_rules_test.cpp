// The rules trained on imprints' features, and the four experiments, on small cases computed by
// hand.

#include <catch2/catch.hpp>
#include <limits>

#include "classifier/imprint/experiments.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/learners/linear_rule.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::imprint::imprint_rules_test {
namespace {

using Rows = std::vector<std::size_t>;
using Rounds = std::vector<Rows>;

Matrix rows_of(const std::vector<std::vector<double>>& rows) {
  Matrix out(rows.size(), rows.front().size());
  for (std::size_t r = 0; r < rows.size(); ++r)
    std::copy(rows[r].begin(), rows[r].end(), out.row(r).begin());
  return out;
}

SeparabilityOutcome separability_of(const Matrix& rows, const std::vector<std::size_t>& of_row,
                                    std::size_t classes) {
  const auto out = separability(rows, of_row, classes);
  REQUIRE(out);
  return *out;
}

TEST_CASE("two classes, worked out by hand: weights, rounds and the tie to the lowest class") {
  const Matrix rows = rows_of({{2.0}, {-1.0}});
  const std::vector<std::size_t> of_row{0, 1};
  const auto out = train_kesler(rows, of_row, 2, {});
  REQUIRE(out);
  // Round 1: (2, 1) ties and is right; (-1, 1) ties and is predicted as class 0: w1 = (-1, 1), w0 =
  // -w1.
  // Round 2: (2, 1): w0 gives 1, w1 gives -1; (-1, 1): w1 gives 2. No errors.
  CHECK(out->converged);
  CHECK(out->rounds == 2);
  CHECK(out->rule.weight()(0, 0) == 1.0);
  CHECK(out->rule.weight()(0, 1) == -1.0);
  CHECK(out->rule.weight()(1, 0) == -1.0);
  CHECK(out->rule.weight()(1, 1) == 1.0);
  CHECK(*out->rule.classify(std::vector{1.0}) == 0);  // both products are 0
  CHECK(*out->rule.classify(std::vector{0.5}) == 1);
}

TEST_CASE("the learning constant scales the weights and nothing else") {
  RandomEngine engine(8);
  Matrix rows(30, 4);
  std::vector<std::size_t> of_row;
  for (std::size_t r = 0; r < 30; ++r) {
    of_row.push_back(r % 3);
    for (std::size_t k = 0; k < 4; ++k)
      rows(r, k) = testing::normal(engine) + (k == r % 3 ? 4.0 : 0.0);
  }
  const auto one = train_kesler(rows, of_row, 3, {});
  const auto four = train_kesler(rows, of_row, 3, {.c = 4.0});
  REQUIRE(one);
  REQUIRE(four);
  CHECK(one->converged);
  CHECK(one->rounds == four->rounds);
  for (std::size_t i = 0; i < one->rule.weight().data().size(); ++i)
    CHECK(4.0 * one->rule.weight().data()[i] == four->rule.weight().data()[i]);
}

TEST_CASE("inseparable rows are reported: after 1000 rounds, and by the hull") {
  const Matrix exclusive = rows_of({{0, 0}, {1, 1}, {0, 1}, {1, 0}});
  const std::vector<std::size_t> of_row{0, 0, 1, 1};
  const auto out = train_kesler(exclusive, of_row, 2, {});
  REQUIRE(out);
  CHECK(!out->converged);
  CHECK(out->rounds == 1000);
  CHECK(out->mistakes > 0);
  CHECK(separability_of(exclusive, of_row, 2).verdict == Separability::not_separable);
  // The same point in two classes.
  CHECK(separability_of(rows_of({{1.0}, {2.0}, {1.0}}), {0, 0, 1}, 2).verdict ==
        Separability::not_separable);
}

TEST_CASE("raw features of unlike size keep a perceptron from what the hull proves in steps") {
  // Just separable in a feature of size 1, beside a useless one of size 1000.
  RandomEngine engine(12);
  Matrix rows(20, 2);
  std::vector<std::size_t> of_row;
  for (std::size_t r = 0; r < 20; ++r) {
    of_row.push_back(r % 2);
    rows(r, 0) = 1000.0 * testing::normal(engine);
    rows(r, 1) = 0.5 + (r % 2 == 0 ? 0.0 : 0.01);
  }
  const auto raw = train_kesler(rows, of_row, 2, {});
  const auto scaled = train_kesler(rows, of_row, 2, {.scaling = FeatureScaling::zscore});
  REQUIRE(raw);
  REQUIRE(scaled);
  CHECK(!raw->converged);
  CHECK(scaled->converged);
  const auto hull = separability_of(rows, of_row, 2);
  CHECK(hull.verdict == Separability::separable);
  CHECK(hull.steps < 20);
}

TEST_CASE("the hull agrees with how the rows were made, for many classes") {
  RandomEngine engine(21);
  for (int repeat = 0; repeat < 20; ++repeat) {
    Matrix truth(4, 6), rows(60, 5);
    for (double& w : truth.data()) w = testing::normal(engine);
    std::vector<std::size_t> of_row;
    for (std::size_t r = 0; r < 60; ++r) {
      for (std::size_t k = 0; k < 5; ++k) rows(r, k) = testing::normal(engine);
      std::vector<double> score(4);
      for (std::size_t c = 0; c < 4; ++c) {
        score[c] = truth(c, 5);
        for (std::size_t k = 0; k < 5; ++k) score[c] += truth(c, k) * rows(r, k);
      }
      of_row.push_back(
          static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin()));
    }
    CHECK(separability_of(rows, of_row, 4).verdict == Separability::separable);
    // A row in the middle of a class's own rows, with another label.
    const std::size_t own = of_row[0];
    Matrix more(61, 5);
    double members = 0;
    for (std::size_t r = 0; r < 60; ++r) {
      std::copy(rows.row(r).begin(), rows.row(r).end(), more.row(r).begin());
      if (of_row[r] != own) continue;
      ++members;
      for (std::size_t k = 0; k < 5; ++k) more(60, k) += rows(r, k);
    }
    for (std::size_t k = 0; k < 5; ++k) more(60, k) /= members;
    auto labels = of_row;
    labels.push_back((own + 1) % 4);
    CHECK(separability_of(more, labels, 4).verdict == Separability::not_separable);
  }
}

TEST_CASE("minimum squared error is the regression on indicators, worked out by hand") {
  // x = -1, 0, 3 of classes 0, 0, 1: the slope of the indicator of class 1 is cov / var.
  const auto rule = train_least_squares(rows_of({{-1.0}, {0.0}, {3.0}}),
                                        std::vector<std::size_t>{0, 0, 1}, 2, FeatureScaling::none);
  REQUIRE(rule);
  const double mean = 2.0 / 3.0, covariance = 3.0 * (1.0 - 1.0 / 3.0) + (1.0 / 3.0);
  const double spread = (25.0 + 4.0 + 49.0) / 9.0, slope = covariance / spread;
  CHECK(rule->weight()(1, 0) == Approx(slope));
  CHECK(rule->weight()(1, 1) == Approx(1.0 / 3.0 - slope * mean));
  CHECK(rule->weight()(0, 0) == Approx(-slope));
  CHECK(*rule->classify(std::vector{3.0}) == 1);
  CHECK(*rule->classify(std::vector{0.0}) == 0);
}

TEST_CASE("the four experiments set aside the stated imprints") {
  const std::vector<std::string> labels{"b", "b", "a", "a", "b", "b", "a", "a", "b"};
  const std::vector<std::string> objects{"B2", "B2", "A1", "A1", "B1", "B1", "A2", "A2", "B3"};
  CHECK(test_rounds(Experiment::one_of_all, labels, objects)->size() == 9);
  CHECK(*test_rounds(Experiment::object_of_all, labels, objects) ==
        Rounds{{0, 1}, {2, 3}, {4, 5}, {6, 7}, {8}});
  CHECK(*test_rounds(Experiment::one_of_class, labels, objects) ==
        Rounds{{0, 2}, {1, 3}, {4, 6}, {5, 7}});
  CHECK(*test_rounds(Experiment::object_of_class, labels, objects) ==
        Rounds{{0, 1, 2, 3}, {4, 5, 6, 7}});
  const std::vector<std::string> mixed{"B2", "B2", "B2", "A1", "B1", "B1", "A2", "A2", "B3"};
  CHECK(!test_rounds(Experiment::one_of_all, labels, mixed));
}

TEST_CASE("a round that leaves a class nothing to learn from is refused") {
  // Class b has one object, c one imprint.
  const std::vector<std::string> labels{"a", "a", "a", "a", "b", "b", "c"};
  const std::vector<std::string> objects{"A1", "A1", "A2", "A2", "B1", "B1", "C1"};
  FeatureMatrix matrix{{"f"}, Matrix(7, 1), labels, objects, labels};
  for (std::size_t r = 0; r < 7; ++r) matrix.values(r, 0) = static_cast<double>(r);
  for (const Experiment experiment : all_experiments) {
    const auto refused = run_experiment(matrix, experiment, Learner::least_squares);
    REQUIRE(!refused);
    CHECK(refused.error().where.find(to_string(experiment)) != std::string::npos);
  }
  const std::span<const std::string> without_c(labels.data(), 6), six(objects.data(), 6);
  const auto check = [&](Experiment experiment) {
    return check_rounds(test_rounds(experiment, without_c, six).value(), without_c);
  };
  CHECK(check(Experiment::one_of_all));
  CHECK(check(Experiment::one_of_class));
  CHECK(check(Experiment::object_of_all).error().where == "b");
  CHECK(check(Experiment::object_of_class).error().where == "b");
}

std::vector<Imprint> stripes() {
  RandomEngine engine(3);
  std::vector<Imprint> out;
  for (std::size_t i = 0; i < 24; ++i) {
    const std::size_t kind = i / 8, object = i / 2;
    Imprint one{Image(24, 24), "i" + std::to_string(i),
                std::string(1, static_cast<char>('a' + kind)), "o" + std::to_string(object)};
    for (std::size_t r = 0; r < 24; ++r)
      for (std::size_t c = 0; c < 24; ++c)
        one.image(r, c) =
            50.0 + (c / (2 + 2 * kind) % 2 == 0 ? 30.0 : 0.0) + testing::normal(engine);
    out.push_back(std::move(one));
  }
  return out;
}

TEST_CASE("every rule separates stripes of three widths, object by object") {
  const auto imprints = stripes();
  const auto matrix = build_matrix(imprints, ScaleOptions{.sigmas = {1.0, 2.0}});
  REQUIRE(matrix);
  CHECK(matrix->groups[3] == "o1");
  for (const Learner rule : table_learners) {
    const auto out = run_experiment(*matrix, Experiment::object_of_all, rule);
    REQUIRE(out);
    INFO(to_string(rule));
    CHECK(out->total == 24);
    CHECK(out->correct + out->wrong.size() == out->total);
    // A perceptron stops at the first line that separates its training rows.
    const bool perceptron = rule == Learner::perceptron || rule == Learner::perceptron_zscore;
    CHECK(out->wrong.size() <= (perceptron ? 2 : 0));
    CHECK(out->converged);
  }
}

TEST_CASE("the search ranks every set of scales, the best and smallest first") {
  const auto imprints = stripes();
  const auto ranked = search_scales(imprints, {.sigmas = {0, 1, 2, 3}, .most_scales = 2});
  REQUIRE(ranked);
  CHECK(ranked->size() == 10);
  CHECK(ranked->front().sigmas.size() == 1);
  CHECK(ranked->front().outcome.correct >= ranked->back().outcome.correct);
  const auto same =
      search_scales(imprints, {.sigmas = {0, 1, 2, 3}, .most_scales = 2, .threads = 1});
  for (std::size_t i = 0; i < 10; ++i) CHECK((*ranked)[i].sigmas == (*same)[i].sigmas);
  CHECK(!search_scales(imprints, {.sigmas = {}}));
  CHECK(!search_scales(imprints, {.sigmas = std::vector<double>(60, 1.0)}));
}

TEST_CASE("Laws' energies: names, a line's answer, small images") {
  CHECK(laws_names(LawsSize::three).size() == 8);
  CHECK(laws_names(LawsSize::five).size() == 24);
  CHECK(laws_names(LawsSize::three).front() == "laws.L3E3");
  Image image(6, 7);
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t c = 0; c < 7; ++c) image(r, c) = static_cast<double>(5 * c);
  const auto ramp = laws_energy(image, LawsSize::three);
  REQUIRE(ramp);
  CHECK((*ramp)[0] == 40.0);  // L3 down: 4; E3 along a slope of 5: 10
  for (std::size_t k = 1; k < 8; ++k) CHECK((*ramp)[k] == 0.0);
  for (const Image& flat : {Image(4, 9, 3.0), Image(40, 9, 127.0)}) {
    const auto none = laws_energy(flat, LawsSize::five);
    REQUIRE(none);
    CHECK(*none == std::vector<double>(24, 0.0));
  }
}

TEST_CASE("constant imprints give the rule for ties, or a perceptron that reports it") {
  std::vector<Imprint> flat;
  for (std::size_t i = 0; i < 8; ++i)
    flat.push_back({Image(9, 9, 40.0), "i" + std::to_string(i), i < 4 ? "a" : "b",
                    "o" + std::to_string(i / 2)});
  const auto matrix = build_matrix(flat, ScaleOptions{.sigmas = {0.0, 1.0}});
  REQUIRE(matrix);
  for (const double value : matrix->values.data()) CHECK(value == 0.0);
  for (const Learner rule : table_learners) {
    INFO(to_string(rule));
    const auto out = run_experiment(*matrix, Experiment::object_of_class, rule);
    REQUIRE(out);
    if (rule == Learner::perceptron || rule == Learner::perceptron_zscore) {
      CHECK_FALSE(out->converged);
      CHECK(out->most_rounds == KeslerOptions{}.most_rounds);
      continue;
    }
    CHECK(out->total == 8);
    // Equal products and discriminants give the first class. For two classes of an SVM with a
    // decision of 0, the second class gets the vote.
    const bool first =
        rule == Learner::least_squares || rule == Learner::ridge || rule == Learner::lda;
    CHECK(out->wrong == (first ? Rows{4, 5, 6, 7} : Rows{0, 1, 2, 3}));
  }
}

TEST_CASE("what cannot be learnt is refused") {
  const std::vector<std::size_t> of_row{0, 1};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(!train_kesler(rows_of({{nan}, {1.0}}), of_row, 2, {}));
  CHECK(!train_kesler(rows_of({{0.0}, {1.0}}), of_row, 1, {}));
  CHECK(!train_kesler(rows_of({{0.0}}), of_row, 2, {}));
  CHECK(!train_kesler(rows_of({{0.0}, {1.0}}), of_row, 2, {.c = 0.0}));
  CHECK(!train_kesler(rows_of({{0.0}, {1.0}}), of_row, 2, {.most_rounds = 0}));
  CHECK(!train_least_squares(rows_of({{nan}, {1.0}}), of_row, 2, FeatureScaling::zscore));
  CHECK(!separability(rows_of({{nan}, {1.0}}), of_row, 2));
  const auto rule = train_kesler(rows_of({{0.0}, {1.0}}), of_row, 2, {});
  REQUIRE(rule);
  CHECK(!rule->rule.classify(std::vector{1.0, 2.0}));
  CHECK(!rule->rule.classify(std::vector{nan}));
  CHECK(!build_matrix({}, ScaleOptions{}));
}

}  // namespace
}  // namespace weft::classifier::imprint::imprint_rules_test
