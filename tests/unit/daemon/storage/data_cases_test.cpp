// Kinds of import faults from public bug reports. Each has its input here; the original inputs of
// the cases are used too if they exist (environment WEFT_CASES, or /work/shared/cases/data/inputs).

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>

#include "daemon/storage/dataset/data_warnings.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "daemon/storage/recordings/import_recordings.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::data_cases_test {
namespace {

using test::TemporaryFolder;
using test::write_file;

/// The case's own input; empty, with a message, if it is not on this machine.
std::optional<std::filesystem::path> input(const std::string& name) {
  const char* const set = std::getenv("WEFT_CASES");
  const std::filesystem::path path =
      std::filesystem::path(set != nullptr ? set : "/work/shared/cases/data/inputs") / name;
  if (std::filesystem::exists(path)) return path;
  WARN("skipped, not on this machine: " + path.string());
  return std::nullopt;
}

std::set<std::string> codes(const std::vector<Warning>& warnings) {
  std::set<std::string> out;
  for (const Warning& one : warnings) out.insert(one.code);
  return out;
}

std::set<std::string> labels(const Dataset& dataset) {
  std::set<std::string> out;
  for (const classifier::Trial& trial : dataset.trials) out.insert(trial.label);
  return out;
}

Result<Dataset> table(const std::string& text) {
  const TemporaryFolder folder;
  write_file(folder / "t.csv", text);
  return import_imprint_table(folder / "t.csv", 2, 2);
}

/// A set with `text` as its only trial or recording.
struct OneFile {
  explicit OneFile(const std::string& text, const std::string& file = "a.csv",
                   const std::string& label = "denim") {
    write_file(folder / "a.csv", text);
    write_file(folder / "m.csv", "file,label\n" + file + "," + label + "\n");
  }
  [[nodiscard]] Result<Dataset> trial(double rate_hz = 0) const {
    return import_manifest(folder / "m.csv", rate_hz);
  }
  [[nodiscard]] Result<RecordingSet> recording(double rate_hz = 0) const {
    return import_recordings(folder / "m.csv", rate_hz);
  }
  TemporaryFolder folder;
};

const std::string four_rows =
    "felt,o1,1,2,3,4\nfelt,o2,1,2,3,5\nwool,o3,7,2,3,4\nwool,o4,7,1,3,4\n";

void is_whole(const Result<Dataset>& dataset) {
  REQUIRE(dataset);
  REQUIRE(dataset->trials.size() == 4);
  CHECK(labels(*dataset) == std::set<std::string>{"felt", "wool"});
  CHECK(dataset->trials[1].group == "o2");
  CHECK(dataset->trials[3].counts == std::vector<double>{7, 1, 3, 4});
}

TEST_CASE("F1: a table with the column label has a heading, whatever the others are called") {
  for (const char* heading :
       {"label,group,0,1,2,3\n", "label,group,x0,x1,x2,x3\n", "\"Label\",\"Group\",0,1,2,3\n",
        "# label,group,0,1,2,3\n", "label,group\n", "label,object,v,v,v,v\n", ""}) {
    CAPTURE(heading);
    is_whole(table(heading + four_rows));
  }
  is_whole(
      table("0,label,1,group,2,3\n1,felt,2,o1,3,4\n1,felt,2,o2,3,5\n7,wool,2,o3,3,4\n"
            "7,wool,1,o4,3,4\n"));
  if (const auto path = input("imp/t_pandas_header.csv"))
    is_whole(import_imprint_table(*path, 2, 2));
}

TEST_CASE("F1: a heading that cannot be known is refused") {
  for (const char* heading :
       {"class,object,0,1,2,3\n",  // without a name, with numbers that count up
        "class,object,a,b,c,d\n",  // no numbers
        "0,1,2,3,4,5\n",           // pandas, without any names
        "label,group,0,1,10,2\n",  // sorted as text
        ",label,group,0,1,2,3\n",  // a column of row numbers, which the rows lack
        "x,label,group\n", "label,label,0,1,2,3\n", "x,y,label,group,0,1,2,3\n"}) {
    CAPTURE(heading);
    const auto refused = table(heading + four_rows);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::parse);
    CHECK_FALSE(refused.error().what.empty());
  }
}

