#include "daemon/analysis/tradeoff/measure_classifier.hpp"

#include <algorithm>
#include <map>
#include <memory>

#include "classifier/fabric/folds.hpp"
#include "classifier/vote/novelty.hpp"
#include "daemon/analysis/tradeoff/answer_timing.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon {
namespace {

using classifier::FeatureMatrix;
using classifier::Split;

/// Material with its splits.
struct Workload {
  Material material;
  SplitPlan plan;
  std::shared_ptr<const std::vector<AnswerTrials>> timed;
};

/// Results of one training, split by split.
struct Training {
  std::vector<std::shared_ptr<const classifier::TrainedLearner>> learners;
  std::vector<std::shared_ptr<const classifier::ClassProfile>> profiles;
  std::map<std::string, std::size_t> chosen;  // recipes chosen by a choice among learners
  double train_s = 0;
};

/// Correct predictions and test trials of one split.
struct Count {
  std::size_t right = 0;
  std::size_t tested = 0;
};

// As in classifier::evaluate(): the mean over the splits, with its interval.
void score(const SplitPlan& plan, const std::vector<Count>& counts, TradeoffPoint& point) {
  std::vector<classifier::SplitSizes> sizes;
  std::vector<double> accuracy;
  for (std::size_t s = 0; s < counts.size(); ++s) {
    if (counts[s].tested == 0) continue;
    const auto tested = static_cast<double>(counts[s].tested);
    sizes.push_back(
        {static_cast<double>(plan.splits[s].train.size()), tested, plan.groups_left_out});
    point.tested += counts[s].tested;
    accuracy.push_back(static_cast<double>(counts[s].right) / tested);
  }
  point.accuracy = classifier::compute_mean(accuracy);
  point.ci95 = classifier::split_interval(accuracy, mean_sizes(sizes));
  if (plan.groups_left_out) name_groups_left_out(point.ci95);
}

/// Classifies one trial with the model of a split.
AnswerFunction answer_function(const StudyCondition& arm, const Training& training,
                               std::size_t split) {
  const auto learner = training.learners[split];
  if (arm.vote.kind == classifier::VoteKind::majority)
    return [learner](std::span<const double> features) { return learner->classify(features); };
  const auto profile = training.profiles[split];
  classifier::VoteOptions vote = arm.vote;
  vote.profile = profile.get();
  return [learner, profile, vote](std::span<const double> features) -> Result<std::size_t> {
    const classifier::FabricModel* cores = learner->cores();
    if (cores == nullptr)
      return fail({.code = Errc::invalid_argument, .what = "learner without cores cannot vote"});
    const auto prepared = learner->prepared(features);
    if (!prepared) return pass(prepared.error());
    const auto ballot = classifier::vote(*cores, *prepared, vote);
    if (!ballot) return pass(ballot.error());
    return ballot->winner;
  };
}

class Measurement {
 public:
  Measurement(const Dataset& dataset, const ClassifierTradeoffOptions& options,
              const classifier::SecondsNow& now, const TradeoffProgress& progress)
      : dataset_(&dataset), options_(&options), now_(&now), progress_(&progress) {}

  Result<TradeoffSet> run() {
    if (options_->timings < 5)
      return fail({.code = Errc::range,
                   .where = "timings",
                   .what = "too few timings for a median",
                   .expected = "at least 5",
                   .got = std::to_string(options_->timings)});
    if (!*now_)
      return fail(
          {.code = Errc::invalid_argument, .where = "timings", .what = "no clock for timing"});
    if (Status ok = prepare_default(); !ok) return pass(ok.error());
    for (std::size_t i = 0; i < plan_.arms.size(); ++i) {
      on_progress(i, plan_.arms[i].name);
      if (Status ok = measure(plan_.arms[i]); !ok) return pass(ok.error(), plan_.arms[i].name);
    }
    on_progress(plan_.arms.size(), "timing of predictions");
    if (Status ok = add_timings(); !ok) return pass(ok.error());
    add_facts();
    return std::move(out_);
  }

 private:
  void on_progress(std::size_t step, const std::string& what) const {
    if (*progress_) (*progress_)(step, plan_.arms.size() + 1, what);
  }

