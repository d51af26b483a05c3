// The handover of a complete campaign starts by itself. SIMULATED.

#include "daemon/analysis/handover/handover.hpp"

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "classifier/model/stored_model.hpp"
#include "daemon/analysis/handover/train.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/campaign/resume.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace handover_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

namespace fs = std::filesystem;

/// Two clearly different fabrics, strokes of 6 mm.
std::string recipe_of(int repetitions, const json& handover) {
  json recipe = json::parse(test::short_recipe("pile"));
  recipe["fabrics"] = {"pile", "nylon"};
  recipe["repetitions"] = repetitions;
  if (!handover.is_null()) recipe["hand_over"] = handover;
  return recipe.dump();
}

const json by_lda{{"learner", "lda"}, {"groups", 2}};

/// A recorded campaign.
struct Recorded {
  TemporaryFolder folder;
  CampaignRequest request;
  explicit Recorded(const json& handover = by_lda, int repetitions = 4) {
    request = test::request_in(folder, recipe_of(repetitions, handover));
    request.error_check = false;
    const auto summary = run_campaign(request, {});
    if (!summary) FAIL(to_string(summary.error()));
    REQUIRE(summary->outcome == recipes::Outcome::complete);
  }
  [[nodiscard]] const fs::path& out() const { return request.out; }
  [[nodiscard]] std::string text(const char* name) const {
    const auto read = read_text_file(out() / "handover" / name);
    if (!read) FAIL(to_string(read.error()));
    return *read;
  }
};

HandoverResult result(const fs::path& folder, const HandoverHooks& hooks = {}) {
  const auto done = run_handover(folder, hooks);
  if (!done) FAIL(to_string(done.error()));
  return *done;
}

std::vector<std::string> left_behind(const fs::path& folder) {
  std::vector<std::string> out;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with("handover"))
      out.push_back(entry.path().filename().string());
  std::sort(out.begin(), out.end());
  return out;
}

void flip_a_bit(const fs::path& file) {
  std::string text = *read_text_file(file);
  text[text.size() / 2] = static_cast<char>(text[text.size() / 2] ^ 1);
  test::write_file(file, text);
}

}  // namespace

TEST_CASE("Each exploration of a complete campaign gets a model, a page and an evaluation") {
  const Recorded campaign;
  std::vector<std::string> reported;
  HandoverHooks hooks;
  hooks.progress = [&](const EvaluationProgress& p) {
    CHECK(p.step == reported.size());
    CHECK(p.steps == 6);
    reported.push_back(p.what);
  };
  const HandoverResult done = result(campaign.out(), hooks);
  CHECK(reported.size() == 6);
  CHECK(done.bench == "simulated");
  REQUIRE(done.models.size() == 2);
  const json evaluation = json::parse(campaign.text("evaluation.json"));
  CHECK(evaluation["bench"] == "simulated");
  CHECK(evaluation["dataset_sha256"] == done.dataset_sha256);
  for (const HandoverModel& handover_model : done.models) {
    INFO(handover_model.exploration);
    CHECK(handover_model.trained == 8);
    CHECK(handover_model.requested == 8);
    std::istringstream in(campaign.text((handover_model.exploration + ".model").c_str()));
    const auto model = classifier::load_model<classifier::FeatureSetup>(in);
    REQUIRE(model);
    CHECK(model->provenance.bench == "simulated");
    CHECK(model->provenance.dataset_sha256 == done.dataset_sha256);
    CHECK(model->setup.exploration == handover_model.exploration);
    CHECK(campaign.text((handover_model.exploration + ".html").c_str()).find("SIMULATED") !=
          std::string::npos);
    // every repetition is tested once, by a model without it
    std::multiset<int> requested;
    for (const json& group : evaluation["explorations"][handover_model.exploration]["groups"]) {
      CHECK(group["trained"] == 4);
      for (const int repetition : group["repetitions"]) requested.insert(repetition);
    }
    CHECK(requested == std::multiset<int>{1, 2, 3, 4});
  }
  CHECK(left_behind(campaign.out()) == std::vector<std::string>{"handover"});
  const auto report = verify(campaign.out());
  REQUIRE(report);
  CHECK(report->holds());
}

