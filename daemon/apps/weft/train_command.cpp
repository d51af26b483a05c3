#include "daemon/apps/weft/train_command.hpp"
#include "classifier/learners/multi_class_svc.hpp"

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "classifier/imprint/feature_sets.hpp"
#include "classifier/imprint/imprint_model.hpp"
#include "classifier/learners/class_folds.hpp"
#include "classifier/live/staged_model.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/campaign/live_classifier.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

using classifier::StoredModel;

namespace ci = classifier::imprint;

// The result of a training, and the facts that its two lines of text need beside the model.
struct Trained {
  StoredModel model;
  std::optional<ci::ImprintSetup> imprints;  // empty: fabrics
  classifier::Recipe recipe;
  std::vector<classifier::RecipeScore> scores;
  std::size_t rows = 0;
  double train_s = 0.0;      // choice and training [s]
  double calibrate_s = 0.0;  // probabilities and the reject rule [s]
  classifier::TrainOptions options;
  classifier::FoldReport folds;
};

json folds_json(const classifier::FoldReport& report) {
  return {{"none", report.none}, {"finer", report.finer}, {"not_tested", report.untested}};
}

// For a data set of imprints; empty for fabrics.
Result<std::optional<ci::ImprintSetup>> imprint_setup(const ChosenTrials& chosen) {
  if (!chosen.imprint_plan) return std::nullopt;
  const auto imprints = extract_imprints(chosen.dataset);
  if (!imprints) return pass(imprints.error());
  const auto grid = find_grid(chosen.dataset, *imprints);
  if (!grid) return pass(grid.error());
  return ci::ImprintSetup{*grid, *chosen.imprint_plan};
}

// For imprints with chosen features: a stored learner uses all features that it gets, so the unused
// ones are removed.
void take_used_features(ChosenTrials& chosen, classifier::ChosenLearner& trained) {
  ci::UsedFeatures used = ci::used_features(trained.trained, *chosen.with_maps);
  chosen.imprint_plan = ci::chosen_plan(*chosen.imprint_plan, trained.recipe);
  chosen.features = std::move(used.matrix);
  trained.trained = std::move(used.learner);
}

// Writes the model file of fabrics, or of imprints.
Status write_model(const Trained& trained, std::ostream& out) {
  const StoredModel& model = trained.model;
  if (!trained.imprints) return classifier::save_model(model, out);
  return classifier::save_model(ci::ImprintModel{model.learner, *trained.imprints, model.provenance,
                                                 model.postprocessing, model.trained_on},
                                out);
}

json summary_json(const TrainArgs& args, const DatasetInfo& info, const Trained& trained) {
  const StoredModel& stored = trained.model;
  json out{{"command", "train"},
           {"file", args.out.string()},
           {"bench", stored.provenance.bench},
           {"ended_early", json(ended_early_json(info))},
           {"dataset_sha256", stored.provenance.dataset_sha256},
           {"training", stored.provenance.training},
           {"exploration", stored.setup.exploration},
           {"learner", classifier::to_string(trained.recipe.learner)},
           {"view", classifier::to_string(trained.recipe.view)},
           {"labels", stored.learner.labels()},
           {"rows", trained.rows},
           {"features", stored.learner.feature_names().size()},
           {"taxels", stored.setup.taxels},
           {"unconverged", trained.options.unconverged->load()},
           {"calibrated", stored.postprocessing.has_value()},
           {"train_s", trained.train_s},
           {"calibrate_s", trained.calibrate_s}};
  if (!trained.folds.as_requested()) out["folds"] = folds_json(trained.folds);
  if (trained.imprints) {
    out["kind"] = "imprints";
    out["array"] = ci::format_grid(trained.imprints->grid);
    out["feature_set"] = to_string(trained.imprints->features);
  }
  if (!trained.scores.empty()) out["candidates"] = candidates_json(trained.scores);
  if (const classifier::FabricModel* model = stored.learner.cores()) {
    const classifier::GridScore cv = model->cross_validation();
    out["cores"] = model->cores().size();
    out["cv_errors"] = cv.errors;
    out["cv_loss"] = cv.loss;
  }
  return out;
}

std::string format_machine(const StoredModel& stored, const classifier::Recipe& recipe) {
  const classifier::FabricModel* model = stored.learner.cores();
  return (model == nullptr ? "" : std::to_string(model->cores().size()) + " cores, ") +
         to_string(recipe);
}

// Settings that no fold tested, if there were no folds.
std::string format_untested(const Trained& trained) {
  if (!trained.folds.none) return {};
  std::string out = "; not tested";
  if (!trained.scores.empty()) out += ", simplest learner chosen";
  const auto* svc = trained.model.learner.as<classifier::MultiClassSvc>();
  if (svc != nullptr) out += ", C " + general(svc->c()) + ", gamma " + general(svc->gamma());
  if (!trained.model.postprocessing)
    out += ", not calibrated: no probability, no check for unknown fabrics";
  return out;
}

