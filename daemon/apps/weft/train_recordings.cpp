#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "classifier/learners/training_cost.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/recording_model.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"
#include "daemon/apps/weft/evaluate_text.hpp"
#include "daemon/apps/weft/train_command.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon::cli {
namespace {

namespace vibro = classifier::vibro;
using nlohmann::json;

struct RecordingPlan {
  vibro::RecordingSetup setup;
  classifier::Recipe recipe;
  classifier::TrainOptions training;
  std::vector<classifier::RecipeScore> scores = {};  // empty without a choice
};

Result<RecordingPlan> plan_for(const TrainArgs& args, const RecordingSet& set) {
  const RecordingChoice& choice = args.recordings;
  if (auto ok = check_command(args.trials, DataKind::whole_recordings); !ok)
    return pass(ok.error(), args.dataset.string());
  if (choice.methods.size() > 1)
    return fail({.code = Errc::invalid_argument,
                 .where = name_in(args.trials.modality, "--method"),
                 .what = "more than one learner for a model",
                 .expected = "one name",
                 .got = joined(choice.methods, ",")});
  const auto features = parse_feature_choice(choice);
  if (!features) return pass(features.error());
  RecordingPlan out;
  out.setup.features = *features;
  if (args.trials.window_s > 0.0) out.setup.window_s = args.trials.window_s;
  out.setup.step_s = choice.step_s;
  const std::size_t columns = vibro::columns_of(set.recordings.front().channels, *features).size();
  // Groups stay whole in folds: common properties of a session must not be learnt as a texture.
  out.training = vibro::window_training({.seed = args.training.seed,
                                         .threads = args.training.threads,
                                         .outliers = choice.outliers,
                                         .budget = args.training.time_budget_s},
                                        vibro::Protocol::groups);
  if (!choice.methods.empty() && choice.methods.front() != "best") {
    const auto learner = classifier::single_learner_from(choice.methods.front());
    if (!learner) return pass(learner.error(), name_in(args.trials.modality, "--method"));
    out.recipe = vibro::window_recipe(*learner, std::min(choice.components, columns));
    return out;
  }
  const auto chosen = vibro::choose_recipe(set.recordings, out.setup, !choice.features.empty(),
                                           choice.components, out.training);
  if (!chosen) return pass(chosen.error());
  out.recipe = chosen->recipe;
  out.setup.features = chosen->features;
  out.scores = chosen->scores;
  return out;
}

// Result of the choice; empty without one.
std::string choice_text(const RecordingPlan& plan) {
  if (plan.scores.empty()) return {};
  const classifier::RecipeScore& first = plan.scores.front();
  if (first.tested == 0 && !first.skipped())
    return "  only one training group, so no cross-validation: chose " + to_string(first.recipe) +
           " untested\n";
  if (first.skipped())
    return "  chose " + to_string(first.recipe) + " untested; " +
           classifier::format_skipped(plan.scores) + "\n";
  return "  cross-validation of windows: " + tried_text(plan.scores) + "\n";
}

std::string format_plan(const RecordingPlan& plan, const std::string& exploration,
                        const std::map<std::string, std::size_t>& outliers) {
  return std::string(classifier::to_string(plan.recipe.learner)) + ", " +
         std::string(vibro::to_string(plan.setup.features.family)) + " " +
         std::string(vibro::to_string(plan.setup.features.combine)) + ", " +
         general(plan.setup.window_s) + " s windows every " + general(plan.setup.step_s) + " s, " +
         std::to_string(plan.recipe.components) + " components, seed " +
         std::to_string(plan.training.seed) +
         (exploration.empty() ? "" : ", exploration " + exploration) +
         format_outliers(plan.training.outliers, outliers);
}

}  // namespace

Result<int> run_train_recordings(const TrainArgs& args, Console& console) {
  if (auto ok = check_output(args.dataset, args.out); !ok) return pass(ok.error());
  auto set = open_recordings(args.dataset, args.trials.exploration, true);
  if (!set) return pass(set.error());
  const std::string sha256 = recordings_sha256(*set);
  if (auto ok = set_groups(*set, args.trials.group); !ok)
    return pass(ok.error(), args.dataset.string());
  const auto plan = plan_for(args, *set);
  if (!plan) return pass(plan.error());
  const double began_s = steady_wall_seconds();
  auto model = vibro::train_recording_model(
      set->recordings, plan->setup, plan->recipe, plan->training,
      {std::string(to_string(set->kind)), sha256, software_version(), {}});
  if (!model) return pass(model.error(), args.dataset.string());
  model->provenance.training =
      format_plan(*plan, args.trials.exploration, model->learner.outliers());
  const double train_s = steady_wall_seconds() - began_s;
  const std::string withheld =
      vibro::reason_without_probability(set->recordings, plan->setup, plan->recipe, plan->training);
  const auto too_short = vibro::too_short_for(plan->setup, set->recordings);
  const std::size_t trained = set->recordings.size() - too_short.size();
  std::ostringstream text;
  if (auto ok = classifier::save_model(*model, text); !ok) return pass(ok.error());
  if (auto ok = write_text_file(args.out, text.view()); !ok) return pass(ok.error());
  const std::vector<Warning> warnings = find_data_warnings(*set);
  print(
      console,
      bench_banner(set->kind) + warnings_text(warnings) + args.out.string() + ": " +
          std::to_string(model->learner.labels().size()) + " textures, " +
          model->provenance.training + ", trained on " + std::to_string(trained) +
          " recordings in " + duration(train_s) + "\n" + choice_text(*plan) +
          (withheld.empty() ? "" : "  not calibrated, so without probability: " + withheld + "\n") +
          (too_short.empty() ? "" : "  " + format_too_short(too_short) + "\n"),
      {{"command", "train"},
       {"kind", "recordings"},
       {"file", args.out.string()},
       {"bench", to_string(set->kind)},
       {"dataset_sha256", model->provenance.dataset_sha256},
       {"training", model->provenance.training},
       {"learner", classifier::to_string(model->learner.kind())},
       {"components", plan->recipe.components},
       {"outliers",
        {{"deviations", plan->training.outliers}, {"left_out", model->learner.outliers()}}},
       {"labels", model->learner.labels()},
       {"candidates", candidates_json(plan->scores)},
       {"calibrated", model->postprocessing.has_value()},
       {"not_calibrated", withheld},
       {"recordings", trained},
       {"too_short", too_short_json(too_short)},
       {"warnings", warnings},
       {"window_s", model->setup.window_s},
       {"step_s", model->setup.step_s},
       {"train_s", train_s}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
