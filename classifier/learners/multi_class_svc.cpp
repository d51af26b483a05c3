#include "classifier/learners/multi_class_svc.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learn/svm_solver.hpp"

namespace weft::classifier {
namespace {

// The rows of two classes. The first class is negative and comes first, as in libsvm.
struct PairRows {
  std::size_t a = 0, b = 0;
  std::vector<std::size_t> row;
  std::vector<int> sign;
};

std::vector<PairRows> pair_rows(std::span<const std::size_t> of_row, std::size_t classes) {
  const auto members = rows_by_class(of_row, classes);
  std::vector<PairRows> out;
  for (std::size_t a = 0; a < classes; ++a) {
    for (std::size_t b = a + 1; b < classes; ++b) {
      PairRows pair{a, b, members[a], std::vector<int>(members[a].size(), -1)};
      pair.row.insert(pair.row.end(), members[b].begin(), members[b].end());
      pair.sign.resize(pair.row.size(), 1);
      out.push_back(std::move(pair));
    }
  }
  return out;
}

Matrix extract_part(const Matrix& square, const std::vector<std::size_t>& index) {
  Matrix out(index.size(), index.size());
  for (std::size_t i = 0; i < index.size(); ++i)
    for (std::size_t j = 0; j < index.size(); ++j) out(i, j) = square(index[i], index[j]);
  return out;
}

Matrix distances(const Matrix& a, const Matrix& b) {
  Matrix out(a.rows(), b.rows());
  add_squared_distances(a, b, 0, a.cols(), out);
  return out;
}

std::vector<std::size_t> classes_at(std::span<const std::size_t> of_row,
                                    const std::vector<std::size_t>& rows) {
  std::vector<std::size_t> out;
  for (const std::size_t r : rows) out.push_back(of_row[r]);
  return out;
}

// Problem of a fold: distances among its training rows, and from them to the validated rows.
struct FoldDistances {
  Matrix train, validate;
  std::vector<PairRows> pairs;
  std::vector<std::size_t> truth;
};

FoldDistances prepare(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes,
                      const Fold& fold) {
  const Matrix train = rows.take(fold.train);
  const Scaler scaler = fit_scaler(train);
  const Matrix z = scaled(scaler, train);
  return {distances(z, z), distances(scaled(scaler, rows.take(fold.validate)), z),
          pair_rows(classes_at(of_row, fold.train), classes), classes_at(of_row, fold.validate)};
}

// Adds the votes of one pair for every validated row to votes[row x classes].
void vote(const PairRows& pair, const SvmSolver& solver, const Matrix& kernel, std::size_t classes,
          std::vector<int>& votes) {
  for (std::size_t v = 0; v < kernel.rows(); ++v) {
    double f = solver.bias();
    for (std::size_t i = 0; i < pair.row.size(); ++i)
      f += solver.coefficient()[i] * kernel(v, pair.row[i]);
    ++votes[v * classes + (f < 0.0 ? pair.a : pair.b)];
  }
}

// Errors of one fold at one gamma, for every C of the grid; the grid is ascending.
Status fold_errors(const FoldDistances& fold, std::size_t classes, double gamma,
                   const TrainOptions& options, std::vector<std::size_t>& errors) {
  const Matrix kernel = rbf(fold.train, gamma);
  const Matrix across = rbf(fold.validate, gamma);
  const std::size_t rows = across.rows();
  std::vector<std::vector<int>> votes(options.grid.c.size(), std::vector<int>(rows * classes));
  for (const PairRows& pair : fold.pairs) {
    if (auto ok = unless_stopped(options.stop); !ok) return ok;
    const Matrix own = extract_part(kernel, pair.row);
    SvmSolver solver(pair.sign, options.search != Search::libsvm);
    if (auto ok = solver.set_kernel(own); !ok) return ok;
    bool settled = false;
    for (std::size_t c = 0; c < votes.size(); ++c) {
      if (!settled) {
        if (auto ok = solver.solve(options.grid.c[c], options.tolerance); !ok) return ok;
        if (!solver.converged()) note_unconverged(options);
      }
      settled = solver.holds_for_larger_c();
      vote(pair, solver, across, classes, votes[c]);
    }
  }
  for (std::size_t c = 0; c < votes.size(); ++c)
    for (std::size_t v = 0; v < rows; ++v)
      errors[c] +=
          place_of_largest(std::span(votes[c]).subspan(v * classes, classes)) != fold.truth[v] ? 1
                                                                                               : 0;
  return {};
}

struct GridChoice {
  std::size_t c = 0, gamma = 0, errors = 0;
};

// Index of the nearest value in an ascending grid, by the logarithm; the smaller one wins a tie.
std::size_t nearest(const std::vector<double>& grid, double value) {
  const auto off = [&](double v) { return std::abs(std::log(v) - std::log(value)); };
  return static_cast<std::size_t>(std::ranges::min_element(grid, {}, off) - grid.begin());
}

// Choice if nothing can be tested: neither so stiff nor so flat that few rows are hardly learned.
GridChoice untested(std::size_t columns, const TrainOptions& options) {
  constexpr double usual_c = 8.0;
  const double usual_gamma = 1.0 / static_cast<double>(std::max<std::size_t>(1, columns));
  return {nearest(options.grid.c, usual_c), nearest(options.grid.gamma, usual_gamma), 0};
}

Result<GridChoice> search(const Matrix& rows, std::span<const std::size_t> of_row,
                          std::size_t classes, std::span<const Fold> folds,
                          const TrainOptions& options) {
  if (folds.empty()) return untested(rows.cols(), options);
  const std::size_t gammas = options.grid.gamma.size();
  const std::size_t cs = options.grid.c.size();
  std::vector<std::vector<std::size_t>> errors(gammas, std::vector<std::size_t>(cs));
  for (const Fold& fold : folds) {
    const FoldDistances problem = prepare(rows, of_row, classes, fold);
    std::vector<Status> done(gammas);
    parallel_for(gammas, options.threads, [&](std::size_t g) {
      done[g] = fold_errors(problem, classes, options.grid.gamma[g], options, errors[g]);
    });
    for (const Status& ok : done)
      if (!ok) return pass(ok.error());
  }
  GridChoice best{0, 0, errors[0][0]};
  for (std::size_t c = 0; c < cs; ++c)
    for (std::size_t g = 0; g < gammas; ++g)
      if (errors[g][c] < best.errors) best = {c, g, errors[g][c]};
  return best;
}

TrainOptions ascending(TrainOptions options) {
  std::sort(options.grid.c.begin(), options.grid.c.end());
  std::sort(options.grid.gamma.begin(), options.grid.gamma.end());
  return options;
}

}  // namespace

Result<MultiClassSvc> MultiClassSvc::fit(const Matrix& rows, std::span<const std::size_t> of_row,
                                         std::size_t classes, std::span<const Fold> folds,
                                         const TrainOptions& unsorted) {
  if (auto ok = check(unsorted); !ok) return pass(ok.error());
  // Memory of the final training on all rows: distances and kernel.
  if (auto ok = check_square_memory(rows.rows(), 2.0); !ok) return pass(ok.error());
  const TrainOptions options = ascending(unsorted);
  const auto chosen = search(rows, of_row, classes, folds, options);
  if (!chosen) return pass(chosen.error());
  Parts out;
  out.classes = classes;
  out.c = options.grid.c[chosen->c];
  out.gamma = options.grid.gamma[chosen->gamma];
  out.cv_errors = chosen->errors;
  out.scaler = fit_scaler(rows);
  out.support = scaled(out.scaler, rows);
  const Matrix kernel = rbf(distances(out.support, out.support), out.gamma);
  for (const PairRows& pair : pair_rows(of_row, classes)) {
    const Matrix own = extract_part(kernel, pair.row);
    SvmSolver solver(pair.sign, options.search != Search::libsvm);
    if (auto ok = solver.set_kernel(own); !ok) return pass(ok.error());
    if (auto ok = solver.solve(out.c, options.tolerance); !ok) return pass(ok.error());
    if (!solver.converged()) note_unconverged(options);
    Machine machine;
    machine.bias = solver.bias();
    for (std::size_t i = 0; i < pair.row.size(); ++i) {
      if (solver.coefficient()[i] == 0.0) continue;
      machine.row.push_back(pair.row[i]);
      machine.coefficient.push_back(solver.coefficient()[i]);
    }
    out.machines.push_back(std::move(machine));
  }
  return MultiClassSvc(std::move(out));
}

Result<ClassScores> MultiClassSvc::predict(std::span<const double> features) const {
  const Matrix& support = parts_.support;
  if (auto ok = check_length(features, support.cols(), "SVC"); !ok) return pass(ok.error());
  std::vector<double> kernel(support.rows()), z(features.size());
  for (std::size_t k = 0; k < z.size(); ++k) z[k] = parts_.scaler.apply(k, features[k]);
  for (std::size_t r = 0; r < kernel.size(); ++r) {
    const auto row = support.row(r);
    for (std::size_t k = 0; k < z.size(); ++k) kernel[r] += (z[k] - row[k]) * (z[k] - row[k]);
  }
  exp_of_negative(kernel, parts_.gamma);
  ClassScores out{0, std::vector<double>(parts_.classes), std::vector<int>(parts_.classes)};
  std::size_t pair = 0;
  for (std::size_t a = 0; a < parts_.classes; ++a) {
    for (std::size_t b = a + 1; b < parts_.classes; ++b, ++pair) {
      const Machine& machine = parts_.machines[pair];
      double f = machine.bias;
      for (std::size_t i = 0; i < machine.row.size(); ++i)
        f += machine.coefficient[i] * kernel[machine.row[i]];
      if (!std::isfinite(f))
        return fail({.code = Errc::range,
                     .where = "SVC",
                     .what = "decision not finite",
                     .hint = "Check the trial: its values are far outside the training range"});
      ++out.votes[f < 0.0 ? a : b];
      out.score[a] -= std::tanh(f);
      out.score[b] += std::tanh(f);
    }
  }
  out.winner = place_of_largest(out.votes);
  return out;
}

void MultiClassSvc::keep_parameters(TrainOptions& options) const {
  options.grid.c = {parts_.c};
  options.grid.gamma = {parts_.gamma};
}

void MultiClassSvc::write(LineWriter& out) const {
  out.number("C", parts_.c);
  out.number("gamma", parts_.gamma);
  out.count("cv_errors", parts_.cv_errors);
  write_scaler(out, parts_.scaler);
  write_matrix(out, "support_vectors", parts_.support);
  for (const Machine& machine : parts_.machines) {
    out.count("machine", machine.row.size());
    out.counts("rows", machine.row);
    out.numbers("coefficients", machine.coefficient);
    out.number("bias", machine.bias);
  }
}

namespace {

constexpr std::size_t most_errors = 1'000'000'000;

MultiClassSvc::Machine read_machine(LineReader& in, std::size_t support) {
  MultiClassSvc::Machine out;
  const std::size_t count = in.count("machine", 0, support);
  out.row = in.counts("rows", count);
  in.within(out.row, support, "support vector");
  out.coefficient = in.numbers("coefficients", count);
  out.bias = in.number("bias");
  return out;
}

}  // namespace

MultiClassSvc MultiClassSvc::read(LineReader& in, std::size_t features, std::size_t classes) {
  Parts out;
  out.classes = classes;
  out.c = in.number("C");
  out.gamma = in.positive("gamma");
  out.cv_errors = in.count("cv_errors", 0, most_errors);
  out.scaler = read_scaler(in, features);
  out.support = read_matrix(in, "support_vectors", features);
  if (out.support.rows() == 0) in.refuse("too few support vectors", "at least 1", "0");
  for (std::size_t i = 0; in.ok() && i < pair_count(classes); ++i)
    out.machines.push_back(read_machine(in, out.support.rows()));
  return MultiClassSvc(std::move(out));
}

}  // namespace weft::classifier
