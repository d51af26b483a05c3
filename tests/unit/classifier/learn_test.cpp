#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <limits>
#include <new>
#include <set>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/learn/feature_view.hpp"
#include "classifier/learn/svm.hpp"
#include "classifier/learn/svm_solver.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::learn_test {
namespace {

Matrix points(const std::vector<std::vector<double>>& rows) {
  Matrix out(rows.size(), rows.front().size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::copy(rows[r].begin(), rows[r].end(), out.row(r).begin());
  }
  return out;
}

Matrix kernel_of(const Matrix& rows, double gamma) {
  Matrix squared(rows.rows(), rows.rows());
  add_squared_distances(rows, rows, 0, rows.cols(), squared);
  return rbf(squared, gamma);
}

std::vector<std::size_t> one_each(std::size_t n) {
  std::vector<std::size_t> out(n);
  for (std::size_t i = 0; i < n; ++i) out[i] = i;
  return out;
}

TEST_CASE("Two points have the SVM solution worked by hand") {
  // maximise 2a - a^2 (1 - k): a = 1 / (1 - k), f = a (K(x, x1) - K(x, x2)), no bias
  const Matrix kernel = kernel_of(points({{0.0}, {1.0}}), 0.7);
  SvmTrainer trainer(std::vector<int>{1, -1});
  REQUIRE(trainer.set_kernel(kernel));
  const auto free = trainer.solve(100.0, 1e-6);
  REQUIRE(free);
  const double alpha = 1.0 / (1.0 - std::exp(-0.7));
  CHECK(free->coefficient[0] == Approx(alpha).epsilon(1e-5));
  CHECK(free->coefficient[1] == Approx(-alpha).epsilon(1e-5));
  CHECK(free->bias == Approx(0.0).margin(1e-5));
  const auto bounded = trainer.solve(0.25, 1e-6);
  CHECK(bounded->coefficient[0] == 0.25);
}

TEST_CASE("Every SVM solution meets the optimality conditions to the tolerance") {
  const FeatureMatrix m = testing::gaussian_classes(2, 20, 3, 1.0, 5);
  std::vector<int> sign(20, 1);
  sign.resize(40, -1);
  const double tolerance = 1e-3;
  SvmTrainer trainer(sign);
  const Matrix kernel = kernel_of(m.values, 0.3);
  REQUIRE(trainer.set_kernel(kernel));
  for (const double c : {0.5, 8.0, 512.0}) {
    const auto svm = trainer.solve(c, tolerance);
    REQUIRE(svm);
    double balance = 0.0;
    for (std::size_t i = 0; i < sign.size(); ++i) {
      double f = svm->bias;
      for (std::size_t j = 0; j < sign.size(); ++j) f += svm->coefficient[j] * kernel(i, j);
      const double alpha = svm->coefficient[i] * sign[i];
      balance += svm->coefficient[i];
      CHECK(alpha >= 0.0);
      CHECK(alpha <= c);
      if (alpha < c) CHECK(sign[i] * f >= 1.0 - 2 * tolerance);
      if (alpha > 0.0) CHECK(sign[i] * f <= 1.0 + 2 * tolerance);
    }
    CHECK(balance == Approx(0.0).margin(1e-9 * c));
  }
}

TEST_CASE("Duplicates with opposite labels converge to bounded coefficients") {
  SvmTrainer trainer(std::vector<int>{1, -1, 1, -1});
  REQUIRE(trainer.set_kernel(kernel_of(points({{1}, {1}, {2}, {3}}), 0.5)));
  const auto svm = trainer.solve(2048.0, 1e-3);
  REQUIRE(svm);
  for (const double v : svm->coefficient) CHECK(std::abs(v) <= 2048.0);
}

TEST_CASE("NaN, one class, a wrong size and unusable parameters never reach libsvm") {
  SvmTrainer trainer(std::vector<int>{1, -1});
  CHECK_FALSE(trainer.solve(1.0, 1e-3));
  Matrix kernel(2, 2, 1.0);
  kernel(0, 1) = std::nan("");
  CHECK_FALSE(trainer.set_kernel(kernel));
  CHECK_FALSE(trainer.set_kernel(Matrix(3, 3)));
  CHECK_FALSE(SvmTrainer(std::vector<int>{1, 1}).set_kernel(Matrix(2, 2, 1.0)));
  REQUIRE(trainer.set_kernel(Matrix(2, 2, 1.0)));
  for (const double c : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    CHECK_FALSE(trainer.solve(c, 1e-3));
  }
  CHECK_FALSE(trainer.solve(1.0, 0.0));
}

TEST_CASE("Distances far from the origin keep their digits and never turn negative") {
  Matrix far = points({{1e6, 0.25}, {1e6 + 0.5, 0.25}, {1e6, 0.25}});
  Matrix squared(3, 3);
  add_squared_distances(far, far, 0, 1, squared);
  add_squared_distances(far, far, 1, 2, squared);
  CHECK(squared(0, 1) == 0.25);
  CHECK(squared(0, 2) == 0.0);
}

TEST_CASE("Scaling gives zero mean and unit deviation, and leaves constants alone") {
  const Matrix rows = points({{1, 5, 1e300, 0.1}, {3, 5, -1e300, 0.1}, {5, 5, 1e300, 0.1}});
  const Scaler scaler = fit_scaler(rows);
  CHECK(scaler.mean[0] == Approx(3.0));
  CHECK(scaler.deviation[0] == Approx(std::sqrt(8.0 / 3.0)));
  CHECK(scaler.deviation[1] == 1.0);
  CHECK(std::isfinite(scaler.deviation[2]));
  CHECK(scaler.deviation[3] == 1.0);
  CHECK(scaled(scaler, rows)(0, 1) == 0.0);
}

TEST_CASE("Eight and eight trials in five folds are dealt 4 3 3 3 3, every trial once") {
  std::vector<int> sign(8, 1);
  sign.resize(16, -1);
  const auto folds = stratified_folds(sign, one_each(16), 5, 1);
  REQUIRE(folds.size() == 5);
  std::multiset<std::size_t> sizes, seen;
  for (const Fold& fold : folds) {
    sizes.insert(fold.validate.size());
    seen.insert(fold.validate.begin(), fold.validate.end());
    CHECK(fold.train.size() + fold.validate.size() == 16);
    const auto positives = std::count_if(fold.validate.begin(), fold.validate.end(),
                                         [&](std::size_t r) { return sign[r] > 0; });
    CHECK(positives >= 1);
    CHECK(positives <= 2);
  }
  CHECK(sizes == std::multiset<std::size_t>{3, 3, 3, 3, 4});
  CHECK(seen.size() == 16);
  CHECK(std::set<std::size_t>(seen.begin(), seen.end()).size() == 16);
}

TEST_CASE("Folds repeat with their seed, change with another, and shrink to the smaller class") {
  std::vector<int> sign(10, 1);
  sign.resize(13, -1);
  const auto a = stratified_folds(sign, one_each(13), 5, 7);
  CHECK(a.size() == 3);
  CHECK(a[0].validate == stratified_folds(sign, one_each(13), 5, 7)[0].validate);
  CHECK(a[0].validate != stratified_folds(sign, one_each(13), 5, 8)[0].validate);
}

TEST_CASE("Windows of one recording are never split between training and validation") {
  const std::vector<int> sign = {1, 1, 1, 1, 1, 1, -1, -1, -1, -1};
  const std::vector<std::size_t> unit = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4};
  const auto folds = stratified_folds(sign, unit, 5, 1);
  CHECK(folds.size() == 2);
  for (const Fold& fold : folds) {
    std::set<std::size_t> train, validate;
    for (const std::size_t r : fold.train) train.insert(unit[r]);
    for (const std::size_t r : fold.validate) validate.insert(unit[r]);
    for (const std::size_t u : validate) CHECK(train.count(u) == 0);
  }
}