TEST_CASE("A split never trains on its test trials, and keeps a repetition's fabrics together") {
  const std::vector<std::uint32_t> repetition{1, 1, 2, 2, 3, 3, 4, 4, 1, 4};
  const auto splits = splits_by_repetition(repetition, {0, 0, 1, 2});
  REQUIRE(splits.size() == 3);
  std::multiset<std::size_t> requested;
  for (const classifier::Split& split : splits) {
    CHECK(split.train.size() + split.test.size() == repetition.size());
    std::set<std::uint32_t> trained;
    for (const std::size_t row : split.train) trained.insert(repetition[row]);
    for (const std::size_t row : split.test) CHECK(trained.count(repetition[row]) == 0);
    requested.insert(split.test.begin(), split.test.end());
  }
  CHECK(requested.size() == repetition.size());
  CHECK(std::set<std::size_t>(requested.begin(), requested.end()).size() == repetition.size());
}

TEST_CASE("A handover is not repeated unless its data changed; the old one is kept") {
  const Recorded campaign;
  const HandoverResult first = result(campaign.out());
  bool worked = false;
  HandoverHooks hooks;
  hooks.progress = [&](const EvaluationProgress&) { worked = true; };
  CHECK(result(campaign.out(), hooks) == first);
  CHECK_FALSE(worked);

  flip_a_bit(campaign.out() / "handover" / "M2.model");
  const auto report = verify(campaign.out());
  REQUIRE(report);
  REQUIRE(report->found_problems.size() == 1);
  CHECK(report->found_problems[0].what.find("M2.model") != std::string::npos);
  const HandoverResult again = result(campaign.out(), hooks);
  CHECK(worked);
  // the same data give the same models, byte for byte, on any number of threads
  CHECK(again == first);
  CHECK(left_behind(campaign.out()) == std::vector<std::string>{"handover", "handover.aside-1"});
  flip_a_bit(campaign.out() / "handover" / "evaluation.json");
  CHECK_FALSE(verify(campaign.out())->holds());
}

TEST_CASE("The remains of a killed handover are not a handover") {
  const Recorded campaign;
  fs::create_directory(campaign.out() / "handover.partial");
  test::write_file(campaign.out() / "handover.partial" / "M1.model", "half a mod");
  const auto before = read_handover(campaign.out());
  REQUIRE(before);
  CHECK_FALSE(*before);
  result(campaign.out());
  CHECK(left_behind(campaign.out()) == std::vector<std::string>{"handover"});
}

TEST_CASE("Nothing partial goes into training") {
  const TemporaryFolder folder;
  CampaignRequest request = test::request_in(folder, recipe_of(4, by_lda));
  request.error_check = false;
  SECTION("stopped") {
    std::atomic<bool> stop{false};
    CampaignHooks hooks;
    hooks.progress = [&](const TrialProgress& line) { stop = line.done >= 12; };
    hooks.stop = &stop;
    const auto summary = run_campaign(request, hooks);
    REQUIRE(summary);
    REQUIRE(summary->trials_complete >= 12);
    const auto refused = run_handover(request.out, {});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::wrong_state);
    CHECK(refused.error().got == std::to_string(summary->trials_complete) + " trials");
  }
  SECTION("killed") {
    REQUIRE(test::killed_at(request, {120, false}) == true);
    const auto refused = run_handover(request.out, {});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::wrong_state);
    CHECK(refused.error().got.empty());
  }
  CHECK(left_behind(request.out).empty());
}

TEST_CASE("A campaign that is not what was certified is not learnt from") {
  const Recorded one;
  json altered = json::parse(*read_text_file(one.out() / "certificate.json"));
  altered["dataset_sha256"] = std::string(64, '0');
  altered.erase("certificate_sha256");
  altered["certificate_sha256"] = sha256_hex(altered.dump());
  test::write_file(one.out() / "certificate.json", altered.dump());
  const auto refused = run_handover(one.out(), {});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::corrupt);
}

TEST_CASE("A hand-over is given up when it is reported to, or when its time is over") {
  const Recorded campaign(json{{"learner", "best"}, {"groups", 4}, {"at_most_s", 100}});
  HandoverHooks hooks;
  std::atomic<int> requested{0};
  hooks.stop = [&] { return ++requested > 40; };
  const auto stopped = run_handover(campaign.out(), hooks);
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().code == Errc::wrong_state);
  hooks.stop = {};
  std::atomic<int> ticks{0};
  hooks.seconds_now = [&] { return static_cast<double>(ticks++); };
  const auto late = run_handover(campaign.out(), hooks);
  REQUIRE_FALSE(late);
  CHECK(late.error().code == Errc::timeout);
  CHECK(late.error().expected == "at most 100 s");
  CHECK(left_behind(campaign.out()).empty());
}

