#include "classifier/vote/postprocessing.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/vote/calibration.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t least_rows = 200;

// Checks the share of known trials that may be refused.
Status check_share(double false_reject) {
  if (false_reject > 0.0 && false_reject < 1.0) return {};
  return fail({.code = Errc::range,
               .where = "learn_aids",
               .what = "false_reject out of range",
               .expected = "above 0 and below 1",
               .got = std::to_string(false_reject)});
}

// Rows for which all decisions are computed: all, or evenly spread ones of a large model.
std::vector<std::size_t> sampled_rows(std::size_t rows, const FabricModel& model) {
  const std::size_t count = std::min(rows, std::max(least_rows, rows_at_a_time(model)));
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(i * rows / count);
  return out;
}

// A block of rows at a time: all decisions of a large model would take gigabytes.
HeldOut held_out_answers(const FabricModel& model, const FeatureMatrix& matrix,
                         const CrossDecisions& decisions, const Calibration& calibration,
                         std::size_t threads) {
  HeldOut out;
  out.row = sampled_rows(matrix.size(), model);
  out.winner.resize(out.row.size());
  out.probability.resize(out.row.size());
  const std::vector<std::size_t> classes = numbers_below(model.labels().size());
  const std::size_t batch = rows_at_a_time(model);
  for (std::size_t from = 0; from < out.row.size(); from += batch) {
    const std::size_t count = std::min(batch, out.row.size() - from);
    const Matrix decision =
        decisions.of_rows(model, matrix.values, std::span(out.row).subspan(from, count), threads);
    parallel_for(count, threads, [&](std::size_t i) {
      const auto f = decision.row(i);
      out.winner[from + i] =
          count_votes(model.pairs(), {f.begin(), f.end()}, classes.size()).winner;
      out.probability[from + i] = probabilities(calibration, classes.size(), classes, f);
    });
  }
  return out;
}

// Scores of training rows like those of a trial of another day.
std::vector<Novelty> held_out_scores(const VotePostprocessing& postprocessing,
                                     const HeldOut& held_out, std::span<const std::size_t> own,
                                     std::span<const std::size_t> unit, std::size_t threads) {
  std::vector<Novelty> out(held_out.row.size());
  parallel_for(out.size(), threads, [&](std::size_t i) {
    std::vector<double> p = held_out.probability[i];
    sharpen(p, postprocessing.calibration.sharpness);
    const std::size_t winner = held_out.winner[i];
    out[i] = training_novelty(postprocessing.reject, postprocessing.profile, own, unit,
                              held_out.row[i], winner, p[winner]);
  });
  return out;
}

constexpr std::size_t most_trials = 10'000'000;

void write_reject(LineWriter& out, const RejectRule& rule) {
  out.text("reject_kind", to_string(rule.kind));
  out.number("false_reject", rule.false_reject);
  out.numbers("reject_threshold", rule.threshold);
  out.numbers("spread", rule.spread);
  out.count("training_trials", rule.trial.rows());
  out.numbers("radius", rule.radius);
  write_rows(out, "trial", rule.trial);
}

RejectRule read_reject(LineReader& in, std::size_t classes, std::size_t features) {
  RejectRule out;
  const auto kind = reject_kind_from(in.text("reject_kind"));
  if (!kind) in.refuse(kind.error().what, kind.error().expected, kind.error().got);
  out.kind = kind.value_or(RejectKind::neighbour);
  out.false_reject = in.number("false_reject");
  const std::vector<double> threshold = in.numbers("reject_threshold", reject_kinds, true);
  if (threshold.size() == reject_kinds)
    std::copy(threshold.begin(), threshold.end(), out.threshold.begin());
  out.spread = in.positives("spread", classes);
  const std::size_t trials = in.count("training_trials", 1, most_trials);
  out.radius = in.positives("radius", in.ok() ? trials : 0);
  out.trial = read_rows(in, "trial", trials, features);
  return out;
}

void write_calibration(LineWriter& out, const Calibration& calibration) {
  out.number("sharpness", calibration.sharpness);
  for (const Sigmoid& s : calibration.sigmoid)
    out.numbers("slope,offset", std::array{s.slope, s.offset});
}

Calibration read_calibration(LineReader& in, std::size_t sigmoids) {
  Calibration out;
  out.sharpness = in.positive("sharpness");
  for (std::size_t i = 0; in.ok() && i < sigmoids; ++i) {
    const std::vector<double> s = in.numbers("slope,offset", 2);
    if (!in.ok()) break;
    if (s[0] > 0.0) in.refuse("falling sigmoid", "slope at most 0", std::to_string(s[0]));
    out.sigmoid.push_back({s[0], s[1]});
  }
  return out;
}

