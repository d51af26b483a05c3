// The transition between the two solvers, and the error if neither finishes.

#include "classifier/learn/svm_solver.hpp"

#include <catch2/catch.hpp>

#include "classifier/fabric/model.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::svm_solver_test {
namespace {

constexpr double tolerance = 1e-3;

struct Problem {
  std::vector<int> sign;
  Matrix kernel;
};

// Two overlapping clouds in one dimension, under an RBF kernel.
Problem clouds(std::size_t rows) {
  RandomEngine engine(rows);
  Problem out{std::vector<int>(rows), Matrix(rows, rows)};
  std::vector<double> x(rows);
  for (std::size_t i = 0; i < rows; ++i) {
    out.sign[i] = i % 2 == 0 ? 1 : -1;
    x[i] = testing::normal(engine) + 0.5 * out.sign[i];
  }
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < rows; ++j)
      out.kernel(i, j) = std::exp(-0.5 * (x[i] - x[j]) * (x[i] - x[j]));
  return out;
}

SvmSolution by_libsvm(const Problem& problem, double c) {
  SvmTrainer trainer(problem.sign);
  REQUIRE(trainer.set_kernel(problem.kernel));
  return trainer.solve(c, tolerance).value();
}

bool same(const SvmSolver& solver, const SvmSolution& want) {
  return solver.bias() == want.bias &&
         std::equal(solver.coefficient().begin(), solver.coefficient().end(),
                    want.coefficient.begin(), want.coefficient.end());
}

TEST_CASE("Where the dense solver reaches its limit libsvm solves the problem, and only there") {
  const Problem problem = clouds(40);
  struct Case {
    std::size_t limit;
    double c;
  };
  for (const auto& [limit, c] : {Case{0, 0.5}, Case{0, 2.0}, Case{1, 512.0}}) {
    SvmSolver solver(limit);
    solver.set_rows(problem.sign, true);
    REQUIRE(solver.set_kernel(problem.kernel));
    REQUIRE(solver.solve(c, tolerance));
    CHECK(solver.by_libsvm());
    CHECK(solver.converged());
    CHECK(same(solver, by_libsvm(problem, c)));
    CHECK_FALSE(solver.holds_for_larger_c());
  }
  SvmSolver patient(problem.sign, true);
  REQUIRE(patient.set_kernel(problem.kernel));
  REQUIRE(patient.solve(512.0, tolerance));
  CHECK_FALSE(patient.by_libsvm());
  CHECK(same(patient, by_libsvm(problem, 512.0)));
}

TEST_CASE("Problems of more rows than the dense solver takes go to libsvm, others do not") {
  for (const std::size_t rows : {SvmSolver::most_dense_rows, SvmSolver::most_dense_rows + 1}) {
    const Problem problem = clouds(rows);
    SvmSolver solver(problem.sign, true);
    REQUIRE(solver.set_kernel(problem.kernel));
    REQUIRE(solver.solve(2.0, tolerance));
    CHECK(solver.by_libsvm() == (rows > SvmSolver::most_dense_rows));
    CHECK(same(solver, by_libsvm(problem, 2.0)));
  }
}

TEST_CASE("Further rows of a kernel, those held out, are not given to libsvm") {
  const Problem problem = clouds(12);
  Matrix longer(20, 12, 0.5);
  for (std::size_t i = 0; i < 12; ++i)
    std::copy(problem.kernel.row(i).begin(), problem.kernel.row(i).end(), longer.row(i).begin());
  SvmSolver solver(problem.sign, false);
  REQUIRE(solver.set_kernel(longer));
  REQUIRE(solver.solve(2.0, tolerance));
  CHECK(same(solver, by_libsvm(problem, 2.0)));
}

// No double is as near to the optimum as this tolerance requires, so both solvers run to their
// limits.
TEST_CASE("A problem that libsvm itself gives up is reported up to the training") {
  FeatureMatrix matrix = testing::gaussian_classes(2, 3, 3, 0.3, 9);
  TrainOptions options{.nested = false, .folds = 2, .tolerance = 1e-300, .threads = 1};
  options.reduction = Reduction::all;
  options.grid.c = {512.0};
  options.grid.gamma = {0.125};
  options.unconverged = std::make_shared<std::atomic<std::size_t>>(0);
  REQUIRE(train(matrix, options));
  CHECK(*options.unconverged > 0);
  *options.unconverged = 0;
  options.tolerance = tolerance;
  REQUIRE(train(matrix, options));
  CHECK(*options.unconverged == 0);
}

}  // namespace
}  // namespace weft::classifier::svm_solver_test
