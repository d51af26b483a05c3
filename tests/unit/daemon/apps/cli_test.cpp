#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/classify_command.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/evaluate_text.hpp"
#include "daemon/apps/weft/progress.hpp"
#include "daemon/apps/weft/trial_choice.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon::cli::cli_test {
namespace {

struct Ran {
  int status;
  std::string out;
  std::string err;
};

Ran weft(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "weft");
  std::ostringstream out, err;
  Console console{out, err};
  const int status = run(static_cast<int>(arguments.size()), arguments.data(), console);
  return {status, out.str(), err.str()};
}

Dataset two_explorations() {
  Dataset dataset;
  dataset.info.taxel_rate_hz = 10;
  for (const char* exploration : {"M1", "M2"}) {
    for (const auto outcome : {TrialOutcome::complete, TrialOutcome::failed}) {
      classifier::Trial trial;
      trial.file = std::string(exploration) + std::string(to_string(outcome));
      trial.label = "denim";
      trial.taxels = 1;
      trial.counts.assign(40, 1.0);
      trial.phase.assign(40, Phase::motion);
      TrialRecord record;
      record.spec.exploration = exploration;
      record.outcome = outcome;
      dataset.trials.push_back(trial);
      dataset.records.push_back(record);
    }
  }
  return dataset;
}

TrialProgress at(std::size_t done, std::size_t planned) {
  TrialProgress p;
  p.done = done;
  p.planned = planned;
  p.fabric = "wool";
  p.exploration = "M1";
  p.repetition = 3;
  p.wall_left_s = 90;
  return p;
}

TEST_CASE("an exception of a library is one sentence; for exhausted memory it has a hint") {
  const auto reply = [](const std::exception& thrown) {
    std::ostringstream out, err;
    Console console{out, err, true};
    CHECK(report_thrown(console, thrown, "rank 3") == exit_failure);
    CHECK(err.str().find("weft: rank 3: ") == 0);
    return nlohmann::json::parse(out.str()).at("error");
  };
  const nlohmann::json memory = reply(std::bad_alloc());
  CHECK(memory.at("code") == "range");
  CHECK(memory.at("hint") != "");
  const nlohmann::json other = reply(std::runtime_error("disk full"));
  CHECK(other.at("code") == "io");
  CHECK(other.at("sentence") == "rank 3: disk full.");
}

TEST_CASE("help and version are no failures") {
  const auto help = weft({"--help"}), bare = weft({});
  CHECK(help.status == exit_ok);
  CHECK(bare.status == exit_ok);
  CHECK(bare.out == help.out);
  CHECK(bare.err.empty());
  CHECK(weft({"evaluate", "--help"}).out.find("--train-groups") != std::string::npos);
  CHECK(weft({"--version"}).out.find("weft ") != std::string::npos);
}

TEST_CASE("a command line that cannot be understood ends with status 2 and a sentence") {
  const auto arguments = GENERATE(values<std::vector<const char*>>({
      {"dance"},
      {"dataset"},
      {"features"},
      {"features", "d.h5", "-o", "f.csv", "--colour"},
      {"features", "d.h5", "-o", "f.csv", "--norm", "l3"},
      {"features", "d.h5", "-o", "f.csv", "--window-s", "0"},
      {"features", "d.h5", "-o", "f.csv", "--window-s", "soon"},
      {"features", "d.h5", "-o", "f.csv", "--window-step-s", "1"},
      {"train", "d.h5", "-o", "m", "--cap", "0"},
      {"train", "d.h5", "-o", "m", "--seed", "-1"},
      {"train", "d.h5", "-o", "m", "--seed", "99999999999999999999"},
      {"evaluate", "d.h5", "--train-groups", "0"},
      {"evaluate", "d.h5", "--train-fraction", "1"},
      {"evaluate", "d.h5", "--train-groups", "0", "--test-groups", "1", "--train-fraction", "0.4"},
      {"run", "recipe.json", "--rig", "rig.json"},
      {"run", "recipe.json", "--rig", "rig.json", "--out", "out", "--seed", "-1"},
      {"check", "recipe.json"},
      {"classify", "model.weft"},
  }));
  const Ran ran = weft(arguments);
  CHECK(ran.status == exit_usage);
  CHECK(ran.out.empty());
  CHECK(ran.err.find("weft: ") == 0);
}

