// Options that say nothing about the kind of the data are refused, never dropped.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
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

// What `weft` says on standard error.
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

TEST_CASE("every option of a command that takes several kinds of data is about one of them") {
  CLI::App root;
  ChosenCommand chosen;
  add_commands(root, chosen);
  const CLI::App* const design = root.get_subcommand("design");
  GivenOptions all;
  for (const CLI::App* const command :
       {root.get_subcommand("evaluate"), root.get_subcommand("train"),
        root.get_subcommand("features"), design->get_subcommand("repetitions")})
    for (const CLI::Option* option : command->get_options()) all.insert(option->get_name());
  CHECK(all.contains("--permute-labels"));
  for (const std::string& option : all) {
    CAPTURE(option);
    bool known = false;
    for (const DataKind kind : {DataKind::slides, DataKind::imprints, DataKind::parts,
                                DataKind::random_windows, DataKind::whole_recordings})
      known = known || check_given({option}, kind);
    CHECK(known);
  }
  CHECK_FALSE(check_given({"--colour"}, DataKind::slides));
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
