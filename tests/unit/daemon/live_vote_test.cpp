// Live votes of a campaign on the simulated bench, in virtual time. SIMULATED.

#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "classifier/live/staged_model.hpp"
#include "daemon/dataset/hdf5_file.hpp"
#include "daemon/trade/early_stop.hpp"
#include "tests/unit/daemon/trade_fixture.hpp"
#include "tests/unit/daemon/trial_bench.hpp"

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

namespace {

/// Two cloths that anybody tells apart, slides of 16 mm at 4 mm/s.
json recipe_of(int repetitions) {
  return json::parse(R"({"schema_version":1,"name":"live","source":"test","seed":3,
    "fabrics":["pile","nylon"],"repetitions":)" +
                     std::to_string(repetitions) + R"(,"explorations":{"M1":{"phases":[
      {"phase":"S","duration_s":0.5},{"phase":"P","force_N":5,"duration_s":0.5},
      {"phase":"M","speed_mm_s":4,"path":[{"dx_mm":0,"dy_mm":16}]},
      {"phase":"E","duration_s":0.5}]}}})");
}

CampaignSummary run(const CampaignRequest& request, const CampaignHooks& hooks = {}) {
  const Result<CampaignSummary> summary = run_campaign(request, hooks);
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

Dataset recorded(const std::filesystem::path& campaign) {
  auto all = load_campaign(campaign, {.all_outcomes = true, .streams = false, .transfers = false});
  REQUIRE(all);
  return *std::move(all);
}

std::string model_text(const Dataset& dataset) {
  classifier::StagedOptions options;
  options.learner = classifier::Learner::lda;
  options.exploration = "M1";
  options.provenance.bench = "simulated";
  const auto model = classifier::train_staged(dataset.trials, dataset.info.taxel_rate_hz, options);
  if (!model) FAIL(to_string(model.error()));
  std::ostringstream out;
  REQUIRE(classifier::save_staged(*model, out));
  return out.str();
}

/// A model from one campaign, beside the recipe of the next.
struct LiveBench {
  TemporaryFolder folder;
  CampaignRequest request;
  LiveBench() {
    request = request_in(folder, recipe_of(4).dump());
    request.error_check = false;
    const CampaignSummary first = run(request);
    test::write_file(folder / "m1.model", model_text(recorded(first.campaign_file)));
  }
  void ask(const json& vote) {
    json recipe = recipe_of(1);
    recipe["explorations"]["M1"]["live_vote"] = vote;
    test::write_file(request.recipe, recipe.dump());
    request.out = folder / "live";
  }
};

const json stop_early{{"model", "m1.model"},
                      {"stop_early", {{"sure_probability", 0.8}, {"least_slide_s", 1}}}};

std::map<Phase, int> samples_of(const classifier::Trial& trial) {
  std::map<Phase, int> out;
  for (const Phase phase : trial.phase) ++out[phase];
  return out;
}

}  // namespace

TEST_CASE("a slide ends once its vote is sure, is marked, and is in no data set of whole ones") {
  LiveBench bench;
  bench.ask(stop_early);
  std::vector<VoteMoment> votes;
  CampaignHooks hooks;
  hooks.vote = [&](const VoteMoment& vote) { votes.push_back(vote); };
  const CampaignSummary s = run(bench.request, hooks);
  INFO((s.error ? to_string(*s.error) : std::string("no error")));
  CHECK(s.outcome == recipes::Outcome::complete);
  CHECK(s.rig == recipes::RigFact::safe);
  CHECK(s.trials_complete == 2);
  REQUIRE(s.trials_ended_early == 2);
  CHECK(s.dataset_file.empty());
  const Dataset all = recorded(s.campaign_file);
  REQUIRE(all.trials.size() == 2);
  CHECK(complete_trials(all).empty());
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(all.records[i].outcome == TrialOutcome::ended_early);
    auto samples = samples_of(all.trials[i]);
    // sure after one second at least, of four that the path takes
    CHECK(samples[Phase::motion] >= 37);
    CHECK(samples[Phase::motion] < 3 * 37);
    CHECK(samples[Phase::end] == Approx(18.5).margin(2));
    CHECK(samples[Phase::press] == Approx(18.5).margin(2));
  }
  REQUIRE_FALSE(votes.empty());
  CHECK(votes.back().ends_slide);
  for (const VoteMoment& vote : votes) {
    CHECK(vote.probability.size() == 2);
    if (vote.ends_slide) CHECK(vote.winner == vote.fabric);
  }
  const auto journal = load_journal(s.campaign_file);
  REQUIRE(journal);
  const auto lines = [&](std::string_view kind) {
    return std::count_if(journal->begin(), journal->end(),
                         [&](const JournalEntry& line) { return line.kind == kind; });
  };
  CHECK(lines("slide_ends_early") == 2);
  CHECK(lines("live_models") == 1);
}

