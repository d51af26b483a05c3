// Downloads of a run's files: exactly the listed contents are sent.

#include "daemon/service/methods/data_files.hpp"

#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/service/methods/services.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace data_files_test {

using namespace weft;
using namespace weft::daemon;
using daemon::api::DataFiles;
using nlohmann::json;
using test::TemporaryFolder;

namespace {

namespace fs = std::filesystem;

const std::string data_text(3'000'000, 'd');

/// The lists of a certified run with a handover.
struct ListedRun {
  TemporaryFolder folder;
  fs::path run = folder / "R-000001";
  ListedRun() {
    fs::create_directory(run);
    test::write_file(run / "dataset.h5", data_text);
    certify(data_text);
    nlohmann::ordered_json evaluation{
        {"bench", "simulated"}, {"dataset_sha256", "x"}, {"models", json::array()}};
    REQUIRE(write_handover(run, evaluation, {{"M1.model", "a model"}}));
  }
  void certify(const std::string& text) const {
    Certificate certificate;
    FileChecksums print;
    print.name = "dataset.h5";
    print.bytes = text.size();
    print.sha256 = sha256_hex(text);
    certificate.files.push_back(print);
    test::write_file(run / "certificate.json", to_json(certificate));
  }
};

std::vector<std::string> names_of(DataFiles& files, const fs::path& run) {
  const auto listed = files.list(run);
  if (!listed) FAIL(to_string(listed.error()));
  std::vector<std::string> out;
  for (const api::DataFile& file : *listed) out.push_back(file.name);
  return out;
}

std::string format_text(const OpenFile& file) {
  std::string text(file.stamp().value().bytes, ' ');
  REQUIRE(file.read(0, {reinterpret_cast<std::uint8_t*>(text.data()), text.size()}));
  return text;
}

/// The files as a daemon sees them some time after the run, when their times are older than a tick.
DataFiles later() {
  return DataFiles([] { return utc_now() + std::chrono::hours(1); });
}

}  // namespace

TEST_CASE("a model too large to be read again is not handed over, and what was stays") {
  const ListedRun listed;
  const nlohmann::ordered_json evaluation{
      {"bench", "simulated"}, {"dataset_sha256", "x"}, {"models", json::array()}};
  const std::string large((std::size_t{1} << 28) + 1, 'm');
  const auto refused = write_handover(listed.run, evaluation, {{"M1.model", large}});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().where == "M1.model");
  CHECK(test::read_file(listed.run / "handover/M1.model") == "a model");
  CHECK(read_handover(listed.run));
}

TEST_CASE("Only files that the lists name are opened") {
  const ListedRun there;
  DataFiles files(utc_now);
  CHECK(names_of(files, there.run) == std::vector<std::string>{"certificate.json", "dataset.h5",
                                                               "handover/M1.model",
                                                               "handover/evaluation.json"});
  for (const std::string& name : names_of(files, there.run)) {
    INFO(name);
    const auto served = files.open(there.run, name);
    REQUIRE(served);
    CHECK(sha256_hex(format_text(*served->file)) == served->sha256);
  }
  for (const char* name : {"", ".", "handover", "../R-000001/dataset.h5", "campaign.sqlite"})
    CHECK(files.open(there.run, name).error().code == Errc::not_found);
  CHECK(files.list(there.folder / "R-000002").error().code == Errc::not_found);
}

TEST_CASE("A file that was altered is not given out, whatever its length and its time of writing") {
  const ListedRun there;
  const fs::path file = there.run / "dataset.h5";
  DataFiles files = later();
  REQUIRE(files.open(there.run, "dataset.h5"));  // its digest is cached
  const auto written = fs::last_write_time(file);
  std::string altered = data_text;
  altered[altered.size() / 2] ^= 1;
  test::write_file(file, altered);
  fs::last_write_time(file, written);
  const auto refused = files.open(there.run, "dataset.h5");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  CHECK(refused.error().expected == sha256_hex(data_text));
  test::write_file(file, data_text.substr(1));
  CHECK(files.open(there.run, "dataset.h5").error().code == Errc::wrong_state);
  test::write_file(file, data_text);
  CHECK(files.open(there.run, "dataset.h5"));
  fs::remove(file);
  CHECK(files.open(there.run, "dataset.h5").error().code == Errc::wrong_state);
}

TEST_CASE("Lists are read and files hashed once, until they are written to") {
  const ListedRun there;
  DataFiles at_once(utc_now);
  REQUIRE(at_once.open(there.run, "dataset.h5"));
  REQUIRE(at_once.open(there.run, "dataset.h5"));
  CHECK(at_once.work().files_hashed == 2);  // too new: a write within the same tick would not show
  DataFiles files = later();
  for (int i = 0; i < 5; ++i) REQUIRE(files.open(there.run, "dataset.h5"));
  CHECK(files.work().lists_read == 1);
  CHECK(files.work().files_hashed == 1);
  test::write_file(there.run / "dataset.h5", data_text + "more");
  there.certify(data_text + "more");
  const auto served = files.open(there.run, "dataset.h5");
  REQUIRE(served);
  CHECK(served->sha256 == sha256_hex(data_text + "more"));
  fs::remove_all(there.run / "handover");
  CHECK(names_of(files, there.run) == std::vector<std::string>{"certificate.json", "dataset.h5"});
}

