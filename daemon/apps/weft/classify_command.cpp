#include "daemon/apps/weft/classify_command.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>

#include "classifier/imprint/imprint_model.hpp"
#include "classifier/model/stored_model.hpp"
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
  CommandModality modality = {};
};

using Labels = std::vector<std::string>;

template <class Number>
json by_label(const Labels& labels, const std::vector<Number>& of_class) {
  json out;
  for (std::size_t k = 0; k < labels.size(); ++k) out[labels[k]] = of_class[k];
  return out;
}

constexpr std::size_t most_named = 10;  // limit for data with hundreds of fabrics

// The winner first, then the others in descending order of votes; empty without votes.
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

// The fabric with a larger probability than the winner of the vote, if any.
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

/// A warning line if the model was trained on simulated data; otherwise empty.
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

/// Comparison of predictions with the true labels, over all recordings.
struct AnswerCounts {
  std::size_t answers = 0;
  std::size_t trained_on = 0;  ///< recordings that the model was trained on
  std::size_t known = 0;       ///< recordings with a label of the model
  std::size_t right = 0;
  std::size_t known_of_new = 0, right_of_new = 0;  ///< of recordings not trained on
  std::vector<std::string> other_labels = {};      ///< true labels that the model does not have

  void add(const Labels& labels, std::size_t winner, const std::string& true_label, bool trained) {
    ++answers;
    trained_on += trained ? 1 : 0;
    if (true_label.empty()) return;
    if (!std::ranges::binary_search(labels, true_label)) {
      if (std::ranges::find(other_labels, true_label) == other_labels.end())
        other_labels.push_back(true_label);
      return;
    }
    const std::size_t is_right = labels[winner] == true_label ? 1 : 0;
    ++known;
    right += is_right;
    known_of_new += trained ? 0 : 1;
    right_of_new += trained ? 0 : is_right;
  }
};

/// The last lines: the number of trained-on recordings and of right predictions.
std::string counts_text(const AnswerCounts& counts, const std::string& things) {
  std::string out;
  const auto of = [](std::size_t n, std::size_t all) {
    return thousands(n) + " of " + thousands(all);
  };
  if (counts.trained_on > 0)
    out += of(counts.trained_on, counts.answers) + " " + things +
           " were used for training; predictions on them do not show the accuracy on new ones.\n";
  if (!counts.other_labels.empty())
    out +=
        "Not counted, because the model lacks these labels: " + joined(counts.other_labels) + "\n";
  if (counts.known == 0) return out;
  out += of(counts.right, counts.known) + " correct";
  if (counts.trained_on > 0 && counts.known_of_new > 0)
    out += "; " + of(counts.right_of_new, counts.known_of_new) + " of those not used for training";
  return out + "\n";
}

/// The JSON members that are equal for every modality.
json head_json(const ClassifyArgs& args, const classifier::Provenance& provenance,
               classifier::Modality modality, classifier::Learner learner, BenchKind bench,
               const AnswerCounts& counts) {
  return {{"command", "classify"},
          {"modality", classifier::to_string(modality)},
          {"model", args.model.string()},
          {"model_bench", provenance.bench},
          {"learner", classifier::to_string(learner)},
          {"bench", to_string(bench)},
          {"used_for_training", counts.trained_on},
          {"labelled", counts.known},
          {"right", counts.right},
          {"labels_not_known", counts.other_labels}};
}

bool is_in(const std::vector<std::uint64_t>& digests, std::uint64_t one) {
  return std::ranges::find(digests, one) != digests.end();
}

/// Text, counts and JSON of predictions with votes, of trials or imprints.
struct Answered {
  std::string text;
  AnswerCounts counts;
  json list = json::array();
};
template <class Setup>
Answered list_answers(const classifier::Model<Setup>& model,
                      const std::vector<PredictedTrial>& answered,
                      const std::vector<std::uint64_t>& digests) {
  Answered out;
  out.list = answers_json(model.learner, model.postprocessing.has_value(), answered);
  for (std::size_t i = 0; i < answered.size(); ++i) {
    const bool trained = is_in(model.trained_on, digests[i]);
    out.text += answer_line(model.learner, answered[i]);
    out.list[i]["used_for_training"] = trained;
    out.counts.add(model.learner.labels(), answered[i].answer.ballot.winner, answered[i].true_label,
                   trained);
  }
  return out;
}

template <class Setup>
Result<classifier::Model<Setup>> open_model(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  auto model = classifier::load_model<Setup>(in);
  if (!model) return pass(model.error(), path.string());
  return model;
}

