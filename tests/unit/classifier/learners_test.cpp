// Every learner of the registry behind one interface.

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "classifier/learners/decision_tree.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/learners/learners.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::learners_test {
namespace {

using classifier::testing::gaussian_classes;
using classifier::testing::normal;

struct Set {
  Matrix rows;
  std::vector<std::size_t> of_row;  ///< classes, labels "0" to "9"

  [[nodiscard]] FeatureMatrix matrix() const {
    FeatureMatrix out;
    out.values = rows;
    for (std::size_t f = 0; f < rows.cols(); ++f) out.names.push_back("f" + std::to_string(f));
    for (std::size_t r = 0; r < of_row.size(); ++r) {
      out.labels.push_back(std::to_string(of_row[r]));
      out.groups.emplace_back();
      out.files.push_back("r" + std::to_string(r));
    }
    return out;
  }
};

Set gaussian_set(std::size_t classes, std::size_t per_class, std::size_t features,
                 double separation, std::uint64_t seed) {
  Set out{gaussian_classes(classes, per_class, features, separation, seed).values, {}};
  for (std::size_t r = 0; r < out.rows.rows(); ++r) out.of_row.push_back(r / per_class);
  return out;
}

TrainOptions quick(std::uint64_t seed = 1) {
  TrainOptions out;
  out.seed = seed;
  out.trees = 50;
  return out;
}

/// All learners except those that choose between several.
std::vector<Learner> concrete_learners() {
  std::vector<Learner> out = all_learners();
  std::erase_if(out, is_choice);
  return out;
}

Result<TrainedLearner> fit(Learner learner, const Set& set, const TrainOptions& options = quick(),
                           std::size_t components = 0) {
  Recipe recipe;
  recipe.learner = learner;
  recipe.view = components > 0 ? View::components : View::standardised;
  recipe.components = components;
  return train_recipe(set.matrix(), recipe, options);
}

std::vector<std::size_t> predict_all(const TrainedLearner& learner, const Matrix& rows) {
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < rows.rows(); ++r)
    out.push_back(learner.classify(rows.row(r)).value());
  return out;
}

double accuracy(const std::vector<std::size_t>& reply, const std::vector<std::size_t>& truth) {
  std::size_t right = 0;
  for (std::size_t i = 0; i < reply.size(); ++i) right += reply[i] == truth[i] ? 1 : 0;
  return static_cast<double>(right) / static_cast<double>(reply.size());
}

TEST_CASE("Every learner tells classes apart that lie apart, the same way every time") {
  const Set train = gaussian_set(4, 30, 3, 5.0, 1), test = gaussian_set(4, 20, 3, 5.0, 2);
  for (const Learner learner : concrete_learners()) {
    INFO(to_string(learner));
    const auto made = fit(learner, train);
    if (!is_available(learner)) {
      REQUIRE_FALSE(made);
      CHECK(made.error().code == Errc::unsupported);
      continue;
    }
    REQUIRE(made);
    CHECK(made->kind() == learner);
    const auto reply = predict_all(*made, test.rows);
    CHECK(accuracy(reply, test.of_row) > 0.9);
    CHECK(predict_all(*fit(learner, train), test.rows) == reply);
  }
}

TEST_CASE("The winner has the largest score, and a score stands for every class") {
  const Set train = gaussian_set(3, 30, 3, 1.0, 12), test = gaussian_set(3, 30, 3, 1.0, 13);
  for (const Learner learner : concrete_learners()) {
    if (!is_available(learner)) continue;
    INFO(to_string(learner));
    const auto made = fit(learner, train);
    REQUIRE(made);
    std::size_t agree = 0;
    for (std::size_t r = 0; r < test.rows.rows(); ++r) {
      const auto scores = made->predict(test.rows.row(r));
      REQUIRE(scores);
      REQUIRE(scores->score.size() == 3);
      CHECK(scores->winner == made->classify(test.rows.row(r)).value());
      agree += place_of_largest(scores->score) == scores->winner ? 1 : 0;
    }
    // Votes of pairs count before their margins.
    const bool is_of_pairs =
        is_cores(learner) || learner == Learner::svc || learner == Learner::svm;
    CHECK(agree >= (is_of_pairs ? 70 : 90));
  }
}

