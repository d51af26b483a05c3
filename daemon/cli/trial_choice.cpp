#include "daemon/cli/trial_choice.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "daemon/cli/dataset_file.hpp"
#include "daemon/report/format.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Trial;

// The exploration that `choice` means; nothing: all of them.
Result<std::optional<std::string>> exploration_of(const Dataset& dataset, const TrialChoice& choice,
                                                  bool one_exploration) {
  const std::vector<std::string> present = explorations_of(dataset);
  if (present.empty()) return fail(Errc::not_found, "no complete trial in the data set");
  if (choice.exploration.empty()) {
    if (present.size() == 1) return present.front();
    if (!one_exploration) return std::nullopt;
    return fail(Errc::invalid_argument, "the data set holds several explorations", {}, {},
                joined(present), "Choose one with --exploration");
  }
  if (std::ranges::find(present, choice.exploration) == present.end())
    return fail(Errc::not_found, "no trial has this exploration", "--exploration", joined(present),
                choice.exploration);
  return choice.exploration;
}

classifier::FeatureSetup setup_of(const TrialSelection& chosen, const TrialChoice& choice,
                                  double period_s) {
  classifier::FeatureSetup setup;
  setup.taxels = chosen.trials.front().taxels;
  setup.phases = classifier::phases_of(chosen.trials.front());
  setup.options.norm = choice.norm == "rms" ? classifier::Norm::rms : classifier::Norm::l2;
  setup.window_s = choice.window_s;
  setup.window_step_s = choice.window_step_s;
  setup.sample_period_s = period_s;
  setup.exploration = chosen.exploration;
  return setup;
}

}  // namespace

void add_trial_options(CLI::App& command, TrialChoice& choice) {
  command.add_option("--exploration", choice.exploration,
                     "only trials of this exploration, such as M1");
  command
      .add_option("--window-s", choice.window_s,
                  "cut phase M into windows of this many seconds; without it whole strokes")
      ->check(CLI::Range(1e-3, 1e6));
  command
      .add_option("--window-step-s", choice.window_step_s, "from one window's start to the next")
      ->check(CLI::Range(1e-3, 1e6))
      ->needs("--window-s");
  command
      .add_option("--norm", choice.norm,
                  "F_norm: l2 as in the paper, or rms for motions of different lengths")
      ->check(CLI::IsMember({"l2", "rms"}))
      ->capture_default_str();
}

double sample_period_s(const Dataset& dataset) {
  return dataset.info.taxel_rate_hz > 0.0 ? 1.0 / dataset.info.taxel_rate_hz : 0.0;
}

Result<TrialSelection> choose_trials(const Dataset& dataset, const TrialChoice& choice,
                                     bool one_exploration) {
  const auto exploration = exploration_of(dataset, choice, one_exploration);
  if (!exploration) return pass(exploration.error());
  std::vector<Trial> strokes = complete_trials(dataset, *exploration);
  TrialSelection out{exploration->value_or(""), strokes.size(), {}};
  auto trials = in_windows(std::move(strokes),
                           {choice.window_s, choice.window_step_s, sample_period_s(dataset)});
  if (!trials) return pass(trials.error());
  out.trials = std::move(*trials);
  return out;
}

Result<std::vector<Trial>> in_windows(std::vector<Trial> strokes,
                                      const classifier::WindowOptions& options) {
  if (options.window_s == 0.0) return strokes;
  if (!(options.sample_period_s > 0.0))
    return fail(Errc::invalid_argument, "the sample rate is not known, so no window can be cut");
  std::vector<Trial> out;
  for (const Trial& stroke : strokes) {
    auto windows = classifier::cut_windows(stroke, options);
    if (!windows) return pass(windows.error());
    std::move(windows->begin(), windows->end(), std::back_inserter(out));
  }
  return out;
}

Result<ChosenTrials> load_trials(const std::filesystem::path& path, const TrialChoice& choice,
                                 bool one_exploration) {
  Result<Dataset> dataset = open_dataset(path);
  if (!dataset) return pass(dataset.error());
  const Result<TrialSelection> chosen = choose_trials(*dataset, choice, one_exploration);
  if (!chosen) return pass(chosen.error(), path.string());
  ChosenTrials out;
  out.strokes = chosen->strokes;
  out.setup = setup_of(*chosen, choice, sample_period_s(*dataset));
  auto features = classifier::build_feature_matrix(chosen->trials, out.setup.options);
  if (!features) return pass(features.error(), path.string());
  out.features = std::move(*features);
  out.sha256 = dataset_sha256(*dataset);
  out.dataset = std::move(*dataset);
  return out;
}

std::string bench_banner(BenchKind kind) {
  switch (kind) {
    case BenchKind::simulated:
      return "SIMULATED data: made by the plant model, no cloth was touched.\n";
    case BenchKind::unknown:
      return "Data of unknown origin: the file does not say which bench recorded it.\n";
    case BenchKind::real:
      return {};
  }
  return {};
}

}  // namespace weft::daemon::cli
