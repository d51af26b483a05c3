// The state of an export after its run is resumed. SIMULATED.

#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "daemon/campaign/resume.hpp"
#include "daemon/storage/certificate/exports.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace export_check_test {

using namespace weft;
using namespace weft::daemon;
using test::TemporaryFolder;

namespace {

/// A campaign with some recorded trials, interrupted by the death of its process.
CampaignRequest interrupted(const TemporaryFolder& folder) {
  CampaignRequest request = test::request_in(folder, test::tiny_recipe(2));
  request.error_check = false;
  REQUIRE(test::killed_at(request, {.write = 10, .after_trials = 2}) == true);
  return request;
}

void resume_recording(CampaignRequest request) {
  request.resume = true;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
}

VerifyReport verified(const std::filesystem::path& folder) {
  auto report = verify(folder);
  if (!report) FAIL(to_string(report.error()));
  return std::move(*report);
}

CheckedExport only_export(const std::filesystem::path& folder) {
  const VerifyReport report = verified(folder);
  CHECK(report.holds());
  REQUIRE(report.exports.size() == 1);
  const auto now = exports_now(folder);
  REQUIRE(now);
  CHECK(now->front().state == report.exports.front().state);
  return report.exports.front();
}

}  // namespace

TEST_CASE("an export of an interrupted run is outdated once the run was resumed") {
  const TemporaryFolder folder;
  const CampaignRequest request = interrupted(folder);
  CHECK(verified(request.out).exports.empty());
  const auto partial = export_campaign(request.out, {});
  REQUIRE(partial);
  CHECK(partial->trials < partial->planned);
  CHECK(only_export(request.out).state == ExportState::current);
  resume_recording(request);
  const CheckedExport then = only_export(request.out);
  CHECK(then.state == ExportState::outdated);
  CHECK(then.name == "export/dataset.h5");
  CHECK(then.trials == partial->trials);
  CHECK(then.done_now == 4);
  REQUIRE(export_campaign(request.out, {}));
  const CheckedExport anew = only_export(request.out);
  CHECK(anew.state == ExportState::current);
  CHECK(anew.trials == 4);
}

TEST_CASE("an export that was altered is found, and one that was removed is no damage") {
  const TemporaryFolder folder;
  const CampaignRequest request = interrupted(folder);
  const auto made = export_campaign(request.out, {ExportFormat::features_csv, "M1"});
  if (!made) FAIL(to_string(made.error()));
  const std::filesystem::path file = request.out / export_folder_name / made->name;
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(static_cast<std::streamoff>(made->bytes / 2));
    bytes.put('#');
  }
  const VerifyReport report = verified(request.out);
  REQUIRE(report.found_problems.size() == 1);
  CHECK(report.found_problems.front().where == "export/" + made->name);
  CHECK(report.found_problems.front().what.starts_with("altered"));
  CHECK(report.exports.front().state == ExportState::altered);
  std::filesystem::remove(file);
  CHECK(only_export(request.out).state == ExportState::missing);
  std::ofstream(request.out / export_folder_name / export_list_name) << "[]";
  CHECK(verified(request.out).found_problems.front().where == "export/list.json");
}

TEST_CASE("an export that is stopped leaves the older one, and the list, as they were") {
  const TemporaryFolder folder;
  const CampaignRequest request = interrupted(folder);
  REQUIRE(export_campaign(request.out, {}));
  resume_recording(request);  // so that the next export is another file
  int requested = 0;
  ExportRequest counted;
  counted.stop_requested = [&requested] { return ++requested > 1'000'000; };
  {
    const TemporaryFolder beside;
    std::filesystem::copy(request.out, beside / "run", std::filesystem::copy_options::recursive);
    REQUIRE(export_campaign(beside / "run", counted));
  }
  const int in_all = requested;
  REQUIRE(in_all > 1);
  for (int stop_at = 1; stop_at <= in_all; ++stop_at) {
    requested = 0;
    ExportRequest cut;
    cut.stop_requested = [&requested, stop_at] { return ++requested == stop_at; };
    CHECK_FALSE(export_campaign(request.out, cut));
    CHECK(only_export(request.out).state == ExportState::outdated);
  }
}

TEST_CASE("an export with a list that cannot be written leaves no digest of another file") {
  const TemporaryFolder folder;
  const CampaignRequest request = interrupted(folder);
  REQUIRE(export_campaign(request.out, {}));
  resume_recording(request);
  const std::filesystem::path in_the_way =
      request.out / export_folder_name /
      (std::string(export_list_name) + ".partial-" + std::to_string(::getpid()));
  std::filesystem::create_directory(in_the_way);
  CHECK_FALSE(export_campaign(request.out, {}));
  CHECK(only_export(request.out).state == ExportState::outdated);
  std::filesystem::remove(in_the_way);
  REQUIRE(export_campaign(request.out, {}));
  CHECK(only_export(request.out).state == ExportState::current);
}

TEST_CASE("an export of a campaign that was discarded later is reported as such") {
  const TemporaryFolder folder;
  const CampaignRequest request = interrupted(folder);
  REQUIRE(export_campaign(request.out, {}));
  REQUIRE(discard_campaign(request.out, "ada"));
  CHECK(only_export(request.out).state == ExportState::discarded);
}

}  // namespace export_check_test
