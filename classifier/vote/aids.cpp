#include "classifier/vote/aids.hpp"

#include <array>
#include <numeric>

#include "classifier/fabric/pair_problem.hpp"
#include "classifier/learn/parallel.hpp"
#include "classifier/vote/cross_decisions.hpp"

namespace weft::classifier {
namespace {

std::vector<std::size_t> counted(std::size_t count) {
  std::vector<std::size_t> out(count);
  std::iota(out.begin(), out.end(), std::size_t{0});
  return out;
}

// Scores of training rows as a trial of another day would get them.
std::vector<Novelty> held_out_scores(const FabricModel& model, const FeatureMatrix& matrix,
                                     const CrossDecisions& held_out, const VoteAids& aids,
                                     const TrainOptions& options) {
  const std::vector<std::size_t> sample = sampled_rows(matrix.size(), model.pairs().size());
  const std::vector<std::size_t> unit =
      fold_units(matrix, counted(matrix.size()), options.fold_unit);
  const std::vector<std::size_t> classes = counted(model.labels().size());
  std::vector<Novelty> out(sample.size());
  parallel_for(sample.size(), options.threads, [&](std::size_t i) {
    const std::size_t r = sample[i];
    const Vote vote =
        count_votes(model.pairs(), held_out.of_row(model, matrix.values.row(r), r), classes.size());
    const double p =
        probabilities(aids.calibration, classes.size(), classes, vote.decision)[vote.winner];
    out[i] = training_novelty(aids.reject, aids.profile, held_out.own, unit, r, vote.winner, p);
  });
  return out;
}

}  // namespace

Result<VoteAids> learn_aids(const FabricModel& model, const FeatureMatrix& matrix,
                            const TrainOptions& options, double false_reject) {
  const auto held_out = cross_decisions(model, matrix, options);
  if (!held_out) return pass(held_out.error());
  return learn_aids(model, matrix, *held_out, options, false_reject);
}

Result<VoteAids> learn_aids(const FabricModel& model, const FeatureMatrix& matrix,
                            const CrossDecisions& held_out, const TrainOptions& options,
                            double false_reject) {
  if (!(false_reject > 0.0 && false_reject < 1.0))
    return fail(Errc::range, "unusable share of known trials to refuse", "learn_aids",
                "between 0 and 1", std::to_string(false_reject));
  auto profile = fit_profile(matrix, model.labels());
  if (!profile) return pass(profile.error());
  VoteAids out;
  out.profile = std::move(*profile);
  out.calibration = fit_calibration(model, matrix, held_out, options.threads);
  const std::vector<std::size_t> unit =
      fold_units(matrix, counted(matrix.size()), options.fold_unit);
  out.reject = fit_reject(matrix, out.profile, held_out.own, unit, options.threads);
  out.reject.false_reject = false_reject;
  const std::vector<Novelty> scores = held_out_scores(model, matrix, held_out, out, options);
  for (std::size_t k = 0; k < reject_kinds; ++k) {
    std::vector<double> one;
    for (const Novelty& score : scores) one.push_back(score[k]);
    out.reject.threshold[k] = upper_threshold(std::move(one), false_reject);
  }
  return out;
}

Result<Answer> answer(const FabricModel& model, const VoteAids& aids,
                      std::span<const double> features, VoteOptions options) {
  options.profile = &aids.profile;
  auto ballot = vote(model, features, options);
  if (!ballot) return pass(ballot.error());
  Answer out;
  out.ballot = std::move(*ballot);
  out.probability = probabilities(aids.calibration, out.ballot);
  const double p = out.probability.empty() ? 1.0 : out.probability[out.ballot.winner];
  out.novelty = novelty(aids.reject, aids.profile, features, out.ballot.winner, p);
  out.none_of_these = aids.reject.refuses(out.novelty);
  return out;
}

}  // namespace weft::classifier
