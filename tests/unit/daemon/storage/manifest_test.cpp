#include <catch2/catch.hpp>
#include <clocale>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace manifest_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

constexpr const char* good_trial = "t_s,phase,ch1,ch2\n0,S,1,2\n0.025,P,3,4\n0.05,M,5,6.5\n";

Error import_error(const TemporaryFolder& folder) {
  const auto dataset = import_manifest(folder / "m.csv");
  REQUIRE_FALSE(dataset);
  return dataset.error();
}

/// True if the message has a word that belongs to the case.
bool is_about(std::string_view word, const Error& error) {
  return error.what.find(word) != std::string::npos;
}

/// The error for a set with `trial` as its only trial file.
Error trial_error(const std::string& trial) {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label,group\na.csv,Silk,0\n");
  write_file(folder / "a.csv", trial);
  Error error = import_error(folder);
  const std::string prefix = (folder / "m.csv").string() + ":2: " + (folder / "a.csv").string();
  INFO(to_string(error));
  CHECK(error.where.starts_with(prefix));
  error.where = error.where.substr(std::min(error.where.size(), prefix.size()));
  return error;
}

Error manifest_error(const std::string& manifest) {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", manifest);
  write_file(folder / "a.csv", good_trial);
  Error error = import_error(folder);
  const std::string prefix = (folder / "m.csv").string();
  CHECK(error.where.starts_with(prefix));
  error.where = error.where.substr(prefix.size());
  return error;
}

}  // namespace

TEST_CASE("a manifest's trials come in its order, with labels, groups, phases, times and counts") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "sub");
  write_file(folder / "m.csv",
             "group, label ,file\r\n2,\"Silk, raw \"\"A\"\"\",sub/b.csv\r\n\r\n1,Wool,a.csv\r\n  ");
  write_file(folder / "sub" / "b.csv",
             "\xEF\xBB\xBF"
             "ch2,t_s,ch1\n20,-1.5,10\n21,-1.25,-1e-3\n");
  write_file(folder / "a.csv", good_trial);
  const auto dataset = import_manifest(folder / "m.csv");
  REQUIRE(dataset);
  REQUIRE(check(*dataset));
  REQUIRE(dataset->trials.size() == 2);
  CHECK(dataset->info.kind == BenchKind::unknown);
  CHECK(dataset->info.source == "manifest");

  const classifier::Trial& first = dataset->trials[0];
  CHECK(first.file == "sub/b.csv");
  CHECK(first.label == "Silk, raw \"A\"");
  CHECK(first.group == "2");
  CHECK(first.counts == std::vector<double>{10, 20, -1e-3, 21});
  CHECK(first.phase == std::vector<Phase>{Phase::motion, Phase::motion});
  CHECK(dataset->records[0].t_ns == std::vector<std::int64_t>{-1500000000, -1250000000});

  const classifier::Trial& second = dataset->trials[1];
  CHECK(second.phase == std::vector<Phase>{Phase::rest, Phase::press, Phase::motion});
  CHECK(second.counts == std::vector<double>{1, 2, 3, 4, 5, 6.5});
  CHECK(dataset->info.taxel_rate_hz == Approx(3 / 0.3));  // three intervals in 0.25 s + 0.05 s
}

TEST_CASE("a manifest states the place of a trial on its fabric, and the data set keeps it") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv",
             "file,label,piece,mounting,patch\na.csv,Wool,2,3,4\nb.csv,Wool,1,1,1\n");
  write_file(folder / "a.csv", good_trial);
  write_file(folder / "b.csv", good_trial);
  const auto dataset = import_manifest(folder / "m.csv");
  REQUIRE(dataset);
  CHECK(dataset->records[0].spec.place == TrialPlace{2, 3, 4});
  REQUIRE(write_hdf5(*dataset, folder / "m.h5"));
  const auto again = read_hdf5(folder / "m.h5");
  REQUIRE(again);
  CHECK(again->records[0].spec.place == TrialPlace{2, 3, 4});
  CHECK(again->records[1].spec.place == TrialPlace{1, 1, 1});
}

