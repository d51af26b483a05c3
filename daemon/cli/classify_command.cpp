#include "daemon/cli/classify_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "classifier/fabric/model_file.hpp"
#include "daemon/cli/dataset_file.hpp"
#include "daemon/cli/model_recordings.hpp"
#include "daemon/cli/standard_input.hpp"
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

struct Answered {
  Trial trial;
  classifier::Answer answer;  ///< without probability and refusal where the model has no aids
};

Result<StoredModel> open_model(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return fail(Errc::not_found, "cannot read the model", path.string());
  auto model = classifier::load_model(in);
  if (!model) return pass(model.error(), path.string());
  return model;
}

Result<Dataset> open_trials(const std::filesystem::path& path, std::istream* in) {
  if (path == "-") return trials_from(in);
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

Result<std::vector<Answered>> answers(const StoredModel& stored, std::vector<Trial> trials,
                                      const classifier::VoteOptions& options) {
  std::vector<Answered> out;
  for (Trial& trial : trials) {
    auto one = classifier::classify(stored, trial, options);
    if (!one) return pass(one.error());
    out.push_back({std::move(trial), std::move(*one)});
  }
  return out;
}

template <class Number>
json by_label(const StoredModel& stored, const std::vector<Number>& of_class) {
  json out;
  for (std::size_t k = 0; k < stored.learner.labels().size(); ++k)
    out[stored.learner.labels()[k]] = of_class[k];
  return out;
}

json to_json(const StoredModel& stored, const std::vector<Answered>& list) {
  json trials = json::array();
  for (const Answered& a : list) {
    const classifier::Ballot& ballot = a.answer.ballot;
    json one{{"file", a.trial.file}, {"label", stored.learner.labels()[ballot.winner]}};
    if (!ballot.votes.empty()) one["votes"] = by_label(stored, ballot.votes);
    if (stored.learner.cores() != nullptr) one["cores_asked"] = ballot.cores;
    if (!a.answer.probability.empty()) one["probability"] = by_label(stored, a.answer.probability);
    if (stored.aids) one["none_of_these"] = a.answer.none_of_these;
    if (!a.trial.label.empty()) one["true_label"] = a.trial.label;
    trials.push_back(std::move(one));
  }
  return trials;
}

// The winner first, then the others that got votes, most votes first; nothing without votes.
std::string votes_text(const std::vector<std::string>& labels, const classifier::Ballot& ballot) {
  if (ballot.votes.empty()) return {};
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (k != ballot.winner && ballot.votes[k] > 0) order.push_back(k);
  std::ranges::stable_sort(order, std::greater<>(), [&](auto k) { return ballot.votes[k]; });
  order.insert(order.begin(), ballot.winner);
  std::string out = "  (votes:";
  for (const std::size_t k : order) out += " " + labels[k] + " " + std::to_string(ballot.votes[k]);
  return out + ")";
}

std::string to_text(const StoredModel& stored, const Answered& answered) {
  const classifier::Ballot& ballot = answered.answer.ballot;
  const std::vector<std::string>& labels = stored.learner.labels();
  std::string out = answered.trial.file + ": " + labels[ballot.winner];
  if (!answered.answer.probability.empty())
    out += " " + percent(answered.answer.probability[ballot.winner], 0) + " %";
  if (answered.answer.none_of_these) out += ", or none of these";
  return out + votes_text(labels, ballot) + "\n";
}

}  // namespace

void add_options(CLI::App& command, ClassifyArgs& args) {
  command.add_option("MODEL", args.model, "model file of `weft train`")->required();
  command
      .add_option("TRIALS", args.trials,
                  "a trial (.csv), a data set (.h5), or - for either on standard input; recordings "
                  "(.h5) for a model of recordings")
      ->required();
  command
      .add_option("--vote", args.vote,
                  "majority or soft: all cores; dag: one core less than fabrics; shortlist: the "
                  "cores of the fabrics whose means are nearest")
      ->check(CLI::IsMember({"majority", "soft", "dag", "shortlist"}))
      ->capture_default_str();
  command.add_option("--shortlist", args.shortlist, "fabrics on the short-list")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
}

Result<int> run_classify(const ClassifyArgs& args, Console& console) {
  if (is_recording_model_file(args.model)) return run_classify_recordings(args, console);
  const Result<classifier::VoteKind> kind = classifier::vote_kind_from(args.vote);
  if (!kind) return pass(kind.error(), "--vote");
  const Result<StoredModel> stored = open_model(args.model);
  if (!stored) return pass(stored.error());
  const Result<Dataset> dataset = open_trials(args.trials, console.in);
  if (!dataset) return pass(dataset.error());
  Result<std::vector<Trial>> trials = prepared(stored->setup, *dataset);
  if (!trials) return pass(trials.error(), args.trials.string());
  const auto list = answers(*stored, std::move(*trials), {*kind, args.shortlist, nullptr});
  if (!list) return pass(list.error(), args.trials.string());
  std::string text = bench_banner(dataset->info.kind);
  if (stored->provenance.bench == "simulated") text += "The model was trained on SIMULATED data.\n";
  for (const Answered& one : *list) text += to_text(*stored, one);
  print(console, text,
        {{"command", "classify"},
         {"model", args.model.string()},
         {"model_bench", stored->provenance.bench},
         {"learner", classifier::to_string(stored->learner.kind())},
         {"bench", to_string(dataset->info.kind)},
         {"vote", args.vote},
         {"trials", to_json(*stored, *list)}});
  return exit_ok;
}

}  // namespace weft::daemon::cli
