// The ten learners of the 2023 paper and two of ours behind one interface.

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "classifier/learners/decision_tree.hpp"
#include "classifier/vibro/learn/learners.hpp"
#include "classifier/vibro/learn/pipeline.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::vibro::vibro_learners_test {
namespace {

using classifier::testing::gaussian_classes;
using classifier::testing::normal;

struct Set {
  Matrix rows;
  std::vector<std::size_t> of_row;
  std::size_t classes = 0;
  [[nodiscard]] Training training() const { return {&rows, of_row, classes}; }
};

Set gaussian_set(std::size_t classes, std::size_t per_class, std::size_t features,
                 double separation, std::uint64_t seed) {
  Set out{gaussian_classes(classes, per_class, features, separation, seed).values, {}, classes};
  for (std::size_t r = 0; r < out.rows.rows(); ++r) out.of_row.push_back(r / per_class);
  return out;
}

MethodOptions quick(std::uint64_t seed = 1) {
  MethodOptions out;
  out.seed = seed;
  out.trees = 50;
  return out;
}

std::vector<std::size_t> predict_all(const Classifier& classifier, const Matrix& rows) {
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < rows.rows(); ++r) out.push_back(classifier.classify(rows.row(r)));
  return out;
}

double accuracy(const std::vector<std::size_t>& reply, const std::vector<std::size_t>& truth) {
  std::size_t right = 0;
  for (std::size_t i = 0; i < reply.size(); ++i) right += reply[i] == truth[i] ? 1 : 0;
  return static_cast<double>(right) / static_cast<double>(reply.size());
}

TEST_CASE("Every learner tells classes apart that lie apart, the same way every time") {
  const Set train = gaussian_set(4, 30, 3, 5.0, 1), test = gaussian_set(4, 20, 3, 5.0, 2);
  for (const Method method : all_methods()) {
    INFO(to_string(method));
    const auto made = fit(method, train.training(), quick());
    if (!available(method)) {
      REQUIRE_FALSE(made);
      CHECK(made.error().code == Errc::unsupported);
      continue;
    }
    REQUIRE(made);
    const auto reply = predict_all(**made, test.rows);
    CHECK(accuracy(reply, test.of_row) > 0.9);
    CHECK(predict_all(**fit(method, train.training(), quick()), test.rows) == reply);
  }
}

TEST_CASE("Learners have names, and unknown ones are refused") {
  for (const Method m : all_methods()) CHECK(method_from(to_string(m)).value() == m);
  CHECK_FALSE(method_from("knn"));
}

TEST_CASE("What cannot be learnt from rows is refused by every method") {
  const Set good = gaussian_set(2, 5, 2, 3.0, 3);
  for (const Method method : all_methods()) {
    INFO(to_string(method));
    Set bad = good;
    bad.rows(3, 1) = std::nan("");
    const auto refused = fit(method, bad.training(), quick());
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == std::string(to_string(method)) + ": row 3, feature 1");
    bad = good;
    bad.of_row.pop_back();
    CHECK_FALSE(fit(method, bad.training(), quick()));
    bad = good;
    bad.of_row[0] = 2;
    CHECK_FALSE(fit(method, bad.training(), quick()));
    bad.classes = 4;  // class 3 has no row
    CHECK_FALSE(fit(method, bad.training(), quick()));
    bad = good;
    bad.of_row.assign(10, 0);
    bad.classes = 1;
    CHECK_FALSE(fit(method, bad.training(), quick()));
    const std::vector<std::size_t> unit(9, 0);
    CHECK_FALSE(fit(method, {&good.rows, good.of_row, good.classes, unit}, quick()));
  }
}

TEST_CASE("Features without spread and rows that nothing tells apart do no harm") {
  Set set = gaussian_set(3, 10, 3, 5.0, 4);
  for (std::size_t r = 0; r < set.rows.rows(); ++r) set.rows(r, 2) = 7.0;
  Set same = set;
  std::fill(same.rows.data().begin(), same.rows.data().end(), 1.0);
  for (const Method method : all_methods()) {
    if (!available(method)) continue;
    INFO(to_string(method));
    const auto made = fit(method, set.training(), quick());
    REQUIRE(made);
    CHECK(accuracy(predict_all(**made, set.rows), set.of_row) > 0.85);
    const auto blind = fit(method, same.training(), quick());
    REQUIRE(blind);
    const auto reply = predict_all(**blind, same.rows);
    CHECK(reply.front() < 3);
    CHECK(reply == std::vector<std::size_t>(reply.size(), reply.front()));
  }
}

TEST_CASE("Features at the ends of double are learnt, each at its own scale") {
  const Set plain = gaussian_set(3, 20, 4, 5.0, 11);
  Set wide = plain;
  for (std::size_t r = 0; r < wide.rows.rows(); ++r) {
    wide.rows(r, 0) *= 1e-300;
    wide.rows(r, 1) *= 1e300;
    wide.rows(r, 3) *= 1e-310;
  }
  for (const Method method : all_methods()) {
    if (!available(method)) continue;
    INFO(to_string(method));
    const auto made = Pipeline::train(wide.training(), {method, 0, quick()});
    REQUIRE(made);
    std::size_t right = 0;
    for (std::size_t r = 0; r < wide.rows.rows(); ++r) {
      const auto reply = made->classify(wide.rows.row(r));
      REQUIRE(reply);
      right += *reply == wide.of_row[r] ? 1 : 0;
    }
    CHECK(100 * right > 85 * wide.rows.rows());
  }
}