// A random layout: units of 1 to 3 rows, each row of a random class; at least two units a class.
struct Layout {
  std::vector<int> sign;
  std::vector<std::size_t> unit;
};

std::size_t units_with(const Layout& layout, int sign) {
  std::set<std::size_t> out;
  for (std::size_t i = 0; i < layout.sign.size(); ++i)
    if (layout.sign[i] == sign) out.insert(layout.unit[i]);
  return out.size();
}

Layout random_layout(RandomEngine& engine) {
  for (;;) {
    Layout out;
    const std::size_t units = 2 + random_below(engine, 7);
    const std::size_t mixing = random_below(engine, 4);  // 0: every unit has only one class
    for (std::size_t u = 0; u < units; ++u) {
      const int own = random_below(engine, 2) == 0 ? 1 : -1;
      for (std::size_t r = 1 + random_below(engine, 3); r > 0; --r) {
        out.sign.push_back(random_below(engine, 4) < mixing ? -own : own);
        out.unit.push_back(u);
      }
    }
    if (units_with(out, 1) >= 2 && units_with(out, -1) >= 2) return out;
  }
}

TEST_CASE("Every fold trains on both classes and splits no group, for all groups and seeds") {
  RandomEngine engine(11);
  for (std::uint64_t round = 0; round < 3000; ++round) {
    const Layout layout = random_layout(engine);
    const auto& [sign, unit] = layout;
    const auto folds = stratified_folds(sign, unit, 5, round);
    const bool tiny = sign.size() < 8;  // then single units or rows may have to be left out
    REQUIRE(folds.size() >=
            std::min<std::size_t>({5, units_with(layout, 1), units_with(layout, -1)}));
    std::vector<std::size_t> validated;
    for (const Fold& fold : folds) {
      std::set<int> classes;
      std::set<std::size_t> trained;
      for (const std::size_t r : fold.train) {
        classes.insert(sign[r]);
        trained.insert(unit[r]);
      }
      REQUIRE(classes.size() == 2);
      REQUIRE(fold.train.size() >= 3);
      REQUIRE_FALSE(fold.validate.empty());
      for (const std::size_t r : fold.validate) REQUIRE((tiny || trained.count(unit[r]) == 0));
      validated.insert(validated.end(), fold.validate.begin(), fold.validate.end());
    }
    std::sort(validated.begin(), validated.end());
    REQUIRE(validated == one_each(sign.size()));
  }
}