TEST_CASE("F1: a first row that counts up is reported unless it has the label of another row") {
  CHECK(codes(table("class,object,5,6,7,8\n" + four_rows).value().warnings) ==
        std::set<std::string>{"numbered_row"});
  CHECK(table("felt,o0,5,6,7,8\n" + four_rows).value().warnings.empty());
}

TEST_CASE("F3: labels may begin with #, and omitted lines are reported") {
  const auto set = table(
      "# made today\n#1 felt,o1,1,2,3,4\n#1 felt,o2,1,2,3,5\n#2 wool,o3,7,2,3,4\n"
      "plain,o5,1,1,1,1\n# the end\n");
  REQUIRE(set);
  CHECK(set->trials.size() == 4);
  CHECK(labels(*set) == std::set<std::string>{"#1 felt", "#2 wool", "plain"});
  CHECK(codes(set->warnings) == std::set<std::string>{"comments", "hash_rows"});
  CHECK(table("#felt,o1,1,2,3,x\nwool,o1,1,2,3,4\n").error().where.find(":1") != std::string::npos);
  if (const auto path = input("imp/t_hash_label.csv")) {
    const auto given = import_imprint_table(*path, 2, 2);
    REQUIRE(given);
    CHECK(labels(*given) == std::set<std::string>{"#1 felt", "#2 wool", "#3 silk", "plain"});
  }
}

TEST_CASE("F4: a byte order mark is no part of the first label, in any table") {
  const std::string mark = "\xEF\xBB\xBF";
  is_whole(table(mark + four_rows));
  is_whole(table(mark + "label,group,0,1,2,3\n" + four_rows));
  CHECK(parse_image_csv("a.csv", mark + "1,2\n3,4\n").value().rows() == 2);
  const OneFile set(mark + "t_s,ch1\n0,1\n0.1,2\n");
  write_file(set.folder / "m.csv", mark + "file,label\na.csv,denim\n");
  CHECK(set.trial());
  if (const auto path = input("imp/t_bom.csv")) is_whole(import_imprint_table(*path, 2, 2));
}

TEST_CASE("F7: an empty cell is refused, whatever separates the cells") {
  for (const char* text : {"1,2,,4\n5,6,,8\n", "1\t2\t\t4\n5\t6\t\t8\n", "1 2 3 4\n5 6 \t\t8\n",
                           "1\t2\t\n3\t4\t\n", "\t1\t2\n\t3\t4\n"}) {
    CAPTURE(text);
    CHECK(parse_image_csv("a.csv", text).error().code == Errc::parse);
  }
  CHECK(parse_image_csv("a.csv", "1;2\n3;4\n").error().code == Errc::parse);
  CHECK(parse_image_csv("a.csv", "1,5;2,5\n3,5;4,5\n").error().code == Errc::parse);
  if (const auto path = input("imp/m_tsv.csv")) CHECK_FALSE(import_imprints(*path));
  if (const auto path = input("imp/c_tabs_missing_all.txt")) CHECK_FALSE(read_image(*path));
}

TEST_CASE("F7: commas that are decimal marks are refused, doubtful ones are reported") {
  for (const char* text : {"0,050\n0,125\n1,000\n", "1,5\n2,05\n", "0,05,0,10\n0,15,0,20\n"}) {
    CAPTURE(text);
    CHECK(parse_image_csv("a.csv", text).error().hint.find("decimal marks") != std::string::npos);
  }
  CHECK(parse_image_csv("a.csv", "007,012\n003,004\n").value()(1, 1) == 4);
  CHECK(parse_image_csv("a.csv", "0 0\n1 05\n").value()(1, 1) == 5);
  CHECK(parse_image_csv("a.csv", "1.5,0.05\n2,0\n").value()(0, 1) == 0.05);
  const auto warnings = [](const char* text) {
    const OneFile set(text);
    return codes(import_imprints(set.folder / "m.csv").value().warnings);
  };
  CHECK(warnings("1,5\n3,5\n3,25\n") == std::set<std::string>{"two_columns"});
  CHECK(warnings("1.5,5\n2,5\n").empty());
  CHECK(warnings("0,5,6\n1,7,8\n2,9,10\n") == std::set<std::string>{"numbered_column"});
  CHECK(warnings("0,1,2\n5,7,8\n9,9,10\n") == std::set<std::string>{"numbered_row"});
  CHECK(warnings("5,6,7\n6,7,8\n7,9,10\n").empty());
}

