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
    return refusal({modality, "evaluate", file, "--leave-one-group-out"});
  };
  CHECK(refused("fabric", sound).find("Take weft vibro.") != std::string::npos);
  CHECK(refused("fabric", imprints).find("Take weft imprint.") != std::string::npos);
  CHECK(refused("imprint", sound).find("Take weft vibro.") != std::string::npos);
  CHECK(refused("imprint", slides).find("Take weft fabric.") != std::string::npos);
  CHECK(refused("vibro", slides).find(slides) != std::string::npos);
  CHECK(refusal({"vibro", "evaluate", sound, "--protocol", "random", "--parts", "3"})
            .find(": --parts: not for windows at random") != std::string::npos);
  CHECK(
      refusal({"imprint", "features", slides, "-o", folder / "x.csv"}).find("Take weft fabric.") !=
      std::string::npos);
  CHECK(refusal({"imprint", "train", slides, "-o", folder / "x.model"}).find("Take weft fabric.") !=
        std::string::npos);
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
  CHECK(refusal({"evaluate", file, "--window-s", "1", "--window-step-s", "0.5", "--train-fraction",
                 "0.5", "--permute-labels", "3", "--none-of-these", "--learner", "lda", "--method",
                 "NB"}) ==
        "weft: " + file +
            ": --learner, --none-of-these, --permute-labels, --train-fraction, --window-step-s: "
            "not for recordings of sound and vibration in contiguous parts. For --learner take "
            "--method, for --train-fraction take --protocol, for --window-step-s take --step-s.\n");
  CHECK(refusal({"train", file, "-o", folder / "x.model", "--learner", "svc", "--window-s", "1",
                 "--window-step-s", ".5"})
            .find("--learner, --window-step-s: not for whole recordings") != std::string::npos);
  CHECK(refusal({"train", file, "-o", folder / "x.model", "--live"})
            .find("--live: not for whole recordings") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(folder / "x.model"));
  for (const std::vector<std::string>& one : {std::vector<std::string>{"--repeats", "3"},
                                              {"--per-recording", "5"},
                                              {"--protocol", "random", "--blocks", "3"},
                                              {"--protocol", "random", "--step-s", "1"},
                                              {"--leave-one-group-out", "--protocol", "blocks"},
                                              {"--leave-one-group-out", "--blocks", "3"}}) {
    std::vector<std::string> arguments{"evaluate", file};
    arguments.insert(arguments.end(), one.begin(), one.end());
    CHECK(refusal(arguments).find(": not for ") != std::string::npos);
  }
}

TEST_CASE("slides refuse the options of recordings and of imprints") {
  const TemporaryFolder folder;
  const std::string file = slides_in(folder);
  CHECK(refusal({"evaluate", file, "--train-fraction", "0.5", "--learner", "lda", "--features",
                 "WIDE", "--step-s", "1"}) ==
        "weft: " + file +
            ": --features, --step-s: not for slides over a tactile array. For --features take "
            "--method with it, for --step-s take --window-step-s.\n");
  for (const char* command : {"train", "features"}) {
    const std::string reply = refusal({command, file, "-o", folder / "x", "--scales", "1,2"});
    CHECK(reply.find("--scales: not for slides") != std::string::npos);
  }
}

TEST_CASE("imprints refuse the options of what moves") {
  const TemporaryFolder folder;
  const std::string file = imprints_in(folder);
  CHECK(refusal({"evaluate", file, "--train-fraction", "0.5", "--features", "WIDE", "--protocol",
                 "random", "--exploration", "M1", "--norm", "rms"}) ==
        "weft: " + file +
            ": --exploration, --features, --norm, --protocol: not for imprints, which stand still. "
            "For --features take --imprint-features.\n");
  CHECK(refusal({"features", file, "-o", folder / "x.csv", "--window-s", "1"})
            .find("--window-s: not for imprints") != std::string::npos);
  CHECK(refusal({"train", file, "-o", folder / "x.model", "--live"})
            .find("--live: not for imprints") != std::string::npos);
  CHECK(
      refusal({"design", "repetitions", file, "--norm", "rms"}).find("--norm: not for imprints") !=
      std::string::npos);
}

}  // namespace
}  // namespace weft::daemon::cli::kind_options_test
