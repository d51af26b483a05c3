// The report of a small campaign: its statements, its SIMULATED marks, its refusals.

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/text/format.hpp"
#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace report_test {

using namespace weft::daemon;
using nlohmann::json;
using report_test::campaign;
using report_test::count_of;
using weft::classifier::Reduction;

namespace {

std::filesystem::path fresh_folder(const std::string& name) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("weft_report_" + name + "_" + std::to_string(::getpid()));
  std::filesystem::remove_all(path);
  std::filesystem::create_directories(path);
  return path;
}

}  // namespace

TEST_CASE("an evaluation covers every exploration with all three reductions") {
  const auto& results = campaign().results;
  REQUIRE(results.size() == 1);
  CHECK(results[0].exploration == "M1");
  CHECK(results[0].trials == 18);
  CHECK(results[0].features == 3 + 12 * 4);
  for (const Reduction reduction : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    REQUIRE(results[0].find(reduction) != nullptr);
    CHECK(results[0].find(reduction)->splits.size() == 2);
    // 2 of 6 trials train, 4 test: 3 fabrics x 4 x 2 splits.
    CHECK(results[0].find(reduction)->confusion.total() == 24);
  }
}

TEST_CASE("fabrics made to differ are told apart, and shuffled labels are not") {
  CHECK(campaign().results[0].find(Reduction::pvalue)->accuracy == 1.0);
  CHECK(campaign().results[0].permuted_accuracy < 0.75);
}

TEST_CASE("times come from the caller's clock alone") {
  // A clock that moves 0.25 s a reading: once around training, once around each answer.
  const auto& e = *campaign().results[0].find(Reduction::pvalue);
  CHECK(e.train_s == Approx(0.25));
  CHECK(e.test_s_per_sample == 0.25);
  CHECK(campaign().results[0].feature_s_per_sample == Approx(0.25 / 18));
}

TEST_CASE("trials that did not complete take no part") {
  Dataset set = report_test::small_campaign(3);
  set.records[0].outcome = TrialOutcome::aborted;
  EvaluateOptions options;
  options.repeats = 1;
  std::vector<std::string> reported;
  const auto results = evaluate_campaign(set, options, {}, [&](const EvaluationProgress& p) {
    CHECK(p.step == reported.size());
    CHECK(p.steps == 5);
    reported.push_back(p.what);
  });
  REQUIRE(results.has_value());
  CHECK(results->front().trials == 8);
  CHECK(reported.size() == 5);
  for (TrialRecord& record : set.records) record.outcome = TrialOutcome::failed;
  const auto refused = evaluate_campaign(set, options, {});
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == weft::Errc::invalid_argument);
}

TEST_CASE("the force of each fabric is computed again from the wrench") {
  const auto targets = force_targets(campaign().set.info);
  REQUIRE(targets.size() == 1);
  CHECK(targets[0].force_n == Approx(5));
  CHECK(targets[0].band_n == Approx(0.5));
  const auto fabrics = force_by_fabric(campaign().set, targets);
  REQUIRE(fabrics.size() == 3);
  CHECK(fabrics[0].fabric == "knitwear1");
  CHECK(fabrics[0].tally.rms_n() == Approx(0.05));
  CHECK(fabrics[1].tally.rms_n() == Approx(0.1));
  CHECK(fabrics[1].tally.worst_n == Approx(0.1));
  // 10 s of motion at 100 Hz, minus at most a taxel period at either end, of 6 trials.
  CHECK(fabrics[1].tally.samples <= 6000);
  CHECK(fabrics[1].tally.samples >= 6 * 994);
  CHECK(force_targets(DatasetInfo{}).empty());
}

