#include "tests/bench/vote_costs.hpp"

namespace weft::classifier {
namespace {

Status check_part(const FabricModel& model, const FeatureMatrix& matrix) {
  if (auto ok = check(matrix); !ok) return ok;
  if (matrix.size() == 0)
    return fail({.code = Errc::invalid_argument, .where = "votes", .what = "nothing to vote on"});
  if (matrix.names == model.feature_names()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = "votes",
               .what = "columns are not those of the training",
               .expected = std::to_string(model.feature_names().size()) + " features",
               .got = std::to_string(matrix.names.size()),
               .hint = "Same sensor, same phases, same order"});
}

struct Answers {
  std::vector<std::size_t> winner;
  std::size_t cores = 0;
};

Result<Answers> answer_all(const FabricModel& model, const FeatureMatrix& matrix,
                           const VoteOptions& options) {
  Answers out;
  out.winner.reserve(matrix.size());
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto ballot = vote(model, matrix.values.row(r), options);
    if (!ballot) return pass(ballot.error(), matrix.files[r]);
    out.winner.push_back(ballot->winner);
    out.cores += ballot->cores;
  }
  return out;
}

VoteCost measure_cost(VoteKind kind, const Answers& answers, std::span<const std::size_t> truth,
                      std::span<const std::size_t> majority, double seconds) {
  VoteCost out;
  out.kind = kind;
  out.trials = truth.size();
  for (std::size_t r = 0; r < truth.size(); ++r) {
    out.correct += answers.winner[r] == truth[r] ? 1 : 0;
    out.as_majority += answers.winner[r] == majority[r] ? 1 : 0;
  }
  const auto n = static_cast<double>(truth.size());
  out.accuracy = static_cast<double>(out.correct) / n;
  out.cores_per_trial = static_cast<double>(answers.cores) / n;
  out.seconds_per_trial = seconds / n;
  return out;
}

}  // namespace

Result<std::vector<VoteCost>> compare_votes(const FabricModel& model, const ClassProfile& profile,
                                            const FeatureMatrix& matrix,
                                            const std::function<double()>& seconds_now,
                                            std::size_t shortlist) {
  if (auto ok = check_part(model, matrix); !ok) return pass(ok.error());
  const auto truth = class_numbers(matrix, model.labels());
  if (!truth) return pass(truth.error());
  const auto now = [&] { return seconds_now ? seconds_now() : 0.0; };
  std::vector<VoteCost> out;
  std::vector<std::size_t> majority;
  for (const VoteKind kind :
       {VoteKind::majority, VoteKind::soft, VoteKind::dag, VoteKind::shortlist}) {
    if (kind == VoteKind::shortlist && profile.empty()) continue;
    const double start = now();
    const auto answers = answer_all(model, matrix, {kind, shortlist, &profile});
    if (!answers) return pass(answers.error());
    const double seconds = now() - start;
    if (kind == VoteKind::majority) majority = answers->winner;
    out.push_back(measure_cost(kind, *answers, *truth, majority, seconds));
  }
  return out;
}

}  // namespace weft::classifier
