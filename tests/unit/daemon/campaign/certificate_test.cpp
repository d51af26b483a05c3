// `weft verify`: finds a flipped bit anywhere in a campaign's files and reports its place.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"
#include "tests/unit/daemon/storage/hdf5_poke.hpp"

namespace certificate_test {

using namespace weft;
using namespace weft::daemon;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;

namespace {

CampaignSummary recorded(const TemporaryFolder& folder) {
  auto request = request_in(folder, short_recipe("denim"));
  request.error_check = false;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

VerifyReport verified(const std::filesystem::path& path) {
  const auto report = verify(path);
  if (!report) FAIL(to_string(report.error()));
  return *report;
}

std::string format_report(const VerifyReport& report) {
  std::string words;
  for (const VerifyProblem& diagnosis : report.found_problems)
    words += diagnosis.where + ": " + diagnosis.what + "\n";
  return words;
}

bool has_finding(const VerifyReport& report, const std::string& what) {
  return format_report(report).find(what) != std::string::npos;
}

}  // namespace

TEST_CASE("a campaign as it was recorded holds, by its folder and by each of its files") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  for (const auto& path : {out, s.campaign_file, s.dataset_file}) {
    const VerifyReport report = verified(path);
    INFO(format_report(report));
    CHECK(report.holds());
    CHECK(report.certified);
  }
  const VerifyReport report = verified(out);
  CHECK(report.finished);
  CHECK(report.complete == 2);
  CHECK(report.dataset_sha256 == s.dataset_sha256);
  const auto certificate = read_certificate(out);
  REQUIRE(certificate);
  REQUIRE(*certificate);
  CHECK((*certificate)->devices.size() == 7);
  CHECK((*certificate)->dataset_sha256 == s.dataset_sha256);
  CHECK(certificate_from_json(to_json(**certificate)).value() == **certificate);
}

TEST_CASE("one flipped bit is found wherever in the files of a campaign it lies") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  for (const auto& file : {s.campaign_file, s.dataset_file, out / certificate_file_name}) {
    const std::string whole = test::read_file(file);
    std::size_t bit = 3;
    for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 61) {
      std::string bent = whole;
      bent[at] = static_cast<char>(bent[at] ^ 1 << bit);
      bit = (bit + 5) % 8;
      test::write_file(file, bent);
      INFO(file << " byte " << at);
      const VerifyReport report = verified(out);
      CHECK_FALSE(report.holds());
      CHECK(has_finding(report, file.filename().string()));
    }
    test::write_file(file, whole);
  }
  CHECK(verified(out).holds());
}

TEST_CASE("damage is reported by trial, stream and chunk, or by table, without a certificate too") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  const auto change = [&](const char* sql) {
    auto database = sqlite::Database::open(s.campaign_file, sqlite::Mode::create);
    REQUIRE(database);
    REQUIRE(database->execute(sql));
  };
  const std::string whole = test::read_file(s.campaign_file);
  change(
      "UPDATE chunk SET data = zeroblob(length(data)) WHERE trial = 2 AND stream = 1 AND number = "
      "0");
  CHECK(has_finding(verified(out), "trial 1 (denim, attempt 0), wrench chunk 0: altered"));
  std::filesystem::rename(out / certificate_file_name, out / "aside");
  CHECK(has_finding(verified(out), "trial 1 (denim, attempt 0), wrench chunk 0: altered"));
  CHECK_FALSE(verified(out).certified);
  std::filesystem::rename(out / "aside", out / certificate_file_name);
  test::write_file(s.campaign_file, whole);
  change("UPDATE trial SET label = 'satin' WHERE id = 1");
  CHECK(has_finding(verified(out), "trial 0000-denim-M1-r01: row"));
  test::write_file(s.campaign_file, whole);
  change("UPDATE journal SET payload_json = '{}' WHERE sequence = 1");
  CHECK(has_finding(verified(out), "table journal: row"));
  test::write_file(s.campaign_file, whole);
  CHECK(verified(out).holds());
}

TEST_CASE("a damaged data set names its trials, and its bytes differ from the certified ones") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  test::flip_stored_bit(s.dataset_file, "/taxel/counts", 0);
  const VerifyReport report = verified(out);
  INFO(format_report(report));
  CHECK(has_finding(report, "dataset.h5: altered"));
  CHECK(has_finding(report, "/taxel/counts of trials 0000-denim-M1-r01, 0001-denim-M2-r01: "));
}