TEST_CASE("F12: a sample with the time and values of the previous one is refused or reported") {
  const OneFile twice("t_s,ch1\n0,1\n0,1\n0.02,2\n0.02,2\n0.04,3\n0.04,3\n");
  CHECK(twice.trial().error().where.ends_with("a.csv:3"));
  CHECK(twice.trial().error().got == "3 of 6");
  const auto stated = twice.trial(50);
  REQUIRE(stated);
  CHECK(stated->info.taxel_rate_hz == 50);
  CHECK(codes(stated->warnings) == std::set<std::string>{"repeated_samples"});
  CHECK(OneFile("t_s,X\n0,1\n0,1\n0.001,2\n0.001,2\n").recording().error().where.ends_with(":3"));
  std::string half;
  for (int i = 0; i < 20; ++i) half += std::to_string(i * 0.001) + "," + std::to_string(i) + "\n";
  const OneFile pasted("t_s,X\n" + half + half);
  for (const double rate_hz : {0.0, 1000.0}) {
    CHECK(pasted.recording(rate_hz).error().what == "time decreases");
    CHECK(pasted.recording(rate_hz).error().where.ends_with("a.csv:22"));
  }
  CHECK(OneFile("t_s,ch1\n0,1\n0.02,1\n0.04,1\n").trial().value().warnings.empty());
  std::string once = "t_s,ch1\n0,1\n0,1\n";  // one of two hundred
  for (int i = 1; i < 200; ++i) once += std::to_string(i * 0.02) + ",1\n";
  const auto read = OneFile(once).trial();
  REQUIRE(read);
  CHECK(codes(read->warnings) == std::set<std::string>{"repeated_samples"});
  for (const char* name : {"time/dupall/m.csv", "time/dupsome/m.csv"})
    if (const auto path = input(name)) CHECK_FALSE(import_manifest(*path));
  if (const auto path = input("rec/m_twice.csv")) CHECK_FALSE(import_recordings(*path));
}

TEST_CASE("F16: labels and groups that look alike are named") {
  const TemporaryFolder folder;
  for (const char* name : {"a.csv", "b.csv"})
    write_file(folder / name, "t_s,ch1\n0,1\n0.02,2\n0.04,3\n");
  const auto warnings = [&](const std::string& first, const std::string& second) {
    write_file(folder / "m.csv", "file,label,group\na.csv," + first + "\nb.csv," + second + "\n");
    const auto set = import_manifest(folder / "m.csv");
    REQUIRE(set);
    return codes(find_similar_labels(set->trials));
  };
  const std::set<std::string> similar{"similar_names"};
  CHECK(warnings("denim,1", "denim\u00A0,1") == similar);
  CHECK(warnings("denim,1", "\" denim\",1") == similar);
  CHECK(warnings("denim,1", "denim\u200B,1") == similar);
  CHECK(warnings("denim,1", "denim,1\u2009") == similar);
  CHECK(warnings("denim,1", "wool,2").empty());
  for (const char* nothing : {"\u00A0", "\" \"", "\u200B\u2003"}) {
    CHECK(OneFile("t_s,ch1\n0,1\n0.02,2\n", "a.csv", nothing).trial().error().what ==
          "label empty");
    CHECK(table(nothing + std::string(",o1,1,2,3,4\n")).error().what == "label empty");
  }
  for (const char* name : {"43_nbsp_two", "44_nfc_nfd", "47_quoted_blank", "48_zwsp"})
    if (const auto path = input("csv/" + std::string(name) + "/m.csv")) {
      CAPTURE(name);
      CHECK(codes(find_data_warnings(import_manifest(*path).value())) == similar);
    }
}

