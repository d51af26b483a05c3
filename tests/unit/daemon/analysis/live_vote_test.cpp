// Live votes of a campaign on the simulated bench, in virtual time. SIMULATED.

#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/answer_timing.hpp"
#include "tests/unit/daemon/analysis/tradeoff_fixture.hpp"
#include "tests/unit/daemon/benches/live_bench.hpp"

namespace live_vote_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::live_test;
using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

namespace {

std::map<Phase, int> samples_of(const classifier::Trial& trial) {
  std::map<Phase, int> out;
  for (const Phase phase : trial.phase) ++out[phase];
  return out;
}

}  // namespace

TEST_CASE("a slide ends once its vote is sure, is marked, and is in no data set of whole ones") {
  LiveBench bench;
  bench.query(stop_early());
  std::vector<LiveVoteUpdate> votes;
  CampaignHooks hooks;
  hooks.vote = [&](const LiveVoteUpdate& vote) { votes.push_back(vote); };
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
    // certain after at least one second of the four of the path
    CHECK(samples[Phase::motion] >= 37);
    CHECK(samples[Phase::motion] < 3 * 37);
    CHECK(samples[Phase::end] == Approx(18.5).margin(2));
    CHECK(samples[Phase::press] == Approx(18.5).margin(2));
  }
  REQUIRE_FALSE(votes.empty());
  CHECK(votes.back().ends_slide);
  for (const LiveVoteUpdate& vote : votes) {
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
  bench.query({{"model", "m1.model"}});
  int votes = 0;
  CampaignHooks hooks;
  hooks.vote = [&](const LiveVoteUpdate& vote) {
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
  const auto contains = [&](const std::string& words) {
    const std::string refusal = bench.refusal();
    INFO(refusal);
    CHECK(refusal.find("/explorations/M") != std::string::npos);
    CHECK(refusal.find(words) != std::string::npos);
  };
  bench.query({{"model", "missing.model"}});
  contains("missing.model");
  test::write_file(bench.folder / "text.model", "not a model");
  bench.query({{"model", "text.model"}});
  contains("expected weft-model 1");
  bench.query(stop_early());
  CHECK(bench.refusal() == "none");
  const auto size = std::filesystem::file_size(bench.folder / "m1.model");
  std::filesystem::resize_file(bench.folder / "m1.model", (std::uintmax_t{1} << 28) + 1);
  contains("268435457 bytes");
  std::filesystem::resize_file(bench.folder / "m1.model", size);
  bench.change_rig([](json& rig) { test::device_of(rig, "taxels")["config"]["taxels"] = 8; });
  contains("expected 8 taxels");
  bench.change_rig([](json&) {});
  const auto faster = [](double factor) {
    return [factor](auto& model) {
      model.sample_rate_hz *= factor;
      for (auto& stage : model.stages) stage.model.setup.sample_period_s /= factor;
    };
  };
  bench.change(faster(1.02));
  contains(" Hz (expected");
  bench.change(faster(1.005));
  CHECK(bench.refusal() == "none");
  json other = recipe_of(1);
  other["explorations"]["M9"] = other["explorations"]["M1"];
  other["explorations"].erase("M1");
  other["explorations"]["M9"]["live_vote"] = stop_early();
  test::write_file(bench.request.recipe, other.dump());
  contains("M1 (expected M9)");
}

TEST_CASE(
    "slides are not ended by a model that is never sure, nor by one of another kind of bench") {
  LiveBench bench;
  const auto with_bench = [](std::string_view name) {
    return [name](auto& model) {
      for (auto& stage : model.stages) stage.model.provenance.bench = name;
    };
  };
  bench.query(stop_early());
  bench.change([](auto& model) { model.stages.back().model.postprocessing.reset(); });
  CHECK(bench.refusal(false).find("--live") != std::string::npos);
  bench.change(with_bench("real"));
  CHECK(bench.refusal().find("real") != std::string::npos);
  bench.change(with_bench("unknown"));
  CHECK(bench.refusal() == "none");
  bench.change({});
  bench.change_rig([](json& rig) {
    rig["bench"] = "real";
    for (json& device : rig["devices"])
      device["link"] = {{"kind", "tcp"}, {"host", "127.0.0.1"}, {"port", 7101}};
  });
  CHECK(bench.refusal().find("simulated") != std::string::npos);
  bench.query({{"model", "m1.model"}});  // votes, but does not end strokes
  CHECK(bench.refusal() == "none");
  bench.change_rig([](json&) {});
  bench.change(with_bench("real"));
  CampaignHooks hooks;
  std::string reported;
  hooks.vote = [&](const LiveVoteUpdate& vote) { reported = vote.model_bench; };
  run(bench.request, hooks);
  CHECK(reported == "real");
}

TEST_CASE("a live model may have 256 MiB, and not a byte more") {
  CHECK(check_live_model_size(std::uintmax_t{1} << 28));
  const Status refused = check_live_model_size((std::uintmax_t{1} << 28) + 1);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().got == "268435457 bytes");
  CHECK_FALSE(refused.error().hint.empty());
}

TEST_CASE("a model that is broken behind its head is found out before the rig is taken") {
  LiveBench bench;
  bench.query(stop_early());
  const std::string good = test::read_file(bench.folder / "m1.model");
  test::write_file(bench.folder / "m1.model", good.substr(0, good.size() / 2));
  CHECK(bench.refusal(false).find("incomplete") != std::string::npos);
  bool taken = false;
  CampaignHooks hooks;
  hooks.rig_acquired = [&] {
    taken = true;
    return Status{};
  };
  CHECK_FALSE(run_campaign(bench.request, hooks));
  CHECK_FALSE(taken);
}

TEST_CASE("a campaign is not resumed with another model than it was started with") {
  LiveBench bench;
  bench.query(stop_early());
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
  CHECK(other.error().what.find("model") != std::string::npos);
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
    const EarlyStops ends = evaluate_rule(*watched, {sure, 0.5});
    CHECK(ends.tested == tested);
    CHECK(ends.right <= ends.stopped);  // at the end no vote is right here
    CHECK(ends.slide_s >= before_s);
    before_s = ends.slide_s;
    if (sure > 1) CHECK(ends.stopped == 0);
  }
  CHECK(before_s == Approx(10.0 * static_cast<double>(tested)));
  CHECK(evaluate_rule(*watched, {0.5, 0.5}).stopped > tested / 2);
  CHECK(evaluate_rule(*watched, {0.5, 4}).slide_s >= 4.0 * static_cast<double>(tested));
}

}  // namespace live_vote_test