std::vector<double> softmax(std::vector<double> score) {
  const double top = *std::max_element(score.begin(), score.end());
  double sum = 0.0;
  for (double& s : score) sum += s = std::exp(s - top);
  for (double& s : score) s /= sum;
  return score;
}

// Recipe of the same learner with its parameters.
Recipe recipe_of(const TrainedLearner& learner, TrainOptions& options) {
  learner.predictor().keep_parameters(options);
  const auto* components = std::get_if<PrincipalComponents>(&learner.view().table());
  return {learner.kind(),
          options.cap,
          learner.view().kind(),
          components != nullptr ? components->axes.rows() : 0,
          {},
          learner.columns()};
}

Result<HeldOut> held_out(const TrainedLearner& learner, const FeatureMatrix& matrix,
                         const std::vector<Fold>& folds, TrainOptions options) {
  const Recipe recipe = recipe_of(learner, options);
  HeldOut out;
  for (const Fold& fold : folds) {
    const auto part = train_recipe(select_rows(matrix, fold.train), recipe, options);
    if (!part) return pass(part.error());
    for (const std::size_t r : fold.validate) {
      auto predicted = part->predict(matrix.values.row(r));
      if (!predicted) return pass(predicted.error(), matrix.files[r]);
      out.row.push_back(r);
      out.winner.push_back(predicted->winner);
      out.probability.push_back(softmax(std::move(predicted->score)));
    }
  }
  return out;
}

Result<std::optional<CalibratedHeldOut>> held_out_of_cores(const TrainedLearner& learner,
                                                           const FeatureMatrix& matrix,
                                                           const TrainOptions& options) {
  const FabricModel& model = *learner.cores();
  const FeatureMatrix own = learner.prepared(matrix);
  const auto decisions = cross_decisions(model, own, options);
  if (!decisions) return pass(decisions.error());
  CalibratedHeldOut out;
  out.calibration.sigmoid = fit_sigmoids(model, *decisions, options.threads);
  out.rows = held_out_answers(model, own, *decisions, out.calibration, options.threads);
  return std::optional(std::move(out));
}

Result<std::optional<VotePostprocessing>> learn_without_cores(const TrainedLearner& learner,
                                                              const FeatureMatrix& matrix,
                                                              const TrainOptions& options,
                                                              double false_reject) {
  const auto held = predict_held_out(learner, matrix, options);
  if (!held) return pass(held.error());
  if (!*held) return std::optional<VotePostprocessing>{};
  auto profile = fit_profile(matrix, learner.labels());
  if (!profile) return pass(profile.error());
  const auto own = class_numbers(matrix, learner.labels());
  if (!own) return pass(own.error());
  VotePostprocessing begun{std::move(*profile), (*held)->calibration, {}};
  return std::optional(
      with_held_out(std::move(begun), (*held)->rows, matrix, *own, options, false_reject));
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

// Predicts the rows from `from` on, as many as `out` has entries, with all cores.
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
    out[i]->ballot.decision = std::vector<double>();  // assigning {} would keep the memory
  });
}

}  // namespace

Result<std::optional<CalibratedHeldOut>> predict_held_out(const TrainedLearner& learner,
                                                          const FeatureMatrix& matrix,
                                                          const TrainOptions& options) {
  if (learner.cores() != nullptr) return held_out_of_cores(learner, matrix, options);
  const std::vector<Fold> folds = class_folds(matrix, options).folds;
  if (folds.empty()) return std::optional<CalibratedHeldOut>{};
  auto rows = held_out(learner, matrix, folds, options);
  if (!rows) return pass(rows.error());
  return std::optional(CalibratedHeldOut{{}, std::move(*rows)});
}

VotePostprocessing with_held_out(VotePostprocessing postprocessing, const HeldOut& held_out,
                                 const FeatureMatrix& matrix, std::span<const std::size_t> own,
                                 const TrainOptions& options, double false_reject) {
  std::vector<std::size_t> truth;
  for (const std::size_t r : held_out.row) truth.push_back(own[r]);
  if (!truth.empty())
    postprocessing.calibration.sharpness = fit_sharpness(held_out.probability, truth);
  const std::vector<std::size_t> unit = row_units(matrix, options.fold_unit);
  postprocessing.reject = fit_reject(matrix, postprocessing.profile, own, unit, options.threads);
  postprocessing.reject.false_reject = false_reject;
  const std::vector<Novelty> scores =
      held_out_scores(postprocessing, held_out, own, unit, options.threads);
  for (std::size_t k = 0; k < reject_kinds; ++k) {
    std::vector<double> one;
    for (const Novelty& score : scores) one.push_back(score[k]);
    postprocessing.reject.threshold[k] = upper_threshold(std::move(one), false_reject);
  }
  return postprocessing;
}