TEST_CASE("the trial shown is the one of median force error") {
  Dataset set = report_test::small_campaign(1);
  set.records[0].quality.force_rms_error_n = 0.9;
  set.records[1].quality.force_rms_error_n = 0.1;
  set.records[2].quality.force_rms_error_n = 0.2;
  CHECK(typical_trial(set, "M1") == std::optional<std::size_t>(2));
  set.records[2].outcome = TrialOutcome::aborted;
  CHECK(typical_trial(set, "M1") == std::optional<std::size_t>(1));
  CHECK_FALSE(typical_trial(set, "M2").has_value());
  const TrialTrace trace = extract_trace(set, 0);
  REQUIRE(trace.phases.size() == 4);
  CHECK(trace.phases[2].phase == weft::Phase::motion);
  CHECK(trace.phases[2].begin_s == Approx(3).margin(1.0 / 37));
  CHECK(trace.tangential_n.value.front() == Approx(0.5));  // 3-4-5 triangle
}

TEST_CASE("cores shown begin with the paper's pairs, in whichever order they are named") {
  const auto lines = core_lines(*campaign().results[0].find(Reduction::pvalue)->trained.cores());
  REQUIRE(lines.size() == 3);
  const std::set<std::string_view> named{"knitwear1", "wool"};
  CHECK(std::ranges::any_of(lines, [&](const CoreLine& line) {
    return std::set<std::string_view>{line.a, line.b} == named;
  }));
  const auto shown = shown_cores(lines, 3);
  REQUIRE(shown.size() == 3);
  CHECK(paper_core(shown[0])->inputs == 2);
  CHECK(paper_core(shown[1])->inputs == 20);
  CHECK(paper_core(shown[2]) == nullptr);
  CHECK(shown[0].features.size() == shown[0].info->inputs);
}

TEST_CASE("report.json holds every key that programs read") {
  const json report = json::parse(report_json(campaign().input()));
  CHECK(report.at("bench") == "simulated");
  CHECK(report.at("trials_planned") == 18);
  CHECK(report.at("trials_complete") == 18);
  CHECK(report.at("complete") == true);
  CHECK(report.at("virtual_s") == 1000);
  CHECK(report.at("wall_s") == 4);
  CHECK(report.at("realtime_factor") == 250);
  CHECK(report.at("dataset_sha256") == campaign().run.dataset_sha256);
  CHECK(report.at("force_rms_error_n").get<double>() == Approx(std::sqrt(0.05)));
  for (const char* reduction : {"pvalue", "pca", "all"}) {
    const json& r = report.at("results").at("M1").at(reduction);
    CHECK(r.at("ci95").size() == 2);
    CHECK(r.at("ci95")[0] <= r.at("accuracy"));
    CHECK(r.at("confusion").at("labels").size() == 3);
    CHECK(r.at("confusion").at("count")[2].size() == 3);
    CHECK(r.at("accuracy_of_splits").size() == r.at("splits"));
    CHECK(r.at("train_s").is_number());
    CHECK(r.at("test_s_per_sample").is_number());
  }
  REQUIRE(report.at("cores").size() == 3);
  for (const char* key : {"pair", "exploration", "features", "delta", "C", "gamma"})
    CHECK(report.at("cores")[0].contains(key));
  CHECK(report.at("cores")[0].at("features")[0].at("p_value").get<double>() <= 1);
  CHECK(report.at("machine") == "test machine");
  CHECK(report.at("commit") == "abc123");
}

TEST_CASE("the page is well formed, self-contained and small") {
  const std::string page = report_html(campaign().input());
  CHECK(report_test::unbalanced(page) == "");
  CHECK(page.size() < 1'500'000);
  for (const char* word : {"<script", "http-equiv", "src=", "@import", "url(", ">nan", " nan"})
    CHECK(page.find(word) == std::string::npos);
  CHECK(count_of(page, "href=") == count_of(page, "href=\"#"));  // only links within the page
}