TEST_CASE("A forest is the same on any number of threads and another with another seed") {
  const Set train = gaussian_set(4, 25, 4, 1.5, 5), test = gaussian_set(4, 50, 4, 1.5, 6);
  MethodOptions one = quick(), two = quick();
  one.threads = 1;
  two.threads = 2;
  const auto a = predict_all(*fit_forest(train.training(), one).value(), test.rows);
  CHECK(a == predict_all(*fit_forest(train.training(), two).value(), test.rows));
  CHECK(a != predict_all(*fit_forest(train.training(), quick(2)).value(), test.rows));
  one.trees = 0;
  CHECK_FALSE(fit_forest(train.training(), one));
}

TEST_CASE("A tree cuts between the values that part the classes") {
  Set set;
  set.rows = Matrix(6, 1);
  for (std::size_t r = 0; r < 6; ++r) set.rows(r, 0) = static_cast<double>(r);
  set.of_row = {0, 0, 1, 1, 1, 0};
  set.classes = 2;
  const auto tree = fit_tree(set.training(), quick()).value();
  CHECK(predict_all(*tree, set.rows) == set.of_row);
  for (const auto& [value, want] : {std::pair(1.49, 0U), {1.51, 1U}, {4.49, 1U}, {4.51, 0U}})
    CHECK(tree->classify(std::vector{value}) == want);
  const RankedRows ranked(set.rows, set.of_row, set.classes);
  RandomEngine engine(1);
  std::vector<double> importance(1, 0.0);
  const auto grown = DecisionTree::grow(ranked, {0, 1, 2, 3, 4, 5}, {1}, engine, importance);
  CHECK(grown.leaves() == 3);
  CHECK(importance[0] == Approx(1.0));
}

TEST_CASE("The forest finds which features matter") {
  Set set = gaussian_set(2, 100, 3, 4.0, 7);  // feature 0 alone tells two classes apart
  const auto importance = forest_importance(set.training(), quick()).value();
  CHECK(std::accumulate(importance.begin(), importance.end(), 0.0) == Approx(1.0));
  CHECK(importance[0] > 0.7);
}

TEST_CASE("Nearest neighbours vote, the lowest class of several wins") {
  Set set;
  set.rows = Matrix(5, 1);
  for (std::size_t r = 0; r < 5; ++r) set.rows(r, 0) = static_cast<double>(r);
  set.of_row = {2, 1, 1, 0, 0};
  set.classes = 3;
  CHECK(fit(Method::knn, set.training())->get()->classify(std::vector{0.0}) == 0);
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

TEST_CASE("A pipeline scales, turns to components and refuses what it was not trained for") {
  Set train = gaussian_set(4, 30, 5, 5.0, 9), test = gaussian_set(4, 30, 5, 5.0, 10);
  for (Set* set : {&train, &test})  // what tells apart is in four features, so in two components
    for (std::size_t r = 0; r < set->rows.rows(); ++r)
      for (std::size_t f = 0; f < 2; ++f) set->rows(r, f + 2) += set->rows(r, f);
  const auto whole = Pipeline::train(train.training(), {Method::knn, 0, quick()}).value();
  CHECK(whole.explained() == 1.0);
  const auto three = Pipeline::train(train.training(), {Method::knn, 3, quick()}).value();
  CHECK(three.explained() > 0.6);
  CHECK(three.explained() < 1.0);
  for (const Pipeline* p : {&whole, &three}) {
    std::size_t right = 0;
    for (std::size_t r = 0; r < test.rows.rows(); ++r)
      right += p->classify(test.rows.row(r)).value() == test.of_row[r] ? 1 : 0;
    CHECK(static_cast<double>(right) / static_cast<double>(test.rows.rows()) > 0.9);
  }
  // Units do not matter.
  const auto before = whole.classify(test.rows.row(0)).value();
  Set metres = train;
  for (std::size_t r = 0; r < metres.rows.rows(); ++r) metres.rows(r, 1) *= 1e-3;
  std::vector<double> row(test.rows.row(0).begin(), test.rows.row(0).end());
  row[1] *= 1e-3;
  CHECK(Pipeline::train(metres.training(), {Method::knn, 0, quick()})->classify(row).value() ==
        before);
  CHECK_FALSE(whole.classify(std::vector<double>(4, 0.0)));
  row[2] = std::nan("");
  CHECK_FALSE(whole.classify(row));
  train.rows(0, 0) = INFINITY;
  CHECK_FALSE(Pipeline::train(train.training(), {Method::knn, 3, quick()}));
  Matrix none;
  CHECK_FALSE(Pipeline::train({&none, {}, 0}, {}));
}

TEST_CASE("As many components as there are features, or more, turn all of them") {
  // Both features rise and fall together; their difference is what tells the classes apart.
  Set train = gaussian_set(2, 40, 2, 0.0, 3);
  for (std::size_t r = 0; r < train.rows.rows(); ++r)
    train.rows(r, 1) = train.rows(r, 0) + 0.1 * train.rows(r, 1) + (train.of_row[r] == 0 ? 0 : 0.6);
  const auto right = [&](const Pipeline& pipeline) {
    std::size_t out = 0;
    for (std::size_t r = 0; r < train.rows.rows(); ++r)
      out += pipeline.classify(train.rows.row(r)).value() == train.of_row[r] ? 1 : 0;
    return out;
  };
  const auto plain = Pipeline::train(train.training(), {Method::nb, 0, quick()}).value();
  CHECK(plain.components() == 0);
  for (const std::size_t requested : {2UL, 3UL, 99UL}) {
    const auto turned = Pipeline::train(train.training(), {Method::nb, requested, quick()}).value();
    CHECK(turned.components() == 2);
    CHECK(turned.explained() == Approx(1.0));
    CHECK(right(turned) > right(plain) + 10);
  }
  CHECK(Pipeline::train(train.training(), {Method::nb, 1, quick()})->components() == 1);
}

}  // namespace
}  // namespace weft::classifier::vibro::vibro_learners_test