TEST_CASE("F23: a rate that milliseconds would give is asked after") {
  const std::set<std::string> slow{"slow_rate"};
  CHECK(codes(OneFile("t_s,ch1\n0,1\n20,2\n40,3\n").trial().value().warnings) == slow);
  CHECK(codes(OneFile("t_s,X\n0,1\n1,2\n2,3\n").recording().value().warnings) == slow);
  CHECK(OneFile("t_s,ch1\n0,1\n20,2\n40,3\n").trial(0.05).value().warnings.empty());
  CHECK(OneFile("t_s,ch1\n0,1\n0.02,2\n0.04,3\n").trial().value().warnings.empty());
  for (const char* name : {"time/ms/m.csv", "csv/16_relative_ms/m.csv"})
    if (const auto path = input(name))
      CHECK(codes(import_manifest(*path).value().warnings) == slow);
  if (const auto path = input("rec/m_ms.csv"))
    CHECK(codes(import_recordings(*path).value().warnings) == slow);
}

TEST_CASE("F24: a plus sign is part of a number, in any table") {
  const auto set = OneFile("t_s,ch1\n+0.0E+00,+8.5E+03\n+2.0E-02,-1\n").trial();
  REQUIRE(set);
  CHECK(set->trials[0].counts == std::vector<double>{8500, -1});
  CHECK(table("felt,o1,+1,+2,+3,+4\n").value().trials[0].counts[3] == 4);
  CHECK(parse_image_csv("a.csv", "+0,+1\n+3,+4\n").value()(1, 1) == 4);
  if (const auto path = input("csv/03_plus_sign/m.csv"))
    CHECK(import_manifest(*path).value().trials[0].counts[1] == 8036.244);
  if (const auto path = input("imp/c_plus.csv")) CHECK(read_image(*path).value()(1, 2) == 5);
}

TEST_CASE("F25: a last line as wide as the others needs no line break") {
  const auto set = OneFile("t_s,ch1,ch2\n0.00,8000,8036\n0.02,8030,8039\n0.04,8039,8027").trial();
  REQUIRE(set);
  CHECK(set->trials[0].counts.back() == 8027);
  CHECK(parse_image_csv("a.csv", "10,20\n30,40\n50,60").value()(2, 1) == 60);
  CHECK_FALSE(OneFile("t_s,ch1\n0.00,8000\n0.02,8030\n0.04,803").trial());
  if (const auto path = input("csv/02_no_final_newline/m.csv"))
    CHECK(import_manifest(*path).value().trials[0].counts.back() == 8015);
}

TEST_CASE("F27: a heading that is not found is shown, with what line 1 is") {
  for (const char* name :
       {"04_hash_header_savetxt", "10_excel_sep_line", "18_upper_header", "22_comment_lines"})
    if (const auto path = input("csv/" + std::string(name) + "/m.csv")) {
      const Error error = import_manifest(*path).error();
      CAPTURE(name, to_string(error));
      CHECK(error.where.ends_with("a.csv:1"));
      CHECK_FALSE(error.got.empty());
      CHECK_FALSE(error.hint.empty());
    }
}