Result<classifier::VoteOptions> vote_options(const ClassifyArgs& args) {
  const auto kind = classifier::vote_kind_from(args.vote);
  if (!kind) return pass(kind.error(), "--vote");
  return classifier::VoteOptions{*kind, args.shortlist, nullptr};
}

Result<int> classify_imprints(const ClassifyArgs& args, Console& console) {
  const auto options = vote_options(args);
  if (!options) return pass(options.error());
  const auto model = open_model<ci::ImprintSetup>(args.model);
  if (!model) return pass(model.error());
  const auto requested = load_imprints(args.trials, console.in);
  if (!requested) return pass(requested.error(), args.trials.string());
  const auto answers =
      ci::classify_imprints(*model, requested->grid, requested->imprints, *options);
  if (!answers) return pass(answers.error(), args.trials.string());
  std::vector<PredictedTrial> list;
  for (std::size_t i = 0; i < answers->size(); ++i)
    list.push_back({requested->imprints[i].file, requested->imprints[i].label, (*answers)[i]});
  const Answered out = list_answers(*model, list, ci::content_digests(requested->imprints));
  json object = head_json(args, model->provenance, classifier::Modality::imprint,
                          model->learner.kind(), requested->bench, out.counts);
  object["kind"] = "imprints";
  object["vote"] = args.vote;
  object["imprints"] = out.list;
  print(console,
        bench_banner(requested->bench) + trained_banner(model->provenance) + out.text +
            counts_text(out.counts, "imprints"),
        object);
  return exit_ok;
}

json windows_by_label(const std::vector<std::string>& labels,
                      const std::vector<std::size_t>& windows) {
  json out = json::object();
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (windows[k] > 0) out[labels[k]] = windows[k];
  return out;
}

Result<int> classify_recordings(const ClassifyArgs& args, Console& console) {
  const auto model = open_model<vibro::RecordingSetup>(args.model);
  if (!model) return pass(model.error());
  const auto set = open_all_recordings(args.trials);
  if (!set) return pass(set.error());
  const auto answers = vibro::classify_recordings(*model, set->recordings);
  if (!answers) return pass(answers.error(), args.trials.string());
  const Labels& labels = model->learner.labels();
  Answered out;
  for (std::size_t i = 0; i < answers->size(); ++i) {
    const vibro::RecordingAnswer& a = (*answers)[i];
    const bool trained = is_in(model->trained_on, vibro::content_digest(set->recordings[i]));
    const std::size_t windows = std::accumulate(a.windows.begin(), a.windows.end(), std::size_t{0});
    out.text += a.file + ": " + labels[a.label] +
                (a.probability.empty() ? "" : " " + percent(a.probability[a.label], 0) + " %") +
                "  (" + std::to_string(a.windows[a.label]) + " of " + std::to_string(windows) +
                " windows)\n";
    out.list.push_back({{"file", a.file},
                        {"label", labels[a.label]},
                        {"windows", windows_by_label(labels, a.windows)},
                        {"used_for_training", trained}});
    if (!a.probability.empty()) out.list.back()["probability"] = by_label(labels, a.probability);
    if (!a.true_label.empty()) out.list.back()["true_label"] = a.true_label;
    out.counts.add(labels, a.label, a.true_label, trained);
  }
  json object = head_json(args, model->provenance, classifier::Modality::vibro,
                          model->learner.kind(), set->kind, out.counts);
  object["kind"] = "recordings";
  object["recordings"] = out.list;
  print(console,
        bench_banner(set->kind) + trained_banner(model->provenance) + out.text +
            counts_text(out.counts, "recordings"),
        object);
  return exit_ok;
}

Result<Dataset> open_trials(const std::filesystem::path& path, std::istream* in) {
  if (path == "-") return trials_from(in);
  return is_csv_name(path) ? import_trial(path) : open_dataset(path);
}

// The model's own exploration. Imported recordings name none and count as the model's exploration.
// With a model of imported recordings, so does the only exploration of a campaign.
Result<std::string> exploration_for(const classifier::FeatureSetup& setup, const Dataset& dataset) {
  const std::vector<std::string> present = list_explorations(dataset);
  if (present.empty())
    return fail({.code = Errc::not_found, .what = "no complete trial in the data set"});
  if (std::ranges::find(present, setup.exploration) != present.end()) return setup.exploration;
  if (present.size() == 1 && (present.front().empty() || setup.exploration.empty()))
    return present.front();
  return fail({.code = Errc::invalid_argument,
               .what = "exploration of the model not in the data set",
               .expected = setup.exploration.empty() ? "a single exploration" : setup.exploration,
               .got = joined(present)});
}