TEST_CASE("an imported set becomes an HDF5 file's worth of content without a group column") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,Silk\n");
  write_file(folder / "a.csv", good_trial);
  const auto dataset = import_manifest(folder / "m.csv");
  REQUIRE(dataset);
  CHECK(dataset->trials[0].group.empty());
  CHECK(check(*dataset));
}

TEST_CASE("numbers are read the same whatever the locale") {
  const char* before = std::setlocale(LC_ALL, nullptr);
  const std::string saved = before;
  std::setlocale(LC_ALL, "de_DE.UTF-8");  // has a decimal comma, if installed
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,Silk\n");
  write_file(folder / "a.csv", good_trial);
  const auto dataset = import_manifest(folder / "m.csv");
  std::setlocale(LC_ALL, saved.c_str());
  REQUIRE(dataset);
  CHECK(dataset->trials[0].counts[5] == 6.5);
}

TEST_CASE("a trial file cut anywhere in its last line is refused with the line") {
  // "0.1,3,41" cut after "4" would still be a number, but another one.
  for (const char* cut : {"0", "0.1", "0.1,3", "0.1,3,", "0.1,3,4", "0.1,3,41"}) {
    const Error error = trial_error(std::string("t_s,ch1,ch2\n0,1,2\n") + cut);
    CHECK(error.code == Errc::parse);
    CHECK(error.what.find("truncated") != std::string::npos);
    CHECK(error.where == ":3");
    CHECK_FALSE(error.hint.empty());
  }
  CHECK(trial_error("t_s,ch1").where == ":1");
}

TEST_CASE("a manifest cut in its last line is refused with the line") {
  for (const char* cut : {"a.csv,Sil", "a.csv,Silk", "a"}) {
    const Error error = manifest_error(std::string("file,label\na.csv,Silk\n") + cut);
    CHECK(error.what.find("truncated") != std::string::npos);
    CHECK(error.where == ":3");
  }
}

TEST_CASE("NaN, infinity, text and empty fields in a trial are refused with line and column") {
  for (const char* bad : {"nan", "NaN", "inf", "-inf", "1.5x", "0x10", "", "1 2"}) {
    const Error error = trial_error(std::string("t_s,ch1,ch2\n0,1,2\n1,3,") + bad + "\n");
    CHECK(error.code == Errc::parse);
    CHECK(error.where == ":3 column ch2");
    CHECK(error.got == std::string("'").append(bad).append("'"));
  }
  for (const char* bad : {"1e999", "-1e400", "1e-400"}) {
    const Error error = trial_error(std::string("t_s,ch1,ch2\n0,1,2\n1,3,") + bad + "\n");
    CHECK(error.expected.find("1.8e308") != std::string::npos);
    CHECK(error.where == ":3 column ch2");
  }
  CHECK(trial_error("t_s,ch1\nnan,1\n").where == ":2 column t_s");
  for (const char* far : {"1e300", "1.7e12", "-4.6e9"}) {  // as milliseconds since 1970
    const Error error = trial_error(std::string("t_s,ch1\n") + far + ",1\n");
    CHECK(error.where == ":2 column t_s");
    CHECK(error.expected.find("142") != std::string::npos);
  }
}

TEST_CASE("a trial's columns must be known, unique and complete") {
  CHECK(is_about("'force'", trial_error("t_s,ch1,force\n0,1,2\n")));
  CHECK(is_about("'ch01'", trial_error("t_s,ch1,ch01\n0,1,2\n")));
  CHECK(is_about("'ch0'", trial_error("t_s,ch1,ch0\n0,1,2\n")));
  CHECK(is_about("column ch2", trial_error("t_s,ch1,ch3\n0,1,2\n")));
  CHECK(is_about("column ch1", trial_error("t_s,ch99999999999\n0,1\n")));
  CHECK(is_about("column ch1", trial_error("t_s,phase\n0,M\n")));
  CHECK(is_about("column t_s", trial_error("ch1,ch2\n0,1\n")));
  CHECK(trial_error("t_s,ch1,ch1\n0,1,1\n").got == "'ch1'");
}