  Status prepare_default() {
    const auto present = list_explorations(*dataset_);
    if (present.empty())
      return fail({.code = Errc::not_found,
                   .where = dataset_->info.name,
                   .what = "no complete trials in the data set"});
    const std::string exploration =
        options_->exploration.empty() ? present.front() : options_->exploration;
    auto bench = bench_for(exploration, 0);
    if (!bench) return pass(bench.error());
    base_ = std::move(*bench);
    const std::size_t labels = classifier::find_classes(base_.material.features).labels.size();
    if (labels < 2)
      return fail({.code = Errc::invalid_argument,
                   .where = "labels",
                   .what = "too few fabrics to compare",
                   .expected = "at least 2",
                   .got = std::to_string(labels)});
    plan_ = plan_tradeoff(*dataset_, base_.material, labels, exploration, *options_);
    out_.bench = dataset_->info.kind;
    out_.left_out = plan_.left_out;
    if (plan_.arms.size() > 1) return {};
    std::vector<std::string> why;
    for (const auto& [family, reason] : plan_.left_out) why.push_back(family + ": " + reason);
    return fail({.code = Errc::invalid_argument,
                 .where = dataset_->info.name,
                 .what = "no requested factor can be varied",
                 .got = joined(why, "; "),
                 .hint = "Choose another factor to vary"});
  }

  Result<Workload> bench_for(const std::string& exploration, double slide_s) const {
    auto material =
        prepare(*dataset_, {exploration, slide_s, options_->features, options_->training.threads});
    if (!material) return pass(material.error());
    auto plan = options_->split(material->features);
    if (!plan) return pass(plan.error());
    Workload out{std::move(*material), std::move(*plan), {}};
    out.timed = timed_trials(rows_of({}, out.material), out.material);
    return out;
  }

  Result<Training> train(const StudyCondition& arm, const Workload& bench) const {
    const FeatureMatrix& features = bench.material.features;
    classifier::TrainOptions options = options_->training;
    options.cap = arm.cap;
    Training out;
    for (const Split& split : bench.plan.splits) {
      const FeatureMatrix rows = classifier::select_rows(features, split.train);
      const double start = (*now_)();
      auto trained = classifier::train_learner(rows, arm.learner, options);
      if (!trained) return pass(trained.error());
      out.train_s += ((*now_)() - start) / static_cast<double>(bench.plan.splits.size());
      if (!trained->scores.empty()) ++out.chosen[to_string(trained->recipe)];
      auto profile =
          classifier::fit_profile(trained->trained.prepared(rows), trained->trained.labels());
      if (!profile) return pass(profile.error());
      out.learners.push_back(
          std::make_shared<classifier::TrainedLearner>(std::move(trained->trained)));
      out.profiles.push_back(std::make_shared<classifier::ClassProfile>(std::move(*profile)));
    }
    return out;
  }

  // The default is measured first, because votes and speeds use its training.
  Status measure(const StudyCondition& arm) {
    if (arm.sure) return measure_stop(arm);
    const StudyCondition& standard = plan_.arms.front();
    std::optional<Workload> own;
    if (!arm.same_material(standard)) {
      auto made = bench_for(arm.exploration, arm.slide_s);
      if (!made) return pass(made.error());
      own = std::move(*made);
    }
    const Workload& bench = own ? *own : base_;
    if (&arm == &standard || !arm.same_training(standard)) {
      auto trained = train(arm, bench);
      if (!trained) return pass(trained.error());
      if (&arm != &standard) return add_point(arm, bench, *trained);
      trained_ = std::move(*trained);
    }
    return add_point(arm, bench, trained_);
  }

  [[nodiscard]] TradeoffPoint new_point(const StudyCondition& arm, double train_s) const {
    TradeoffPoint out;
    out.name = arm.name;
    out.family = arm.family;
    out.settings = list_settings(arm, *options_);
    out.bench = dataset_->info.kind;
    out.train_s = train_s;
    return out;
  }

