#include "daemon/analysis/tradeoff/early_stop.hpp"

#include <algorithm>

namespace weft::daemon {
namespace {

using classifier::LivePrediction;
using classifier::Trial;

const Trial& slide_of(const Dataset& dataset, const Material& material, std::size_t row) {
  return dataset.trials[material.trials[row].front()];
}

Result<std::size_t> find_truth(const std::vector<std::string>& labels, const Trial& trial) {
  const auto known = std::ranges::lower_bound(labels, trial.label);
  if (known != labels.end() && *known == trial.label)
    return static_cast<std::size_t>(known - labels.begin());
  return fail({.code = Errc::invalid_argument,
               .where = trial.file,
               .what = "test label was never trained",
               .got = trial.label,
               .hint = "Give every fabric trials on both sides or leave it out"});
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
    const auto truth = find_truth(out.model->last().learner.labels(), trial);
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