TEST_CASE("the page lists recorded sound and the pages of the handover") {
  Dataset set = report_test::small_campaign(1);
  const CampaignSummary run = report_test::make_summary(set);
  const auto page_of = [&] { return report_html({run, set, campaign().results, "", ""}); };
  CHECK(page_of().find("handover/") == std::string::npos);
  CHECK(page_of().find("sound 8000") == std::string::npos);
  json recipe = json::parse(set.info.recipe_json);
  recipe["hand_over"] = {{"from", "vibration"}};
  set.info.recipe_json = recipe.dump();
  set.info.sound = {8000, 160};
  CHECK(page_of().find("sound 8000.0 Hz") != std::string::npos);
  CHECK(page_of().find("handover/M1.html (sound and vibration)") != std::string::npos);
  recipe["hand_over"] = json::object();
  set.info.recipe_json = recipe.dump();
  CHECK(page_of().find("handover/M1.html (model)") != std::string::npos);
  CHECK(report_test::unbalanced(page_of()) == "");
}

TEST_CASE("every figure is marked SIMULATED") {
  const std::string page = report_html(campaign().input());
  const std::string badge = "<figcaption><span class=\"badge\">SIMULATED</span>";
  CHECK(count_of(page, "<figcaption>") >= 8);
  CHECK(count_of(page, "<figcaption>") == count_of(page, badge));
  CHECK(count_of(page, "<svg") <= count_of(page, badge));
  const std::string text = summary_text(campaign().input());
  CHECK(text.find("SIMULATED bench") != std::string::npos);
  CHECK(text.find("All values are SIMULATED.") != std::string::npos);
}

TEST_CASE("the paper's values are shown for its own task only") {
  CHECK(paper::accuracies_beside(campaign().results).empty());
  CHECK(count_of(report_html(campaign().input()), "class=\"paper-mark\"") == 0);
  std::vector<ExplorationResult> results = campaign().results;
  ExplorationResult& m1 = results.front();
  weft::classifier::Confusion& confusion = m1.reductions.front().evaluation.confusion;
  confusion.labels.assign(paper::fabrics, "fabric");
  confusion.count.assign(paper::fabrics * paper::fabrics, 1);
  CHECK(paper::accuracies_beside(results).empty());  // the paper's accuracies need more than 18
                                                     // trials
  m1.trials = paper::trials_of_exploration;
  REQUIRE(paper::accuracies_beside(results).size() == 1);
  CHECK(paper::accuracies_beside(results).front().exploration == "M1");
  m1.exploration = "M3";
  CHECK(paper::accuracies_beside(results).empty());
}

TEST_CASE("the headline is of groups of repetitions, with what naming one label would give") {
  const auto measured = measure_headlines(campaign().set, 1);
  REQUIRE(measured.has_value());
  REQUIRE(measured->size() == 1);
  const Headline& one = measured->front();
  CHECK(one.exploration == "M1");
  CHECK(one.tested == 18);
  CHECK(one.labels == 3);
  CHECK(one.base_rate == Approx(1.0 / 3));
  CHECK(one.accuracy.share == 1.0);
  CHECK(one.accuracy.ci95_low < 1.0);
  ReportInput input = campaign().input();
  input.headlines = *measured;
  const json document = json::parse(report_json(input));
  CHECK(document["headline"][0]["accuracy"] == 1.0);
  CHECK(document["headline"][0]["tested"] == 18);
  CHECK(document["other_protocols"][0]["key"] == "results");
  const std::string page = report_html(input);
  CHECK(page.find(headline_text(one)) != std::string::npos);
  // The result comes first: headline and matrix before any other picture or table.
  CHECK(page.find(headline_text(one)) < page.find("<svg"));
  CHECK(page.find("class=\"heat\"") < page.find("class=\"plot\""));
  CHECK(page.find("class=\"heat\"") < page.find("<table"));
  HandoverResult handover{"simulated", "", {{"M1", "", "", "lda", 18, 18, .5, .3, .7}}, {}};
  const auto given = handover_headlines(handover, campaign().set);
  REQUIRE(given.size() == 1);
  CHECK(given.front().accuracy.share == .5);
  CHECK(given.front().base_rate == Approx(1.0 / 3));
}

