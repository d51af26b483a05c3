// A killed campaign is resumed: no complete trial is lost or recorded twice, at most one repetition
// is repeated, and the data set equals that of an undisturbed run. SIMULATED.

#include "daemon/campaign/resume.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/benches/resumed_campaign.hpp"

namespace resume_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::check_holds;
using test::check_whole;
using test::killed_at;
using test::KillPoint;
using test::loaded;
using test::request_for;
using test::resumed;
using test::run;
using test::stopped_after_two;
using test::TemporaryFolder;

namespace {

/// One killed run: checks the file as it is, then resumes it. False if nothing was killed.
bool survives(KillPoint point) {
  const TemporaryFolder folder;
  const CampaignRequest request = request_for(folder, 1);
  INFO("write " << point.write << (point.torn ? ", torn" : ""));
  const test::ReportedTrials reported;
  const auto killed = killed_at(request, point, reported.hooks());
  REQUIRE(killed);
  if (!*killed) return false;
  const auto file = request.out / "campaign.sqlite";
  std::size_t saved = 0;
  if (std::filesystem::exists(file)) {
    check_holds(file);
    if (!is_blank_campaign(file)) saved = loaded(file).trials.size();
  }
  CHECK(saved >= reported.complete());
  resumed(request);
  check_whole(request.out, 1, 1);
  return true;
}

/// The file records the program that began a campaign and the one that resumed it.
void check_software(const std::filesystem::path& file) {
  CHECK(loaded(file).info.software_version == software_version());
  const auto journal = load_journal(file);
  REQUIRE(journal);
  const auto on_progress =
      std::find_if(journal->begin(), journal->end(),
                   [](const JournalEntry& line) { return line.kind == "resumed"; });
  REQUIRE(on_progress != journal->end());
  CHECK(json::parse(on_progress->payload_json).at("software_version") == software_version());
}

}  // namespace

TEST_CASE("a campaign killed at any one of its writes goes on to the data of an undisturbed run") {
  const std::uint64_t step = test::writes_between_kills();
  std::uint64_t write = 1;
  for (; survives({write, false}); write += step) survives({write, true});
  WARN("SIMULATED, " << write - 1 << " writes, the process killed at each or, by day, each third");
  CHECK(write > 30);
}

TEST_CASE("a resume that is killed too is resumed") {
  for (const std::uint64_t second : {1U, 3U, 8U, 15U, 30U}) {
    const TemporaryFolder folder;
    CampaignRequest request = request_for(folder);
    INFO("second kill at write " << second);
    REQUIRE(killed_at(request, {40, false}) == true);
    request.resume = true;
    REQUIRE(killed_at(request, {second, false}) == true);
    if (std::filesystem::exists(request.out / "campaign.sqlite"))
      check_holds(request.out / "campaign.sqlite");
    resumed(request);
    check_whole(request.out, 2);
  }
}

TEST_CASE("a preview of a resume lists the remaining steps and changes nothing") {
  const TemporaryFolder folder;
  const CampaignRequest request = request_for(folder);
  CHECK(stopped_after_two(request).trials_complete == 2);
  const std::string before = test::read_file(request.out / "campaign.sqlite");
  const auto preview = preview_resume(request);
  REQUIRE(preview);
  CHECK(preview->complete == 2);
  CHECK(preview->left == 2);
  std::string words;
  for (const std::string& step : preview->will) words += step + "\n";
  INFO(words);
  CHECK(words.find("trial 3 (satin, M1, repetition 1)") != std::string::npos);
  CHECK(words.find("mount satin") != std::string::npos);
  CHECK(test::read_file(request.out / "campaign.sqlite") == before);
  resumed(request);
  check_whole(request.out, 1);
  check_software(request.out / "campaign.sqlite");
  const auto again = preview_resume(request);
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::wrong_state);
  CHECK(again.error().where.ends_with("campaign.sqlite"));
}

TEST_CASE("a resume that is stopped before what is left changes nothing, and can be resumed") {
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder);
  CHECK(stopped_after_two(request).trials_complete == 2);
  const auto file = request.out / "campaign.sqlite";
  const std::string before = test::read_file(file);
  CampaignHooks hooks;
  std::atomic<bool> stop = false;
  hooks.stop = &stop;
  hooks.progress = [&](const TrialProgress& line) { stop = line.done == 1; };
  request.resume = true;
  const auto stopped = run_campaign(request, hooks);
  REQUIRE(stopped);
  REQUIRE(stopped->dataset_error);
  CHECK(stopped->trials_complete == 2);
  CHECK(stopped->rig == recipes::RigFact::safe);
  CHECK(stopped->dataset_error->code == Errc::wrong_state);
  CHECK(stopped->dataset_error->where.ends_with("resume"));
  CHECK((test::read_file(file) == before));
  CHECK_FALSE(std::filesystem::exists(file.string() + "-wal"));
  check_holds(request.out);
  CHECK(verify(request.out)->certified);
  CHECK(preview_resume(request)->left == 2);
  resumed(request);
  check_whole(request.out, 1);
}

