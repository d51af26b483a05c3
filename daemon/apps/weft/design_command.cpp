#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/analysis/design/design_page.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;
namespace design = classifier::design;

struct DesignAnalyseArgs {
  std::vector<std::filesystem::path> datasets;
  std::filesystem::path out;  ///< page; empty: not written
  std::string learner = "lda";
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
  double shortest_mm = 0.2, longest_mm = 5;
};
struct DesignRepetitionsArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;  ///< page; empty: not written
  TrialChoice trials;
  std::string learner = "pvalue";
  std::size_t predict = 20;
  double accuracy = 0.9;
  std::size_t most = 200;
  std::size_t first = 0;
  bool strokes = false;
  std::size_t draws = 4;
  std::size_t resamples = 2000;
  std::uint64_t seed = 1;
};

std::string cells_text(const SweepAnalysis& a) {
  Table table;
  table.row(
      {"cell", "accuracy", "95 % interval", "signal/noise", "saturated", "seconds", "chosen in"});
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    const auto& cell = a.choice.cells[i];
    table.row({(i == a.choice.chosen ? "> " : "") + format_cell(a, i),
               percent(cell.figures.accuracy) + " %",
               percent(cell.ci95.low) + " to " + percent(cell.ci95.high),
               fixed(a.cells[i].snr_db.value, 1) + " dB",
               percent(a.cells[i].saturated_share.value, 2) + " %",
               fixed(a.cells[i].seconds.value, 1), percent(cell.chosen_share) + " %"});
  }
  return table.text();
}

std::string analysis_text(const SweepAnalysis& a) {
  std::vector<std::string> on;
  for (const std::size_t i : a.choice.front) on.push_back(format_cell(a, i));
  return bench_banner(a.bench) + a.exploration + ", " + std::to_string(a.fabrics.size()) +
         " fabrics, " + std::to_string(a.replicates) + " replicates\n" + cells_text(a) +
         format_left_out(a) + "Front of separability against seconds: " + joined(on, "; ") + "\n" +
         wrapped(recommendation(a), "");
}

std::string page_line(const std::filesystem::path& out) {
  return out.empty() ? "" : "page: " + out.string() + "\n";
}

std::string curve_text(const RepetitionStudy& study) {
  Table table;
  table.row({"repetitions", "accuracy", "95 % interval"});
  for (const auto& p : study.curve.points)
    table.row({std::to_string(p.repetitions), percent(p.accuracy) + " %",
               percent(p.ci95.low) + " to " + percent(p.ci95.high)});
  return bench_banner(study.bench) + table.text() + wrapped(format_repetition_study(study), "");
}

void add_options(CLI::App& command, DesignAnalyseArgs& args) {
  command.add_option("DATA", args.datasets, "data sets of a sweep, all of the same bench kind")
      ->required();
  command.add_option("-o,--output", args.out, "write the page to this file (HTML)");
  command
      .add_option("--learner", args.learner,
                  "use this learner (lda, svc, trees, pvalue, best, ...)")
      ->capture_default_str();
  add_count(command, "--resamples", args.resamples, 100, 1'000'000,
            "resample the trials N times, for the stability of the choice");
  command.add_option("--seed", args.seed, "set the seed of resamples and learner")
      ->capture_default_str();
  add_number(command, "--shortest-mm", args.shortest_mm, 0.001, 1000.0,
             "set the shortest period of a texture");
  add_number(command, "--longest-mm", args.longest_mm, 0.001, 1000.0,
             "set the longest period of a texture");
}

