#include "daemon/apps/weft/classify_command.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "classifier/base/line_io.hpp"
#include "classifier/imprint/imprint_model.hpp"
#include "classifier/live/staged_model.hpp"
#include "classifier/model/model_file.hpp"
#include "classifier/vibro/recording_model.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/base/file/file_kind.hpp"
#include "daemon/base/text/csv_table.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::StoredModel;
using classifier::Trial;
using nlohmann::json;

namespace ci = classifier::imprint;
namespace vibro = classifier::vibro;

struct ClassifyArgs {
  std::filesystem::path model;
  std::filesystem::path trials;  ///< a trial (CSV) or a data set (HDF5); "-": standard input
  std::string vote = "majority";
  std::size_t shortlist = 20;
  bool shortlist_given = false;  ///< on the command line
};

using Labels = std::vector<std::string>;

template <class Number>
json by_label(const Labels& labels, const std::vector<Number>& of_class) {
  json out;
  for (std::size_t k = 0; k < labels.size(); ++k) out[labels[k]] = of_class[k];
  return out;
}

constexpr std::size_t most_named = 10;  // of hundreds of fabrics nobody reads the last

// The winner first, then the others that got votes, most votes first; nothing without votes.
std::string votes_text(const Labels& labels, const classifier::Ballot& ballot) {
  if (ballot.votes.empty()) return {};
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (k != ballot.winner && ballot.votes[k] > 0) order.push_back(k);
  std::ranges::stable_sort(order, std::greater<>(), [&](auto k) { return ballot.votes[k]; });
  order.insert(order.begin(), ballot.winner);
  std::string out = "  (votes:";
  for (std::size_t i = 0; i < std::min(order.size(), most_named); ++i)
    out += " " + labels[order[i]] + " " + std::to_string(ballot.votes[order[i]]);
  if (order.size() > most_named)
    out += ", " + std::to_string(order.size() - most_named) + " more fabrics";
  return out + ")";
}

// The fabric that has a larger probability than the winner of the vote, if any.
std::optional<std::size_t> find_likelier(const classifier::Prediction& answer) {
  const std::vector<double>& p = answer.probability;
  if (p.empty()) return std::nullopt;
  const auto likeliest = static_cast<std::size_t>(std::ranges::max_element(p) - p.begin());
  return p[likeliest] > p[answer.ballot.winner] ? std::optional(likeliest) : std::nullopt;
}

std::string disagreement_text(const Labels& labels, const classifier::Prediction& answer) {
  const auto likelier = find_likelier(answer);
  if (!likelier) return {};
  return "  (vote and probability disagree: " + labels[*likelier] + " " +
         percent(answer.probability[*likelier], 0) + " %)";
}

/// A line that says so where the model learnt from simulated data; nothing otherwise.
std::string trained_banner(const classifier::Provenance& provenance) {
  return provenance.bench == "simulated" ? "The model was trained on SIMULATED data.\n" : "";
}

/// [{file, label, votes, cores_asked, probability, likelier, none_of_these, true_label}], what
/// there is of it.
json answers_json(const classifier::TrainedLearner& learner, bool has_postprocessing,
                  const std::vector<PredictedTrial>& answered) {
  const Labels& labels = learner.labels();
  json out = json::array();
  for (const PredictedTrial& a : answered) {
    const classifier::Ballot& ballot = a.answer.ballot;
    json one{{"file", a.file}, {"label", labels[ballot.winner]}};
    if (!ballot.votes.empty()) one["votes"] = by_label(labels, ballot.votes);
    if (learner.cores() != nullptr) one["cores_asked"] = ballot.cores;
    if (!a.answer.probability.empty()) one["probability"] = by_label(labels, a.answer.probability);
    if (const auto likelier = find_likelier(a.answer)) one["likelier"] = labels[*likelier];
    if (has_postprocessing) one["none_of_these"] = a.answer.none_of_these;
    if (!a.true_label.empty()) one["true_label"] = a.true_label;
    out.push_back(std::move(one));
  }
  return out;
}

struct LoadedImprints {
  BenchKind bench = BenchKind::unknown;
  ci::TaxelGrid grid;
  std::vector<ci::Imprint> imprints;
};

Result<LoadedImprints> of_image(const std::filesystem::path& path) {
  auto image = read_image(path);
  if (!image) return pass(image.error());
  const ci::TaxelGrid grid{image->rows(), image->cols()};
  return LoadedImprints{BenchKind::unknown, grid, {{std::move(*image), path.string(), {}, {}}}};
}

Result<LoadedImprints> load_imprints(const std::filesystem::path& path, std::istream* in) {
  if (path != "-" && path.extension() != ".h5") return of_image(path);
  const auto dataset = path == "-" ? trials_from(in) : open_dataset(path);
  if (!dataset) return pass(dataset.error());
  auto imprints = extract_imprints(*dataset);
  if (!imprints) return pass(imprints.error());
  const auto grid = find_grid(*dataset, *imprints);
  if (!grid) return pass(grid.error());
  return LoadedImprints{dataset->info.kind, *grid, std::move(*imprints)};
}

