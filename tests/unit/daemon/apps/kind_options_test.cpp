// Options that do not apply to the kind of the data are refused, never ignored.

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::cli::kind_options_test {
namespace {

using test::TemporaryFolder;

// Output of `weft` on standard error.
std::string refusal(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "weft");
  std::vector<const char*> words;
  for (const std::string& one : arguments) words.push_back(one.c_str());
  std::ostringstream out, err;
  Console console{out, err};
  CHECK(run(static_cast<int>(words.size()), words.data(), console) == exit_failure);
  CHECK(out.str().empty());
  return err.str();
}

/// The error of a refused command, as --json prints it.
nlohmann::json error_of(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"weft", "--json"});
  std::vector<const char*> words;
  for (const std::string& one : arguments) words.push_back(one.c_str());
  std::ostringstream out, err;
  Console console{out, err};
  CHECK(run(static_cast<int>(words.size()), words.data(), console) == exit_failure);
  return nlohmann::json::parse(out.str()).at("error");
}

bool has(const nlohmann::json& text, const std::string& part) {
  return text.get<std::string>().find(part) != std::string::npos;
}

std::string recordings_in(const TemporaryFolder& folder) {
  RecordingSet set{"two", "recordings", BenchKind::real, {}};
  for (const char* label : {"felt", "foil"})
    set.recordings.push_back(
        {label, label, "1", {{"X", 100.0, "1"}}, {std::vector<double>(500, 1.0)}});
  REQUIRE(write_recordings(set, folder / "r.h5"));
  return folder / "r.h5";
}

std::string slides_in(const TemporaryFolder& folder) {
  Dataset slides;
  for (const char* label : {"denim", "wool"}) {
    slides.trials.push_back({label, label, "1", 1, {}, {}});
    slides.trials.back().counts.assign(40, 1.0);
    slides.trials.back().phase.assign(40, Phase::motion);
    slides.records.emplace_back().outcome = TrialOutcome::complete;
    for (std::int64_t i = 0; i < 40; ++i) slides.records.back().t_ns.push_back(i * 100'000'000);
  }
  REQUIRE(write_hdf5(slides, folder / "s.h5"));
  return folder / "s.h5";
}

std::string imprints_in(const TemporaryFolder& folder) {
  Dataset imprints;
  for (const char* label : {"ridge", "dot"})
    REQUIRE(append_imprint(imprints, classifier::imprint::Image(4, 4), label, label, label));
  REQUIRE(write_hdf5(imprints, folder / "i.h5"));
  return folder / "i.h5";
}

TEST_CASE("every option of a command that learns is about one kind of data") {
  CLI::App root;
  ChosenCommand chosen;
  add_commands(root, chosen);
  const std::vector<std::string> learning{"features", "evaluate", "train"};
  std::set<std::string> all;
  for (const std::string& name : learning)
    for (const CLI::Option* option : root.get_subcommand(name)->get_options())
      all.insert(option->get_name());
  for (const CLI::Option* option :
       root.get_subcommand("design")->get_subcommand("repetitions")->get_options())
    all.insert(option->get_name());
  CHECK(all.contains("--permute-labels"));
  for (const std::string& option : all) {
    CAPTURE(option);
    bool known = false;
    for (const DataKind kind : {DataKind::slides, DataKind::imprints, DataKind::parts,
                                DataKind::random_windows, DataKind::whole_recordings})
      known = known || check_given({{option, option}}, kind);
    CHECK(known);
  }
  CHECK_FALSE(check_given({{"--colour", "--colour"}}, DataKind::slides));
}