TEST_CASE("a trial's lines must be whole, in time order and of known phases") {
  const Error longer = trial_error("t_s,ch1\n0,1\n1,2,3\n");
  CHECK(longer.where == ":3");
  CHECK(longer.expected == "2");
  CHECK(longer.got == "3");
  const Error shorter = trial_error("t_s,ch1\n0\n1,2\n");
  CHECK(shorter.where == ":2");
  CHECK(shorter.expected == "2");
  CHECK(shorter.got == "1");
  CHECK(trial_error("t_s,ch1\n1,1\n0.5,2\n").what == "time decreases");
  CHECK(trial_error("t_s,phase,ch1\n1,Q,1\n").got == "'Q'");
  CHECK(trial_error("t_s,phase,ch1\n1,MM,1\n").what == "unknown phase");
  CHECK(is_about("no samples", trial_error("t_s,ch1\n")));
  CHECK(trial_error("").what == "file empty");
  CHECK(is_about("zero byte", trial_error(std::string("t_s,ch1\n0,1\0\n", 13))));
}

TEST_CASE("huge lines and huge headers are refused, not swallowed") {
  CHECK(trial_error("t_s,ch1\n0," + std::string(2000000, '1') + "\n").got == "2000002 bytes");
  std::string commas(100000, ',');
  CHECK(is_about("columns", trial_error(commas += '\n')));
}

TEST_CASE("a missing file of a manifest is reported with its name and line") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,Silk\nmissing.csv,Wool\n");
  write_file(folder / "a.csv", good_trial);
  const Error error = import_error(folder);
  CHECK(error.code == Errc::not_found);
  CHECK(error.where == (folder / "m.csv").string() + ":3: " + (folder / "missing.csv").string());
  CHECK(import_manifest(folder / "no.csv").error().code == Errc::not_found);
}

TEST_CASE("a manifest's columns and lines must make sense") {
  CHECK(manifest_error("").what == "file empty");
  CHECK(is_about("no trials", manifest_error("file,label\n")));
  CHECK(manifest_error("file,label,piece\na.csv,Silk,0\n").got == "0");
  CHECK(manifest_error("file,label,mounting\na.csv,Silk,1.5\n").got == "1.5");
  CHECK(is_about("column label", manifest_error("file,group\na.csv,0\n")));
  CHECK(is_about("column file", manifest_error("label\nSilk\n")));
  CHECK(manifest_error("file,label\na.csv,\n").what == "label empty");
  CHECK(manifest_error("file,label\na.csv,\" \"\n").what == "label empty");
  CHECK(is_about("file name", manifest_error("file,label\n,Silk\n")));
  CHECK(is_about("file name", manifest_error("file,label\n\" \",Silk\n")));
  CHECK(manifest_error("file,label\n\"a.csv,Silk\n").where == ":2");
  CHECK(manifest_error("file,label\n\"a.csv\"x,Silk\n").where == ":2");
  const Error twice = manifest_error("file,label\na.csv,Silk\nsub/../a.csv,Silk\n");
  CHECK(is_about("twice", twice));
  CHECK(twice.got == "sub/../a.csv");
  CHECK(twice.where == ":3");
}

TEST_CASE("a file is listed twice under whatever name") {
  const TemporaryFolder folder;
  write_file(folder / "a.csv", good_trial);
  std::filesystem::create_directory(folder / "sub");
  std::filesystem::create_symlink("../a.csv", folder / "sub" / "link.csv");
  for (const std::string& other :
       {std::string("./a.csv"), std::string("sub/link.csv"), (folder / "a.csv").string()}) {
    write_file(folder / "m.csv", "file,label\na.csv,Silk\n" + other + ",Wool\n");
    const Error error = import_error(folder);
    CHECK(is_about("twice", error));
    CHECK(error.where == (folder / "m.csv").string() + ":3");
    CHECK(error.got == other);
    CHECK(error.hint.find((folder / "m.csv").string() + ":2 as 'a.csv'") != std::string::npos);
  }
}

TEST_CASE("trials of different channel counts do not make one set") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,Silk\nb.csv,Wool\n");
  write_file(folder / "a.csv", good_trial);
  write_file(folder / "b.csv", "t_s,ch1\n0,1\n");
  const Error error = import_error(folder);
  CHECK(is_about("a.csv", error));
  CHECK(error.expected == "2");
  CHECK(error.got == "1");
  CHECK(error.where.ends_with("m.csv:3: b.csv"));
}

}  // namespace manifest_test
