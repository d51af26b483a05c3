#include "classifier/learn/dense_smo.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "classifier/learn/svm.hpp"

namespace dense_smo_test {

namespace {

using weft::classifier::DenseSmo;
using weft::classifier::Matrix;
using weft::classifier::SvmTrainer;

constexpr double tolerance = 1e-3;

struct Problem {
  std::vector<int> sign;
  Matrix kernel;
};

// Two clouds `shift` standard deviations apart under an RBF kernel.
Problem clouds(std::mt19937_64& engine, std::size_t rows, std::size_t inputs, double shift,
               double gamma) {
  std::normal_distribution<double> noise;
  Problem out{std::vector<int>(rows), Matrix(rows, rows)};
  Matrix x(rows, inputs);
  for (std::size_t i = 0; i < rows; ++i) {
    out.sign[i] = i < 2 ? (i == 0 ? 1 : -1) : (engine() % 2 == 0 ? 1 : -1);
    for (std::size_t k = 0; k < inputs; ++k) x(i, k) = noise(engine) + shift * out.sign[i];
  }
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < rows; ++j) {
      double squared = 0.0;
      for (std::size_t k = 0; k < inputs; ++k) squared += std::pow(x(i, k) - x(j, k), 2);
      out.kernel(i, j) = std::exp(-gamma * squared);
    }
  }
  return out;
}

bool same_as_libsvm(DenseSmo& own, const SvmTrainer& reference, double c) {
  const auto expected = reference.solve(c, tolerance);
  if (!own.solve(c, tolerance) || own.bias() != expected->bias) return false;
  return std::equal(own.coefficient().begin(), own.coefficient().end(),
                    expected->coefficient.begin(), expected->coefficient.end());
}

std::pair<DenseSmo, SvmTrainer> both(const Problem& problem) {
  DenseSmo own;
  own.set_rows(problem.sign);
  own.set_kernel(problem.kernel.row(0).data(), problem.kernel.cols());
  SvmTrainer reference(problem.sign);
  REQUIRE(reference.set_kernel(problem.kernel));
  return {std::move(own), std::move(reference)};
}

}  // namespace

TEST_CASE("the dense solver equals libsvm bit for bit, from four rows to two hundred") {
  std::mt19937_64 engine(11);
  for (std::size_t round = 0; round < 600; ++round) {
    const std::size_t rows = round % 60 == 0 ? 200 : 4 + engine() % 40;
    const double gamma = std::pow(4.0, static_cast<double>(engine() % 8) - 6.0);
    const double shift = 0.3 * static_cast<double>(engine() % 5);
    auto [own, reference] = both(clouds(engine, rows, 1 + engine() % 6, shift, gamma));
    for (const double c : {0.5, 2.0, 8.0, 32.0, 128.0, 512.0, 2048.0}) {
      INFO("round " << round << ", rows " << rows << ", gamma " << gamma << ", C " << c);
      REQUIRE(same_as_libsvm(own, reference, c));
    }
  }
}

TEST_CASE("a solution that never touched C is libsvm's solution for every larger C") {
  std::mt19937_64 engine(12);
  std::size_t held = 0;
  for (std::size_t round = 0; round < 200; ++round) {
    auto [own, reference] = both(clouds(engine, 13, 3, 1.2, 0.125));
    REQUIRE(own.solve(32.0, tolerance));
    if (!own.holds_for_larger_c()) continue;
    ++held;
    for (const double c : {33.0, 2048.0, 1e300}) REQUIRE(same_as_libsvm(own, reference, c));
  }
  CHECK(held > 20);
}

TEST_CASE("duplicates with opposite labels stay bounded and equal libsvm's answer") {
  Problem problem{{1, -1, 1, -1}, Matrix(4, 4)};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) problem.kernel(i, j) = 1.0;
  auto [own, reference] = both(problem);
  for (const double c : {1e-300, 1.0, 1e6}) CHECK(same_as_libsvm(own, reference, c));
}

TEST_CASE("the solver can be handed one problem after another of any size") {
  std::mt19937_64 engine(13);
  DenseSmo own;
  for (const std::size_t rows : std::vector<std::size_t>{30, 5, 64, 13}) {
    const Problem problem = clouds(engine, rows, 2, 0.5, 0.5);
    own.set_rows(problem.sign);
    own.set_kernel(problem.kernel.row(0).data(), problem.kernel.cols());
    SvmTrainer reference(problem.sign);
    REQUIRE(reference.set_kernel(problem.kernel));
    CHECK(same_as_libsvm(own, reference, 8.0));
  }
}

}  // namespace dense_smo_test
