#include "daemon/storage/dataset/dataset.hpp"

#include <catch2/catch.hpp>

#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/recordings/import_recordings.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::copies_test {
namespace {

using test::TemporaryFolder;
using test::write_file;

TEST_CASE("files with the same samples are named together, whatever they are called") {
  const TemporaryFolder folder;
  const std::string one = "t_s,ch1\n0,1\n0.1,2\n";
  write_file(folder / "a.csv", one);
  write_file(folder / "b.csv", "t_s,ch1\n0,1\n0.1,3\n");
  write_file(folder / "c.csv", "t_s,ch1\r\n7,1\r\n7.1,2.0\r\n");  // written by another program
  write_file(folder / "d.csv", one);
  write_file(folder / "m.csv", "file,label\na.csv,x\nb.csv,x\nc.csv,y\nd.csv,z\n");
  const auto slides = import_manifest(folder / "m.csv");
  REQUIRE(slides);
  CHECK(copies_in(*slides) == Copies{{"a.csv", "c.csv", "d.csv"}});
  CHECK(copies_text(copies_in(*slides)).find("a.csv = c.csv = d.csv.") != std::string::npos);
  CHECK(copies_text({}).empty());
}

TEST_CASE("recordings are copies where all channels are") {
  const TemporaryFolder folder;
  write_file(folder / "a.csv", "t_s,X,Y\n0,1,2\n0.1,3,4\n");
  write_file(folder / "b.csv", "t_s,X,Y\n0,1,2\n0.1,3,5\n");
  write_file(folder / "c.csv", "t_s,X,Y\n0,1,2\n0.1,3,4\n");
  write_file(folder / "m.csv", "file,label\na.csv,x\nb.csv,x\nc.csv,y\n");
  const auto set = import_recordings(folder / "m.csv");
  REQUIRE(set);
  CHECK(copies_in(*set) == Copies{{"a.csv", "c.csv"}});
}

TEST_CASE("many copies are counted, not all named") {
  std::vector<std::string> names, contents;
  for (int i = 0; i < 14; ++i) {
    names.push_back(std::to_string(i));
    contents.push_back(std::to_string(i / 2));
  }
  const std::string text = copies_text(copies_among(names, contents));
  CHECK(text.find("0 = 1; 2 = 3; 4 = 5; 6 = 7; 8 = 9; and 2 more") != std::string::npos);
}

}  // namespace
}  // namespace weft::daemon::copies_test