TEST_CASE("with --json a mistake in the command line is one JSON object too") {
  const Ran ran = weft({"features", "d.h5", "-o", "f.csv", "--colour", "--json"});
  CHECK(ran.status == exit_usage);
  const auto object = nlohmann::json::parse(ran.out);
  CHECK(object.at("error").at("code") == "usage");
  CHECK(object.at("error").at("message").get<std::string>().find("--colour") != std::string::npos);
}

TEST_CASE("a failure ends with status 1, its parts in JSON and its sentence on standard error") {
  const Ran ran = weft({"--json", "dataset", "info", "/no/such/data.h5"});
  CHECK(ran.status == exit_failure);
  CHECK(ran.err.find("/no/such/data.h5") != std::string::npos);
  const auto error = nlohmann::json::parse(ran.out).at("error");
  CHECK(error.at("code") == "not found");
  CHECK(error.at("where") == "/no/such/data.h5");
}

TEST_CASE("the group lists do not swallow the data set that follows") {
  const Ran ran = weft({"evaluate", "--train-groups", "0", "--test-groups", "1", "/no/such/d.h5"});
  CHECK(ran.status == exit_failure);
  CHECK(ran.err.find("/no/such/d.h5") != std::string::npos);
}

TEST_CASE("only complete trials of the chosen exploration take part") {
  const auto chosen = choose_trials(two_explorations(), {"M2", 0.0, 0.0, "l2"}, true);
  REQUIRE(chosen);
  REQUIRE(chosen->trials.size() == 1);
  CHECK(chosen->trials.front().file == "M2complete");
  CHECK(chosen->exploration == "M2");
}

TEST_CASE("explorations are not mixed, except the cells of a sweep without training") {
  Dataset swept = two_explorations();
  swept.info.factors = {"force_N"};
  for (TrialRecord& record : swept.records)
    record.spec.factors = {record.spec.exploration == "M1" ? 2.0 : 5.0};
  CHECK(choose_trials(swept, {}, false)->trials.size() == 2);
  CHECK(choose_trials(swept, {}, false)->exploration.empty());
  CHECK_FALSE(choose_trials(swept, {}, true));
  for (const bool one_exploration : {false, true}) {
    const auto mixed = choose_trials(two_explorations(), {}, one_exploration);
    REQUIRE_FALSE(mixed);
    CHECK(mixed.error().got == "M1, M2");
  }
  CHECK(choose_trials(two_explorations(), {"M3", 0.0, 0.0, "l2"}, true).error().code ==
        Errc::not_found);
}

TEST_CASE("the only exploration with complete trials is chosen without being named") {
  Dataset dataset = two_explorations();
  for (TrialRecord& record : dataset.records)
    if (record.spec.exploration == "M2") record.outcome = TrialOutcome::aborted;
  const auto chosen = choose_trials(dataset, {}, true);
  REQUIRE(chosen);
  CHECK(chosen->exploration == "M1");
  CHECK(chosen->trials.size() == 1);
  for (TrialRecord& record : dataset.records) record.outcome = TrialOutcome::aborted;
  CHECK(choose_trials(dataset, {}, true).error().code == Errc::not_found);
}

TEST_CASE("windows are cut at the data set's own rate") {
  // 4 s of motion at 10 Hz hold two windows of 1.5 s, and seven that start every 0.4 s
  CHECK(choose_trials(two_explorations(), {"M1", 1.5, 0.0, "l2"}, true)->trials.size() == 2);
  CHECK(choose_trials(two_explorations(), {"M1", 1.5, 0.4, "l2"}, true)->trials.size() == 7);
  CHECK(choose_trials(two_explorations(), {"M1", 1.5, 0.4, "l2"}, true)->strokes == 1);
  Dataset no_rate = two_explorations();
  no_rate.info.taxel_rate_hz = 0;
  CHECK_FALSE(choose_trials(no_rate, {"M1", 1.5, 0.0, "l2"}, true));
}

