#include "classifier/fabric/grid_search.hpp"

#include <catch2/catch.hpp>
#include <numeric>
#include <random>

#include "classifier/learn/svm_solver.hpp"

namespace loss_bound_test {

using namespace weft::classifier;

namespace {

struct Problem {
  Matrix squared;  // [(train + held out) x train]
  std::vector<int> train, held_out;
};

Problem gaussian_problem(std::size_t columns, double apart, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  Problem out{{}, {-1, -1, -1, -1, -1, -1, 1, 1, 1, 1, 1, 1, 1}, {1, -1, -1}};
  Matrix rows(out.train.size() + out.held_out.size(), columns);
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const std::size_t n = out.train.size();
    const int sign = r < n ? out.train[r] : out.held_out[r - n];
    for (std::size_t k = 0; k < columns; ++k) rows(r, k) = normal(engine) + apart * sign;
  }
  out.squared = Matrix(rows.rows(), out.train.size());
  add_squared_distances(rows, rows, 0, columns, out.squared);
  return out;
}

double true_loss(const Problem& problem, double c, double gamma) {
  const Matrix kernel = rbf(problem.squared, gamma);
  SvmSolver solver(problem.train, true);
  REQUIRE(solver.set_kernel(kernel));
  REQUIRE(solver.solve(c, 1e-3));
  double loss = 0.0;
  for (std::size_t v = 0; v < problem.held_out.size(); ++v) {
    const auto k = kernel.row(problem.train.size() + v);
    const double f = std::inner_product(k.begin(), k.end(), solver.coefficient().begin(), 0.0);
    loss += std::max(0.0, 1.0 - problem.held_out[v] * (f + solver.bias()));
  }
  return loss;
}

}  // namespace

TEST_CASE("The bound never exceeds the loss of the solved SVM, over the whole grid and beyond") {
  std::size_t useful = 0, points = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Problem problem = gaussian_problem(1 + seed % 20, 0.1 * (seed % 7), seed);
    const LossBound bound(problem.squared, problem.train, problem.held_out);
    for (double c = 0x1p-5; c <= 0x1p13; c *= 4) {
      for (double gamma = 0x1p-15; gamma <= 0x1p5; gamma *= 4) {
        const double least = bound.least_loss(c, gamma);
        INFO("seed " << seed << ", C " << c << ", gamma " << gamma);
        REQUIRE(least <= true_loss(problem, c, gamma));
        useful += least > 0.5 ? 1 : 0;
        ++points;
      }
    }
  }
  CHECK(useful > points / 5);
}

TEST_CASE("A flat kernel and one that knows only itself must lose 2 for every pair held out") {
  const Problem problem = gaussian_problem(20, 0.5, 3);
  const LossBound bound(problem.squared, problem.train, problem.held_out);
  CHECK(bound.least_loss(1.0, 1e-9) == Approx(2.0).epsilon(1e-4));
  CHECK(bound.least_loss(1e6, 1e3) == Approx(2.0).epsilon(1e-4));
}

TEST_CASE("Rows of one class held out bound nothing") {
  const Problem problem = gaussian_problem(5, 0.5, 4);
  const std::vector<int> one_class{1, 1, 1};
  CHECK(LossBound(problem.squared, problem.train, one_class).least_loss(1e-6, 1e-6) == 0.0);
}

TEST_CASE("Equal rows of both classes lose 2 for the pair held out, whatever C") {
  Problem problem = gaussian_problem(5, 0.5, 4);
  for (double& d : problem.squared.data()) d = 0.0;
  const double least =
      LossBound(problem.squared, problem.train, problem.held_out).least_loss(1e12, 1e3);
  CHECK(least == Approx(2.0).epsilon(1e-6));  // f is the bias alone: no C separates equal rows
}

}  // namespace loss_bound_test
