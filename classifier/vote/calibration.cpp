#include "classifier/vote/calibration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/vote/novelty.hpp"
#include "classifier/vote/vote.hpp"

namespace weft::classifier {
namespace {

constexpr double least_probability = 1e-12;  // limits the effect of one trial on the sharpness

Sigmoid core_sigmoid(const CrossDecisions& held_out, const std::vector<std::size_t>& rows_a,
                     const std::vector<std::size_t>& rows_b, Pair pair, bool offset) {
  std::vector<double> f;
  std::vector<int> sign;
  for (const std::size_t r : rows_a) {
    f.push_back(held_out.against(r, pair.b));
    sign.push_back(1);
  }
  for (const std::size_t r : rows_b) {
    f.push_back(-held_out.against(r, pair.a));
    sign.push_back(-1);
  }
  return fit_sigmoid(f, sign, offset);
}

double log_loss(const std::vector<std::vector<double>>& coupled,
                const std::vector<std::size_t>& truth, double power) {
  double sum = 0.0;
  for (std::size_t i = 0; i < coupled.size(); ++i) {
    std::vector<double> p = coupled[i];
    sharpen(p, power);
    sum -= std::log(std::max(p[truth[i]], least_probability));
  }
  return sum;
}

constexpr double least = 1e-7;  // as libsvm clips

// Matrix Q of equation 21: q_tt = sum of r_st^2 over s, q_tj = -r_jt r_tj.
Eigen::MatrixXd objective(std::span<const double> first_wins, std::size_t classes) {
  const auto n = static_cast<Eigen::Index>(classes);
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(n, n);
  std::size_t pair = 0;
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = a + 1; b < n; ++b) {
      const double r = std::clamp(first_wins[pair++], least, 1.0 - least);
      q(a, a) += (1.0 - r) * (1.0 - r);
      q(b, b) += r * r;
      q(a, b) = q(b, a) = -r * (1.0 - r);
    }
  }
  return q;
}

// Lin, Lin and Weng 2007, appendix: Newton's method with backtracking.
constexpr int most_steps = 100;
constexpr double least_step = 1e-10;
constexpr double ridge = 1e-12;       // keeps the Hessian positive definite
constexpr double gradient_ok = 1e-9;  // for a sum over decision values scaled to at most 1

struct Problem {
  std::vector<double> f;       // scaled to at most 1
  std::vector<double> target;  // Platt's
  bool offset = true;          // false: the offset stays 0
};

// -log likelihood, written so that exp() never overflows (section 3 of the paper).
double cost(const Problem& problem, const Sigmoid& s) {
  double sum = 0.0;
  for (std::size_t i = 0; i < problem.f.size(); ++i) {
    const double x = s.slope * problem.f[i] + s.offset;
    const double t = x >= 0.0 ? problem.target[i] : problem.target[i] - 1.0;
    sum += t * x + std::log1p(std::exp(-std::abs(x)));
  }
  return sum;
}

struct Derivatives {
  double slope = 0.0, offset = 0.0;                     // gradient
  double slope2 = ridge, mixed = 0.0, offset2 = ridge;  // Hessian
};

Derivatives derivatives(const Problem& problem, const Sigmoid& s) {
  Derivatives out;
  for (std::size_t i = 0; i < problem.f.size(); ++i) {
    const double f = problem.f[i];
    const double p = s(f);
    const double d1 = problem.target[i] - p;
    const double d2 = p * (1.0 - p);
    out.slope += f * d1;
    out.offset += d1;
    out.slope2 += f * f * d2;
    out.mixed += f * d2;
    out.offset2 += d2;
  }
  if (!problem.offset) out.offset = out.mixed = 0.0;
  return out;
}

