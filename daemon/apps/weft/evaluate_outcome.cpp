#include "daemon/apps/weft/evaluate_outcome.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "classifier/evaluate/open_set_check.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/learners/training_cost.hpp"
#include "daemon/analysis/report/confounding.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/interval_text.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Evaluation;
using classifier::Learner;

// Learners of "every" for slides: the paper's, ours, and best, which tries all of these.
constexpr std::array every_learner = {Learner::pvalue, Learner::pca,   Learner::all, Learner::lda,
                                      Learner::svc,    Learner::trees, Learner::best};

/// Parses the words of --learner.
Result<std::vector<Learner>> parse_learners(const std::vector<std::string>& words) {
  std::vector<Learner> out;
  for (const std::string& word : words) {
    if (word == "every") return std::vector(every_learner.begin(), every_learner.end());
    const auto one = classifier::learner_from(word);
    if (!one) return pass(one.error(), "--learner");
    if (std::find(out.begin(), out.end(), *one) == out.end()) out.push_back(*one);
  }
  return out;
}

// Other learners choose nothing by folds; calibrated probabilities always need folds.
bool needs_folds(Learner learner, bool calibration) {
  return calibration || is_choice(learner) || is_cores(learner) || learner == Learner::svc;
}

std::map<std::string, std::size_t> count_folds(const EvaluateArgs& args, Learner learner,
                                               const classifier::FeatureMatrix& features,
                                               const std::vector<classifier::Split>& splits) {
  std::map<std::string, std::size_t> out;
  for (const classifier::Split& split : splits) {
    const classifier::FoldReport report =
        fold_report(select_rows(features, split.train), learner, train_options(args.training));
    if (!report.as_requested()) ++out[format_folds(report)];
  }
  return out;
}

Result<std::vector<Outcome>> evaluate_all(const EvaluateArgs& args,
                                          const std::vector<Learner>& learners,
                                          const ChosenTrials& chosen,
                                          const std::vector<classifier::Split>& splits,
                                          bool calibration) {
  std::vector<Outcome> out;
  for (const Learner learner : learners) {
    const classifier::TrainOptions options = train_options(args.training);
    const LearningTask task = learning_task(chosen, learner, options.cap);
    auto evaluation = classifier::evaluate(task.matrix, splits, task.candidates, options,
                                           steady_wall_seconds, calibration);
    if (!evaluation) return pass(evaluation.error(), args.dataset.string());
    if (args.leave_one_group_out) name_groups_left_out(*evaluation);
    out.push_back({learner, std::move(*evaluation)});
  }
  return out;
}

/// Repeats the outcomes without each mounting's level.
Status remove_levels(const EvaluateArgs& args, const ChosenTrials& chosen, Measured& out) {
  const bool only_choices =
      std::ranges::all_of(out.outcomes, classifier::is_choice, &Outcome::learner);
  const auto features = features_without_level(chosen, args.trials);
  if (!features) return pass(features.error(), args.dataset.string());
  for (Outcome& outcome : out.outcomes) {
    if (is_choice(outcome.learner) && !only_choices) continue;
    auto reached =
        classifier::evaluate(*features, out.splits, outcome.learner, train_options(args.training));
    if (!reached) return pass(reached.error(), args.dataset.string());
    if (args.leave_one_group_out) name_groups_left_out(*reached);
    outcome.level_removed = std::move(*reached);
  }
  return {};
}

std::vector<GroupLeftOut> by_group(const classifier::FeatureMatrix& features,
                                   const Measured& measured) {
  std::vector<GroupLeftOut> out;
  for (std::size_t s = 0; s < measured.splits.size(); ++s) {
    const auto& test = measured.splits[s].test;
    GroupLeftOut one{features.groups[test.front()], test.size(), {}};
    for (const Outcome& outcome : measured.outcomes)
      one.accuracy.push_back(outcome.evaluation.splits[s].accuracy);
    out.push_back(std::move(one));
  }
  return out;
}

