// Data set and certificate of one reading equal those of two.

#include <catch2/catch.hpp>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace export_certified_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

/// Trials 0 and 2 complete, 1 failed, 3 without an end.
std::filesystem::path recorded(const TemporaryFolder& folder) {
  auto path = folder / campaign_file_name;
  auto recorder = Recorder::create(path, small_header());
  REQUIRE(recorder);
  for (std::uint32_t trial = 0; trial < 4; ++trial) {
    REQUIRE(recorder->begin_trial(small_spec(trial), at_ms(100000 * trial)));
    REQUIRE(record_samples(*recorder, trial, 40));
    if (trial == 3) break;
    REQUIRE(recorder->end_trial(trial == 1 ? TrialOutcome::failed : TrialOutcome::complete,
                                {0.05, 0.99}, at_ms(100000 * trial + 1)));
  }
  REQUIRE(recorder->commit());
  return path;
}

void execute(const std::filesystem::path& campaign, const char* sql) {
  auto database = sqlite::Database::open(campaign, sqlite::Mode::read_write);
  REQUIRE(database);
  REQUIRE(database->execute(sql));
}

}  // namespace

TEST_CASE("data set and certificate of one reading are those of two") {
  const TemporaryFolder folder;
  const auto campaign = recorded(folder);
  const auto dataset = folder / dataset_file_name;
  const auto digest = export_certified(campaign, dataset);
  REQUIRE(digest);
  const auto certificate = read_certificate(folder.path());
  REQUIRE(certificate);
  REQUIRE(*certificate);
  const auto loaded = load_campaign(campaign);
  REQUIRE(loaded);
  CHECK(*digest == dataset_sha256(*loaded));
  CHECK(*digest == write_hdf5(*loaded, folder / "alone.h5").value());
  CHECK(same_content(*read_hdf5(dataset), *loaded));
  CHECK(**certificate == certify(campaign, dataset).value());

  const auto all = load_campaign(campaign, {.all_outcomes = true});
  REQUIRE((*certificate)->trials.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    const CertifiedTrial& trial = (*certificate)->trials[i];
    CHECK(trial.name == all->trials[i].file);
    CHECK(trial.outcome == to_string(all->records[i].outcome));
    CHECK(trial.sha256 == trial_sha256(all->trials[i], all->records[i]));
  }
}

TEST_CASE("an export that fails is an error, and leaves neither data set nor certificate") {
  const TemporaryFolder folder;
  const auto campaign = recorded(folder);
  const auto dataset = folder / dataset_file_name;
  std::filesystem::create_directories(dataset / "in the way");
  const auto failed = export_certified(campaign, dataset);
  REQUIRE_FALSE(failed);
  CHECK(failed.error().code == Errc::io);
  CHECK_FALSE(std::filesystem::exists(folder / certificate_file_name));
  CHECK(std::filesystem::is_directory(dataset));
}

TEST_CASE(
    "damage of a trial that is not for training keeps the certificate away, not the data set") {
  const TemporaryFolder folder;
  const auto campaign = recorded(folder);
  const auto dataset = folder / dataset_file_name;
  const std::string whole = dataset_sha256(load_campaign(campaign).value());
  execute(campaign, "UPDATE chunk SET crc32 = crc32 + 1 WHERE trial = 2");
  const auto failed = export_certified(campaign, dataset);
  REQUIRE_FALSE(failed);
  CHECK(failed.error().code == Errc::corrupt);
  CHECK_FALSE(std::filesystem::exists(folder / certificate_file_name));
  CHECK(dataset_sha256(read_hdf5(dataset).value()) == whole);
}

TEST_CASE("of a discarded campaign no data set is made") {
  const TemporaryFolder folder;
  const auto campaign = recorded(folder);
  execute(campaign, "INSERT INTO journal (t_ns, kind, payload_json) VALUES (0, 'discarded', '{}')");
  const auto refused = export_certified(campaign, folder / dataset_file_name);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  CHECK_FALSE(std::filesystem::exists(folder / dataset_file_name));
  CHECK_FALSE(std::filesystem::exists(folder / certificate_file_name));
}

}  // namespace export_certified_test