TEST_CASE("a headline lists the labels that it does not test") {
  Dataset set = campaign().set;
  const std::string lonely = set.trials.front().label;
  for (std::size_t i = 0; i < set.records.size(); ++i)
    if (set.trials[i].label == lonely && set.records[i].spec.repetition != 1)
      set.records[i].outcome = TrialOutcome::aborted;
  const auto measured = measure_headlines(set, 1);
  REQUIRE(measured.has_value());
  REQUIRE(measured->size() == 1);
  CHECK(measured->front().labels == 2);
  CHECK(measured->front().base_rate == Approx(0.5));
  CHECK(measured->front().not_tested == std::vector<std::string>{lonely});
  CHECK(headline_text(measured->front()).find(lonely) != std::string::npos);
}

TEST_CASE("one group of repetitions gives no headline") {
  Dataset set = campaign().set;
  for (TrialRecord& record : set.records) record.spec.repetition = 1;
  const auto none = measure_headlines(set, 1);  // one group: no training data remain
  REQUIRE(none.has_value());
  CHECK(none->empty());
}

TEST_CASE("an interval is shown with what it is") {
  const std::string method = campaign().results[0].find(Reduction::pvalue)->ci95.method;
  REQUIRE_FALSE(method.empty());
  const std::string page = report_html(campaign().input());
  CHECK(count_of(page, method) >= 2);  // figure and table
  const std::string text = summary_text(campaign().input());
  CHECK(text.find("+-") == std::string::npos);  // an interval limited at 100 % is not symmetric
  CHECK(text.find(": 95 % interval") != std::string::npos);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) CHECK(line.size() <= 80);
  CHECK(methods_text({{"M1 pvalue", "t"}, {"M1 pca", "t"}}) == "t");
  CHECK(methods_text({{"M1 pvalue", "t"}, {"M1 pca", "w"}, {"M2 pca", "t"}}) ==
        "t (M1 pvalue, M2 pca); w (M1 pca)");
}

TEST_CASE("a real bench is not called simulated") {
  Dataset set = campaign().set;
  set.info.kind = BenchKind::real;
  CampaignSummary run = campaign().run;
  run.bench = BenchKind::real;
  const std::string page = report_html({run, set, campaign().results, "", ""});
  CHECK(count_of(page, "SIMULATED") == 0);
  CHECK(count_of(page, "REAL BENCH") > 8);
}

TEST_CASE("a run and a data set of different benches are refused") {
  CampaignSummary run = campaign().run;
  run.bench = BenchKind::real;
  const ReportInput input{run, campaign().set, campaign().results, "", ""};
  const weft::Status refused = check(input);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().expected == "real");
  CHECK(refused.error().got == "simulated");
}

TEST_CASE("both files are written whole, and a folder that is missing is an error") {
  const auto folder = fresh_folder("whole");
  const ReportInput input = campaign().input();
  const auto write = [&](const std::filesystem::path& html) {
    return write_page(html, report_record(input), report_document(input));
  };
  REQUIRE(write(folder / "report.html").has_value());
  CHECK(report_test::file_text(folder / "report.json") == report_json(campaign().input()));
  CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 2);
  CHECK(report_test::file_text(folder / "report.html") == report_html(campaign().input()));
  CHECK_FALSE(write(folder / "none" / "report.html").has_value());
  std::filesystem::remove_all(folder);
}

TEST_CASE("names cannot inject markup or drive the terminal") {
  Dataset set = report_test::small_campaign(1);
  const std::string evil = "</title><script>alert(1)</script>\x1B[2J\xFF";
  set.info.name = set.info.software_version = evil;
  for (TrialRecord& record : set.records) record.spec.label = evil;
  CampaignSummary run = report_test::make_summary(set);
  run.level = evil;
  const ReportInput input{run, set, campaign().results, evil, evil};
  const std::string page = report_html(input);
  CHECK(page.find("<script") == std::string::npos);
  CHECK(report_test::unbalanced(page) == "");
  CHECK(summary_text(input).find('\x1B') == std::string::npos);
  CHECK(json::accept(report_json(input)));
}

