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

TEST_CASE("a manifest says what of its cloth a trial touched, and the data set keeps it") {
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
    CHECK(error.what == "the last line has no line break: the file may be cut short");
    CHECK(error.where == ":3");
    CHECK(error.hint == "Add a newline if the file is whole");
  }
  CHECK(trial_error("t_s,ch1").where == ":1");
}

TEST_CASE("a manifest cut in its last line is refused with the line") {
  for (const char* cut : {"a.csv,Sil", "a.csv,Silk", "a"}) {
    const Error error = manifest_error(std::string("file,label\na.csv,Silk\n") + cut);
    CHECK(error.what == "the last line has no line break: the file may be cut short");
    CHECK(error.where == ":3");
  }
}

TEST_CASE("NaN, infinity, text and empty fields in a trial are refused with line and column") {
  for (const char* bad : {"nan", "NaN", "inf", "-inf", "1.5x", "0x10", "", "1 2"}) {
    const Error error = trial_error(std::string("t_s,ch1,ch2\n0,1,2\n1,3,") + bad + "\n");
    CHECK(error.what == "not a finite number");
    CHECK(error.where == ":3 column ch2");
    CHECK(error.got == std::string("'").append(bad).append("'"));
  }
  for (const char* bad : {"1e999", "-1e400", "1e-400"}) {
    const Error error = trial_error(std::string("t_s,ch1,ch2\n0,1,2\n1,3,") + bad + "\n");
    CHECK(error.what == "a number that no double can hold");
    CHECK(error.where == ":3 column ch2");
  }
  CHECK(trial_error("t_s,ch1\nnan,1\n").where == ":2 column t_s");
  for (const char* far : {"1e300", "1.7e12", "-4.6e9"}) {  // as milliseconds since 1970
    const Error error = trial_error(std::string("t_s,ch1\n") + far + ",1\n");
    CHECK(error.what == "a time beyond all reason");
    CHECK(error.where == ":2 column t_s");
    CHECK(error.expected == "within 142 years of 0");
  }
}

TEST_CASE("a trial's columns must be known, unique and complete") {
  CHECK(trial_error("t_s,ch1,force\n0,1,2\n").what == "unknown column 'force'");
  CHECK(trial_error("t_s,ch1,ch01\n0,1,2\n").what == "unknown column 'ch01'");
  CHECK(trial_error("t_s,ch1,ch0\n0,1,2\n").what == "unknown column 'ch0'");
  CHECK(trial_error("t_s,ch1,ch3\n0,1,2\n").what == "the column ch2 is missing");
  CHECK(trial_error("t_s,ch99999999999\n0,1\n").what == "the column ch1 is missing");
  CHECK(trial_error("t_s,phase\n0,M\n").what == "the column ch1 is missing");
  CHECK(trial_error("ch1,ch2\n0,1\n").what == "the column t_s is missing");
  CHECK(trial_error("t_s,ch1,ch1\n0,1,1\n").what == "two columns of the same name");
}

TEST_CASE("a trial's lines must be whole, in time order and of known phases") {
  CHECK(trial_error("t_s,ch1\n0,1\n1,2,3\n").what == "wrong number of fields");
  CHECK(trial_error("t_s,ch1\n0\n1,2\n").what == "wrong number of fields");
  CHECK(trial_error("t_s,ch1\n1,1\n0.5,2\n").what == "time runs backwards");
  CHECK(trial_error("t_s,phase,ch1\n1,Q,1\n").got == "'Q'");
  CHECK(trial_error("t_s,phase,ch1\n1,MM,1\n").what == "unknown phase");
  CHECK(trial_error("t_s,ch1\n").what == "a header but no samples");
  CHECK(trial_error("").what == "the file is empty");
  CHECK(trial_error(std::string("t_s,ch1\n0,1\0\n", 13)).what == "a zero byte: not a text file");
}

TEST_CASE("huge lines and huge headers are refused, not swallowed") {
  CHECK(trial_error("t_s,ch1\n0," + std::string(2000000, '1') + "\n").what ==
        "the line is too long");
  std::string commas(100000, ',');
  CHECK(trial_error(commas += '\n').what == "too many columns");
}

TEST_CASE("a manifest naming a missing file says which, and from which line") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,Silk\nmissing.csv,Wool\n");
  write_file(folder / "a.csv", good_trial);
  const Error error = import_error(folder);
  CHECK(error.code == Errc::not_found);
  CHECK(error.where == (folder / "m.csv").string() + ":3: " + (folder / "missing.csv").string());
  CHECK(import_manifest(folder / "no.csv").error().code == Errc::not_found);
}

TEST_CASE("a manifest's columns and lines must make sense") {
  CHECK(manifest_error("").what == "the file is empty");
  CHECK(manifest_error("file,label\n").what == "a header but no trials");
  CHECK(manifest_error("file,label,piece\na.csv,Silk,0\n").what == "not a whole number from 1 on");
  CHECK(manifest_error("file,label,mounting\na.csv,Silk,1.5\n").what ==
        "not a whole number from 1 on");
  CHECK(manifest_error("file,group\na.csv,0\n").what == "the column label is missing");
  CHECK(manifest_error("label\nSilk\n").what == "the column file is missing");
  CHECK(manifest_error("file,label\na.csv,\n").what == "the label is empty");
  CHECK(manifest_error("file,label\na.csv,\" \"\n").what == "the label is empty");
  CHECK(manifest_error("file,label\n,Silk\n").what == "the file name is empty");
  CHECK(manifest_error("file,label\n\" \",Silk\n").what == "the file name is empty");
  CHECK(manifest_error("file,label\n\"a.csv,Silk\n").where == ":2");
  CHECK(manifest_error("file,label\n\"a.csv\"x,Silk\n").where == ":2");
  const Error twice = manifest_error("file,label\na.csv,Silk\nsub/../a.csv,Silk\n");
  CHECK(twice.what == "the file is listed twice");
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
    CHECK(error.what == "the file is listed twice");
    CHECK(error.where == (folder / "m.csv").string() + ":3");
    CHECK(error.got == other);
    CHECK(error.hint == "It stands in " + (folder / "m.csv").string() + ":2 as 'a.csv' already");
  }
}

TEST_CASE("trials of different channel counts do not make one set") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label\na.csv,Silk\nb.csv,Wool\n");
  write_file(folder / "a.csv", good_trial);
  write_file(folder / "b.csv", "t_s,ch1\n0,1\n");
  const Error error = import_error(folder);
  CHECK(error.what == "another number of channels than a.csv");
  CHECK(error.where.ends_with("m.csv:3: b.csv"));
}

}  // namespace manifest_test