TEST_CASE("the commands of a modality have its options alone, under one name") {
  CLI::App root;
  ChosenCommand chosen;
  add_commands(root, chosen);
  const auto has = [&](const char* modality, const char* command, const std::string& option) {
    const CLI::App* const found = root.get_subcommand(modality)->get_subcommand(command);
    return found->get_option_no_throw(option) != nullptr;
  };
  for (const char* modality : {"fabric", "vibro", "imprint"})
    for (const char* option : {"--learner", "--report", "--seed", "--leave-one-group-out"})
      CHECK(has(modality, "evaluate", option));
  for (const char* option :
       {"--method", "--reduction", "--window-step-s", "--imprint-features", "--blocks"})
    for (const char* modality : {"fabric", "vibro", "imprint"})
      CHECK_FALSE(has(modality, "evaluate", option));
  CHECK(has("fabric", "evaluate", "--step-s"));
  CHECK(has("vibro", "evaluate", "--step-s"));
  CHECK_FALSE(has("imprint", "evaluate", "--step-s"));
  CHECK_FALSE(has("fabric", "evaluate", "--features"));
  CHECK(has("vibro", "train", "--features"));
  CHECK(has("imprint", "train", "--features"));
  CHECK(has("vibro", "evaluate", "--parts"));
  CHECK(has("fabric", "train", "--live"));
  CHECK_FALSE(has("vibro", "train", "--live"));
  CHECK_FALSE(has("vibro", "classify", "--vote"));
  CHECK(has("imprint", "tables", "--rules"));
}

TEST_CASE("a command of one modality refuses the data of another and names its own") {
  const TemporaryFolder folder;
  const std::string sound = recordings_in(folder), slides = slides_in(folder);
  const std::string imprints = imprints_in(folder);
  const auto refused = [&](const char* modality, const std::string& file) {
    return error_of({modality, "evaluate", file, "--leave-one-group-out"});
  };
  CHECK(has(refused("fabric", sound).at("hint"), "weft vibro"));
  CHECK(has(refused("fabric", imprints).at("hint"), "weft imprint"));
  CHECK(has(refused("imprint", sound).at("hint"), "weft vibro"));
  CHECK(has(refused("imprint", slides).at("hint"), "weft fabric"));
  CHECK(has(refused("vibro", slides).at("where"), slides));
  const auto parts = error_of({"vibro", "evaluate", sound, "--protocol", "random", "--parts", "3"});
  CHECK(parts.at("where") == sound + ": --parts");
  CHECK(has(parts.at("message"), "random windows"));
  CHECK(has(error_of({"imprint", "features", slides, "-o", folder / "x.csv"}).at("hint"),
            "weft fabric"));
  CHECK(has(error_of({"imprint", "train", slides, "-o", folder / "x.model"}).at("hint"),
            "weft fabric"));
}

TEST_CASE("learners after --learner are one list, with commas or blanks") {
  using Words = std::vector<std::string>;
  CHECK(join_learners({"evaluate", "--learner", "best", "lda", "data.h5", "lda"}) ==
        Words{"evaluate", "--learner", "best,lda", "data.h5", "lda"});
  CHECK(join_learners({"--learner", "best,", "lda", "RForest,every", "x.h5"}) ==
        Words{"--learner", "best,lda,RForest,every", "x.h5"});
  CHECK(join_learners({"x.h5", "lda", "svc"}) == Words{"x.h5", "lda", "svc"});
  CHECK(join_learners({"--learner", "best", "--seed", "lda"}) ==
        Words{"--learner", "best", "--seed", "lda"});
  CHECK(join_learners({"--learner"}) == Words{"--learner"});
}

TEST_CASE("help leaves out what is rarely needed, --help-all has it") {
  const auto reply = [](const char* flag) {
    const std::vector<const char*> words{"weft", "fabric", "evaluate", flag};
    std::ostringstream out, err;
    Console console{out, err};
    CHECK(run(static_cast<int>(words.size()), words.data(), console) == exit_ok);
    return out.str();
  };
  const std::string brief = reply("--help"), whole = reply("--help-all");
  CHECK(std::ranges::count(brief, '\n') <= 48);
  CHECK(brief.find("--learner") != std::string::npos);
  CHECK(brief.find("--paper-selection") == std::string::npos);
  CHECK(whole.find("--learner") != std::string::npos);
  CHECK(whole.find("--paper-selection") != std::string::npos);
  std::istringstream lines(brief);
  for (std::string line; std::getline(lines, line);) CHECK(line.size() <= 80);
}