// The splits with fewer training trials of each label, by their number. Draws of one split are
// adjacent.
using ThinSplits = std::map<std::size_t, std::vector<classifier::Split>>;

Result<ThinSplits> thin_splits(const EvaluateArgs& args, const classifier::FeatureMatrix& features,
                               const std::vector<classifier::Split>& splits) {
  ThinSplits out;
  for (const std::size_t trials : args.curve) {
    auto thin = classifier::thinned(splits, features.labels, features.files, trials,
                                    args.curve_draws, args.training.seed);
    if (!thin) return pass(thin.error(), "--learning-curve");
    out[trials] = std::move(*thin);
  }
  return out;
}

// Draws of one split share its trials: their mean accuracy counts as one value of that split.
classifier::Interval curve_interval(const EvaluateArgs& args, const classifier::Scores& drawn,
                                    const std::vector<classifier::Split>& splits) {
  std::vector<double> accuracy(splits.size());
  for (std::size_t i = 0; i < drawn.splits.size(); ++i)
    accuracy[i / args.curve_draws] +=
        drawn.splits[i].accuracy / static_cast<double>(args.curve_draws);
  classifier::Interval out = classifier::split_interval(accuracy, mean_sizes(splits));
  if (args.leave_one_group_out) name_groups_left_out(out);
  return out;
}

Result<std::vector<CurvePoint>> measure_curve(const EvaluateArgs& args,
                                              const std::vector<Learner>& learners,
                                              const ChosenTrials& chosen,
                                              const std::vector<classifier::Split>& splits,
                                              const ThinSplits& thin) {
  std::vector<CurvePoint> out;
  for (const auto& [trials, drawn] : thin) {
    const auto outcomes = evaluate_all(args, learners, chosen, drawn, false);
    if (!outcomes) return pass(outcomes.error());
    CurvePoint point{trials, drawn.size(), {}};
    for (const Outcome& outcome : *outcomes)
      point.values.push_back({outcome.name(), outcome.evaluation.accuracy,
                              outcome.evaluation.deviation,
                              curve_interval(args, outcome.evaluation, splits)});
    out.push_back(std::move(point));
  }
  return out;
}

constexpr std::size_t most_timed = 16;

/// Mean over the first of `count` items [s], each extracted once before; 0 if an extraction fails.
template <class Extract>
double mean_seconds(std::size_t count, const classifier::SecondsNow& seconds_now,
                    const Extract& extract) {
  const std::size_t timed = std::min(most_timed, count);
  double sum_s = 0.0;
  for (std::size_t i = 0; i < timed; ++i) {
    if (!extract(i)) return 0.0;
    const double began_s = seconds_now();
    if (!extract(i)) return 0.0;
    sum_s += seconds_now() - began_s;
  }
  return timed == 0 ? 0.0 : sum_s / static_cast<double>(timed);
}

}  // namespace

Result<Measured> measure(const EvaluateArgs& args, const ChosenTrials& chosen) {
  const auto learners = parse_learners(args.learners);
  if (!learners) return pass(learners.error());
  auto splits = make_splits(args, chosen.features);
  if (!splits) return pass(splits.error());
  const auto thin = thin_splits(args, chosen.features, *splits);
  if (!thin) return pass(thin.error());
  if (args.none_of_these)
    if (auto ok = classifier::check_labels_can_be_left_out(chosen.features, *splits); !ok)
      return pass(ok.error(), args.dataset.string());
  Measured out;
  out.splits = std::move(*splits);
  out.never_tested = classifier::never_tested(out.splits, chosen.features.labels,
                                              chosen.features.groups, chosen.features.files);
  out.duplicates = classifier::find_duplicates(chosen.features, out.splits);
  if (args.train_fraction != 0.0)
    out.groups_on_both_sides = classifier::groups_on_both_sides(out.splits, chosen.features.groups);
  out.warnings = warnings_of(chosen.dataset, chosen.setup.exploration);
  const bool calibration = args.calibration || !args.report.empty();
  auto outcomes = evaluate_all(args, *learners, chosen, out.splits, calibration);
  if (!outcomes) return pass(outcomes.error());
  out.outcomes = std::move(*outcomes);
  for (Outcome& outcome : out.outcomes)
    if (needs_folds(outcome.learner, calibration || args.none_of_these))
      outcome.folds = count_folds(args, outcome.learner, chosen.features, out.splits);
  out.confounded =
      !chosen.imprint_plan && shares_mountings(chosen.dataset, chosen.features.files, out.splits);
  if (out.confounded && args.trials.remove_level.empty())
    if (Status ok = remove_levels(args, chosen, out); !ok) return pass(ok.error());
  if (args.leave_one_group_out) out.groups = by_group(chosen.features, out);
  auto curve = measure_curve(args, *learners, chosen, out.splits, *thin);
  if (!curve) return pass(curve.error());
  out.curve = std::move(*curve);
  return out;
}