TEST_CASE("F29: whole numbers and floats of every width are read, others named by type") {
  const auto npy = [](const std::string& type, const std::string& body) {
    const std::string head =
        "{'descr': '" + type + "', 'fortran_order': False, 'shape': (1, 2), }\n";
    return parse_image_npy("n", std::string("\x93NUMPY\x01\0", 8) + static_cast<char>(head.size()) +
                                    '\0' + head + body);
  };
  const auto values = [](const Result<classifier::imprint::Image>& image) {
    REQUIRE(image);
    return std::as_const(*image).data();
  };
  using namespace std::string_literals;
  CHECK(values(npy("<i8", "\xFE\xFF\xFF\xFF\xFF\xFF\xFF\xFF\0\1\0\0\0\0\0\0"s)) ==
        std::vector<double>{-2, 256});
  CHECK(values(npy(">u8", "\0\0\0\0\0\0\0\7\0\0\0\1\0\0\0\0"s)) ==
        std::vector<double>{7, 4294967296});
  CHECK(values(npy("<f2", "\0\x3E\0\xC0"s)) == std::vector<double>{1.5, -2});
  CHECK(values(npy("<f2", "\1\0\xFF\x7B"s)) == std::vector<double>{0x1p-24, 65504});
  CHECK(std::isinf(values(npy("<f2", "\0\x7C\0\xFC"s))[0]));
  CHECK(values(npy("|b1", "\1\0"s)) == std::vector<double>{1, 0});
  for (const char* shape : {"(1, 2, 1)", "(2,)", "()"})
    CHECK(parse_image_npy(
              "n", std::string("\x93NUMPY\x01\0", 8) + "\x46\0"s +
                       (std::string("{'descr': '<f8', 'fortran_order': False, 'shape': ") + shape +
                        ", }" + std::string(70, ' '))
                           .substr(0, 70))
              .error()
              .got == shape);
  CHECK(npy("<u8", std::string(16, '\xFF')).error().code == Errc::range);
  CHECK(npy("<i8", "\1\0\0\0\0\0\x20\0\0\0\0\0\0\0\0\0"s).error().code == Errc::range);
  for (const char* type : {"<f16", "|O", "<U3", "<c8", "<M8", "", "<", "i8"}) {
    CAPTURE(type);
    const Error error = npy(type, std::string(5, 'x')).error();
    CHECK(error.got == type);
    CHECK(error.hint.find("astype") != std::string::npos);
  }
  for (const char* name : {"i8", "u8", "f2"})
    if (const auto path = input("imp/n_" + std::string(name) + ".npy")) CHECK(read_image(*path));
  for (const char* name : {"f16", "obj", "str"})
    if (const auto path = input("imp/n_" + std::string(name) + ".npy"))
      CHECK(read_image(*path).error().expected.starts_with("b1,"));
}

TEST_CASE("F36: a path with backslashes is refused with the sign that separates folders") {
  const OneFile set("t_s,ch1\n0,1\n0.02,2\n", "data\\a.csv");
  CHECK(set.trial().error().code == Errc::not_found);
  CHECK(set.trial().error().where.ends_with("m.csv:2"));
  CHECK(set.trial().error().hint.find('/') != std::string::npos);
  write_file(set.folder / "data\\a.csv", "t_s,ch1\n0,1\n0.02,2\n");  // a normal name on this system
  CHECK(set.trial());
  if (const auto path = input("csv/27_windows_path/m.csv"))
    CHECK(import_manifest(*path).error().hint.find('/') != std::string::npos);
}

TEST_CASE("F42: a file of another kind is named, with the command that takes it") {
  const TemporaryFolder folder;
  write_file(folder / "a.h5", std::string("RIFF\x24\0\0\0WAVEfmt ", 16));
  CHECK(import_trial(folder / "a.h5").error().hint.find("recordings") != std::string::npos);
  CHECK(read_image(folder / "a.h5").error().got.find("WAV") != std::string::npos);
  write_file(folder / "a.npy", std::string("PK\x03\x04\0\0\0\0\0\0\0\0", 12));
  CHECK(read_image(folder / "a.npy").error().got.find("npz") != std::string::npos);
  write_file(folder / "a.wav", std::string("\x89HDF\r\n\x1a\n\0\0\0\0", 12));
  CHECK(read_sound_file(folder / "a.wav").error().got == "an HDF5 file");
  write_file(folder / "a.txt", "t_s,X\n0,1\n");
  CHECK(read_sound_file(folder / "a.txt").error().hint.find(".csv") != std::string::npos);
  if (const auto path = input("h5/generic.h5")) {
    CHECK(import_manifest(*path).error().got == "an HDF5 file");
    CHECK_FALSE(import_manifest(*path).error().hint.empty());
  }
}

}  // namespace
}  // namespace weft::daemon::data_cases_test
