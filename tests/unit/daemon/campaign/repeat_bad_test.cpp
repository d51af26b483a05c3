// Rejected attempts are found, kept apart and repeated. SIMULATED.

#include <catch2/catch.hpp>

#include "daemon/campaign/attempt_quality.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace repeat_bad_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

namespace {

constexpr double check_rate_hz = 40, check_force_rate_hz = 100;

recipes::RepeatBad take_limits() {
  recipes::RepeatBad out;
  out.at_most = 1;
  return out;
}

/// A hundred frames of four taxels; `count` gives taxel 2's.
AttemptQualityCheck frames_of(const std::function<std::uint16_t(int)>& count,
                              std::uint32_t lost_before_each = 0) {
  AttemptQualityCheck quality_check(take_limits(), check_rate_hz, check_force_rate_hz);
  quality_check.begin();
  for (int i = 0; i < 100; ++i) {
    const auto noisy = static_cast<std::uint16_t>(1000 + i % 3);
    const std::array<std::uint16_t, 4> counts{noisy, noisy, count(i), noisy};
    Sample sample;
    sample.lost = lost_before_each;
    sample.host = TimePoint(from_seconds(i / check_rate_hz));
    TaxelSample frame;
    frame.counts = counts;
    sample.value = frame;
    quality_check.check(sample);
  }
  return quality_check;
}

std::uint16_t live_count(int i) {
  return static_cast<std::uint16_t>(500 + i % 2);
}

std::string error_text_of(const AttemptQualityCheck& quality_check, double in_band = 1) {
  const auto bad = quality_check.verdict(in_band);
  return bad ? bad->where + ": " + bad->what : "";
}

/// Two fabrics, two repetitions; the taxel driver's own watch is off, so only the attempt check
/// finds faults.
CampaignRequest checked_request(const TemporaryFolder& folder, const json& faults,
                                int at_most = 2) {
  json recipe = json::parse(test::tiny_recipe(2));
  recipe["repeat_bad"] = {{"at_most", at_most}};
  json rig = test::bench17();
  test::device_of(rig, "taxels")["config"]["watch_s"] = 0;
  if (!faults.empty()) rig["simulation"]["faults"] = faults;
  CampaignRequest request = request_in(folder, recipe.dump(), rig);
  request.error_check = false;
  return request;
}

CampaignSummary run_checked(const CampaignRequest& request) {
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

Dataset evaluated_dataset(const CampaignRequest& request, bool all = false) {
  auto dataset = load_campaign(request.out / "campaign.sqlite", {.all_outcomes = all});
  if (!dataset) FAIL(to_string(dataset.error()));
  return std::move(*dataset);
}

/// A dead pad during the first attempt of trial 1, which works again before the second.
const json& dead_in_trial_1() {
  static const json faults = [] {
    const TemporaryFolder folder;
    const CampaignRequest request = checked_request(folder, {});
    run_checked(request);
    const std::vector<std::int64_t> t_ns = evaluated_dataset(request).records.at(1).t_ns;
    const double from_s = static_cast<double>(t_ns.front()) * 1e-9 - 0.1;
    const double length_s = static_cast<double>(t_ns.back()) * 1e-9 - from_s + 0.1;
    json rig = test::bench17();
    return json::array({{{"device", test::device_of(rig, "taxels")["name"]},
                         {"fault", "dead_pad"},
                         {"start_s", from_s},
                         {"duration_s", length_s}}});
  }();
  return faults;
}

std::map<std::uint32_t, std::vector<TrialOutcome>> outcomes_of(const Dataset& all) {
  std::map<std::uint32_t, std::vector<TrialOutcome>> out;
  for (const TrialRecord& record : all.records) out[record.spec.index].push_back(record.outcome);
  return out;
}

}  // namespace

TEST_CASE("an attempt is bad with lost samples, a dead or full taxel, or force outside the band") {
  CHECK(error_text_of(frames_of(live_count)) == "");
  const auto dead = [](int i) { return i < 39 ? std::uint16_t{7} : live_count(i); };
  CHECK(error_text_of(frames_of(dead)) == "");  // 39 of 40 frames
  CHECK(error_text_of(frames_of([&](int i) {
          return i < 40 ? std::uint16_t{7} : live_count(i);
        })).starts_with("taxel 3: taxel value "));
  const auto full = [](int frames) {
    return [frames](int i) { return i % 50 < frames ? std::uint16_t{0xFFFF} : live_count(i); };
  };
  CHECK(error_text_of(frames_of(full(1))) == "taxel 3: taxel saturated");
  CHECK(error_text_of(
            frames_of([](int i) { return i == 9 ? std::uint16_t{0xFFFF} : live_count(i); })) == "");
  CHECK(error_text_of(frames_of(live_count, 1)).starts_with(": taxel frames "));
  CHECK(error_text_of(frames_of(live_count), 0.81) == "");
  CHECK(error_text_of(frames_of(live_count), 0.79).starts_with("while it was held: force "));
}

TEST_CASE("lost force readings make an attempt bad, also those missing at the end of a phase") {
  AttemptQualityCheck quality_check = frames_of(live_count);
  Sample reading;
  reading.value = WrenchSample{};
  for (int i = 0; i < 200; ++i) {
    reading.host = TimePoint(from_seconds(i / check_force_rate_hz));
    quality_check.check(reading);
  }
  CHECK(error_text_of(quality_check) == "");
  AttemptQualityCheck torn = quality_check;
  reading.lost = 3;  // 3 of 204
  torn.check(reading);
  CHECK(error_text_of(torn).starts_with(": force readings "));
  // The last frame came at 2.475 s, the last reading at 1.99 s.
  const auto paused = [](AttemptQualityCheck at, double now_s) {
    at.pause(TimePoint(from_seconds(now_s)));
    return error_text_of(at);
  };
  CHECK(paused(quality_check, 2.07) == "");
  CHECK(paused(quality_check, 2.2).starts_with(": force readings "));
  const AttemptQualityCheck frames_alone = frames_of(live_count);
  CHECK(paused(frames_alone, 2.55) == "");
  CHECK(paused(frames_alone, 2.6).starts_with(": taxel frames "));
  // The recording continues at 2.5 s: data that come late or not at all are lost.
  const auto resumed = [&](double first_s, double now_s) {
    AttemptQualityCheck at = frames_alone;
    at.resume(TimePoint(from_seconds(2.5)));
    Sample late;
    late.host = TimePoint(from_seconds(first_s));
    TaxelSample frame;
    const std::array<std::uint16_t, 4> counts{1, 2, 3, 4};
    frame.counts = counts;
    late.value = frame;
    if (first_s > 0) at.check(late);
    return paused(at, now_s);
  };
  CHECK(resumed(2.55, 2.6) == "");
  CHECK(resumed(3.5, 3.55).starts_with(": taxel frames "));
  CHECK(resumed(0, 3.5).starts_with(": taxel frames "));
  quality_check.begin();
  CHECK(paused(quality_check, 9) == "");  // of another attempt
}

TEST_CASE(
    "a repetition with a dead pad is kept as rejected and taken again; the data set is whole") {
  const TemporaryFolder folder;
  const CampaignRequest request = checked_request(folder, dead_in_trial_1());
  const CampaignSummary summary = run_checked(request);
  CHECK(summary.outcome == recipes::Outcome::complete);
  CHECK(summary.trials_complete == 4);
  CHECK(summary.attempts_rejected == 1);
  const Dataset all = evaluated_dataset(request, true);
  CHECK(outcomes_of(all).at(1) == std::vector{TrialOutcome::rejected, TrialOutcome::complete});
  CHECK(all.trials.at(1).samples() > 40);  // the rejected attempt is kept
  const auto exported = read_hdf5(summary.dataset_file);
  REQUIRE(exported);
  REQUIRE(exported->records.size() == 4);
  for (const TrialRecord& record : exported->records)
    CHECK(record.outcome == TrialOutcome::complete);
  CHECK(exported->records[1].spec.attempt == 1);
  CHECK(verify(request.out)->holds());
  const auto journal = load_journal(summary.campaign_file);
  REQUIRE(journal);
  CHECK(std::count_if(journal->begin(), journal->end(), [](const JournalEntry& line) {
          return line.kind == "take_rejected" &&
                 line.payload_json.find("taxel 6") != std::string::npos;
        }) == 1);
}

TEST_CASE("a pad that stays dead fails the trial after the attempts that the recipe allows") {
  const TemporaryFolder folder;
  json faults = dead_in_trial_1();
  faults[0].erase("duration_s");
  CampaignRequest request = checked_request(folder, faults, 1);
  CHECK(run_checked(request).outcome == recipes::Outcome::failed);
  const std::vector failed{TrialOutcome::rejected, TrialOutcome::failed};
  CHECK(outcomes_of(evaluated_dataset(request, true)).at(1) == failed);
  // When resumed, it gets one more attempt.
  request.resume = true;
  CHECK(run_checked(request).outcome == recipes::Outcome::failed);
  const std::vector once_more{TrialOutcome::rejected, TrialOutcome::failed, TrialOutcome::failed};
  CHECK(outcomes_of(evaluated_dataset(request, true)).at(1) == once_more);
}

TEST_CASE("a kill before, in or after a bad attempt changes neither data nor number of attempts") {
  const TemporaryFolder whole;
  const CampaignRequest untouched = checked_request(whole, dead_in_trial_1());
  run_checked(untouched);
  const Dataset expected = evaluated_dataset(untouched);
  int killed = 0;
  for (std::uint64_t write = 20;; write += 9) {
    const TemporaryFolder folder;
    CampaignRequest request = checked_request(folder, dead_in_trial_1());
    const auto died = test::killed_at(request, {write, false});
    REQUIRE(died);
    if (!*died) break;
    ++killed;
    INFO("write " << write);
    request.resume = true;
    const CampaignSummary summary = run_checked(request);
    CHECK(summary.outcome == recipes::Outcome::complete);
    CHECK(summary.attempts_rejected == 1);
    CHECK(test::difference(expected, evaluated_dataset(request)) == "");
    std::size_t rejected = 0;
    for (const TrialRecord& record : evaluated_dataset(request, true).records)
      rejected += record.outcome == TrialOutcome::rejected ? 1 : 0;
    CHECK(rejected == 1);
    CHECK(verify(request.out)->holds());
  }
  CHECK(killed > 5);
}

}  // namespace repeat_bad_test