TEST_CASE("imprints have as many taxels as their array, not as a row of it") {
  const auto path = std::filesystem::temp_directory_path() /
                    ("weft-taxels-" + std::to_string(::getpid()) + ".h5");
  Dataset dataset;
  for (const char* label : {"ridge", "dot"})
    REQUIRE(append_imprint(dataset, classifier::imprint::Image(8, 6), label, label, label));
  REQUIRE(write_hdf5(dataset, path));
  const auto chosen = load_trials(path, {}, true);
  std::filesystem::remove(path);
  REQUIRE(chosen);
  CHECK(chosen->setup.taxels == 48);
}

TEST_CASE("features of two explorations stand side by side, for commands that make no model") {
  const auto path = std::filesystem::temp_directory_path() /
                    ("weft-joined-" + std::to_string(::getpid()) + ".h5");
  Dataset dataset = two_explorations();
  for (TrialRecord& record : dataset.records)
    for (std::int64_t i = 0; i < 40; ++i) record.t_ns.push_back(i * 100'000'000);
  REQUIRE(write_hdf5(dataset, path));
  TrialChoice choice;
  choice.exploration = "M1+M2";
  const auto both = load_trials(path, choice, true, true);
  const auto model = load_trials(path, choice, true);
  choice.exploration = "M1+M3";
  const auto missing = load_trials(path, choice, true, true);
  dataset.records[1].outcome = TrialOutcome::complete;  // another trial of M1, twice as fast
  dataset.records[1].spec.repetition = 1;
  for (std::int64_t& t : dataset.records[1].t_ns) t /= 2;
  REQUIRE(write_hdf5(dataset, path));
  choice.exploration = "M1+M2";
  const auto two_rates = load_trials(path, choice, true, true);
  std::filesystem::remove(path);
  REQUIRE_FALSE(two_rates);
  CHECK(two_rates.error().code == Errc::invalid_argument);
  CHECK(two_rates.error().got.find("Hz and") != std::string::npos);
  REQUIRE(both);
  CHECK(both->features.size() == 1);
  REQUIRE(both->features.names.size() == 24);
  CHECK(both->features.names[0] == "M1:max.M.1");
  CHECK(both->features.names[12] == "M2:max.M.1");
  CHECK(both->features.values(0, 0) == both->features.values(0, 12));
  CHECK(both->setup.exploration == "M1+M2");
  CHECK_FALSE(model);
  REQUIRE_FALSE(missing);
  CHECK(missing.error().got == "M3");
}

TEST_CASE("a random split of windows is refused, a split by groups is not") {
  classifier::FeatureMatrix features;
  features.labels = {"a", "a", "a", "b", "b", "b"};
  features.groups = {"0", "0", "1", "0", "0", "1"};
  EvaluateArgs args;
  CHECK_FALSE(make_splits(args, features));  // no split at all
  args.train_fraction = 0.5;
  args.repeats = 4;
  CHECK(make_splits(args, features)->size() == 4);
  args.trials.window_s = 1.0;
  CHECK_FALSE(make_splits(args, features));
  args.train_groups = {"0"};
  args.test_groups = {"1"};
  const auto split = make_splits(args, features);
  REQUIRE(split);
  CHECK(split->front().test == std::vector<std::size_t>{2, 5});
}

TEST_CASE("simulated data are called simulated and real data are not") {
  CHECK(bench_banner(BenchKind::simulated).find("SIMULATED") != std::string::npos);
  CHECK(bench_banner(BenchKind::unknown).find("unknown") != std::string::npos);
  CHECK(bench_banner(BenchKind::real).empty());
}

TEST_CASE("a bar fills in proportion and is never longer than its width") {
  CHECK(bar(0, 8, 4) == "[....]");
  CHECK(bar(4, 8, 4) == "[##..]");
  CHECK(bar(7, 8, 4) == "[###.]");
  CHECK(bar(9, 8, 4) == "[####]");
  CHECK(bar(0, 0, 4) == "[####]");
}