// One Newton step; false if the cost cannot fall any further.
bool improve(const Problem& problem, Sigmoid& s, double& at) {
  const Derivatives d = derivatives(problem, s);
  if (std::abs(d.slope) < gradient_ok && std::abs(d.offset) < gradient_ok) return false;
  const double det = d.slope2 * d.offset2 - d.mixed * d.mixed;
  const double slope = -(d.offset2 * d.slope - d.mixed * d.offset) / det;
  const double offset = -(d.slope2 * d.offset - d.mixed * d.slope) / det;
  const double fall = d.slope * slope + d.offset * offset;
  if (!std::isfinite(slope) || !std::isfinite(offset)) return false;
  for (double step = 1.0; step >= least_step; step *= 0.5) {
    const Sigmoid next{s.slope + step * slope, s.offset + step * offset};
    const double there = cost(problem, next);
    if (!(there < at + 1e-4 * step * fall)) continue;
    s = next;
    at = there;
    return true;
  }
  return false;
}

// The options with a grid of the one point that the core chose.
TrainOptions as_chosen(TrainOptions options, const FabricModel& model, const CoreInfo& info) {
  options.reduction = model.reduction();
  options.grid = {{info.c}, {info.gamma}, {info.threshold}, {info.threshold}};
  return options;
}

// Decides the rows of one core after the other; one per thread.
class PairWorker {
 public:
  PairWorker(const FabricModel& model, const FeatureMatrix& matrix, const TrainOptions& options,
             const RareT& rare)
      : model_(model), matrix_(matrix), options_(options), rare_(rare), pairs_(matrix, options) {}

  // Decides the rows of core `i`; its classes have the rows `a` and `b`.
  Status decide(std::size_t i, const std::vector<std::size_t>& a, const std::vector<std::size_t>& b,
                CrossDecisions& out) {
    const PairProblem& problem = pairs_.make(a, b);
    const Pair pair = model_.pairs()[i];
    const auto f = held_out(problem, as_chosen(options_, model_, model_.cores()[i].info()));
    if (!f) return pass(f.error(), model_.labels()[pair.a] + " vs " + model_.labels()[pair.b]);
    for (std::size_t k = 0; k < f->size(); ++k)
      out.against(problem.rows[k], problem.sign[k] > 0 ? pair.b : pair.a) =
          problem.sign[k] * (*f)[k];
    return {};
  }

 private:
  // Decision values of the problem's rows, class a first.
  Result<std::vector<double>> held_out(const PairProblem& problem, const TrainOptions& chosen) {
    std::vector<double> out(problem.rows.size());
    const Matrix rows = matrix_.values.take(problem.rows);
    for (const Fold& fold : problem.folds) {
      std::vector<int> sign;
      for (const std::size_t i : fold.train) sign.push_back(problem.sign[i]);
      const auto core = train_core(rows.take(fold.train), sign, {}, chosen, rare_, search_);
      if (!core) return pass(core.error());
      for (const std::size_t i : fold.validate) {
        out[i] = core->decide(rows.row(i));
        if (!std::isfinite(out[i]))
          return fail({.code = Errc::range,
                       .where = matrix_.files[problem.rows[i]],
                       .what = "held-out decision not finite"});
      }
    }
    return out;
  }

  const FabricModel& model_;
  const FeatureMatrix& matrix_;
  const TrainOptions& options_;
  const RareT& rare_;
  PairMaker pairs_;
  GridSearch search_;
};

Status check_training(const FabricModel& model, const FeatureMatrix& matrix) {
  if (auto ok = check(matrix); !ok) return ok;
  if (matrix.names == model.feature_names()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = "cross_decisions",
               .what = "columns differ from the training"});
}

}  // namespace

// Divides by the largest first, so nothing underflows to 0 / 0.
void sharpen(std::vector<double>& p, double power) {
  if (power == 1.0) return;
  const double top = *std::max_element(p.begin(), p.end());
  double sum = 0.0;
  for (double& value : p) sum += value = std::pow(value / top, power);
  for (double& value : p) value /= sum;
}