  Status add_point(const StudyCondition& arm, const Workload& bench, const Training& training) {
    TradeoffPoint point = new_point(arm, training.train_s);
    add_chosen(training, point);
    const auto counts = count(arm, bench, training);
    if (!counts) return pass(counts.error());
    score(bench.plan, *counts, point);
    const std::vector<std::size_t> rows = rows_of(arm, bench.material);
    point.contact_s = contact_of(rows, bench.material);
    out_.points.push_back(std::move(point));
    answers_.push_back({arm.speed_mm_s ? timed_trials(rows, bench.material) : bench.timed,
                        answer_function(arm, training, 0)});
    return {};
  }

  /// All rules use the same votes, so the slides are evaluated only once.
  Status watch_all() {
    if (!watched_.empty()) return {};
    classifier::StagedOptions how;
    how.learner = options_->learner;
    how.training = options_->training;
    how.features = options_->features;
    const double start = (*now_)();
    for (std::size_t s = 0; s < base_.plan.splits.size(); ++s) {
      const AnswerFunction whole = answer_function(plan_.arms.front(), trained_, s);
      auto watched = watch_slides(
          *dataset_, base_.material, base_.plan.splits[s], how,
          [&](std::size_t row) { return whole(base_.material.features.values.row(row)); });
      if (!watched) return pass(watched.error());
      watched_.push_back(std::move(*watched));
    }
    watched_s_ = ((*now_)() - start) / static_cast<double>(watched_.size());
    return {};
  }

  Status measure_stop(const StudyCondition& arm) {
    if (Status ok = watch_all(); !ok) return ok;
    TradeoffPoint point = new_point(arm, watched_s_);
    std::vector<Count> counts;
    double slide_s = 0;
    std::size_t stopped = 0;
    for (const WatchedSplit& split : watched_) {
      const EarlyStops ends = evaluate_rule(split, {*arm.sure, least_slide_s});
      counts.push_back({ends.right, ends.tested});
      slide_s += ends.slide_s;
      stopped += ends.stopped;
    }
    score(base_.plan, counts, point);
    point.contact_s = slide_s / static_cast<double>(point.tested);
    point.settings.emplace_back("ended_early_share",
                                static_cast<double>(stopped) / static_cast<double>(point.tested));
    add_evaluation(point.contact_s);
    out_.points.push_back(std::move(point));
    return {};
  }

  /// Times the evaluation of a slide at the stage that is reached in `slide_s`.
  void add_evaluation(double slide_s) {
    const auto model = watched_.front().model;
    std::size_t stage = 0;
    while (stage + 1 < model->stages.size() && model->slide_s(stage + 1) <= slide_s) ++stage;
    auto trials = std::make_shared<std::vector<AnswerTrials>>(*base_.timed);
    for (AnswerTrials& one : *trials)
      for (classifier::Trial& trial : one)
        trial = classifier::begun_slide(trial, model->stages[stage].motion_frames);
    answers_.push_back(
        {trials, [model, stage](std::span<const double> features) -> Result<std::size_t> {
           const classifier::StoredModel& requested = model->stages[stage].model;
           const auto predicted =
               classifier::predict(requested.learner, requested.postprocessing, features);
           if (!predicted) return pass(predicted.error());
           return predicted->ballot.winner;
         }});
  }

  static void add_chosen(const Training& training, TradeoffPoint& point) {
    std::vector<std::string> words;
    for (const auto& [recipe, splits] : training.chosen)
      words.push_back(recipe + " (" + std::to_string(splits) + ")");
    if (!words.empty()) point.settings.emplace_back("chose", joined(words, "; "));
  }

  static bool concerns(const StudyCondition& arm, const Material& material, std::size_t row) {
    return !arm.speed_mm_s || material.speed_mm_s[row] == arm.speed_mm_s;
  }

  static std::vector<std::size_t> rows_of(const StudyCondition& arm, const Material& material) {
    std::vector<std::size_t> out;
    for (std::size_t row = 0; row < material.slide_s.size(); ++row)
      if (concerns(arm, material, row)) out.push_back(row);
    return out;
  }

  static double contact_of(const std::vector<std::size_t>& rows, const Material& material) {
    std::vector<double> slides;
    for (const std::size_t row : rows) slides.push_back(material.slide_s[row]);
    return classifier::compute_mean(slides);
  }