Result<VotePostprocessing> fit_postprocessing(const FabricModel& model, const FeatureMatrix& matrix,
                                              const TrainOptions& options, double false_reject) {
  const auto decisions = cross_decisions(model, matrix, options);
  if (!decisions) return pass(decisions.error());
  return fit_postprocessing(model, matrix, *decisions, options, false_reject);
}

Result<VotePostprocessing> fit_postprocessing(const FabricModel& model, const FeatureMatrix& matrix,
                                              const CrossDecisions& decisions,
                                              const TrainOptions& options, double false_reject) {
  if (auto ok = check_share(false_reject); !ok) return pass(ok.error());
  auto profile = fit_profile(matrix, model.labels());
  if (!profile) return pass(profile.error());
  VotePostprocessing begun;
  begun.profile = std::move(*profile);
  begun.calibration.sigmoid = fit_sigmoids(model, decisions, options.threads);
  const HeldOut held_out =
      held_out_answers(model, matrix, decisions, begun.calibration, options.threads);
  return with_held_out(std::move(begun), held_out, matrix, decisions.own, options, false_reject);
}

Result<Prediction> predict(const FabricModel& model, const VotePostprocessing& postprocessing,
                           std::span<const double> features, VoteOptions options) {
  options.profile = &postprocessing.profile;
  auto ballot = vote(model, features, options);
  if (!ballot) return pass(ballot.error());
  return postprocess(std::move(*ballot), postprocessing, features);
}

Prediction postprocess(Ballot ballot, const VotePostprocessing& postprocessing,
                       std::span<const double> features) {
  Prediction out;
  out.ballot = std::move(ballot);
  out.probability = probabilities(postprocessing.calibration, out.ballot);
  if (postprocessing.profile.empty()) return out;
  const double p = out.probability.empty() ? 1.0 : out.probability[out.ballot.winner];
  out.novelty =
      novelty(postprocessing.reject, postprocessing.profile, features, out.ballot.winner, p);
  out.none_of_these = postprocessing.reject.refuses(out.novelty);
  return out;
}

void write_postprocessing(LineWriter& out,
                          const std::optional<VotePostprocessing>& postprocessing) {
  const bool calibration_alone = postprocessing && postprocessing->profile.empty();
  out.count("aids", !postprocessing ? 0 : calibration_alone ? 2 : 1);
  if (!postprocessing) return;
  if (calibration_alone) {
    write_calibration(out, postprocessing->calibration);
    return;
  }
  write_rows(out, "class_mean", postprocessing->profile.mean);
  out.numbers("class_deviation", postprocessing->profile.deviation);
  write_calibration(out, postprocessing->calibration);
  write_reject(out, postprocessing->reject);
}

std::optional<VotePostprocessing> read_postprocessing(LineReader& in, std::size_t classes,
                                                      std::size_t features, std::size_t sigmoids) {
  const std::size_t kind = in.count("aids", 0, 2);
  if (kind == 0) return std::nullopt;
  VotePostprocessing out;
  if (kind == 2) {
    out.calibration = read_calibration(in, sigmoids);
    return out;
  }
  out.profile.mean = read_rows(in, "class_mean", classes, features);
  out.profile.deviation = in.positives("class_deviation", features);
  out.calibration = read_calibration(in, sigmoids);
  out.reject = read_reject(in, classes, features);
  return out;
}

Result<std::optional<VotePostprocessing>> fit_postprocessing(const TrainedLearner& learner,
                                                             const FeatureMatrix& matrix,
                                                             const TrainOptions& options,
                                                             double false_reject) {
  if (auto ok = check_share(false_reject); !ok) return pass(ok.error());
  if (auto ok = check(matrix); !ok) return pass(ok.error());
  if (matrix.names != learner.feature_names())
    return fail({.code = Errc::invalid_argument,
                 .where = "learn_aids",
                 .what = "columns differ from the training"});
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
                 .what = "kind of vote for a model without cores",
                 .expected = "a model of cores",
                 .got = std::string(to_string(learner.kind())),
                 .hint = "Omit the kind of vote, or train cores"});
  auto predicted = learner.predict(features);
  if (!predicted) return pass(predicted.error());
  Prediction out;
  out.ballot.winner = predicted->winner;
  out.ballot.votes = std::move(predicted->votes);
  if (!out.ballot.votes.empty()) out.ballot.support = predicted->score;
  if (!postprocessing) return out;
  out.probability = softmax(std::move(predicted->score));
  sharpen(out.probability, postprocessing->calibration.sharpness);
  if (postprocessing->profile.empty()) return out;
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
