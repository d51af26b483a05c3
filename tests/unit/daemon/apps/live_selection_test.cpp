// A campaign with live votes records a selection, and all its results state that. SIMULATED.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/unit/daemon/benches/live_bench.hpp"

namespace live_selection_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::live_test;
using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

namespace {

struct Reply {
  int status = 0;
  std::string out, err;
};

Reply weft_says(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "weft");
  std::vector<const char*> argv;
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out, err;
  cli::Console console{out, err};
  const int status = cli::run(static_cast<int>(argv.size()), argv.data(), console);
  return {status, out.str(), err.str()};
}

/// M1's strokes end early; M2's, which have no votes, do not.
json half_selected(int repetitions) {
  json recipe = recipe_of(repetitions);
  recipe["explorations"]["M2"] = recipe["explorations"]["M1"];
  recipe["explorations"]["M1"]["live_vote"] = stop_early();
  return recipe;
}

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("what a live vote left out is counted in the data set, its certificate and every tool") {
  LiveBench bench;
  test::write_file(bench.request.recipe, half_selected(3).dump());
  const std::string out = (bench.folder / "live").string();
  const Reply ran =
      weft_says({"run", bench.request.recipe.string(), "--rig", bench.request.rig.string(), "--out",
                 out, "--no-error-check", "--json"});
  INFO(ran.err);
  REQUIRE(ran.status == 0);
  CHECK(json::parse(ran.out)["selected"] == true);
  CHECK(has(ran.err, "not classified"));
  const std::string file = out + "/dataset.h5";
  const auto dataset = read_hdf5(file);
  REQUIRE(dataset);
  CHECK(dataset->trials.size() == 6);
  const std::vector<EndedEarly> expected{{"nylon", "M1", 3}, {"pile", "M1", 3}};
  CHECK(dataset->info.ended_early == expected);
  const auto certificate = read_certificate(out);
  REQUIRE(certificate);
  CHECK((*certificate)->ended_early == expected);
  CHECK(certificate_from_json(to_json(**certificate)).value() == **certificate);
  CHECK(verify(out)->holds());
  const std::string words = "6 slides that a live vote ended early are left out (nylon 3, pile 3)";
  CHECK(has(test::read_file(out + "/report.html"), words));
  const json report = json::parse(test::read_file(out + "/report.json"));
  CHECK(report["results"].empty());
  CHECK(report["ended_early"].size() == 2);

  const std::string model = (bench.folder / "m.model").string();
  const std::string csv = (bench.folder / "f.csv").string();
  const std::vector<std::vector<std::string>> tools{
      {"dataset", "info", file},
      {"dataset", "info", out + "/campaign.sqlite"},
      {"train", file, "--learner", "lda", "-o", model},
      {"train", file, "--live", "--learner", "lda", "-o", model},
      {"features", file, "-o", csv},
      {"evaluate", file, "--learner", "lda", "--train-fraction", "0.4", "--repeats", "1"}};
  for (const auto& tool : tools) {
    const Reply reply = weft_says(tool);
    INFO(tool[0] << ' ' << tool[1] << ": " << reply.out << reply.err);
    CHECK(reply.status == 0);
    CHECK(has(reply.out, words));
  }
}

TEST_CASE("a campaign with only complete strokes is no selection and is classified") {
  const TemporaryFolder folder;
  const auto request = request_in(folder, recipe_of(3).dump());
  const std::string out = (folder / "out").string();
  const Reply ran = weft_says({"run", request.recipe.string(), "--rig", request.rig.string(),
                               "--out", out, "--no-error-check", "--repeats", "1", "--json"});
  INFO(ran.err);
  REQUIRE(ran.status == 0);
  CHECK_FALSE(json::parse(ran.out).contains("selected"));
  CHECK_FALSE(json::parse(test::read_file(out + "/report.json"))["results"].empty());
  CHECK_FALSE(has(test::read_file(out + "/report.html"), "live vote"));
  CHECK(read_hdf5(out + "/dataset.h5")->info.ended_early.empty());
}

}  // namespace live_selection_test