TEST_CASE("a certificate with checksums of blocks, as version 1 had them, is read") {
  const TemporaryFolder folder;
  const auto out = recorded(folder).campaign_file.parent_path();
  auto old = nlohmann::json::parse(test::read_file(out / certificate_file_name));
  old.erase("certificate_sha256");
  old["version"] = 1;
  for (auto& file : old["files"]) {
    file["block_bytes"] = 16384;
    file["block_crc32"] = "0123abcd4567ef89";
    file["regions"] = nlohmann::json::array({{0, 32768, "table chunk"}});
  }
  old["certificate_sha256"] = sha256_hex(old.dump());
  test::write_file(out / certificate_file_name, old.dump(1));
  const VerifyReport report = verified(out);
  INFO(format_report(report));
  CHECK(report.holds());
  CHECK(report.certified);
}

TEST_CASE("a page of the database that is gone is a sentence and not a crash") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  const std::string whole = test::read_file(s.campaign_file);
  constexpr std::size_t page = 16384;
  for (const char filling : {'\0', '\xFF', 'x'})
    for (std::size_t at = 0; at + page <= whole.size(); at += page) {
      std::string bent = whole;
      std::fill_n(bent.begin() + static_cast<std::ptrdiff_t>(at), page, filling);
      test::write_file(s.campaign_file, bent);
      INFO("page " << at / page + 1);
      CHECK(has_finding(verified(out), ": altered"));
      static_cast<void>(load_campaign(s.campaign_file, {.all_outcomes = true}));
    }
  test::write_file(s.campaign_file, whole.substr(0, whole.size() / 2));
  CHECK(has_finding(verified(out), std::to_string(whole.size()) + " bytes"));
  test::write_file(s.campaign_file, "");
  CHECK_FALSE(verified(out).holds());
}

TEST_CASE("a certified file that is missing is found, and one that was never certified too") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  for (const auto& file : {s.campaign_file, s.dataset_file}) {
    std::filesystem::rename(file, out / "aside");
    const VerifyReport report = verified(out);
    CHECK_FALSE(report.certified);
    CHECK(has_finding(report, file.filename().string() + ": missing"));
    std::filesystem::rename(out / "aside", file);
  }
  CHECK(verified(out).certified);
  auto certificate = read_certificate(out);
  REQUIRE(certificate);
  std::swap((*certificate)->files.front(), (*certificate)->files.back());
  (*certificate)->files.pop_back();
  for (const auto& listed : {s.dataset_file, s.campaign_file}) {
    test::write_file(out / certificate_file_name, to_json(**certificate));
    const VerifyReport report = verified(out);
    CHECK_FALSE(report.certified);
    const auto& other = listed == s.dataset_file ? s.campaign_file : s.dataset_file;
    CHECK(has_finding(report, other.filename().string() + ": not in "));
    (*certificate)->files = {file_checksums(s.campaign_file).value()};
  }
}

TEST_CASE("recipe and rig in a data set have their SHA-256") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto dataset = read_hdf5(s.dataset_file);
  REQUIRE(dataset);
  const auto other = folder / "other.h5";
  const auto with = [&](auto change) {
    Dataset altered = *dataset;
    change(altered.info);
    REQUIRE(write_hdf5(altered, other));
    return verified(other);
  };
  CHECK(with([](DatasetInfo&) {}).holds());
  CHECK(has_finding(with([](DatasetInfo& info) { info.recipe_json += " "; }),
                    "other.h5: /provenance: recipe"));
  CHECK(has_finding(with([](DatasetInfo& info) { info.rig_json += " "; }),
                    "other.h5: /provenance: rig"));
}

TEST_CASE("a certificate is all of its file") {
  const TemporaryFolder folder;
  const auto out = recorded(folder).campaign_file.parent_path();
  const std::string whole = test::read_file(out / certificate_file_name);
  test::write_file(out / certificate_file_name, whole + std::string("\0{}", 3));
  CHECK(has_finding(verified(out), "zero byte"));
}

TEST_CASE("what never was a campaign is refused") {
  const TemporaryFolder folder;
  CHECK(verify(folder / "none").error().code == Errc::not_found);
  CHECK(verify((folder / "x").parent_path()).error().code == Errc::not_found);
  test::write_file(folder / "text", "not a data set");
  CHECK_FALSE(verified(folder / "text").holds());
}

}  // namespace certificate_test