double seconds_of_features(const TrialChoice& choice, const ChosenTrials& chosen,
                           const classifier::SecondsNow& seconds_now) {
  if (choice.window_s != 0.0) return 0.0;
  if (chosen.imprint_plan) {
    const auto imprints = extract_imprints(chosen.dataset);
    if (!imprints) return 0.0;
    const classifier::imprint::Image& first = imprints->front().image;
    auto features = classifier::imprint::PlannedFeatures::make(*chosen.imprint_plan, first.rows(),
                                                               first.cols());
    if (!features) return 0.0;
    return mean_seconds(imprints->size(), seconds_now, [&](std::size_t i) {
      return features->extract((*imprints)[i].image).has_value();
    });
  }
  auto selection = choose_trials(chosen.dataset, choice, false);
  if (!selection) return 0.0;
  classifier::FeatureExtractor extractor(chosen.setup.options);
  std::vector<classifier::Trial>& trials = selection->trials;
  trials.resize(std::min(trials.size(), most_timed));
  for (classifier::Trial& trial : trials)
    if (!remove_level(trial, choice)) return 0.0;
  return mean_seconds(trials.size(), seconds_now,
                      [&](std::size_t i) { return extractor.extract(trials[i]).has_value(); });
}

// "lda" or "lda (4 splits), svc (1 splits)": the chosen recipes, and how often.
std::string chosen_text(const Evaluation& e) {
  std::map<std::string, std::size_t> count;
  for (const auto& recipe : e.recipes) ++count[to_string(recipe)];
  std::vector<std::string> out;
  for (const auto& [name, splits] : count)
    out.push_back(count.size() == 1 ? name
                                    : name + " (" + std::to_string(splits) +
                                          (splits == 1 ? " split)" : " splits)"));
  return joined(out);
}

nlohmann::json candidates_json(const std::vector<classifier::RecipeScore>& scores) {
  nlohmann::json out = nlohmann::json::array();
  for (const auto& score : scores)
    out.push_back({{"learner", to_string(score.recipe)},
                   {"errors", score.errors},
                   {"tested", score.tested},
                   {"rounds", score.rounds},
                   {"cost_s", score.cost_s},
                   {"skipped", score.skipped()}});
  return out;
}

std::string tried_text(const std::vector<classifier::RecipeScore>& scores) {
  std::size_t most = 0, tried = 0;
  for (const auto& score : scores) most = std::max(most, score.tested);
  const classifier::RecipeScore* best = nullptr;
  for (const auto& score : scores) {
    if (score.skipped()) continue;
    ++tried;
    if (score.tested == most && (best == nullptr || score.errors < best->errors)) best = &score;
  }
  std::vector<std::string> out;
  if (best != nullptr)
    out.push_back(to_string(best->recipe) + " " + std::to_string(best->errors) + " errors of " +
                  std::to_string(best->tested) +
                  (tried > 1 ? ", chosen from " + std::to_string(tried) + " (see --json)" : ""));
  if (auto skipped = classifier::format_skipped(scores); !skipped.empty())
    out.push_back(std::move(skipped));
  return joined(out, "; ");
}

}  // namespace weft::daemon::cli