TEST_CASE("recordings refuse the options of slides in one sentence, with their own beside") {
  const TemporaryFolder folder;
  const std::string file = recordings_in(folder);
  std::vector<std::string> of_slides{"evaluate",         file,  "--window-s",       "1",
                                     "--window-step-s",  "0.5", "--train-fraction", "0.5",
                                     "--permute-labels", "3",   "--none-of-these"};
  of_slides.insert(of_slides.end(), {"--learner", "lda", "--method", "NB"});
  const auto error = error_of(of_slides);
  CHECK(error.at("where") == file +
                                 ": --learner, --none-of-these, --permute-labels, "
                                 "--train-fraction, --window-step-s");
  CHECK(has(error.at("message"), "contiguous parts"));
  for (const char* const pair :
       {"--method instead of --learner", "--protocol instead of --train-fraction",
        "--step-s instead of --window-step-s"})
    CHECK(has(error.at("hint"), pair));
  CHECK(refusal(of_slides) == "weft: " + error.at("sentence").get<std::string>() + "\n");
  const auto train = error_of({"train", file, "-o", folder / "x.model", "--learner", "svc",
                               "--window-s", "1", "--window-step-s", ".5"});
  CHECK(train.at("where") == file + ": --learner, --window-step-s");
  CHECK(has(train.at("message"), "whole"));
  CHECK(error_of({"train", file, "-o", folder / "x.model", "--live"}).at("where") ==
        file + ": --live");
  CHECK_FALSE(std::filesystem::exists(folder / "x.model"));
  for (const std::vector<std::string>& one : {std::vector<std::string>{"--repeats", "3"},
                                              {"--per-recording", "5"},
                                              {"--protocol", "random", "--blocks", "3"},
                                              {"--protocol", "random", "--step-s", "1"},
                                              {"--leave-one-group-out", "--protocol", "blocks"},
                                              {"--leave-one-group-out", "--blocks", "3"}}) {
    std::vector<std::string> arguments{"evaluate", file};
    arguments.insert(arguments.end(), one.begin(), one.end());
    CHECK(has(error_of(arguments).at("where"), file + ": --"));
  }
}

TEST_CASE("slides refuse the options of recordings and of imprints") {
  const TemporaryFolder folder;
  const std::string file = slides_in(folder);
  const auto error = error_of({"evaluate", file, "--train-fraction", "0.5", "--learner", "lda",
                               "--features", "WIDE", "--step-s", "1"});
  CHECK(error.at("where") == file + ": --features, --step-s");
  CHECK(has(error.at("message"), "strokes"));
  CHECK(has(error.at("hint"), "--method with --features"));
  CHECK(has(error.at("hint"), "--window-step-s instead of --step-s"));
  for (const char* command : {"train", "features"}) {
    const auto reply = error_of({command, file, "-o", folder / "x", "--scales", "1,2"});
    CHECK(reply.at("where") == file + ": --scales");
    CHECK(has(reply.at("message"), "strokes"));
  }
}

TEST_CASE("imprints refuse the options of what moves") {
  const TemporaryFolder folder;
  const std::string file = imprints_in(folder);
  const auto error = error_of({"evaluate", file, "--train-fraction", "0.5", "--features", "WIDE",
                               "--protocol", "random", "--exploration", "M1", "--norm", "rms"});
  CHECK(error.at("where") == file + ": --exploration, --features, --norm, --protocol");
  CHECK(has(error.at("hint"), "--imprint-features instead of --features"));
  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& option) {
    const auto one = error_of(arguments);
    CHECK(one.at("where") == file + ": " + option);
    CHECK(has(one.at("message"), "imprints"));
  };
  refused({"features", file, "-o", folder / "x.csv", "--window-s", "1"}, "--window-s");
  refused({"train", file, "-o", folder / "x.model", "--live"}, "--live");
  refused({"design", "repetitions", file, "--norm", "rms"}, "--norm");
}

}  // namespace
}  // namespace weft::daemon::cli::kind_options_test