// Golden section on the logarithm; the loss has one minimum if no probability is clipped.
double fit_sharpness(const std::vector<std::vector<double>>& coupled,
                     const std::vector<std::size_t>& truth) {
  const double ratio = (std::sqrt(5.0) - 1.0) / 2.0;
  double low = -std::log(8.0), high = std::log(8.0);
  const auto loss = [&](double x) { return log_loss(coupled, truth, std::exp(x)); };
  double left = high - ratio * (high - low), right = low + ratio * (high - low);
  double at_left = loss(left), at_right = loss(right);
  while (high - low > 1e-4) {
    if (at_left <= at_right) {
      high = right;
      right = left;
      at_right = at_left;
      at_left = loss(left = high - ratio * (high - low));
    } else {
      low = left;
      left = right;
      at_left = at_right;
      at_right = loss(right = low + ratio * (high - low));
    }
  }
  return std::exp((low + high) / 2.0);
}

// Bisection on the logarithm; below the minimum the loss falls.
double cautious_sharpness(const std::vector<std::vector<double>>& coupled,
                          const std::vector<std::size_t>& truth) {
  constexpr double half_of_chi_squared = 1.92;
  const double best = fit_sharpness(coupled, truth);
  const double most = log_loss(coupled, truth, best) + half_of_chi_squared;
  double low = -std::log(8.0), high = std::log(best);
  if (log_loss(coupled, truth, std::exp(low)) <= most) return std::exp(low);
  while (high - low > 1e-4) {
    const double middle = (low + high) / 2.0;
    (log_loss(coupled, truth, std::exp(middle)) <= most ? high : low) = middle;
  }
  return std::exp(high);
}

std::vector<double> probabilities(const Calibration& calibration, std::size_t all_classes,
                                  std::span<const std::size_t> classes,
                                  std::span<const double> decision) {
  if (classes.size() < 2) return std::vector<double>(classes.size(), 1.0);
  std::vector<double> first_wins;
  first_wins.reserve(decision.size());
  for (std::size_t a = 0; a < classes.size(); ++a)
    for (std::size_t b = a + 1; b < classes.size(); ++b)
      first_wins.push_back(calibration.sigmoid[pair_index(classes[a], classes[b], all_classes)](
          decision[first_wins.size()]));
  std::vector<double> p = couple(first_wins, classes.size());
  sharpen(p, calibration.sharpness);
  return p;
}

std::vector<double> probabilities(const Calibration& calibration, const Ballot& ballot) {
  if (ballot.classes.size() < 2) return {};  // no core decided
  const std::size_t all = ballot.votes.size();
  const std::vector<double> p = probabilities(calibration, all, ballot.classes, ballot.decision);
  std::vector<double> out(all);
  for (std::size_t k = 0; k < p.size(); ++k) out[ballot.classes[k]] = p[k];
  return out;
}

std::vector<Sigmoid> fit_sigmoids(const FabricModel& model, const CrossDecisions& held_out,
                                  std::size_t threads) {
  const auto rows = rows_by_class(held_out.own, model.labels().size());
  std::vector<Sigmoid> out(model.pairs().size());
  parallel_for(out.size(), threads, [&](std::size_t i) {
    const Pair pair = model.pairs()[i];
    out[i] = core_sigmoid(held_out, rows[pair.a], rows[pair.b], pair, out.size() > 1);
  });
  return out;
}