TEST_CASE("a resume refuses another recipe, rig or seed, a bench of another past, and damage") {
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder);
  REQUIRE(killed_at(request, {40, false}) == true);
  request.resume = true;
  const auto refused = [&](const std::string& why) {
    const std::string before = test::read_file(request.out / "campaign.sqlite");
    const auto result = run_campaign(request, {});
    REQUIRE_FALSE(result);
    INFO(to_string(result.error()));
    CHECK(to_string(result.error()).find(why) != std::string::npos);
    CHECK(test::read_file(request.out / "campaign.sqlite") == before);
  };
  const std::string recipe = test::read_file(request.recipe);
  json other_recipe = json::parse(recipe);
  other_recipe["name"] = "other";
  test::write_file(request.recipe, other_recipe.dump());
  refused("another recipe");
  refused("/name: \"other\", recorded " + json::parse(recipe)["name"].dump());
  json longer = json::parse(recipe);
  longer["fabrics"].push_back("silk");
  test::write_file(request.recipe, longer.dump());
  refused("/fabrics/-: \"silk\", recorded nothing");
  test::write_file(request.recipe, recipe);
  request.seed = 8;
  refused("another seed");
  request.seed.reset();
  const std::string rig = test::read_file(request.rig);
  json other = json::parse(rig);
  test::device_of(other, "x")["emulator"]["serial"] = 45999999;
  test::write_file(request.rig, other.dump(2));
  refused("another rig");
  refused("/devices/0/emulator/serial: 45999999, recorded 45000001");
  test::write_file(request.rig, rig);
  request.resume = false;
  refused("already exists");
  test::write_file(request.recipe, json::parse(recipe).dump(7));  // the same content
  test::write_file(request.rig, json::parse(rig).dump());
  resumed(request);
  check_whole(request.out, 1);
}

TEST_CASE("a resume that only writes data set and certificate claims nothing of the rig") {
  const TemporaryFolder folder;
  const CampaignRequest request = request_for(folder);
  run(request);
  std::filesystem::remove(request.out / certificate_file_name);
  const CampaignSummary summary = resumed(request);
  CHECK(summary.outcome == recipes::Outcome::complete);
  CHECK(summary.cleanup == recipes::Cleanup::skipped);
  CHECK(summary.rig == recipes::RigFact::unknown);
  check_whole(request.out, 0);
}

TEST_CASE("a campaign with a failed trial from before a resume is not complete after it") {
  const TemporaryFolder folder;
  const CampaignRequest request = request_for(folder);
  stopped_after_two(request);
  {
    // As after a pause, so that the past is not replayed and the engine begins with trial 2.
    auto file = sqlite::Database::open(request.out / "campaign.sqlite", sqlite::Mode::read_write);
    REQUIRE(file);
    REQUIRE(
        file->execute("UPDATE trial SET outcome = 'failed' WHERE plan_index = 0;"
                      "INSERT INTO journal (t_ns, kind, payload_json) VALUES "
                      "(0, 'order', '{\"order\":\"pause\"}')"));
  }
  std::filesystem::remove(request.out / certificate_file_name);
  const CampaignSummary summary = resumed(request);
  CHECK(summary.trials_complete == 3);
  CHECK(summary.outcome == recipes::Outcome::failed);
  CHECK(summary.cleanup == recipes::Cleanup::done);
}

TEST_CASE(
    "while a campaign goes on, no data set from before lies beside it as if it were its own") {
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder);
  const std::string before = test::read_file(stopped_after_two(request).dataset_file);
  request.resume = true;
  REQUIRE(killed_at(request, {12, false}) == true);
  CHECK_FALSE(std::filesystem::exists(request.out / certificate_file_name));
  CHECK_FALSE(std::filesystem::exists(request.out / "dataset.h5"));
  CHECK(test::read_file(request.out / "dataset.aside-1.h5") == before);
  resumed(request);
  check_whole(request.out, 2);
}

TEST_CASE("a resumed campaign that lost its log reports it") {
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder, 4);
  const auto file = stopped_after_two(request).campaign_file;
  request.resume = true;
  REQUIRE(killed_at(request, {60, false}) == true);
  REQUIRE(loaded(file).trials.size() > 2);
  CHECK(std::filesystem::remove(file.string() + "-wal"));
  std::filesystem::remove(file.string() + "-shm");
  const auto report = verify(request.out);
  REQUIRE(report);
  CHECK_FALSE(report->holds());
}

TEST_CASE("a folder with a removed campaign file is not started anew by a resume") {
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder);
  const CampaignSummary whole = run(request);
  const std::string dataset = test::read_file(whole.dataset_file);
  request.resume = true;
  for (const char* left : {"", "nothing"}) {
    std::filesystem::remove(whole.campaign_file);
    if (*left == 0) test::write_file(whole.campaign_file, "");
    const auto refused = run_campaign(request, {});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::corrupt);
    CHECK(test::read_file(whole.dataset_file) == dataset);
    CHECK(std::filesystem::exists(request.out / certificate_file_name));
  }
}

TEST_CASE("two runs do not work in one folder") {
  const TemporaryFolder folder;
  const CampaignRequest request = request_for(folder);
  {
    const auto held = prepare_folder(request.out, 0);
    REQUIRE(held);
    const auto result = run_campaign(request, {});
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Errc::busy);
  }
  CHECK(run(request).trials_complete == 4);
}

}  // namespace resume_test
