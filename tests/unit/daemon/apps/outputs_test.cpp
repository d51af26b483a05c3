// No output replaces a record or a file of another program.

#include <catch2/catch.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/pages/document/document.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace outputs_test {

using namespace weft;
using namespace weft::daemon;
using test::read_file;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;
using test::write_file;

namespace {

struct Ran {
  int status;
  std::string reported;
};

Ran weft(const std::vector<std::string>& arguments) {
  std::vector<const char*> raw{"weft"};
  for (const std::string& one : arguments) raw.push_back(one.c_str());
  std::ostringstream out, err;
  cli::Console console{out, err};
  const int status = cli::run(static_cast<int>(raw.size()), raw.data(), console);
  return {status, out.str() + err.str()};
}

void refuses(const std::vector<std::string>& arguments, const std::string& words) {
  const Ran ran = weft(arguments);
  INFO(ran.reported);
  CHECK(ran.status == cli::exit_failure);
  CHECK(ran.reported.find(words) != std::string::npos);
}

CampaignSummary recorded(const TemporaryFolder& folder) {
  auto request = request_in(folder, short_recipe("denim"));
  request.error_check = false;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  return *summary;
}

}  // namespace

TEST_CASE("no output replaces a campaign file or a certificate, under whatever name") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path(), certificate = out / certificate_file_name;
  write_file(folder / "a.csv", "t_s,ch1\n0,1\n1,2\n");
  write_file(folder / "m.csv", "file,label\na.csv,x\n");
  const std::string manifest = folder / "m.csv", campaign = s.campaign_file, file = certificate;
  refuses({"dataset", "import", manifest, "-o", campaign}, "the recording of a campaign");
  refuses({"dataset", "export", campaign, "-o", file}, "the certificate of a campaign");
  refuses({"imprint", "scene", "-o", file}, "the certificate of a campaign");
  std::filesystem::copy_file(s.campaign_file, folder / "mine.bin");
  std::filesystem::copy_file(certificate, folder / "mine.txt");
  std::filesystem::create_symlink(s.campaign_file, folder / "link.h5");
  for (const char* name : {"mine.bin", "link.h5"})
    refuses({"features", s.dataset_file, "-o", folder / name}, "the recording of a campaign");
  refuses({"features", s.dataset_file, "-o", folder / "mine.txt"}, "the certificate of a campaign");
  CHECK(verify(out)->holds());
  CHECK(verify(out)->certified);
  // Without a certificate, verify would accept any file in its place.
  std::filesystem::remove(certificate);
  refuses({"features", s.dataset_file, "-o", file}, "the certificate of a campaign");
  const Ran other = weft({"dataset", "export", campaign, "-o", folder / "certificate.json"});
  INFO(other.reported);
  CHECK(other.status == cli::exit_ok);
}

TEST_CASE("a report's JSON document replaces an older one, and no other file") {
  const TemporaryFolder folder;
  const CampaignSummary s = recorded(folder);
  const auto out = s.campaign_file.parent_path();
  const auto report = [&](const std::filesystem::path& page) {
    return std::vector<std::string>{"report", out, "-o", page, "--no-trade", "--repeats", "1"};
  };
  const std::string recipe = short_recipe("denim");
  for (const std::string& others : {recipe, std::string("no JSON"), std::string("[]")}) {
    write_file(folder / "mine.json", others);
    refuses(report(folder / "mine.html"), "mine.json");
    CHECK(read_file(folder / "mine.json") == others);
  }
  refuses(report(out / "certificate.html"), "the certificate of a campaign");
  CHECK(verify(out)->certified);
  for (int i = 0; i < 2; ++i) {
    const Ran ran = weft(report(folder / "page.html"));
    INFO(ran.reported);
    CHECK(ran.status == cli::exit_ok);
    CHECK(read_file(folder / "page.json").starts_with("{"));
  }
  const std::string page = read_file(folder / "page.html");
  const Ran again = weft({"report", "--from", folder / "page.json", "-o", folder / "again.html"});
  INFO(again.reported);
  CHECK(again.status == cli::exit_ok);
  CHECK(read_file(folder / "again.html") == page);
  std::filesystem::remove(folder / "page.html");
  CHECK(weft({"report", "--from", folder / "page.json"}).status == cli::exit_ok);
  CHECK(read_file(folder / "page.html") == page);
  refuses({"report", "--from", folder / "mine.json", "-o", folder / "x.html"}, "mine.json");
  refuses({"report", "--from", folder / "page.json", "-o", folder / "page.json"}, "page.json");
  refuses({"report", out, "--from", folder / "page.json"}, "FOLDER or --from");
  refuses({"report", out}, "-o PAGE.html");
}

TEST_CASE("xdg-open shows a page, and its absence is an error") {
  const TemporaryFolder folder;
  Document document{"test", "title"};
  REQUIRE(write_page(folder / "page.html", nlohmann::ordered_json::object(), document));
  const std::string path = std::getenv("PATH");
  const std::vector<std::string> command{"report", "--from", folder / "page.json", "--open"};
  ::setenv("PATH", (folder / "").c_str(), 1);
  refuses(command, "xdg-open");
  write_file(folder / "xdg-open", "#!/bin/sh\necho \"$1\" > \"$0.log\"\n");
  std::filesystem::permissions(folder / "xdg-open", std::filesystem::perms::owner_all);
  CHECK(weft(command).status == cli::exit_ok);
  CHECK(read_file(folder / "xdg-open.log") == (folder / "page.html").string() + "\n");
  write_file(folder / "xdg-open", "#!/bin/sh\nexit 3\n");
  refuses(command, "--open: ");
  ::setenv("PATH", path.c_str(), 1);
}

}  // namespace outputs_test
