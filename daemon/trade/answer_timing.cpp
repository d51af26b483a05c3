#include "daemon/trade/answer_timing.hpp"

#include <algorithm>
#include <deque>

#include "classifier/features/extract.hpp"

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

/// Trials that some of the answers have in common.
struct Common {
  const std::vector<AnswerTrials>* trials;
  std::vector<std::size_t> users;  // numbers of the answers
  FeatureExtractor extractor;      // keeps the tables of its own lengths
  std::vector<std::vector<double>> rows;

  Common(const std::vector<AnswerTrials>* of, const classifier::FeatureOptions& options)
      : trials(of), extractor(options), rows(of->size()) {}
  [[nodiscard]] double share(double seconds) const {
    return seconds / static_cast<double>(rows.size());
  }
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
    common->users.push_back(i);
  }
  return out;
}

Status time_once(const std::vector<TimedAnswer>& all, Common& common, const SecondsNow& now,
                 std::vector<AnswerTimes>& out) {
  const double start = now();
  for (std::size_t k = 0; k < common.rows.size(); ++k)
    if (Status ok = extract(common.extractor, (*common.trials)[k], common.rows[k]); !ok) return ok;
  const double features_s = common.share(now() - start);
  for (const std::size_t i : common.users) {
    const double asked = now();
    for (const auto& row : common.rows)
      if (const auto winner = all[i].answer(row); !winner) return pass(winner.error());
    out[i].vote_s.push_back(common.share(now() - asked));
    out[i].features_s.push_back(features_s);
  }
  return {};
}

}  // namespace

Result<std::vector<AnswerTimes>> AnswerTiming::run(std::size_t repetitions,
                                                   const classifier::FeatureOptions& options,
                                                   const SecondsNow& seconds_now) const {
  std::vector<AnswerTimes> out;
  std::deque<Common> commons = by_trials(all_, options);
  for (std::size_t repetition = 0; repetition <= repetitions; ++repetition) {
    if (repetition <= 1) out.assign(all_.size(), {});  // the first one does not count
    for (Common& common : commons)
      if (Status ok = time_once(all_, common, seconds_now, out); !ok) return pass(ok.error());
  }
  return out;
}

}  // namespace weft::daemon
