#include "daemon/analysis/tradeoff/answer_timing.hpp"

#include <algorithm>
#include <deque>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/analysis/tradeoff/tradeoff_point.hpp"

namespace weft::daemon {
namespace {

using classifier::FeatureExtractor;
using classifier::SecondsNow;

/// Features of one answer, the parts one behind the other, into `row`.
Status extract(FeatureExtractor& extractor, const AnswerTrials& parts, std::vector<double>& row) {
  row.clear();
  for (const classifier::Trial& trial : parts) {
    const auto features = extractor.extract(trial);
    if (!features) return pass(features.error(), trial.file);
    row.insert(row.end(), features->begin(), features->end());
  }
  return {};
}

/// [trials x repetitions]
using Samples = std::vector<std::vector<double>>;

std::vector<double> medians(const Samples& samples) {
  std::vector<double> out;
  for (const auto& of_trial : samples) out.push_back(compute_median(of_trial));
  return out;
}

/// Trials that some of the answers have in common.
struct Common {
  struct User {
    const AnswerFunction* answer;
    std::size_t number;
    Samples vote_s;
  };
  const std::vector<AnswerTrials>* trials;
  FeatureExtractor extractor;
  std::vector<std::vector<double>> rows;
  Samples features_s;
  std::vector<User> users;

  Common(const std::vector<AnswerTrials>* of, const classifier::FeatureOptions& options)
      : trials(of), extractor(options), rows(of->size()), features_s(of->size()) {}
};

std::deque<Common> by_trials(const std::vector<TimedAnswer>& all,
                             const classifier::FeatureOptions& options) {
  std::deque<Common> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto* trials = all[i].trials.get();
    auto common = std::ranges::find(out, trials, &Common::trials);
    if (common == out.end()) {
      out.emplace_back(trials, options);
      common = std::prev(out.end());
    }
    common->users.push_back({&all[i].answer, i, Samples(all[i].trials->size())});
  }
  return out;
}

// An extractor keeps the tables of a few lengths of motion only: each trial is extracted once more
// before it counts, or sets of many lengths would pay for tables at every trial, others for none.
Status time_once(Common& common, const SecondsNow& now) {
  for (std::size_t k = 0; k < common.rows.size(); ++k) {
    if (Status ok = extract(common.extractor, (*common.trials)[k], common.rows[k]); !ok) return ok;
    const double start = now();
    if (Status ok = extract(common.extractor, (*common.trials)[k], common.rows[k]); !ok) return ok;
    common.features_s[k].push_back(now() - start);
  }
  for (Common::User& user : common.users)
    for (std::size_t k = 0; k < common.rows.size(); ++k) {
      const double start = now();
      if (const auto winner = (*user.answer)(common.rows[k]); !winner) return pass(winner.error());
      user.vote_s[k].push_back(now() - start);
    }
  return {};
}

void forget(Common& common) {
  for (auto& samples : common.features_s) samples.clear();
  for (Common::User& user : common.users)
    for (auto& samples : user.vote_s) samples.clear();
}

}  // namespace

Result<std::vector<AnswerTimes>> AnswerTiming::run(std::size_t repetitions,
                                                   const classifier::FeatureOptions& options,
                                                   const SecondsNow& seconds_now) const {
  std::deque<Common> commons = by_trials(all_, options);
  for (std::size_t repetition = 0; repetition <= repetitions; ++repetition)
    for (Common& common : commons) {
      if (Status ok = time_once(common, seconds_now); !ok) return pass(ok.error());
      if (repetition == 0) forget(common);
    }
  std::vector<AnswerTimes> out(all_.size());
  for (const Common& common : commons)
    for (const Common::User& user : common.users)
      out[user.number] = {medians(common.features_s), medians(user.vote_s)};
  return out;
}

}  // namespace weft::daemon
