#include "daemon/cli/train_command.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/cli/dataset_file.hpp"
#include "daemon/dataset/atomic_file.hpp"
#include "daemon/loop/wall_clock.hpp"
#include "daemon/report/format.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

json summary_json(const TrainArgs& args, const classifier::StoredModel& stored, std::size_t rows,
                  double train_s) {
  const classifier::GridScore cv = stored.model.cross_validation();
  return {{"command", "train"},
          {"file", args.out.string()},
          {"bench", stored.provenance.bench},
          {"dataset_sha256", stored.provenance.dataset_sha256},
          {"training", stored.provenance.training},
          {"exploration", stored.setup.exploration},
          {"reduction", classifier::to_string(stored.model.reduction())},
          {"labels", stored.model.labels()},
          {"rows", rows},
          {"features", stored.model.feature_names().size()},
          {"taxels", stored.setup.taxels},
          {"cores", stored.model.cores().size()},
          {"cv_errors", cv.errors},
          {"cv_loss", cv.loss},
          {"train_s", train_s}};
}

std::string summary_text(const TrainArgs& args, const classifier::StoredModel& stored,
                         std::size_t rows, double train_s) {
  return args.out.string() + ": " + std::to_string(stored.model.labels().size()) + " fabrics, " +
         std::to_string(stored.model.cores().size()) + " cores (" +
         std::string(classifier::to_string(stored.model.reduction())) + "), trained on " +
         std::to_string(rows) + " feature vectors of " +
         std::to_string(stored.model.feature_names().size()) + " in " + duration(train_s) + "\n";
}

}  // namespace

void add_options(CLI::App& command, TrainArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  command.add_option("-o,--output", args.out, "model file to write")->required();
  command
      .add_option("--reduction", args.reduction,
                  "of the features; best: chosen by cross-validation")
      ->check(CLI::IsMember({"pvalue", "pca", "all", "best"}))
      ->capture_default_str();
  add_trial_options(command, args.trials);
  add_train_options(command, args.training);
}

Result<int> run_train(const TrainArgs& args, Console& console) {
  const Trainer here = [](const ChosenTrials& chosen, const classifier::TrainOptions& options) {
    return classifier::train(chosen.features, options);
  };
  return run_train_with(here, args, console);
}

Result<int> run_train_with(const Trainer& trainer, const TrainArgs& args, Console& console) {
  const Result<classifier::Reduction> reduction = classifier::reduction_from(args.reduction);
  if (!reduction) return pass(reduction.error(), "--reduction");
  if (auto ok = refuse_same_file(args.dataset, args.out); !ok) return pass(ok.error());
  Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, true);
  if (!chosen) return pass(chosen.error());
  const double began_s = steady_wall_seconds();
  auto model = trainer(*chosen, train_options(args.training, *reduction));
  if (!model) return pass(model.error(), args.dataset.string());
  const double train_s = steady_wall_seconds() - began_s;
  auto aids =
      classifier::learn_aids(*model, chosen->features, train_options(args.training, *reduction));
  if (!aids) return pass(aids.error(), args.dataset.string());
  const BenchKind kind = chosen->dataset.info.kind;
  const classifier::StoredModel stored{
      std::move(*model),
      std::move(chosen->setup),
      {std::string(to_string(kind)), chosen->sha256, WEFT_VERSION, describe(args.training)},
      std::move(*aids)};
  std::ostringstream text;
  if (auto ok = classifier::save_model(stored, text); !ok) return pass(ok.error());
  if (auto ok = write_text_file(args.out, text.view()); !ok) return pass(ok.error());
  const std::size_t rows = chosen->features.size();
  print(console, bench_banner(kind) + summary_text(args, stored, rows, train_s),
        summary_json(args, stored, rows, train_s));
  return exit_ok;
}

}  // namespace weft::daemon::cli
