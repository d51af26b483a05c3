#include "classifier/vote/learner_prediction.hpp"

#include <algorithm>
#include <cmath>

#include "classifier/base/memory.hpp"
#include "classifier/base/parallel.hpp"
#include "classifier/baseline/class_folds.hpp"
#include "classifier/fabric/pair_problem.hpp"

namespace weft::classifier {
namespace {

// What a learner without cores says: the answer, its votes where it has any, a score per class.
struct Predicted {
  Ballot ballot;
  std::vector<double> score;
};

Result<Predicted> predict_class(const TrainedLearner& learner, std::span<const double> features) {
  const auto own = learner.prepared(features);
  if (!own) return pass(own.error());
  Predicted out;
  if (const auto* svc = std::get_if<MultiClassSvc>(&learner.machine())) {
    auto tally = svc->vote(*own);
    if (!tally) return pass(tally.error());
    out.score = tally->support;
    out.ballot.winner = tally->winner;
    out.ballot.votes = std::move(tally->votes);
    out.ballot.support = std::move(tally->support);
    return out;
  }
  if (const auto* trees = std::get_if<TreeEnsemble>(&learner.machine())) {
    TreeEnsemble::Tally tally = trees->tally(*own);
    out.ballot.winner = tally.winner;
    out.score = std::move(tally.log_share);
    return out;
  }
  auto score = std::get<ShrinkageLda>(learner.machine()).discriminants(*own);
  if (!score) return pass(score.error());
  out.ballot.winner =
      static_cast<std::size_t>(std::max_element(score->begin(), score->end()) - score->begin());
  out.score = std::move(*score);
  return out;
}

std::vector<double> softmax(std::vector<double> score) {
  const double top = *std::max_element(score.begin(), score.end());
  double sum = 0.0;
  for (double& s : score) sum += s = std::exp(s - top);
  for (double& s : score) s /= sum;
  return score;
}

// The same learner with the parameters it has.
Recipe recipe_of(const TrainedLearner& learner, TrainOptions& options) {
  if (const auto* svc = std::get_if<MultiClassSvc>(&learner.machine())) {
    options.grid.c = {svc->c()};
    options.grid.gamma = {svc->gamma()};
  }
  return {learner.kind(), options.cap, learner.view().kind()};
}

Result<HeldOut> held_out(const TrainedLearner& learner, const FeatureMatrix& matrix,
                         const std::vector<Fold>& folds, TrainOptions options) {
  const Recipe recipe = recipe_of(learner, options);
  HeldOut out;
  for (const Fold& fold : folds) {
    const auto part = train_recipe(select_rows(matrix, fold.train), recipe, options);
    if (!part) return pass(part.error());
    for (const std::size_t r : fold.validate) {
      auto predicted = predict_class(*part, matrix.values.row(r));
      if (!predicted) return pass(predicted.error(), matrix.files[r]);
      out.row.push_back(r);
      out.winner.push_back(predicted->ballot.winner);
      out.probability.push_back(softmax(std::move(predicted->score)));
    }
  }
  return out;
}

Result<std::optional<VotePostprocessing>> learn_without_cores(const TrainedLearner& learner,
                                                              const FeatureMatrix& matrix,
                                                              const TrainOptions& options,
                                                              double false_reject) {
  const std::vector<Fold> folds = class_folds(matrix, options).folds;
  if (folds.empty()) return std::optional<VotePostprocessing>{};
  auto profile = fit_profile(matrix, learner.labels());
  if (!profile) return pass(profile.error());
  const auto own = class_numbers(matrix, learner.labels());
  if (!own) return pass(own.error());
  const auto held = held_out(learner, matrix, folds, options);
  if (!held) return pass(held.error());
  VotePostprocessing begun;
  begun.profile = std::move(*profile);
  return std::optional(with_held_out(std::move(begun), *held, matrix, *own, options, false_reject));
}

Result<std::optional<VotePostprocessing>> learn_of_cores(const TrainedLearner& learner,
                                                         const FeatureMatrix& matrix,
                                                         const TrainOptions& options,
                                                         double false_reject) {
  auto postprocessing =
      fit_postprocessing(*learner.cores(), learner.prepared(matrix), options, false_reject);
  if (!postprocessing) return pass(postprocessing.error());
  return std::optional(std::move(*postprocessing));
}

Result<Prediction> predict_with_cores(const TrainedLearner& learner,
                                      const std::optional<VotePostprocessing>& postprocessing,
                                      std::span<const double> features,
                                      const VoteOptions& options) {
  const auto own = learner.prepared(features);
  if (!own) return pass(own.error());
  if (postprocessing) return predict(*learner.cores(), *postprocessing, *own, options);
  auto ballot = vote(*learner.cores(), *own, options);
  if (!ballot) return pass(ballot.error());
  return Prediction{std::move(*ballot), {}, {}, false};
}

// Rows from `from` on, as many as `out` has places, asked of all cores.
void predict_with_all_cores(const TrainedLearner& learner,
                            const std::optional<VotePostprocessing>& postprocessing, VoteKind kind,
                            const Matrix& rows, std::size_t from, std::span<Result<Prediction>> out,
                            std::size_t threads) {
  const FabricModel& model = *learner.cores();
  Matrix own(out.size(), model.feature_names().size());
  parallel_for(out.size(), threads, [&](std::size_t i) {
    const auto prepared = learner.prepared(rows.row(from + i));
    if (prepared) std::ranges::copy(*prepared, own.row(i).begin());
    if (!prepared) out[i] = pass(prepared.error());
  });
  const Matrix decisions = model.decisions(own, threads);
  parallel_for(out.size(), threads, [&](std::size_t i) {
    if (!out[i]) return;
    const auto f = decisions.row(i);
    auto ballot = count_all(model, {f.begin(), f.end()}, kind);
    if (!ballot) {
      out[i] = pass(ballot.error());
      return;
    }
    out[i] = postprocessing ? postprocess(std::move(*ballot), *postprocessing, own.row(i))
                            : Prediction{std::move(*ballot), {}, {}, false};
    out[i]->ballot.decision = std::vector<double>();  // {} would keep the memory
  });
}

}  // namespace

Result<std::optional<VotePostprocessing>> fit_postprocessing(const TrainedLearner& learner,
                                                             const FeatureMatrix& matrix,
                                                             const TrainOptions& options,
                                                             double false_reject) {
  if (!(false_reject > 0.0 && false_reject < 1.0))
    return fail({.code = Errc::range,
                 .where = "learn_aids",
                 .what = "unusable share of known trials to refuse",
                 .expected = "between 0 and 1",
                 .got = std::to_string(false_reject)});
  if (auto ok = check(matrix); !ok) return pass(ok.error());
  if (matrix.names != learner.feature_names())
    return fail({.code = Errc::invalid_argument,
                 .where = "learn_aids",
                 .what = "columns are not those of the training"});
  return within_memory(matrix.size(), [&] {
    return learner.cores() != nullptr ? learn_of_cores(learner, matrix, options, false_reject)
                                      : learn_without_cores(learner, matrix, options, false_reject);
  });
}
Result<Prediction> predict(const TrainedLearner& learner,
                           const std::optional<VotePostprocessing>& postprocessing,
                           std::span<const double> features, const VoteOptions& options) {
  if (learner.cores() != nullptr)
    return predict_with_cores(learner, postprocessing, features, options);
  if (options.kind != VoteKind::majority)
    return fail({.code = Errc::invalid_argument,
                 .where = std::string(to_string(options.kind)),
                 .what = "kinds of vote are for cores",
                 .expected = "a model of cores",
                 .got = std::string(to_string(learner.kind())),
                 .hint = "Leave the kind of vote out, or train cores"});
  auto predicted = predict_class(learner, features);
  if (!predicted) return pass(predicted.error());
  Prediction out{std::move(predicted->ballot), {}, {}, false};
  if (!postprocessing) return out;
  out.probability = softmax(std::move(predicted->score));
  sharpen(out.probability, postprocessing->calibration.sharpness);
  out.novelty = novelty(postprocessing->reject, postprocessing->profile, features,
                        out.ballot.winner, out.probability[out.ballot.winner]);
  out.none_of_these = postprocessing->reject.refuses(out.novelty);
  return out;
}

std::vector<Result<Prediction>> predict_all(const TrainedLearner& learner,
                                            const std::optional<VotePostprocessing>& postprocessing,
                                            const Matrix& rows, const VoteOptions& options,
                                            std::size_t threads) {
  std::vector<Result<Prediction>> out(rows.rows());
  const FabricModel* cores = learner.cores();
  const bool all = options.kind == VoteKind::majority || options.kind == VoteKind::soft;
  if (cores == nullptr || !all) {
    parallel_for(out.size(), threads, [&](std::size_t r) {
      out[r] = predict(learner, postprocessing, rows.row(r), options);
      if (out[r]) out[r]->ballot.decision = std::vector<double>();
    });
    return out;
  }
  const std::size_t batch = rows_at_a_time(*cores);
  for (std::size_t from = 0; from < out.size(); from += batch)
    predict_with_all_cores(learner, postprocessing, options.kind, rows, from,
                           std::span(out).subspan(from, std::min(batch, out.size() - from)),
                           threads);
  return out;
}

}  // namespace weft::classifier