TEST_CASE("a campaign that stopped early is marked, also without results") {
  Dataset set = report_test::small_campaign(1);
  CampaignSummary run = report_test::make_summary(set);
  run.trials_planned = 680;
  run.outcome = weft::recipes::Outcome::aborted;
  run.error = weft::Error{.code = weft::Errc::device, .where = "z", .what = "stage z <stalled>"};
  run.wall_s = 0;
  run.force = {};
  const std::vector<ExplorationResult> none;
  const ReportInput input{run, set, none, "", ""};
  const std::string page = report_html(input);
  CHECK(page.find("not complete:</b> 3 of 680") != std::string::npos);
  CHECK(page.find("&lt;stalled&gt;") != std::string::npos);
  CHECK(report_test::unbalanced(page) == "");
  for (const char* word : {">nan", " nan", "\"nan", "-nan"})
    CHECK(page.find(word) == std::string::npos);
  const json report = json::parse(report_json(input));
  CHECK(report.at("realtime_factor") == 0);
  CHECK(report.at("results").empty());
  CHECK(report.at("complete") == false);
  CHECK(summary_text(input).find("3 of 680, aborted") != std::string::npos);
}

TEST_CASE("every figure of an incomplete campaign states its number of trials") {
  CampaignSummary run = campaign().run;
  run.trials_planned = 20;
  run.outcome = weft::recipes::Outcome::failed;
  const ReportInput input{run, campaign().set, campaign().results, "", ""};
  const std::string page = report_html(input);
  const std::string badges =
      "<figcaption><span class=\"badge\">SIMULATED</span> "
      "<span class=\"badge\">INCOMPLETE, 18 of 20 trials</span>";
  CHECK(count_of(page, "<figcaption>") == count_of(page, badges));
  CHECK(report_test::unbalanced(page) == "");
  CHECK(summary_text(input).find("INCOMPLETE, 18 of 20 trials") != std::string::npos);
  const json report = json::parse(report_json(input));
  CHECK(report.at("complete") == false);
  CHECK(report.at("results").at("M1").at("trials") == 18);
  CHECK(report_html(campaign().input()).find("INCOMPLETE") == std::string::npos);
}

TEST_CASE("A report made afterwards states whether the files are verified") {
  VerifyReport verified;
  verified.certified = verified.finished = true;
  verified.planned = verified.complete = 18;
  verified.attempts = 19;
  CampaignSummary run = campaign().run;
  run.wall_s = 0;
  ReportInput input{run, campaign().set, campaign().results, "", ""};
  CHECK(report_html(input).find("every byte") == std::string::npos);
  input.verified = &verified;
  std::string page = report_html(input);
  CHECK(page.find("every byte") != std::string::npos);
  CHECK(page.find("18 of 18 complete, in 19 attempts") != std::string::npos);
  CHECK(page.find("\u00D7 real time") == std::string::npos);
  CHECK(page.find("all fabrics") != std::string::npos);
  verified.found_problems.push_back({"campaign.sqlite, trial <4>", "its digest is another", ""});
  page = report_html(input);
  CHECK(page.find("not verified: 1 problem") != std::string::npos);
  CHECK(page.find("trial &lt;4&gt;") != std::string::npos);
}

TEST_CASE("On paper every page has the campaign's name and its bench") {
  CampaignSummary run = campaign().run;
  run.name = "a\"b\\\n<c";
  const ReportInput input{run, campaign().set, campaign().results, "", ""};
  const std::string page = report_html(input);
  CHECK(page.find("@top-right{content:\"SIMULATED\"") != std::string::npos);
  CHECK(page.find(R"(@top-left{content:"Campaign\20 a\22 b\5c ?\3c c";)") != std::string::npos);
}

}  // namespace report_test