TEST_CASE("away from a terminal progress is at most twenty plain lines") {
  std::ostringstream out;
  ProgressPrinter printer(out, false);
  for (std::size_t done = 1; done <= 680; ++done) printer(at(done, 680));
  printer.finish();
  const std::string text = out.str();
  CHECK(std::count(text.begin(), text.end(), '\n') == 20);
  CHECK(text.find('\r') == std::string::npos);
  CHECK(text.find("680/680") != std::string::npos);
}

TEST_CASE("a trial that did not complete is named wherever progress goes by lines") {
  std::ostringstream out;
  ProgressPrinter printer(out, false);
  TrialProgress aborted = at(0, 680);  // it does not count as complete
  aborted.outcome = recipes::Outcome::aborted;
  printer(aborted);
  CHECK(out.str().find("trial 1 (wool M1 #3)") != std::string::npos);
  TrialProgress failed = at(2, 680);
  failed.outcome = recipes::Outcome::failed;
  printer(failed);
  CHECK(out.str().find("trial 2 (wool M1 #3)") != std::string::npos);
}

TEST_CASE("on a terminal a shorter line wipes what the longer one left") {
  std::ostringstream out;
  ProgressPrinter printer(out, true);
  printer(at(1, 1000));
  const std::size_t first = out.str().size();
  printer(at(1000, 1000));
  printer.finish();
  CHECK(out.str().size() >= 2 * first);
  CHECK(out.str().back() == '\n');
  CHECK(out.str().find("ETA") != std::string::npos);
}

TEST_CASE("columns line up by characters, not by bytes") {
  Table table;
  table.row({"a", "1"});
  table.row({"\xC3\xA9t\xC3\xA9", "234"});
  CHECK(table.text("") == "a      1\n\xC3\xA9t\xC3\xA9  234\n");
  Table facts(Align::left);
  facts.row({"a", "1"});
  facts.row({"bcd", "22"});
  CHECK(facts.text("") == "a    1\nbcd  22\n");
}

TEST_CASE("a confusion matrix shows mistakes as numbers and zeros as dots") {
  classifier::Confusion confusion({"wool", "silk", "none"});
  confusion.at(0, 0) = 3;
  confusion.at(0, 1) = 1;
  confusion.at(1, 1) = 4;
  const std::string text = confusion_text(confusion);
  CHECK(text.find("1 wool  3  1  .      75.0") != std::string::npos);
  CHECK(text.find("2 silk  .  4  .     100.0") != std::string::npos);
  CHECK(text.find("3 none  .  .  .         -") != std::string::npos);
}

TEST_CASE("of many fabrics the ten with most votes are named, the winner first") {
  classifier::FeatureMatrix matrix;
  matrix.names = {"mean.P"};
  matrix.values = classifier::Matrix(26, 1);
  for (std::size_t r = 0; r < 26; ++r) {
    matrix.values(r, 0) = static_cast<double>(r);
    matrix.labels.push_back(std::string(1, static_cast<char>('a' + r / 2)));
    matrix.files.push_back(std::to_string(r));
    matrix.groups.push_back("");
  }
  const auto learner = classifier::train_recipe(matrix, {classifier::Learner::lda}, {});
  REQUIRE(learner);
  PredictedTrial trial{"t.csv", "", {}};
  trial.answer.ballot.winner = 3;
  for (int k = 0; k < 13; ++k) trial.answer.ballot.votes.push_back(k == 3 ? 12 : k);
  CHECK(answer_line(*learner, trial) ==
        "t.csv: d  (votes: d 12 m 12 l 11 k 10 j 9 i 8 h 7 g 6 f 5 e 4, 2 more fabrics)\n");
  trial.answer.ballot.votes.assign(13, 0);
  trial.answer.ballot.votes[3] = 2;
  CHECK(answer_line(*learner, trial) == "t.csv: d  (votes: d 2)\n");
  trial.answer.none_of_these = true;
  CHECK(answer_line(*learner, trial).find("(nearest: d)  (votes: d 2)") != std::string::npos);
}

}  // namespace
}  // namespace weft::daemon::cli::cli_test
