#include "classifier/vote/vote.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "protocols/base/names.hpp"

namespace weft::classifier {
namespace {

constexpr NameTable<VoteKind, 4> kind_names = {{
    {VoteKind::majority, "majority"},
    {VoteKind::soft, "soft"},
    {VoteKind::dag, "dag"},
    {VoteKind::shortlist, "shortlist"},
}};

tl::unexpected<Error> not_finite() {
  return fail({.code = Errc::range,
               .where = "vote",
               .what = "decision of a core not finite",
               .hint = "Check the trial: its values are far outside the training range"});
}

// Majority vote among `classes` (ascending).
Result<Ballot> count_among(const FabricModel& model, std::span<const double> features,
                           std::span<const std::size_t> classes) {
  const std::size_t all = model.labels().size();
  const std::vector<Pair> pairs = all_pairs(classes.size());
  std::vector<double> decision;
  decision.reserve(pairs.size());
  for (const Pair& pair : pairs) {
    const std::size_t core = pair_index(classes[pair.a], classes[pair.b], all);
    decision.push_back(model.cores()[core].decide(features));
    if (!std::isfinite(decision.back())) return not_finite();
  }
  Vote among = count_votes(pairs, std::move(decision), classes.size());
  Ballot out{classes[among.winner],
             std::vector<int>(all),
             std::vector<double>(all),
             pairs.size(),
             {classes.begin(), classes.end()},
             std::move(among.decision)};
  for (std::size_t k = 0; k < classes.size(); ++k) {
    out.votes[classes[k]] = among.votes[k];
    out.support[classes[k]] = among.support[k];
  }
  return out;
}

std::size_t softest(const Vote& vote) {
  const auto merit = [&](std::size_t k) {
    return std::tuple(std::nearbyint(vote.support[k] * 1e9), vote.votes[k]);
  };
  std::size_t winner = 0;
  for (std::size_t k = 1; k < vote.votes.size(); ++k)
    if (merit(k) > merit(winner)) winner = k;
  return winner;
}

Result<Ballot> dag_vote(const FabricModel& model, std::span<const double> features) {
  const std::size_t classes = model.labels().size();
  Ballot out{0, std::vector<int>(classes), std::vector<double>(classes), 0, {}, {}};
  std::size_t first = 0, last = classes - 1;
  while (first < last) {
    const double f = model.cores()[pair_index(first, last, classes)].decide(features);
    if (!std::isfinite(f)) return not_finite();
    out.support[first] += std::tanh(f);
    out.support[last] -= std::tanh(f);
    ++out.votes[f > 0.0 ? first : last];
    ++out.cores;
    f > 0.0 ? --last : ++first;
  }
  out.winner = first;
  return out;
}

Result<Ballot> shortlist_vote(const FabricModel& model, std::span<const double> features,
                              const VoteOptions& options) {
  const ClassProfile* profile = options.profile;
  if (options.shortlist == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "vote",
                 .what = "short-list too short",
                 .expected = "at least 1",
                 .got = "0"});
  if (profile == nullptr || profile->classes() != model.labels().size() ||
      profile->mean.cols() != features.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "vote",
                 .what = "model without class means for a short-list",
                 .hint = "Train the model again, or use another kind of vote"});
  return count_among(model, features, nearest_classes(*profile, features, options.shortlist));
}

}  // namespace

std::string_view to_string(VoteKind kind) {
  return name_in(kind_names, kind);
}

Result<VoteKind> vote_kind_from(std::string_view text) {
  return value_from(kind_names, text, "unknown kind of vote", "majority, soft, dag or shortlist");
}

Result<Ballot> count_all(const FabricModel& model, std::vector<double> decision, VoteKind kind) {
  if (!std::ranges::all_of(decision, [](double f) { return std::isfinite(f); }))
    return not_finite();
  std::vector<std::size_t> every = numbers_below(model.labels().size());
  Vote vote = count_votes(model.pairs(), std::move(decision), every.size());
  const std::size_t winner = kind == VoteKind::soft ? softest(vote) : vote.winner;
  return Ballot{
      winner,           std::move(vote.votes),   std::move(vote.support), model.pairs().size(),
      std::move(every), std::move(vote.decision)};
}

std::size_t rows_at_a_time(const FabricModel& model) {
  constexpr std::size_t most_decisions = 4'000'000;
  return std::max<std::size_t>(1, most_decisions / model.cores().size());
}

Status check_features(const FabricModel& model, std::span<const double> features) {
  const std::vector<std::string>& names = model.feature_names();
  if (auto ok = check_length(features, names.size(), "vote", another_sensor); !ok) return ok;
  const std::size_t bad = first_not_finite(features);
  if (bad < features.size()) return not_finite(names[bad], "feature", features[bad]);
  return {};
}

Result<Ballot> vote(const FabricModel& model, std::span<const double> features,
                    const VoteOptions& options) {
  if (auto ok = check_features(model, features); !ok) return pass(ok.error());
  if (options.kind == VoteKind::dag) return dag_vote(model, features);
  if (options.kind == VoteKind::shortlist) return shortlist_vote(model, features, options);
  std::vector<double> decision;
  decision.reserve(model.cores().size());
  for (const FabricCore& core : model.cores()) decision.push_back(core.decide(features));
  return count_all(model, std::move(decision), options.kind);
}

}  // namespace weft::classifier