TEST_CASE("a vote that ends nothing leaves the campaign as it is without one") {
  LiveBench bench;
  bench.ask({{"model", "m1.model"}});
  int votes = 0;
  CampaignHooks hooks;
  hooks.vote = [&](const VoteMoment& vote) {
    ++votes;
    CHECK_FALSE(vote.ends_slide);
  };
  const CampaignSummary voted = run(bench.request, hooks);
  CHECK(voted.trials_ended_early == 0);
  CHECK(votes == 2 * 5);  // after 0.5, 1, 2, 3 and 4 s of both
  const TemporaryFolder other;
  CampaignRequest plain = request_in(other, recipe_of(1).dump());
  plain.error_check = false;
  CHECK(run(plain).dataset_sha256 == voted.dataset_sha256);
}

TEST_CASE("a model that does not fit the recipe is refused before anything moves") {
  LiveBench bench;
  const auto refused = [&](const json& vote) {
    bench.ask(vote);
    const auto checked = check_request(bench.request);
    REQUIRE_FALSE(checked);
    CHECK(to_string(checked.error()).find("live_vote") != std::string::npos);
    return to_string(checked.error());
  };
  refused({{"model", "missing.model"}});
  test::write_file(bench.folder / "text.model", "not a model");
  refused({{"model", "text.model"}});
  json other = recipe_of(1);
  other["explorations"]["M9"] = other["explorations"]["M1"];
  other["explorations"].erase("M1");
  other["explorations"]["M9"]["live_vote"] = stop_early;
  test::write_file(bench.request.recipe, other.dump());
  const auto checked = check_request(bench.request);
  REQUIRE_FALSE(checked);
  CHECK(to_string(checked.error()).find("another exploration") != std::string::npos);
}

TEST_CASE("a campaign is not gone on with by another model than it was begun with") {
  LiveBench bench;
  bench.ask(stop_early);
  CampaignHooks hooks;
  RunOrders orders;
  hooks.orders = &orders;
  hooks.progress = [&](const TrialProgress&) { orders.give({Order::abort, "test"}); };
  const CampaignSummary cut = run(bench.request, hooks);
  REQUIRE(cut.trials_complete < 2);
  const std::string good = test::read_file(bench.folder / "m1.model");
  bench.request.resume = true;
  test::write_file(bench.folder / "m1.model",
                   model_text(recorded(bench.folder / "out" / "campaign.sqlite")));
  const Dataset first = recorded(bench.folder / "out" / "campaign.sqlite");
  Dataset less = first;
  less.trials.pop_back();
  less.records.pop_back();
  test::write_file(bench.folder / "m1.model", model_text(less));
  const auto other = run_campaign(bench.request, {});
  REQUIRE_FALSE(other);
  CHECK(to_string(other.error()).find("another model") != std::string::npos);
  test::write_file(bench.folder / "m1.model", good);
  const CampaignSummary whole = run(bench.request);
  CHECK(whole.trials_complete == 2);
  CHECK(whole.trials_ended_early == 2);
}

TEST_CASE("a surer rule never lets a slide end sooner, and none ends what is never sure") {
  const Dataset set = trade_test::campaign_set(6);
  const auto material = prepare(set, {"M1", 0, {}, 1});
  REQUIRE(material);
  auto splits = classifier::stratified_splits(material->features.labels, 0.5, 1, 1);
  REQUIRE(splits);
  classifier::StagedOptions how;
  how.learner = classifier::Learner::lda;
  how.training.threads = 1;
  const auto watched = watch_slides(set, *material, splits->front(), how,
                                    [](std::size_t) { return Result<std::size_t>(99); });
  if (!watched) FAIL(to_string(watched.error()));
  const std::size_t tested = splits->front().test.size();
  double before_s = 0;
  for (const double sure : {0.5, 0.7, 0.9, 0.99, 0.9999, 2.0}) {
    const EarlyStops ends = judge(*watched, {sure, 0.5});
    CHECK(ends.tested == tested);
    CHECK(ends.right <= ends.stopped);  // at the end nobody is right here
    CHECK(ends.slide_s >= before_s);
    before_s = ends.slide_s;
    if (sure > 1) CHECK(ends.stopped == 0);
  }
  CHECK(before_s == Approx(10.0 * static_cast<double>(tested)));
  CHECK(judge(*watched, {0.5, 0.5}).stopped > tested / 2);
  CHECK(judge(*watched, {0.5, 4}).slide_s >= 4.0 * static_cast<double>(tested));
}