TEST_CASE("The report is written with the hand-over; one that fails costs nothing else") {
  const Recorded campaign;
  HandoverHooks hooks;
  hooks.report = [](const Dataset&, const HandoverResult&, const std::vector<HandoverText>&,
                    const StopRequested&) -> Result<std::vector<HandoverText>> {
    return fail({.code = Errc::io, .what = "no room"});
  };
  const Recorded without;
  REQUIRE(run_handover(without.out(), hooks));
  CHECK(json::parse(without.text("evaluation.json"))["report_error"].is_string());
  const auto fewer = listed_handover_files(without.out());
  REQUIRE(fewer);
  CHECK(std::ranges::count(*fewer, "report.html", &FileChecksums::name) == 0);
  std::string reported, records;
  hooks.report = [&](const Dataset& data, const HandoverResult& reached,
                     const std::vector<HandoverText>& files, const StopRequested&) {
    reported = reached.results_json + std::to_string(data.trials.size());
    for (const HandoverText& file : files) records += file.name + " ";
    return Result<std::vector<HandoverText>>(std::vector<HandoverText>{{"report.html", "<p>"}});
  };
  const HandoverResult done = result(campaign.out(), hooks);
  CHECK(campaign.text("report.html") == "<p>");
  const auto files = listed_handover_files(campaign.out());
  REQUIRE(files);
  CHECK(std::ranges::count(*files, "report.html", &FileChecksums::name) == 1);
  CHECK(reported == done.results_json + "16");
  CHECK(records.starts_with("evaluation.json "));
  CHECK(records.find("M1.json ") != std::string::npos);
  const json results = json::parse(done.results_json);
  REQUIRE(results.size() == done.models.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    CHECK(results[i]["accuracy"] == done.models[i].accuracy);
    CHECK(results[i]["tested"] == done.models[i].requested);
    CHECK(results[i]["labels"] == 2);
  }
}

TEST_CASE("A recorded recipe states its handover, whatever happened to its file") {
  const Recorded declined(false);
  const auto wanted = load_handover_spec(declined.out());
  REQUIRE(wanted);
  CHECK_FALSE(*wanted);
  CHECK(run_handover(declined.out(), {}).error().code == Errc::not_found);
  const Recorded silent(nullptr);
  const auto by_default = load_handover_spec(silent.out());
  REQUIRE(by_default);
  REQUIRE(*by_default);
  CHECK((*by_default)->by_default);
  CHECK(result(silent.out()).models.size() == 2);  // one of each exploration
  const Recorded campaign;
  fs::remove(campaign.request.recipe);
  const auto requested = load_handover_spec(campaign.out());
  REQUIRE(requested);
  REQUIRE(*requested);
  CHECK((*requested)->learner == "lda");
}

TEST_CASE("Every learner that a recipe may name is one of the classifier's") {
  for (const std::string_view name : recipes::handover_learners(recipes::HandoverSource::taxels)) {
    INFO(name);
    CHECK(classifier::learner_from(name));
  }
}

TEST_CASE("A complete campaign without its handover is resumed for the handover only") {
  Recorded campaign;
  campaign.request.resume = true;
  const std::string recorded = *read_text_file(campaign.out() / "certificate.json");
  const auto preview = preview_resume(campaign.request);
  REQUIRE(preview);
  CHECK(preview->left == 0);
  REQUIRE(preview->will.size() == 1);
  bool taken = false;
  CampaignHooks hooks;
  hooks.rig_acquired = [&] {
    taken = true;
    return Status{};
  };
  const auto summary = run_campaign(campaign.request, hooks);
  REQUIRE(summary);
  CHECK(summary->outcome == recipes::Outcome::complete);
  CHECK(summary->has_handover);
  CHECK(summary->trials_complete == summary->trials_planned);
  CHECK(recorded.find(summary->dataset_sha256) != std::string::npos);
  CHECK_FALSE(taken);
  CHECK(*read_text_file(campaign.out() / "certificate.json") == recorded);
  result(campaign.out());
  CHECK(run_campaign(campaign.request, {}).error().code == Errc::wrong_state);
  Recorded silent(nullptr);
  silent.request.resume = true;
  CHECK(run_campaign(silent.request, {}).error().code == Errc::wrong_state);
}

}  // namespace handover_test
