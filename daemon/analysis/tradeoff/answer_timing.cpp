#include "daemon/analysis/tradeoff/answer_timing.hpp"

#include <algorithm>
#include <deque>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"

namespace weft::daemon {
namespace {

using classifier::FeatureExtractor;
using classifier::SecondsNow;

/// Writes the features of one prediction into `row`, part after part.
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

/// Trials that several predictors share.
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

std::deque<Common> by_trials(std::span<const TimedAnswer> all,
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

// An extractor keeps the tables of a few motion lengths only. Each trial is therefore extracted
// once before it is timed. Otherwise sets with many lengths would include the time of tables in
// every trial, and others in none.
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

using classifier::LivePrediction;
using classifier::Trial;

const Trial& slide_of(const Dataset& dataset, const Material& material, std::size_t row) {
  return dataset.trials[material.trials[row].front()];
}

Status watch(classifier::LiveVoter& voter, const Trial& trial, WatchedSlide& out) {
  voter.restart();
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    auto evaluation = voter.add(trial.phase[i], trial.row(i));
    if (!evaluation) return pass(evaluation.error(), trial.file);
    if (*evaluation) out.evaluations.push_back(std::move(**evaluation));
  }
  return {};
}

}  // namespace

Result<std::vector<AnswerTimes>> time_answers(std::span<const TimedAnswer> all,
                                              std::size_t repetitions,
                                              const classifier::FeatureOptions& options,
                                              const SecondsNow& seconds_now) {
  std::deque<Common> commons = by_trials(all, options);
  for (std::size_t repetition = 0; repetition <= repetitions; ++repetition)
    for (Common& common : commons) {
      if (Status ok = time_once(common, seconds_now); !ok) return pass(ok.error());
      if (repetition == 0) forget(common);
    }
  std::vector<AnswerTimes> out(all.size());
  for (const Common& common : commons)
    for (const Common::User& user : common.users)
      out[user.number] = {medians(common.features_s), medians(user.vote_s)};
  return out;
}

Result<std::size_t> find_label(const std::vector<std::string>& labels, const std::string& label,
                               const std::string& file) {
  const auto known = std::ranges::lower_bound(labels, label);
  if (known != labels.end() && *known == label)
    return static_cast<std::size_t>(known - labels.begin());
  return fail({.code = Errc::invalid_argument,
               .where = file,
               .what = "test label without training trials",
               .got = label,
               .hint = "Give every fabric training and test trials, or remove the fabric"});
}

Result<WatchedSplit> watch_slides(const Dataset& dataset, const Material& material,
                                  const classifier::Split& split,
                                  const classifier::StagedOptions& options,
                                  const AnswerAtEnd& at_end) {
  std::vector<Trial> training;
  for (const std::size_t row : split.train) training.push_back(slide_of(dataset, material, row));
  auto model = classifier::train_staged(training, dataset.info.taxel_rate_hz, options);
  if (!model) return pass(model.error());
  WatchedSplit out{std::make_shared<const classifier::StagedModel>(std::move(*model)), {}};
  classifier::LiveVoter voter(out.model);
  for (const std::size_t row : split.test) {
    const Trial& trial = slide_of(dataset, material, row);
    const auto truth = find_label(out.model->last().learner.labels(), trial.label, trial.file);
    if (!truth) return pass(truth.error());
    const auto answered = at_end(row);
    if (!answered) return pass(answered.error(), trial.file);
    WatchedSlide slide{*truth, {}, *answered, material.slide_s[row]};
    if (Status ok = watch(voter, trial, slide); !ok) return pass(ok.error());
    out.slides.push_back(std::move(slide));
  }
  return out;
}

EarlyStops evaluate_rule(const WatchedSplit& split, const classifier::StopRule& rule) {
  EarlyStops out;
  for (const WatchedSlide& slide : split.slides) {
    const auto sure = std::ranges::find_if(
        slide.evaluations,
        [&](const LivePrediction& evaluation) { return classifier::is_sure(rule, evaluation); });
    const bool early = sure != slide.evaluations.end();
    ++out.tested;
    out.right += (early ? sure->winner : slide.at_end) == slide.truth ? 1 : 0;
    out.stopped += early ? 1 : 0;
    out.slide_s += early ? sure->slide_s : slide.whole_s;
  }
  return out;
}

}  // namespace weft::daemon
