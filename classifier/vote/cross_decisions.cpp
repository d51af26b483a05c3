#include "classifier/vote/cross_decisions.hpp"

#include <cmath>
#include <memory>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/pair_problem.hpp"
#include "classifier/vote/class_profile.hpp"
#include "classifier/vote/vote.hpp"

namespace weft::classifier {
namespace {

// A grid of the one point that the core chose.
TrainOptions as_chosen(TrainOptions options, const FabricModel& model, const CoreInfo& info) {
  options.reduction = model.reduction();
  options.grid = {{info.c}, {info.gamma}, {info.threshold}, {info.threshold}};
  return options;
}

// Asks one core after the other about its own rows; one per thread.
class PairWorker {
 public:
  PairWorker(const FabricModel& model, const FeatureMatrix& matrix, const TrainOptions& options,
             const RareT& rare)
      : model_(model), matrix_(matrix), options_(options), rare_(rare), pairs_(matrix, options) {}

  // Of core `i`, whose classes have the rows `a` and `b`.
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
                       .what = "a held-out decision is not finite"});
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
               .what = "columns are not those of the training"});
}

}  // namespace

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
                 .what = "a label of the model has no training row"});
  CrossDecisions out{std::move(*own), Matrix(matrix.size(), model.labels().size())};
  const RareT rare;
  std::vector<Status> done(model.pairs().size());
  parallel_workers(done.size(), options.threads, [&] {
    auto worker = std::make_shared<PairWorker>(model, matrix, options, rare);
    return [&, worker](std::size_t i) {
      done[i] = unless_stopped(options);
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