/// `args.model` is one of imprints.
Result<int> run_classify_imprints(const ClassifyArgs& args, Console& console) {
  const auto kind = classifier::vote_kind_from(args.vote);
  if (!kind) return pass(kind.error(), "--vote");
  std::ifstream in(args.model, std::ios::binary);
  const auto model = ci::load_imprint_model(in);
  if (!model) return pass(model.error(), args.model.string());
  const auto requested = load_imprints(args.trials, console.in);
  if (!requested) return pass(requested.error(), args.trials.string());
  const auto answers = ci::classify_imprints(*model, requested->grid, requested->imprints,
                                             {*kind, args.shortlist, nullptr});
  if (!answers) return pass(answers.error(), args.trials.string());
  std::string text = bench_banner(requested->bench) + trained_banner(model->provenance);
  std::vector<PredictedTrial> list;
  for (std::size_t i = 0; i < answers->size(); ++i) {
    list.push_back({requested->imprints[i].file, requested->imprints[i].label, (*answers)[i]});
    text += answer_line(model->learner, list.back());
  }
  print(console, text,
        {{"command", "classify"},
         {"kind", "imprints"},
         {"model", args.model.string()},
         {"model_bench", model->provenance.bench},
         {"learner", classifier::to_string(model->learner.kind())},
         {"bench", to_string(requested->bench)},
         {"vote", args.vote},
         {"imprints", answers_json(model->learner, model->postprocessing.has_value(), list)}});
  return exit_ok;
}

json windows_by_label(const std::vector<std::string>& labels,
                      const std::vector<std::size_t>& windows) {
  json out = json::object();
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (windows[k] > 0) out[labels[k]] = windows[k];
  return out;
}

/// `args.model` is one of recordings.
Result<int> run_classify_recordings(const ClassifyArgs& args, Console& console) {
  std::ifstream in(args.model, std::ios::binary);
  const auto model = vibro::load_recording_model(in);
  if (!model) return pass(model.error(), args.model.string());
  const auto set = open_all_recordings(args.trials);
  if (!set) return pass(set.error());
  const auto answers = vibro::classify_recordings(*model, set->recordings);
  if (!answers) return pass(answers.error(), args.trials.string());
  std::string text = bench_banner(set->kind) + trained_banner(model->provenance);
  json list = json::array();
  for (const vibro::RecordingAnswer& a : *answers) {
    std::size_t windows = 0;
    for (const std::size_t n : a.windows) windows += n;
    text += a.file + ": " + model->learner.labels()[a.label] + "  (" +
            std::to_string(a.windows[a.label]) + " of " + std::to_string(windows) + " windows)\n";
    list.push_back({{"file", a.file},
                    {"label", model->learner.labels()[a.label]},
                    {"windows", windows_by_label(model->learner.labels(), a.windows)}});
    if (!a.true_label.empty()) list.back()["true_label"] = a.true_label;
  }
  print(console, text,
        {{"command", "classify"},
         {"kind", "recordings"},
         {"model", args.model.string()},
         {"model_bench", model->provenance.bench},
         {"learner", classifier::to_string(model->learner.kind())},
         {"bench", to_string(set->kind)},
         {"recordings", std::move(list)}});
  return exit_ok;
}

Result<StoredModel> open_model(const std::filesystem::path& path) {
  std::error_code unseen;
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path, unseen))
    return fail({.code = Errc::not_found,
                 .where = path.string(),
                 .what = "cannot read the model",
                 .expected = "a model file",
                 .got = in ? "a folder" : ""});
  auto model = classifier::load_model(in);
  if (!model && model.error().code == Errc::parse)
    return pass(with_file_kind(model.error(), path), path.string());
  if (!model) return pass(model.error(), path.string());
  return model;
}

// Enough of a file to know its kind; nothing of one that cannot be read.
std::string read_beginning(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string out(64, '\0');
  in.read(out.data(), static_cast<std::streamsize>(out.size()));
  out.resize(static_cast<std::size_t>(in.gcount()));
  return out;
}

Result<Dataset> open_trials(const std::filesystem::path& path, std::istream* in) {
  if (path == "-") return trials_from(in);
  return is_csv_name(path) ? import_trial(path) : open_dataset(path);
}

// The model's own exploration. Imported recordings name none, and are taken for what the model
// knows; so is the only exploration of a campaign by a model of imported recordings.
Result<std::string> exploration_for(const classifier::FeatureSetup& setup, const Dataset& dataset) {
  const std::vector<std::string> present = list_explorations(dataset);
  if (present.empty())
    return fail({.code = Errc::not_found, .what = "no complete trial in the data set"});
  if (std::ranges::find(present, setup.exploration) != present.end()) return setup.exploration;
  if (present.size() == 1 && (present.front().empty() || setup.exploration.empty()))
    return present.front();
  return fail({.code = Errc::invalid_argument,
               .what = "no trial of the exploration that the model was trained on",
               .expected = setup.exploration.empty() ? "a single exploration" : setup.exploration,
               .got = joined(present)});
}