std::string folds_line(const Trained& trained) {
  if (trained.folds.as_requested()) return {};
  return "  folds: " + format_folds(trained.folds) + format_untested(trained) + "\n";
}

std::string summary_text(const TrainArgs& args, const Trained& trained) {
  const StoredModel& stored = trained.model;
  std::string out =
      args.out.string() + ": " + std::to_string(stored.learner.labels().size()) +
      (trained.imprints ? " classes of imprints, " : " fabrics, ") +
      format_machine(stored, trained.recipe) + ", trained on " + std::to_string(trained.rows) +
      " feature vectors of " + std::to_string(stored.learner.feature_names().size()) + " in " +
      duration(trained.train_s) +
      (stored.postprocessing ? ", calibrated in " + duration(trained.calibrate_s) : "") + "\n" +
      folds_line(trained);
  if (!trained.scores.empty() && !trained.folds.none) {
    const std::size_t rounds = trained.scores.front().rounds;
    out += "  cross-validation" + (rounds > 1 ? ", " + std::to_string(rounds) + " rounds" : "") +
           ": " + tried_text(trained.scores) + "\n";
  }
  return out;
}

std::string stages_text(const TrainArgs& args, const classifier::StagedModel& model,
                        std::size_t slides, double train_s) {
  std::vector<std::string> lengths;
  for (std::size_t i = 0; i < model.stages.size(); ++i)
    lengths.push_back(general(model.slide_s(i)));
  return args.out.string() + ": " + std::to_string(model.last().learner.labels().size()) +
         " fabrics, votes after " + joined(lengths) + " s of stroke, trained on " +
         std::to_string(slides) + " strokes in " + duration(train_s) + "\n" +
         (model.last().postprocessing ? ""
                                      : "  not calibrated, so without probability: fewer than two "
                                        "labels have three strokes\n");
}

json stages_json(const TrainArgs& args, const DatasetInfo& info,
                 const classifier::StagedModel& model, std::size_t slides,
                 const classifier::TrainOptions& options, double train_s) {
  json stages = json::array();
  for (std::size_t i = 0; i < model.stages.size(); ++i)
    stages.push_back({{"slide_s", model.slide_s(i)},
                      {"learner", classifier::to_string(model.stages[i].model.learner.kind())},
                      {"training", model.stages[i].model.provenance.training},
                      {"calibrated", model.stages[i].model.postprocessing.has_value()}});
  const StoredModel& last = model.last();
  return {{"command", "train"},
          {"live", true},
          {"file", args.out.string()},
          {"bench", last.provenance.bench},
          {"ended_early", json(ended_early_json(info))},
          {"dataset_sha256", last.provenance.dataset_sha256},
          {"training", last.provenance.training},
          {"exploration", last.setup.exploration},
          {"labels", last.learner.labels()},
          {"rows", slides},
          {"stages", std::move(stages)},
          {"unconverged", options.unconverged->load()},
          {"train_s", train_s}};
}

std::size_t label_count(const std::vector<classifier::Trial>& trials) {
  std::set<std::string_view> labels;
  for (const classifier::Trial& trial : trials) labels.insert(trial.label);
  return labels.size();
}

Result<int> run_train_live(const TrainArgs& args, classifier::Learner learner, Console& console) {
  auto dataset = open_dataset(args.dataset);
  if (!dataset) return pass(dataset.error());
  if (auto ok = check_command(args.trials, kind_of(*dataset)); !ok)
    return pass(ok.error(), args.dataset.string());
  auto chosen = choose_trials(*dataset, args.trials, true);
  if (!chosen) return pass(chosen.error(), args.dataset.string());
  classifier::StagedOptions options;
  options.learner = learner;
  options.training = train_options(args.training);
  options.features.norm = args.trials.norm == "rms" ? classifier::Norm::rms : classifier::Norm::l2;
  options.exploration = chosen->exploration;
  options.provenance = {std::string(to_string(dataset->info.kind)), dataset_sha256(*dataset),
                        software_version(),
                        describe(args.training, label_count(chosen->trials), {})};
  const double began_s = steady_wall_seconds();
  const auto model = classifier::train_staged(chosen->trials, dataset->info.taxel_rate_hz, options);
  if (!model) return pass(model.error(), args.dataset.string());
  const double train_s = steady_wall_seconds() - began_s;
  std::ostringstream text;
  if (auto ok = classifier::save_staged(*model, text); !ok) return pass(ok.error());
  if (auto ok = check_live_model_size(text.view().size()); !ok)
    return pass(ok.error(), args.out.string());
  if (auto ok = write_text_file(args.out, text.view()); !ok) return pass(ok.error());
  const std::vector<Warning> warnings = warnings_of(*dataset, chosen->exploration);
  json out =
      stages_json(args, dataset->info, *model, chosen->trials.size(), options.training, train_s);
  out["warnings"] = warnings;
  print(console,
        bench_banner(dataset->info) + warnings_text(warnings) +
            stages_text(args, *model, chosen->trials.size(), train_s) +
            unconverged_text(options.training),
        out);
  return exit_ok;
}