TEST_CASE("No symbolic link leads to a file that is given out") {
  const ListedRun there;
  DataFiles files(utc_now);
  const fs::path elsewhere = there.folder / "elsewhere";
  const auto refused = [&](const std::string& name) {
    const auto served = files.open(there.run, name);
    return !served && served.error().code == Errc::wrong_state;
  };
  fs::rename(there.run / "handover", elsewhere);
  fs::create_symlink(elsewhere, there.run / "handover");
  CHECK(refused("handover/M1.model"));
  fs::remove(there.run / "handover");
  fs::rename(elsewhere, there.run / "handover");
  CHECK(files.open(there.run, "handover/M1.model"));
  fs::rename(there.run / "dataset.h5", elsewhere);
  fs::create_symlink(elsewhere, there.run / "dataset.h5");
  CHECK(refused("dataset.h5"));
  fs::remove(there.run / "dataset.h5");
  REQUIRE(mkfifo((there.run / "dataset.h5").c_str(), 0600) == 0);
  CHECK(refused("dataset.h5"));  // and it does not wait for a writer
}

TEST_CASE("A file is opened beneath its folder alike, all at once and step by step") {
  const ListedRun there;
  fs::create_symlink(there.run, there.folder / "link");
  fs::create_symlink("/etc/hostname", there.run / "outside");
  for (const OpenFile::Way way : {OpenFile::Way::at_once, OpenFile::Way::step_by_step}) {
    INFO(static_cast<int>(way));
    const auto opened = [&](const char* name) {
      return OpenFile::beneath(there.folder.path(), name, way);
    };
    const auto file = opened("R-000001/dataset.h5");
    REQUIRE(file);
    CHECK(format_text(*file) == data_text);
    std::uint8_t byte = 0;
    CHECK_FALSE(file->read(data_text.size(), {&byte, 1}));
    for (const char* name : {"link/dataset.h5", "R-000001/outside", "../R-000001/dataset.h5",
                             "R-000001/../../x", "/etc/hostname", "R-000001", "nothing", ""}) {
      INFO(name);
      CHECK_FALSE(opened(name));
    }
  }
}

TEST_CASE("A run's files are listed by an errand: its certificate may have megabytes") {
  const TemporaryFolder folder;
  test::RunManagerBench bench(folder, test::tiny_recipe(1));
  const runs::RunView run = bench.ended(bench.submit().stored.id());
  DataFiles files(utc_now);
  api::Services services;
  services.run_manager = bench.manager.get();
  services.files = &files;
  std::function<api::Services::Report()> background;
  services.file_background = [&](std::function<api::Services::Report()> work, const auto&) {
    background = std::move(work);
    return true;
  };
  rpc::Methods methods;
  api::add_data_methods(methods, services);
  std::optional<rpc::Outcome> reply;
  const json params{{"run", run.stored.id()}};
  const rpc::Caller caller;
  methods.find("data.get").value()->handler({params, caller}, [&](auto out) { reply = out; });
  CHECK_FALSE(reply);
  REQUIRE(background);
  const auto report = background();
  CHECK_FALSE(reply);
  report();
  REQUIRE(reply);
  CHECK(json::parse(reply->value())["files"].size() == 3);
  CHECK(files.work().lists_read == 1);

  const auto verified = [&] {
    reply.reset();
    background = {};
    methods.find("data.verify").value()->handler({params, caller}, [&](auto out) { reply = out; });
    CHECK_FALSE(reply);
    background()();
    return json::parse(reply->value());
  };
  CHECK(verified()["certified"] == true);
  CHECK(verified()["findings"].empty());
  std::string whole = test::read_file(run.stored.folder / "dataset.h5");
  whole[whole.size() / 2] ^= 1;
  test::write_file(run.stored.folder / "dataset.h5", whole);
  CHECK(verified()["holds"] == false);
  CHECK(verified()["findings"][0]["where"] == "dataset.h5");
  whole[whole.size() / 2] ^= 1;
  test::write_file(run.stored.folder / "dataset.h5", whole);
  std::optional<Result<server::ServedFile>> served;
  const auto reported = [&](const Result<server::ServedFile>& file) { served = file; };
  api::open_served_file(services, run.stored.id() + "/dataset.h5", reported);
  CHECK_FALSE(served);
  background()();
  REQUIRE(served);
  CHECK(served->value().sha256.size() == 64);
  services.file_background = [](const auto&, const auto&) { return false; };
  api::open_served_file(services, run.stored.id() + "/dataset.h5", reported);
  CHECK(served->error().code == Errc::timeout);
}

}  // namespace data_files_test