// Prepared as the training trials were.
Result<std::vector<Trial>> prepared(const classifier::FeatureSetup& setup, const Dataset& dataset) {
  const Result<std::string> exploration = exploration_for(setup, dataset);
  if (!exploration) return pass(exploration.error());
  if (auto ok = check_rate(dataset, *exploration, setup.sample_period_s); !ok)
    return pass(ok.error());
  return in_windows(dataset, *exploration,
                    {setup.window_s, setup.window_step_s, setup.sample_period_s});
}

Result<std::vector<PredictedTrial>> answers(const StoredModel& stored,
                                            const std::vector<Trial>& trials,
                                            const classifier::VoteOptions& options) {
  auto results = classifier::classify(stored, trials, options);
  if (!results) return pass(results.error());
  std::vector<PredictedTrial> out;
  for (std::size_t i = 0; i < trials.size(); ++i)
    out.push_back({trials[i].file, trials[i].label, std::move((*results)[i])});
  return out;
}

void add_options(CLI::App& command, ClassifyArgs& args) {
  command.add_option("MODEL", args.model, "model file of `weft train`")->required();
  command
      .add_option("TRIALS", args.trials,
                  "a trial (.csv), a data set (.h5), or - for either on standard input; recordings "
                  "(.h5) for a model of recordings; imprints (.h5), or one (.csv, .txt, .pgm, "
                  ".npy), for a model of imprints")
      ->required();
  add_keyword(
      command, "--vote", args.vote, {"majority", "soft", "dag", "shortlist"},
      "majority or soft: all cores; dag: one core less than fabrics; shortlist: the cores of "
      "the fabrics whose means are nearest");
  add_count(command, "--shortlist", args.shortlist, 1, 10000, "fabrics on the short-list")
      ->each([&args](const std::string&) { args.shortlist_given = true; });
}

Result<int> run_classify(const ClassifyArgs& args, Console& console) {
  if (args.shortlist_given && args.vote != "shortlist")
    return fail({.code = Errc::invalid_argument,
                 .where = "--shortlist",
                 .what = "a short-list is of another kind of vote",
                 .expected = "--vote shortlist",
                 .got = "--vote " + args.vote});
  const auto beginning = read_beginning(args.model);
  if (classifier::is_of_kind(beginning, vibro::recording_model_header))
    return run_classify_recordings(args, console);
  if (classifier::is_of_kind(beginning, ci::imprint_model_header))
    return run_classify_imprints(args, console);
  if (classifier::is_of_kind(beginning, classifier::staged_file_header))
    return fail({.code = Errc::unsupported,
                 .where = args.model.string(),
                 .what = "a model for votes while a slide goes on",
                 .expected = "a model of `weft train` without --live",
                 .hint = "Name it in a recipe's classify.live, or train again without --live"});
  const Result<classifier::VoteKind> kind = classifier::vote_kind_from(args.vote);
  if (!kind) return pass(kind.error(), "--vote");
  const Result<StoredModel> stored = open_model(args.model);
  if (!stored) return pass(stored.error());
  const Result<Dataset> dataset = open_trials(args.trials, console.in);
  if (!dataset) return pass(dataset.error());
  const Result<std::vector<Trial>> trials = prepared(stored->setup, *dataset);
  if (!trials) return pass(trials.error(), args.trials.string());
  const auto list = answers(*stored, *trials, {*kind, args.shortlist, nullptr});
  if (!list) return pass(list.error(), args.trials.string());
  std::string text = bench_banner(dataset->info.kind) + trained_banner(stored->provenance);
  for (const PredictedTrial& one : *list) text += answer_line(stored->learner, one);
  print(console, text,
        {{"command", "classify"},
         {"model", args.model.string()},
         {"model_bench", stored->provenance.bench},
         {"learner", classifier::to_string(stored->learner.kind())},
         {"bench", to_string(dataset->info.kind)},
         {"vote", args.vote},
         {"trials", answers_json(stored->learner, stored->postprocessing.has_value(), *list)}});
  return exit_ok;
}

}  // namespace

std::string answer_line(const classifier::TrainedLearner& learner, const PredictedTrial& answered) {
  const classifier::Ballot& ballot = answered.answer.ballot;
  const Labels& labels = learner.labels();
  std::string out = answered.file + ": " + labels[ballot.winner];
  if (!answered.answer.probability.empty())
    out += " " + percent(answered.answer.probability[ballot.winner], 0) + " %";
  if (answered.answer.none_of_these) out += ", or none of these";
  return out + votes_text(labels, ballot) + disagreement_text(labels, answered.answer) + "\n";
}

void add_classify_command(const CommandGroup& weft) {
  weft.add<ClassifyArgs>("classify", "what a model says of a trial", run_classify);
}

}  // namespace weft::daemon::cli
