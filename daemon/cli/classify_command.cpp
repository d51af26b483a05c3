#include "daemon/cli/classify_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "classifier/fabric/model_file.hpp"
#include "daemon/cli/dataset_file.hpp"
#include "daemon/cli/trial_choice.hpp"
#include "daemon/dataset/import.hpp"
#include "daemon/report/format.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::StoredModel;
using classifier::Trial;
using nlohmann::json;

// A recording that is faster or slower than the training by more than this has other windows.
constexpr double rate_tolerance = 0.05;

struct Answer {
  Trial trial;
  classifier::Vote vote;
};

Result<StoredModel> open_model(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(Errc::not_found, "cannot read the model", path.string());
  auto model = classifier::load_model(in);
  if (!model) return pass(model.error(), path.string());
  return model;
}

Result<Dataset> open_trials(const std::filesystem::path& path) {
  return path.extension() == ".csv" ? import_trial(path) : open_dataset(path);
}

Status check_rate(const classifier::FeatureSetup& setup, const Dataset& dataset) {
  const double period_s = sample_period_s(dataset);
  if (setup.window_s == 0.0 || period_s == 0.0) return {};
  if (std::abs(period_s / setup.sample_period_s - 1.0) <= rate_tolerance) return {};
  return fail(Errc::invalid_argument, "recorded at another rate than the training trials",
              "sample period", std::to_string(setup.sample_period_s) + " s",
              std::to_string(period_s) + " s");
}

// The model's own exploration. Imported recordings name none, and are taken for what the model
// knows; so is the only exploration of a campaign by a model of imported recordings.
Result<std::string> exploration_for(const classifier::FeatureSetup& setup, const Dataset& dataset) {
  const std::vector<std::string> present = explorations_of(dataset);
  if (present.empty()) return fail(Errc::not_found, "no complete trial in the data set");
  if (std::ranges::find(present, setup.exploration) != present.end()) return setup.exploration;
  if (present.size() == 1 && (present.front().empty() || setup.exploration.empty()))
    return present.front();
  return fail(Errc::invalid_argument, "no trial of the exploration that the model was trained on",
              {}, setup.exploration.empty() ? "a single exploration" : setup.exploration,
              joined(present));
}

// Prepared as the training trials were.
Result<std::vector<Trial>> prepared(const classifier::FeatureSetup& setup, const Dataset& dataset) {
  const Result<std::string> exploration = exploration_for(setup, dataset);
  if (!exploration) return pass(exploration.error());
  if (auto ok = check_rate(setup, dataset); !ok) return pass(ok.error());
  return in_windows(complete_trials(dataset, *exploration),
                    {setup.window_s, setup.window_step_s, setup.sample_period_s});
}

Result<std::vector<Answer>> answers(const StoredModel& stored, std::vector<Trial> trials) {
  std::vector<Answer> out;
  for (Trial& trial : trials) {
    auto vote = classifier::classify(stored, trial);
    if (!vote) return pass(vote.error());
    out.push_back({std::move(trial), std::move(*vote)});
  }
  return out;
}

json votes_json(const StoredModel& stored, const classifier::Vote& vote) {
  json out;
  for (std::size_t k = 0; k < stored.model.labels().size(); ++k)
    out[stored.model.labels()[k]] = vote.votes[k];
  return out;
}

json to_json(const StoredModel& stored, const std::vector<Answer>& list) {
  json trials = json::array();
  for (const Answer& a : list) {
    json one{{"file", a.trial.file},
             {"label", stored.model.labels()[a.vote.winner]},
             {"votes", votes_json(stored, a.vote)}};
    if (!a.trial.label.empty()) one["true_label"] = a.trial.label;
    trials.push_back(std::move(one));
  }
  return trials;
}

// The winner first, then the others that got votes, most votes first.
std::string to_text(const StoredModel& stored, const Answer& answer) {
  const std::vector<std::string>& labels = stored.model.labels();
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (k != answer.vote.winner && answer.vote.votes[k] > 0) order.push_back(k);
  std::ranges::stable_sort(order, std::greater<>(), [&](auto k) { return answer.vote.votes[k]; });
  order.insert(order.begin(), answer.vote.winner);
  std::string out = answer.trial.file + ": " + labels[answer.vote.winner] + "  (votes:";
  for (const std::size_t k : order)
    out += " " + labels[k] + " " + std::to_string(answer.vote.votes[k]);
  return out + ")\n";
}

}  // namespace

void add_options(CLI::App& command, ClassifyArgs& args) {
  command.add_option("MODEL", args.model, "model file of `weft train`")->required();
  command.add_option("TRIALS", args.trials, "a trial (.csv) or a data set (.h5)")->required();
}

Result<int> run_classify(const ClassifyArgs& args, Console& console) {
  const Result<StoredModel> stored = open_model(args.model);
  if (!stored) return pass(stored.error());
  const Result<Dataset> dataset = open_trials(args.trials);
  if (!dataset) return pass(dataset.error());
  Result<std::vector<Trial>> trials = prepared(stored->setup, *dataset);
  if (!trials) return pass(trials.error(), args.trials.string());
  const Result<std::vector<Answer>> list = answers(*stored, std::move(*trials));
  if (!list) return pass(list.error(), args.trials.string());
  std::string text = bench_banner(dataset->info.kind);
  if (stored->provenance.bench == "simulated") text += "The model was trained on SIMULATED data.\n";
  for (const Answer& answer : *list) text += to_text(*stored, answer);
  print(console, text,
        {{"command", "classify"},
         {"model", args.model.string()},
         {"model_bench", stored->provenance.bench},
         {"bench", to_string(dataset->info.kind)},
         {"trials", to_json(*stored, *list)}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