// The conditions of the minimum are Q p = -b e, e'p = 1. Hence (Q + d e e') p = (d - b) e for every
// d. So p is the normalised solution of one positive definite system (theorem 2 and its appendix);
// libsvm iterates instead.
std::vector<double> couple(std::span<const double> first_wins, std::size_t classes) {
  WEFT_ASSERT(classes >= 2 && first_wins.size() == classes * (classes - 1) / 2);
  Eigen::MatrixXd q = objective(first_wins, classes);
  const auto n = static_cast<Eigen::Index>(classes);
  q.array() += q.diagonal().maxCoeff();
  const Eigen::VectorXd solution = q.ldlt().solve(Eigen::VectorXd::Ones(n));
  std::vector<double> p(classes);
  double sum = 0.0;
  for (std::size_t k = 0; k < classes; ++k) {
    p[k] = std::max(0.0, solution[static_cast<Eigen::Index>(k)]);
    sum += p[k];
  }
  if (!(sum > 0.0 && std::isfinite(sum)))
    return std::vector<double>(classes, 1.0 / static_cast<double>(classes));
  for (double& value : p) value /= sum;
  return p;
}

double Sigmoid::operator()(double f) const {
  const double x = slope * f + offset;
  return x >= 0.0 ? std::exp(-x) / (1.0 + std::exp(-x)) : 1.0 / (1.0 + std::exp(x));
}

Sigmoid fit_sigmoid(std::span<const double> f, std::span<const int> sign, bool offset) {
  double top = 0.0, positive = 0.0, negative = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    top = std::max(top, std::abs(f[i]));
    (sign[i] > 0 ? positive : negative) += 1.0;
  }
  const double high = (positive + 1.0) / (positive + 2.0), low = 1.0 / (negative + 2.0);
  const double mean = (positive * high + negative * low) / std::max(1.0, positive + negative);
  const Sigmoid flat{0.0, f.empty() || !offset ? 0.0 : std::log((1.0 - mean) / mean)};
  if (!(top > std::numeric_limits<double>::min())) return flat;
  Problem problem;
  problem.offset = offset;
  for (std::size_t i = 0; i < f.size(); ++i) {
    problem.f.push_back(f[i] / top);
    problem.target.push_back(sign[i] > 0 ? high : low);
  }
  Sigmoid out = flat;
  double at = cost(problem, out);
  for (int step = 0; step < most_steps && improve(problem, out, at); ++step) continue;
  out.slope /= top;
  return out.slope < 0.0 && std::isfinite(out.slope) ? out : flat;
}

Matrix CrossDecisions::of_rows(const FabricModel& model, const Matrix& values,
                               std::span<const std::size_t> rows, std::size_t threads) const {
  const std::size_t classes = model.labels().size();
  Matrix out = model.decisions(values.take(rows), threads);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::size_t c = own[rows[k]];
    for (std::size_t other = 0; other < classes; ++other) {
      if (other < c) out(k, pair_index(other, c, classes)) = -against(rows[k], other);
      if (other > c) out(k, pair_index(c, other, classes)) = against(rows[k], other);
    }
  }
  return out;
}

Result<CrossDecisions> cross_decisions(const FabricModel& model, const FeatureMatrix& matrix,
                                       const TrainOptions& options) {
  if (auto ok = check_training(model, matrix); !ok) return pass(ok.error());
  auto own = class_numbers(matrix, model.labels());
  if (!own) return pass(own.error());
  const RowsOfLabel rows = rows_by_label(matrix);
  if (rows.size() != model.labels().size())
    return fail({.code = Errc::invalid_argument,
                 .where = "cross_decisions",
                 .what = "label without training rows"});
  CrossDecisions out{std::move(*own), Matrix(matrix.size(), model.labels().size())};
  const RareT rare;
  std::vector<Status> done(model.pairs().size());
  parallel_workers(done.size(), options.threads, [&] {
    auto worker = std::make_shared<PairWorker>(model, matrix, options, rare);
    return [&, worker](std::size_t i) {
      done[i] = unless_stopped(options.stop);
      if (!done[i]) return;
      const auto [a, b] = model.pairs()[i];
      done[i] = worker->decide(i, rows.at(model.labels()[a]), rows.at(model.labels()[b]), out);
    };
  });
  for (const Status& status : done)
    if (!status) return pass(status.error());
  return out;
}

}  // namespace weft::classifier