Result<int> run_train(const TrainArgs& args, Console& console) {
  if (is_about_recordings(args.trials, args.dataset, !args.recordings.methods.empty()))
    return run_train_recordings(args, console);
  if (args.live) {
    const auto learner = classifier::learner_from(args.learner);
    if (!learner) return pass(learner.error(), "--learner");
    if (auto ok = check_output(args.dataset, args.out); !ok) return pass(ok.error());
    return run_train_live(args, *learner, console);
  }
  const Trainer here = [](const ChosenTrials& chosen, classifier::Learner learner,
                          const classifier::TrainOptions& options) {
    const LearningTask task = learning_task(chosen, learner, options.cap);
    return classifier::train_best(task.matrix, task.candidates, options);
  };
  return run_train_with(here, args, console);
}

}  // namespace

void add_options(CLI::App& command, TrainArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  command.add_option("-o,--output", args.out, "write the model to this file")->required();
  LearningOptions options(command, args.trials.modality, args.trials.given);
  add_trial_options(command, options, args.trials);
  auto* const windows = command.get_option("--window-s");
  add_learner_option(
      options.place_of("--learner"), args.trials.modality ? "--learner" : "--learner,--reduction",
      args.learner,
      "train this learner (lda, svc, trees, pvalue, pca, all, cores-best, best, ...)");
  command
      .add_flag("--live", args.live,
                "train for live votes: one model per stroke time of 0.5, 1, 2, 3, 4, 6 ... s")
      ->excludes(windows);
  add_train_options(command, args.training);
  add_learners_option(command, options.name_of("--method"), args.recordings.methods,
                      "train this vibration learner (best, nb, knn, tree, forest, svm, lda, ...)")
      ->expected(1);
  add_recording_feature_options(options, args.recordings);
  add_row_options(options, args.recordings);
  options.finish();
}

Result<int> run_train_with(const Trainer& trainer, const TrainArgs& args, Console& console) {
  const Result<classifier::Learner> learner = classifier::learner_from(args.learner);
  if (!learner) return pass(learner.error(), "--learner");
  if (args.live)
    return fail({.code = Errc::unsupported,
                 .where = "--live",
                 .what = "models for live votes cannot be trained with MPI",
                 .expected = "weft fabric train --live"});
  if (auto ok = check_output(args.dataset, args.out); !ok) return pass(ok.error());
  Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, true);
  if (!chosen) return pass(chosen.error());
  const classifier::TrainOptions options = train_options(args.training);
  const double began_s = steady_wall_seconds();
  auto trained = trainer(*chosen, *learner, options);
  if (!trained) return pass(trained.error(), args.dataset.string());
  const double train_s = steady_wall_seconds() - began_s;
  if (!trained->recipe.columns.empty()) take_used_features(*chosen, *trained);
  auto imprints = imprint_setup(*chosen);
  if (!imprints) return pass(imprints.error(), args.dataset.string());
  auto postprocessing = classifier::fit_postprocessing(trained->trained, chosen->features, options);
  if (!postprocessing) return pass(postprocessing.error(), args.dataset.string());
  const double calibrate_s = steady_wall_seconds() - began_s - train_s;
  const BenchKind kind = chosen->dataset.info.kind;
  classifier::FoldReport folds = fold_report(chosen->features, *learner, options);
  const std::string how =
      describe(args.training, trained->trained.labels().size(), format_folds(folds));
  const Trained done{{std::move(trained->trained),
                      std::move(chosen->setup),
                      {std::string(to_string(kind)), chosen->sha256, software_version(), how},
                      std::move(*postprocessing),
                      std::move(chosen->digests)},
                     std::move(*imprints),
                     trained->recipe,
                     std::move(trained->scores),
                     chosen->features.size(),
                     train_s,
                     calibrate_s,
                     options,
                     std::move(folds)};
  const auto written =
      write_streamed_file(args.out, [&](std::ostream& out) { return write_model(done, out); });
  if (!written) return pass(written.error());
  const std::vector<Warning> warnings = warnings_of(chosen->dataset, done.model.setup.exploration);
  json out = summary_json(args, chosen->dataset.info, done);
  out["warnings"] = warnings;
  print(console,
        bench_banner(chosen->dataset.info) + warnings_text(warnings) + summary_text(args, done) +
            unconverged_text(options),
        out);
  return exit_ok;
}

CLI::App* add_train_command(const CommandGroup& group, CommandModality modality) {
  TrainArgs preset;
  preset.trials.modality = modality;
  return group.add<TrainArgs>("train", run_train, preset);
}

}  // namespace weft::daemon::cli
