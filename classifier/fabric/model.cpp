#include "classifier/fabric/model.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <tuple>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"

namespace weft::classifier {
namespace {

std::vector<std::string> collect_labels(const RowsOfLabel& rows) {
  std::vector<std::string> out;
  for (const auto& entry : rows) out.push_back(entry.first);
  return out;
}

// Trains cores one after the other; one per thread.
class PairTrainer {
 public:
  PairTrainer(const FeatureMatrix& matrix, const TrainOptions& options, const RareT& rare)
      : matrix_(matrix), options_(options), rare_(rare), pairs_(matrix, options) {}

  Result<FabricCore> train(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
    const PairProblem& problem = pairs_.make(a, b);
    return train_core(matrix_.values.take(problem.rows), problem.sign, problem.folds, options_,
                      rare_, search_);
  }

 private:
  const FeatureMatrix& matrix_;
  const TrainOptions& options_;
  const RareT& rare_;
  PairMaker pairs_;
  GridSearch search_;
};

}  // namespace

std::vector<Pair> all_pairs(std::size_t classes) {
  std::vector<Pair> out;
  for (std::size_t a = 0; a < classes; ++a) {
    for (std::size_t b = a + 1; b < classes; ++b) out.push_back({a, b});
  }
  return out;
}

Vote count_votes(std::span<const Pair> pairs, std::vector<double> decision, std::size_t classes) {
  Vote out{0, std::vector<int>(classes), std::vector<double>(classes), std::move(decision)};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double f = out.decision[i];
    ++out.votes[f > 0.0 ? pairs[i].a : pairs[i].b];
    const double weight = std::tanh(f);
    out.support[pairs[i].a] += weight;
    out.support[pairs[i].b] -= weight;
  }
  const auto merit = [&](std::size_t k) {
    return std::tuple(out.votes[k], std::nearbyint(out.support[k] * 1e9));
  };
  for (std::size_t k = 1; k < classes; ++k) {
    if (merit(k) > merit(out.winner)) out.winner = k;
  }
  return out;
}

FabricModel::FabricModel(std::vector<std::string> labels, std::vector<std::string> features,
                         Reduction reduction, std::vector<FabricCore> cores)
    : labels_(std::move(labels)),
      features_(std::move(features)),
      reduction_(reduction),
      pairs_(all_pairs(labels_.size())),
      cores_(std::move(cores)) {
  WEFT_ASSERT(cores_.size() == pairs_.size());
}

Result<Vote> FabricModel::classify(std::span<const double> features) const {
  if (auto ok = check_length(features, features_.size(), "classify", another_sensor); !ok)
    return pass(ok.error());
  if (auto ok = check_features(features, features_); !ok) return pass(ok.error());
  std::vector<double> decision;
  decision.reserve(cores_.size());
  for (const FabricCore& core : cores_) decision.push_back(core.decide(features));
  if (!std::all_of(decision.begin(), decision.end(), [](double f) { return std::isfinite(f); })) {
    return fail({.code = Errc::range,
                 .where = "classify",
                 .what = "decision of a core not finite",
                 .hint = "Check the trial: its values are far outside the training range"});
  }
  return count_votes(pairs_, std::move(decision), labels_.size());
}

Matrix FabricModel::decisions(const Matrix& rows, std::size_t threads) const {
  Matrix out(rows.rows(), cores_.size());
  parallel_blocks(cores_.size(), threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i)
      for (std::size_t r = 0; r < rows.rows(); ++r) out(r, i) = cores_[i].decide(rows.row(r));
  });
  return out;
}

GridScore FabricModel::cross_validation() const {
  GridScore sum;
  for (const FabricCore& core : cores_) {
    sum.errors += core.info().cv_errors;
    sum.loss += core.info().cv_loss;
  }
  return sum;
}

Result<std::vector<FabricCore>> train_cores(const FeatureMatrix& matrix,
                                            const TrainOptions& requested, std::size_t first,
                                            std::size_t stride) {
  const RowsOfLabel rows = rows_by_label(matrix);
  const std::vector<std::string> labels = collect_labels(rows);
  std::vector<std::size_t> size;
  for (const auto& entry : rows) size.push_back(entry.second.size());
  std::ranges::sort(size, std::greater<>());
  size.resize(std::min<std::size_t>(size.size(), 2));
  // Memory of the largest pair while one of its folds is tested: distances and kernel.
  if (auto ok = check_square_memory(std::accumulate(size.begin(), size.end(), std::size_t{0}), 1.6);
      !ok)
    return pass(ok.error());
  TrainOptions options = requested;
  options.tie = resolved(requested.tie, labels.size());
  std::vector<Pair> pairs;
  const std::vector<Pair> all = all_pairs(labels.size());
  for (std::size_t i = first; i < all.size(); i += stride) pairs.push_back(all[i]);
  const RareT rare;
  std::vector<std::optional<Result<FabricCore>>> trained(pairs.size());
  parallel_workers(pairs.size(), options.threads, [&] {
    auto trainer = std::make_shared<PairTrainer>(matrix, options, rare);
    return [&, trainer](std::size_t i) {
      if (const Status ok = unless_stopped(options.stop); !ok)
        trained[i].emplace(pass(ok.error()));
      else
        trained[i].emplace(
            trainer->train(rows.at(labels[pairs[i].a]), rows.at(labels[pairs[i].b])));
    };
  });
  std::vector<FabricCore> cores;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!*trained[i]) {
      return pass(trained[i]->error(), labels[pairs[i].a] + " vs " + labels[pairs[i].b]);
    }
    cores.push_back(std::move(**trained[i]));
  }
  return cores;
}

Result<FabricModel> train(const FeatureMatrix& matrix, const TrainOptions& options,
                          const CoreTrainer& trainer) {
  if (auto ok = check(matrix); !ok) return pass(ok.error());
  if (auto ok = check(options); !ok) return pass(ok.error());
  if (auto ok = check_labels(matrix.labels); !ok) return pass(ok.error());
  std::vector<std::string> labels = collect_labels(rows_by_label(matrix));
  auto cores = trainer(options);
  if (!cores) return pass(cores.error());
  const std::size_t pairs = pair_count(labels.size());
  if (cores->size() != pairs)
    return fail({.code = Errc::invalid_argument,
                 .where = "cores",
                 .what = "wrong number of cores",
                 .expected = std::to_string(pairs) + ", one per pair of labels",
                 .got = std::to_string(cores->size())});
  return FabricModel(std::move(labels), matrix.names, options.reduction, std::move(*cores));
}

Result<FabricModel> train(const FeatureMatrix& matrix, const TrainOptions& options) {
  return train(matrix, options,
               [&](const TrainOptions& same) { return train_cores(matrix, same); });
}

}  // namespace weft::classifier