TEST_CASE("Learners have names, and unknown ones are refused") {
  for (const Learner one : all_learners()) CHECK(learner_from(to_string(one)).value() == one);
  for (const auto& [name, learner] : {std::pair("kNN", Learner::knn),
                                      {"RForest", Learner::forest},
                                      {"LDA", Learner::lda},
                                      {"SVM", Learner::svm},
                                      {"Cores", Learner::all},
                                      {"cores", Learner::pvalue},
                                      {"cores-all", Learner::all},
                                      {"kesler-zscore", Learner::perceptron_zscore}})
    CHECK(learner_from(name).value() == learner);
  for (const char* wrong : {"", "Knn", "rf"}) CHECK_FALSE(learner_from(wrong));
  CHECK(single_learner_from("RForest").value() == Learner::forest);
  for (const char* choice : {"best", "cores-best"}) CHECK_FALSE(single_learner_from(choice));
}

TEST_CASE("Every learner refuses rows that it cannot learn from") {
  const Set good = gaussian_set(2, 5, 2, 3.0, 3);
  for (const Learner learner : concrete_learners()) {
    INFO(to_string(learner));
    Set bad = good;
    bad.rows(3, 1) = std::nan("");
    const auto refused = fit(learner, bad);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == "r3: f1");
    bad = good;
    bad.of_row.pop_back();
    CHECK_FALSE(fit(learner, bad));
    bad = good;
    bad.of_row.assign(10, 0);
    CHECK_FALSE(fit(learner, bad));
  }
  for (const Learner choice : {Learner::best, Learner::cores_best}) CHECK_FALSE(fit(choice, good));
}

TEST_CASE("Features without spread and rows that nothing tells apart do no harm") {
  Set set = gaussian_set(3, 10, 3, 5.0, 4);
  for (std::size_t r = 0; r < set.rows.rows(); ++r) set.rows(r, 2) = 7.0;
  Set same = set;
  std::fill(same.rows.data().begin(), same.rows.data().end(), 1.0);
  for (const Learner learner : concrete_learners()) {
    if (!is_available(learner)) continue;
    INFO(to_string(learner));
    const auto made = fit(learner, set);
    REQUIRE(made);
    CHECK(accuracy(predict_all(*made, set.rows), set.of_row) > 0.85);
    const auto blind = fit(learner, same);
    REQUIRE(blind);
    const auto reply = predict_all(*blind, same.rows);
    CHECK(reply.front() < 3);
    CHECK(reply == std::vector<std::size_t>(reply.size(), reply.front()));
  }
}

TEST_CASE("Features at the ends of double are learnt, each at its own scale") {
  Set wide = gaussian_set(3, 20, 4, 5.0, 11);
  for (std::size_t r = 0; r < wide.rows.rows(); ++r) {
    wide.rows(r, 0) *= 1e-300;
    wide.rows(r, 1) *= 1e300;
    wide.rows(r, 3) *= 1e-310;
  }
  for (const Learner learner : concrete_learners()) {
    if (!is_available(learner)) continue;
    INFO(to_string(learner));
    const auto made = fit(learner, wide);
    REQUIRE(made);
    CHECK(accuracy(predict_all(*made, wide.rows), wide.of_row) > 0.85);
  }
}

TEST_CASE("A forest is the same on any number of threads and another with another seed") {
  const Set train = gaussian_set(4, 25, 4, 1.5, 5), test = gaussian_set(4, 50, 4, 1.5, 6);
  TrainOptions one = quick(), two = quick();
  one.threads = 1;
  two.threads = 2;
  for (const Learner learner : {Learner::forest, Learner::trees}) {
    const auto a = predict_all(*fit(learner, train, one), test.rows);
    CHECK(a == predict_all(*fit(learner, train, two), test.rows));
    CHECK(a != predict_all(*fit(learner, train, quick(2)), test.rows));
  }
  one.trees = 0;
  CHECK_FALSE(fit(Learner::forest, train, one));
}