Result<int> run_design_analyse(const DesignAnalyseArgs& args, Console& console) {
  if (args.shortest_mm >= args.longest_mm)
    return fail({.code = Errc::invalid_argument,
                 .where = "--shortest-mm",
                 .what = "shortest period not below the longest",
                 .expected = "less than --longest-mm"});
  const auto learner = classifier::learner_from(args.learner);
  if (!learner) return pass(learner.error(), "--learner");
  std::vector<Dataset> datasets;
  for (const auto& path : args.datasets) {
    if (Status ok = check_page(path, args.out); !ok) return pass(ok.error());
    auto dataset = open_dataset(path);
    if (!dataset) return pass(dataset.error());
    datasets.push_back(std::move(*dataset));
  }
  SweepOptions options;
  options.learner = *learner;
  options.band = {args.shortest_mm / 1e3, args.longest_mm / 1e3};
  options.resamples = args.resamples;
  options.seed = args.seed;
  options.progress = [&](const std::string& what) {
    console.err << "design: " << what << std::endl;
  };
  const auto analyses = analyse_sweep(datasets, options);
  if (!analyses) return pass(analyses.error());
  std::string text;
  Blocks sections;
  json list = json::array();
  for (const SweepAnalysis& one : *analyses) {
    text += analysis_text(one);
    sections += design_section(one);
    list.push_back(json(design_json(one)));
  }
  const json record{{"command", "design analyse"}, {"analyses", list}};
  if (Status ok = write_page_files(args.out, record,
                                   design_document("Which setting: " + datasets.front().info.name,
                                                   analyses->front().bench, std::move(sections)));
      !ok)
    return pass(ok.error());
  print(console, text + page_line(args.out), record);
  return exit_ok;
}

void add_options(CLI::App& command, DesignRepetitionsArgs& args) {
  command.add_option("DATA", args.dataset, "data set")->required();
  command.add_option("-o,--output", args.out, "write the page to this file (HTML)");
  LearningOptions options(command, {}, args.trials.given);
  add_trial_options(command, options, args.trials);
  command
      .add_option("--learner", args.learner,
                  "use this learner (lda, svc, trees, pvalue, best, ...)")
      ->capture_default_str();
  add_count(command, "--predict", args.predict, 3, 100'000,
            "forecast the accuracy for this number of repetitions");
  add_number(command, "--accuracy", args.accuracy, 0.01, 0.9999,
             "find the repetitions that reach this accuracy (0 to 1)");
  add_count(command, "--most", args.most, 3, 100'000, "give up beyond this number of repetitions");
  command.add_option("--first", args.first, "use only the first N repetitions");
  command.add_flag("--strokes", args.strokes,
                   "count every trial of a label as a repetition, in random order");
  add_count(command, "--draws", args.draws, 1, 1000,
            "train N times for each size and each left-out repetition");
  add_count(command, "--resamples", args.resamples, 100, 1'000'000,
            "resample the repetitions N times, for the intervals");
  command.add_option("--seed", args.seed, "set the seed of draws and resamples")
      ->capture_default_str();
  options.finish();
}

Result<int> run_design_repetitions(const DesignRepetitionsArgs& args, Console& console) {
  if (Status ok = check_page(args.dataset, args.out); !ok) return pass(ok.error());
  const auto learner = classifier::learner_from(args.learner);
  if (!learner) return pass(learner.error(), "--learner");
  if (args.trials.window_s != 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "--window-s",
                 .what = "option not possible for repetitions"});
  const auto chosen = load_trials(args.dataset, args.trials, true);
  if (!chosen) return pass(chosen.error());
  const classifier::FeatureMatrix matrix =
      by_repetition(chosen->features, chosen->dataset, {args.strokes, args.first, args.seed});
  design::CurveOptions options;
  options.learner = *learner;
  options.draws = args.draws;
  options.seed = args.seed;
  auto curve = design::learning_curve(matrix, options);
  if (!curve) return pass(curve.error(), args.dataset.string());
  const auto forecast = design::forecast_repetitions(
      *curve, {args.predict, args.accuracy, args.most, args.resamples, args.seed});
  if (!forecast) return pass(forecast.error());
  const RepetitionStudy study{
      chosen->dataset.info.kind, chosen->sha256,
      chosen->setup.exploration, std::string(classifier::to_string(*learner)),
      std::move(*curve),         *forecast};
  json out = json(design_json(study));
  out["command"] = "design repetitions";
  if (Status ok =
          write_page_files(args.out, out,
                           design_document("How many repetitions: " + chosen->dataset.info.name,
                                           study.bench, design_section(study)));
      !ok)
    return pass(ok.error());
  print(console, curve_text(study) + page_line(args.out), out);
  return exit_ok;
}

}  // namespace

void add_design_commands(const CommandGroup& weft) {
  const CommandGroup group = weft.group("design");
  group.add<DesignAnalyseArgs>("analyse", run_design_analyse);
  group.add<DesignRepetitionsArgs>("repetitions", run_design_repetitions);
}

}  // namespace weft::daemon::cli
