#include "daemon/cli/trial_choice.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "classifier/features/windows.hpp"
#include "daemon/dataset/hdf5_file.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Trial;

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

Status check_exploration(const Dataset& dataset, const TrialChoice& choice, bool one_exploration) {
  const std::vector<std::string> present = explorations_of(dataset);
  if (choice.exploration.empty() && one_exploration && present.size() > 1)
    return fail(Errc::invalid_argument, "the data set holds several explorations", {}, {},
                joined(present), "Choose one with --exploration");
  if (!choice.exploration.empty() &&
      std::find(present.begin(), present.end(), choice.exploration) == present.end())
    return fail(Errc::not_found, "no trial has this exploration", "--exploration", joined(present),
                choice.exploration);
  return {};
}

std::vector<Trial> complete_trials(const Dataset& dataset, const std::string& exploration) {
  std::vector<Trial> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome != TrialOutcome::complete) continue;
    if (exploration.empty() || record.spec.exploration == exploration)
      out.push_back(dataset.trials[i]);
  }
  return out;
}

Result<std::vector<Trial>> in_windows(const std::vector<Trial>& strokes, const TrialChoice& choice,
                                      double period_s) {
  if (!(period_s > 0.0))
    return fail(Errc::invalid_argument, "the sample rate is not known, so no window can be cut",
                "--window-s");
  std::vector<Trial> out;
  for (const Trial& stroke : strokes) {
    auto windows =
        classifier::cut_windows(stroke, {choice.window_s, choice.window_step_s, period_s});
    if (!windows) return pass(windows.error());
    std::move(windows->begin(), windows->end(), std::back_inserter(out));
  }
  return out;
}

classifier::FeatureSetup setup_of(const std::vector<Trial>& trials, const TrialChoice& choice,
                                  double period_s) {
  classifier::FeatureSetup setup;
  setup.taxels = trials.front().taxels;
  setup.phases = classifier::phases_of(trials.front());
  setup.options.norm = choice.norm == "rms" ? classifier::Norm::rms : classifier::Norm::l2;
  setup.window_s = choice.window_s;
  setup.window_step_s = choice.window_step_s;
  setup.sample_period_s = period_s;
  setup.exploration = choice.exploration;
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

std::vector<std::string> explorations_of(const Dataset& dataset) {
  std::vector<std::string> out;
  for (const TrialRecord& record : dataset.records) {
    const std::string& name = record.spec.exploration;
    if (std::find(out.begin(), out.end(), name) == out.end()) out.push_back(name);
  }
  return out;
}

double sample_period_s(const Dataset& dataset) {
  return dataset.info.taxel_rate_hz > 0.0 ? 1.0 / dataset.info.taxel_rate_hz : 0.0;
}

Result<std::vector<Trial>> choose_trials(const Dataset& dataset, const TrialChoice& choice,
                                         bool one_exploration) {
  if (auto ok = check_exploration(dataset, choice, one_exploration); !ok) return pass(ok.error());
  std::vector<Trial> trials = complete_trials(dataset, choice.exploration);
  if (trials.empty()) return fail(Errc::not_found, "no complete trial in the data set");
  if (choice.window_s == 0.0) return trials;
  return in_windows(trials, choice, sample_period_s(dataset));
}

Result<ChosenTrials> load_trials(const std::filesystem::path& path, const TrialChoice& choice,
                                 bool one_exploration) {
  Result<Dataset> dataset = read_hdf5(path);
  if (!dataset) return pass(dataset.error());
  const Result<std::vector<Trial>> trials = choose_trials(*dataset, choice, one_exploration);
  if (!trials) return pass(trials.error(), path.string());
  ChosenTrials out;
  out.strokes = complete_trials(*dataset, choice.exploration).size();
  out.setup = setup_of(*trials, choice, sample_period_s(*dataset));
  auto features = classifier::build_feature_matrix(*trials, out.setup.options);
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