TEST_CASE("A tree cuts between the values that part the classes") {
  Set set;
  set.rows = Matrix(6, 1);
  for (std::size_t r = 0; r < 6; ++r) set.rows(r, 0) = static_cast<double>(r);
  set.of_row = {0, 0, 1, 1, 1, 0};
  const auto tree = fit(Learner::tree, set).value();
  CHECK(predict_all(tree, set.rows) == set.of_row);
  for (const auto& [value, want] : {std::pair(1.49, 0U), {1.51, 1U}, {4.49, 1U}, {4.51, 0U}})
    CHECK(tree.classify(std::vector{value}).value() == want);
  const RankedRows ranked(set.rows, set.of_row, 2);
  RandomEngine engine(1);
  std::vector<double> importance(1, 0.0);
  const auto grown = DecisionTree::grow(ranked, {0, 1, 2, 3, 4, 5}, {1}, engine, importance);
  CHECK(grown.leaves() == 3);
  CHECK(importance[0] == Approx(1.0));
}

TEST_CASE("The forest finds which features matter") {
  Set set = gaussian_set(2, 100, 3, 4.0, 7);  // only feature 0 separates the two classes
  const FeatureMatrix matrix = set.matrix();
  const Classes classes = find_classes(matrix);
  const auto importance = forest_importance({matrix, classes}, quick()).value();
  CHECK(std::accumulate(importance.begin(), importance.end(), 0.0) == Approx(1.0));
  CHECK(importance[0] > 0.7);
}

TEST_CASE("Nearest neighbours vote, the lowest class of several wins") {
  Set set;
  set.rows = Matrix(5, 1);
  for (std::size_t r = 0; r < 5; ++r) set.rows(r, 0) = static_cast<double>(r);
  set.of_row = {2, 1, 1, 0, 0};
  CHECK(fit(Learner::knn, set)->classify(std::vector{0.0}).value() == 0);
}

TEST_CASE("The minimum of a quadratic form and of Rosenbrock's valley are found") {
  const Slopes quadratic = [](const std::vector<double>& x, std::vector<double>& slope) {
    double value = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double weight = std::pow(10.0, static_cast<double>(i)), away = x[i] - 1.0;
      value += 0.5 * weight * away * away;
      slope[i] = weight * away;
    }
    return value;
  };
  for (const double v : minimum(quadratic, std::vector<double>(5, -3.0)))
    CHECK(v == Approx(1.0).margin(1e-3));
  const Slopes valley = [](const std::vector<double>& x, std::vector<double>& slope) {
    const double a = 1.0 - x[0], b = x[1] - x[0] * x[0];
    slope = {-2.0 * a - 400.0 * x[0] * b, 200.0 * b};
    return a * a + 100.0 * b * b;
  };
  const auto found = minimum(valley, {-1.2, 1.0});
  CHECK(found[0] == Approx(1.0).margin(1e-3));
  CHECK(found[1] == Approx(1.0).margin(1e-3));
}

TEST_CASE("A product of matrices is the sum of products at every size") {
  RandomEngine engine(8);
  for (const std::size_t rows : {1U, 5U, 6U, 7U, 13U}) {
    for (const std::size_t columns : {1U, 16U, 17U, 40U}) {
      const std::size_t inner = 9, stride = 16, padded = padded_columns(columns);
      std::vector<float> a(rows * stride), b(inner * padded), out(rows * padded);
      for (float& v : a) v = static_cast<float>(normal(engine));
      for (float& v : b) v = static_cast<float>(normal(engine));
      product(a.data(), rows, inner, stride, b.data(), padded, out.data());
      for (std::size_t r = 0; r < rows; ++r) {
        for (std::size_t c = 0; c < padded; ++c) {
          float want = 0.0F;
          for (std::size_t i = 0; i < inner; ++i) want += a[r * stride + i] * b[i * padded + c];
          CHECK(out[r * padded + c] == Approx(want).margin(1e-5));
        }
      }
    }
  }
}