  [[nodiscard]] std::shared_ptr<const std::vector<AnswerTrials>> timed_trials(
      const std::vector<std::size_t>& rows, const Material& material) const {
    return std::make_shared<std::vector<AnswerTrials>>(
        some_trials(*dataset_, material, rows, options_->timed_trials));
  }

  Result<std::vector<Count>> count(const StudyCondition& arm, const Workload& bench,
                                   const Training& training) const {
    std::vector<Count> out;
    for (std::size_t s = 0; s < bench.plan.splits.size(); ++s) {
      auto one = count_split(arm, bench, training, s);
      if (!one) return pass(one.error());
      out.push_back(*one);
    }
    if (std::ranges::none_of(out, [](const Count& c) { return c.tested > 0; }))
      return fail({.code = Errc::invalid_argument, .where = arm.name, .what = "no test trials"});
    return out;
  }

  Result<Count> count_split(const StudyCondition& arm, const Workload& bench,
                            const Training& training, std::size_t s) const {
    const FeatureMatrix& features = bench.material.features;
    const auto& labels = training.learners[s]->labels();
    const AnswerFunction answer = answer_function(arm, training, s);
    Count out;
    for (const std::size_t row : bench.plan.splits[s].test) {
      if (!concerns(arm, bench.material, row)) continue;
      const auto truth = find_label(labels, features.labels[row], features.files[row]);
      if (!truth) return pass(truth.error());
      const auto winner = answer(features.values.row(row));
      if (!winner) return pass(winner.error(), features.files[row]);
      ++out.tested;
      out.right += *winner == *truth ? 1 : 0;
    }
    return out;
  }

  Status add_timings() {
    const auto timings = time_answers(answers_, options_->timings, options_->features, *now_);
    if (!timings) return pass(timings.error());
    for (std::size_t i = 0; i < out_.points.size(); ++i) {
      const AnswerTimes& times = (*timings)[i];
      TradeoffPoint& point = out_.points[i];
      for (std::size_t k = 0; k < times.features_s.size(); ++k)
        point.timings_s.push_back(times.features_s[k] + times.vote_s[k]);
      point.answer_s = classifier::compute_mean(point.timings_s);
      point.features_s = classifier::compute_mean(times.features_s);
      point.vote_s = classifier::compute_mean(times.vote_s);
    }
    return {};
  }

  void add_facts() {
    const FeatureMatrix& features = base_.material.features;
    const auto number = [](std::size_t n) { return static_cast<double>(n); };
    out_.facts = {{"trials", number(features.size())},
                  {"labels", number(classifier::find_classes(features).labels.size())},
                  {"features", number(features.names.size())},
                  {"split", base_.plan.words},
                  {"splits", number(base_.plan.splits.size())},
                  {"train_rows", number(base_.plan.splits.front().train.size())},
                  {"test_rows", number(base_.plan.splits.front().test.size())},
                  {"timings", number(options_->timings)},
                  {"timed_trials", number(base_.timed->size())}};
    if (!plan_.arms.front().exploration.empty())
      out_.facts.emplace_back("exploration", plan_.arms.front().exploration);
  }

  const Dataset* dataset_;
  const ClassifierTradeoffOptions* options_;
  const classifier::SecondsNow* now_;
  const TradeoffProgress* progress_;
  Workload base_;
  Training trained_;  // the default's
  std::vector<WatchedSplit> watched_;
  double watched_s_ = 0;  // mean over the splits
  TradeoffPlan plan_;
  std::vector<TimedAnswer> answers_;
  TradeoffSet out_;
};

}  // namespace

const std::vector<TradeoffCost>& classifier_costs() {
  static const std::vector<TradeoffCost> costs = {
      {"answer_s", "time of one prediction, features and vote, one thread", "compute time",
       &TradeoffPoint::answer_s},
      {"contact_s", "sliding time of one prediction", "contact", &TradeoffPoint::contact_s}};
  return costs;
}

Result<TradeoffSet> measure_classifier_tradeoff(const Dataset& dataset,
                                                const ClassifierTradeoffOptions& options,
                                                const classifier::SecondsNow& seconds_now,
                                                const TradeoffProgress& progress) {
  return Measurement(dataset, options, seconds_now, progress).run();
}

}  // namespace weft::daemon