// Prepares the trials in the same way as the training trials.
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
  command.add_option("MODEL", args.model, "model file of `weft ... train`")->required();
  std::string text = "trials, recordings or imprints (.h5, .csv, image; -: standard input)";
  if (args.modality == classifier::Modality::fabric)
    text = "trial (.csv) or data set (.h5), or - for standard input";
  if (args.modality == classifier::Modality::vibro) text = "vibration recordings (.h5)";
  if (args.modality == classifier::Modality::imprint)
    text = "imprints (.h5), or one imprint (.csv, .txt, .pgm, .npy)";
  command.add_option("DATA", args.trials, text)->required();
  if (args.modality == classifier::Modality::vibro) return;  // vibro models have no votes of cores
  add_keyword(command, "--vote", args.vote, {"majority", "soft", "dag", "shortlist"},
              "choose how the cores vote");
  add_count(command, "--shortlist", args.shortlist, 1, 10000,
            "put this number of fabrics on the short-list")
      ->each([&args](const std::string&) { args.shortlist_given = true; });
}

/// Kind of model in the file.
Result<classifier::ModelKind> kind_of_model(const std::filesystem::path& path) {
  std::error_code unseen;
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path, unseen))
    return fail({.code = Errc::not_found,
                 .where = path.string(),
                 .what = "model not readable",
                 .expected = "a model file",
                 .got = in ? "a folder" : ""});
  std::string beginning(512, '\0');
  in.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(in.gcount()));
  const auto kind = classifier::find_model_kind(beginning);
  if (kind) return kind;
  if (kind.error().code != Errc::parse) return pass(kind.error(), path.string());
  return pass(with_file_kind(kind.error(), path), path.string());
}

Result<int> classify_trials(const ClassifyArgs& args, Console& console) {
  const auto options = vote_options(args);
  if (!options) return pass(options.error());
  const Result<StoredModel> stored = open_model<classifier::FeatureSetup>(args.model);
  if (!stored) return pass(stored.error());
  const Result<Dataset> dataset = open_trials(args.trials, console.in);
  if (!dataset) return pass(dataset.error());
  const Result<std::vector<Trial>> trials = prepared(stored->setup, *dataset);
  if (!trials) return pass(trials.error(), args.trials.string());
  const auto list = answers(*stored, *trials, *options);
  if (!list) return pass(list.error(), args.trials.string());
  const Answered out = list_answers(*stored, *list, classifier::content_digests(*trials));
  json object = head_json(args, stored->provenance, classifier::Modality::fabric,
                          stored->learner.kind(), dataset->info.kind, out.counts);
  object["vote"] = args.vote;
  object["trials"] = out.list;
  print(console,
        bench_banner(dataset->info.kind) + trained_banner(stored->provenance) + out.text +
            counts_text(out.counts, stored->setup.window_s > 0 ? "windows" : "trials"),
        object);
  return exit_ok;
}

Result<int> run_classify(const ClassifyArgs& args, Console& console) {
  if (args.shortlist_given && args.vote != "shortlist")
    return fail({.code = Errc::invalid_argument,
                 .where = "--shortlist",
                 .what = "option needs --vote shortlist",
                 .expected = "--vote shortlist",
                 .got = "--vote " + args.vote});
  const auto kind = kind_of_model(args.model);
  if (!kind) return pass(kind.error());
  if (args.modality && *args.modality != kind->modality)
    return fail({.code = Errc::invalid_argument,
                 .where = args.model.string(),
                 .what = "model of another kind",
                 .expected = std::string(to_string(*args.modality)),
                 .got = std::string(to_string(kind->modality)),
                 .hint = "Use weft " + std::string(to_string(kind->modality)) + " classify"});
  switch (kind->modality) {
    case classifier::Modality::vibro:
      return classify_recordings(args, console);
    case classifier::Modality::imprint:
      return classify_imprints(args, console);
    case classifier::Modality::fabric:
      return classify_trials(args, console);
  }
  return exit_failure;
}

}  // namespace

std::string answer_line(const classifier::TrainedLearner& learner, const PredictedTrial& answered) {
  const classifier::Ballot& ballot = answered.answer.ballot;
  const Labels& labels = learner.labels();
  std::string named = labels[ballot.winner];
  if (!answered.answer.probability.empty())
    named += " " + percent(answered.answer.probability[ballot.winner], 0) + " %";
  const std::string out =
      answered.file + ": " +
      (answered.answer.none_of_these ? "unknown fabric (nearest: " + named + ")" : named);
  return out + votes_text(labels, ballot) + disagreement_text(labels, answered.answer) + "\n";
}

CLI::App* add_classify_command(const CommandGroup& group, CommandModality modality) {
  ClassifyArgs preset;
  preset.modality = modality;
  return group.add<ClassifyArgs>("classify", run_classify, preset);
}

}  // namespace weft::daemon::cli