TEST_CASE("Features are scaled, turned to components, and refused where they are others") {
  Set train = gaussian_set(4, 30, 5, 5.0, 9), test = gaussian_set(4, 30, 5, 5.0, 10);
  for (Set* set : {&train, &test})  // the difference is in four features, so in two components
    for (std::size_t r = 0; r < set->rows.rows(); ++r)
      for (std::size_t f = 0; f < 2; ++f) set->rows(r, f + 2) += set->rows(r, f);
  const auto explained = [](const TrainedLearner& learner) {
    return std::get<PrincipalComponents>(learner.view().table()).explained;
  };
  const auto whole = fit(Learner::knn, train).value();
  const auto three = fit(Learner::knn, train, quick(), 3).value();
  CHECK(explained(three) > 0.6);
  CHECK(explained(three) < 1.0);
  for (const TrainedLearner* one : {&whole, &three})
    CHECK(accuracy(predict_all(*one, test.rows), test.of_row) > 0.9);
  // Units do not matter.
  const auto before = whole.classify(test.rows.row(0)).value();
  Set metres = train;
  for (std::size_t r = 0; r < metres.rows.rows(); ++r) metres.rows(r, 1) *= 1e-3;
  std::vector<double> row(test.rows.row(0).begin(), test.rows.row(0).end());
  row[1] *= 1e-3;
  CHECK(fit(Learner::knn, metres)->classify(row).value() == before);
  CHECK_FALSE(whole.classify(std::vector<double>(4, 0.0)));
  row[2] = std::nan("");
  CHECK_FALSE(whole.classify(row));
  train.rows(0, 0) = INFINITY;
  CHECK_FALSE(fit(Learner::knn, train, quick(), 3));
  CHECK_FALSE(fit(Learner::knn, Set()));
}

TEST_CASE("As many components as there are features, or more, turn all of them") {
  // Both features rise and fall together; their difference separates the classes.
  Set train = gaussian_set(2, 40, 2, 0.0, 3);
  for (std::size_t r = 0; r < train.rows.rows(); ++r)
    train.rows(r, 1) = train.rows(r, 0) + 0.1 * train.rows(r, 1) + (train.of_row[r] == 0 ? 0 : 0.6);
  const auto right = [&](const TrainedLearner& learner) {
    return accuracy(predict_all(learner, train.rows), train.of_row);
  };
  const auto plain = fit(Learner::nb, train).value();
  CHECK(plain.view().width(2) == 2);
  for (const std::size_t requested : {2UL, 3UL, 99UL}) {
    const auto turned = fit(Learner::nb, train, quick(), requested).value();
    CHECK(turned.view().width(2) == 2);
    CHECK(std::get<PrincipalComponents>(turned.view().table()).explained == Approx(1.0));
    CHECK(right(turned) > right(plain) + 0.125);
  }
  CHECK(fit(Learner::nb, train, quick(), 1)->view().width(2) == 1);
}

TEST_CASE("A recipe of some columns looks at no other, and the better columns are chosen") {
  Set set = gaussian_set(2, 40, 3, 0.0, 21);
  for (std::size_t r = 0; r < set.rows.rows(); ++r)
    set.rows(r, 2) += set.of_row[r] == 0 ? -3.0 : 3.0;
  const FeatureMatrix matrix = set.matrix();
  Recipe blind, sees;
  blind.learner = sees.learner = Learner::lda;
  blind.columns = {0, 1};
  sees.columns = {2};
  const auto chosen = train_best(matrix, std::vector{blind, sees}, quick());
  REQUIRE(chosen);
  CHECK(chosen->recipe == sees);
  CHECK(accuracy(predict_all(chosen->trained, set.rows), set.of_row) > 0.95);
  CHECK(accuracy(predict_all(*train_recipe(matrix, blind, quick()), set.rows), set.of_row) < 0.8);
  Set other = set;
  for (std::size_t r = 0; r < set.rows.rows(); ++r) other.rows(r, 0) = other.rows(r, 1) = 1e6;
  CHECK(predict_all(chosen->trained, other.rows) == predict_all(chosen->trained, set.rows));
}

}  // namespace
}  // namespace weft::classifier::learners_test