TEST_CASE(
    "A group that both classes share is never dealt together with the only other of a class") {
  // class a in groups A and B, class b in A and C
  const std::vector<int> sign = {1, -1, 1, -1, 1, 1, -1, -1};
  const std::vector<std::size_t> unit = {0, 0, 1, 2, 0, 1, 0, 2};
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto folds = stratified_folds(sign, unit, 5, seed);
    REQUIRE(folds.size() == 2);
    for (const Fold& fold : folds) CHECK(fold.train.size() == 4);
  }
}

TEST_CASE("Two trials of each class are left out one at a time, so that a fold can select") {
  const std::vector<int> sign = {1, 1, -1, -1};
  for (const auto& unit : {one_each(4), std::vector<std::size_t>{0, 1, 0, 1}}) {
    const auto folds = stratified_folds(sign, unit, 5, 1);
    REQUIRE(folds.size() == 4);
    for (const Fold& fold : folds) CHECK(fold.train.size() == 3);
  }
  // whole recordings if those suffice: 1 and 9 windows of each class
  std::vector<int> windows(10, 1);
  windows.resize(20, -1);
  std::vector<std::size_t> recording(20);
  for (std::size_t i = 0; i < 20; ++i) recording[i] = 2 * (i / 10) + (i % 10 == 0 ? 0 : 1);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    for (const Fold& fold : stratified_folds(windows, recording, 5, seed)) {
      CHECK(fold.train.size() >= 3);
      std::set<std::size_t> trained;
      for (const std::size_t r : fold.train) trained.insert(recording[r]);
      for (const std::size_t r : fold.validate) CHECK(trained.count(recording[r]) == 0);
    }
  }
}

TEST_CASE("An exception of a thread reaches the caller of a parallel loop once all have ended") {
  for (const std::size_t threads : {1U, 2U, 5U}) {
    std::atomic<std::size_t> done{0};
    const auto work = [&](std::size_t i) {
      if (i == 7) throw std::bad_alloc();
      ++done;
    };
    CHECK_THROWS_AS(parallel_for(20, threads, work), std::bad_alloc);
    CHECK(done >= (threads == 1 ? 7 : 19));
    CHECK_THROWS_AS(parallel_workers(20, threads, [&] { return work; }), std::bad_alloc);
    CHECK_THROWS_AS(parallel_blocks(20, threads,
                                    [](std::size_t, std::size_t to) {
                                      if (to == 20) throw std::bad_alloc();
                                    }),
                    std::bad_alloc);
  }
}

TEST_CASE("Kernels larger than the machine are refused with rows, gigabytes and a way out") {
  CHECK(check_square_memory(1000, 2.0));
  const auto refused = check_square_memory(10'000'000, 2.0);  // 1.6 PB
  REQUIRE_FALSE(refused);
  const std::string reply = to_string(refused.error());
  for (const char* part : {"10000000 feature vectors", "1600000.0 GB", "--learner lda"})
    CHECK(reply.find(part) != std::string::npos);
}

TEST_CASE("A parallel loop visits every item once with any number of threads") {
  for (const std::size_t threads : {0U, 1U, 3U, 50U}) {
    std::vector<int> visits(20);
    parallel_for(20, threads, [&](std::size_t i) { ++visits[i]; });
    CHECK(visits == std::vector<int>(20, 1));
    std::vector<int> blocks(20);
    parallel_blocks(20, threads, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) ++blocks[i];
    });
    CHECK(blocks == std::vector<int>(20, 1));
  }
  parallel_for(0, 4, [](std::size_t) { FAIL("no item to visit"); });
}

}  // namespace
}  // namespace weft::classifier::learn_test
