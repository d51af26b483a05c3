// The reader of all tables: fields, headings, numbers, last lines.

#include "daemon/base/text/csv_table.hpp"

#include <catch2/catch.hpp>

#include "daemon/base/text/similar_names.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::csv_table_test {
namespace {

using Rows = std::vector<std::vector<std::string>>;

const CsvRules matrix{
    .heading = CsvRules::Heading::never, .hash = CsvRules::Hash::comment, .tabs_or_blanks = true};

Result<Rows> read(const std::string& text, const CsvRules& rules = {}) {
  auto csv = CsvTable::from_text("a.csv", text, rules);
  if (!csv) return pass(csv.error());
  Rows out;
  auto more = csv->next();
  for (; more && *more; more = csv->next()) out.push_back(csv->fields());
  if (!more) return pass(more.error());
  return out;
}

/// "where: what" of the error for a text; empty if it is read.
std::string complaint(const std::string& text, const CsvRules& rules = {}) {
  const auto rows = read(text, rules);
  return rows ? "" : rows.error().where + ": " + rows.error().what;
}

Result<double> number(const std::string& field) {
  auto csv = CsvTable::from_text("a.csv", "x,y\n1," + field + "\n");
  REQUIRE(csv);
  REQUIRE(csv->next());
  return csv->number(1);
}

TEST_CASE("fields: quotes, blanks, order mark and line ends of every system") {
  const Rows expected{{"a, \"b\"", "1"}, {"c d", "2"}};
  for (const std::string& text :
       {std::string("x,y\n\"a, \"\"b\"\"\",1\nc d, 2 \n"),
        std::string("\xEF\xBB\xBF\"x\" , \"y\"\r\n \"a, \"\"b\"\"\" ,1\r\n\r\n\t c d,2\r\n"),
        std::string("x,y\r\"a, \"\"b\"\"\",1\rc d,2\r"),
        std::string("x,y\r\r\n\"a, \"\"b\"\"\",1\r\r\nc d,2\r\r\n")}) {
    CAPTURE(text);
    const auto rows = read(text);
    REQUIRE(rows);
    CHECK(*rows == expected);
  }
  CHECK(read(std::string("x,y\nc\0d,2\n", 10)).error().code == Errc::parse);
  CHECK(complaint("x,y\n\"a\nb\",1\n").starts_with("a.csv:2: quote"));
  CHECK(complaint("x,y\n\"a\"b,1\n").starts_with("a.csv:2: quote"));
  CHECK(complaint("") == "a.csv: file empty");
  CHECK(complaint("\xEF\xBB\xBF\n\n") == "a.csv: file empty");
}

TEST_CASE("numbers: a plus sign, all of the field, points as decimal marks") {
  CHECK(number("+1.5e+03") == 1500.0);
  CHECK(number("\"+2\"") == 2.0);
  CHECK(number("-.5") == -0.5);
  for (const char* bad : {"+-1", "++1", "+", "\"1,5\"", "1;5", "+nan", "inf", "1e999", "", "0x10"})
    CHECK(number(bad).error().where == "a.csv:2 column y");
  CHECK(number("\"1,5\"").error().hint.find("decimal marks") != std::string::npos);
}

TEST_CASE("matrices: a tab separates two fields, of which one may be empty, blanks are runs") {
  CHECK(read("1\t2\n3\t4\n", matrix).value() == Rows{{"1", "2"}, {"3", "4"}});
  CHECK(read("1\t\t2\n3\t4\t5\n", matrix).value() == Rows{{"1", "", "2"}, {"3", "4", "5"}});
  CHECK(read("1\t2\t\n3\t4\t5\n", matrix).value() == Rows{{"1", "2", ""}, {"3", "4", "5"}});
  CHECK(read("\t2\n3\t4\n", matrix).value() == Rows{{"", "2"}, {"3", "4"}});
  CHECK(read("  1   2 \n 3 \t 4\n", matrix).value() == Rows{{"1", "2"}, {"3", "4"}});
  CHECK(read("1 2 3\n4\t\t5\n", matrix).value() == Rows{{"1", "2", "3"}, {"4", "", "5"}});
  CHECK(read("# 1\n1,2\n\n#\n3,4\n", matrix).value() == Rows{{"1", "2"}, {"3", "4"}});
  for (const char* text : {"1,2\n3 4\n", "1 2\n3\n"}) {
    const Error error = read(text, matrix).error();
    CHECK(error.where == "a.csv:2");
    CHECK(error.expected == "2");
    CHECK(error.got == "1");
  }
}

TEST_CASE("a last line without a line break is read where it looks like those before") {
  for (const char* whole : {"x,y\n0,1.25\n1,12.50\n2,3.75", "x,y\n0,8000\n1,7999\n12,8015",
                            "x,y\n0,1\n1,12\n2,3\r", "x,y\n0,-1e+3\n1,-2e+3\n2,-9e+3"}) {
    CAPTURE(whole);
    CHECK(complaint(whole).empty());
  }
  for (const char* text :
       {"x,y\n0,1.25\n1,2.50\n2,3.7", "x,y\n0,8000\n1,7999\n2,801", "x,y\n0,8000\n1,7999\n2",
        "x,y\n0,8000\n1,7999\n2,", "x,y\n0,9\n1,10\n2,11", "x,y\n0,8000\n1,8001"})
    CHECK(complaint(text).ends_with("truncated"));
  CHECK(complaint("x,y").starts_with("a.csv:1: "));
  CHECK(complaint("x,y").ends_with("truncated"));
}

TEST_CASE("a heading is one of names: what is odd is named, with what to do") {
  CHECK(read("x,x\n").error().where == "a.csv:1");
  CHECK(read("x,x\n").error().got == "'x'");
  CHECK(complaint("x,y,\n1,2,\n").starts_with("a.csv:1: column 3 "));
  CHECK(complaint(",x\n0,1\n").starts_with("a.csv:1: column 1 "));
  CHECK(complaint("x;y\n1,5;2\n").starts_with("a.csv:1: "));
  CHECK(read("x;y\n1,5;2\n").error().got == "semicolons");
  CHECK(complaint("x\ty\n1\t2\n").starts_with("a.csv:1: "));
  CHECK(read("x\ty\n1\t2\n").error().got == "tabs");
  CHECK(read("sep=,\nx,y\n1,2\n").error().hint.find("sep=") != std::string::npos);
}

TEST_CASE("a missing column: those that are there, and the one that was meant") {
  const auto error = [](const std::string& text, std::string_view name = "t_s") {
    auto csv = CsvTable::from_text("a.csv", text);
    REQUIRE(csv);
    const auto column = csv->take_column(name);
    REQUIRE_FALSE(column);
    CHECK(column.error().code == Errc::parse);
    CHECK(column.error().where == "a.csv:1");
    return column.error();
  };
  CHECK(error("T_S,CH1\n").hint.find("'T_S'") != std::string::npos);
  CHECK(error("time,X,Y,Z\n").hint.find("'time'") != std::string::npos);
  CHECK(error("Timestamp (ms),X\n").hint.find("'Timestamp (ms)'") != std::string::npos);
  CHECK(error("t_s [s],ch1 [V]\n").hint.find("'t_s [s]'") != std::string::npos);
  CHECK(error("t_s ch1 ch2\n").hint.find("commas") != std::string::npos);
  CHECK(error("time,X,Y\n").got == "'time', 'X', 'Y'");
  CHECK(error("file,lable\n", "label").hint.find("'lable'") != std::string::npos);
  CHECK(error("# t_s,ch1\n0,1\n").hint.find('#') != std::string::npos);
  CHECK(error("# sensor A\n# 50 Hz\nt_s,ch1\n").hint.find("line 3") != std::string::npos);
  CHECK(error("Device 7\nRate,50\n\nt_s,ch1\n0,1\n").hint.find("line 4") != std::string::npos);
  CHECK(error("0,1,2\n0.1,2,3\n").hint.find("only numbers") != std::string::npos);
}

TEST_CASE("columns are taken once, by name; the rest is refused or taken") {
  auto csv = CsvTable::from_text("a.csv", "ch2,lable,t_s,ch1\n");
  REQUIRE(csv);
  CHECK(csv->take_column("t_s") == 2U);
  CHECK_FALSE(csv->find_column("phase"));
  CHECK(csv->check_rest({"label"}).error().what.find("'ch2'") != std::string::npos);
  CHECK(csv->take_series("ch").error().what.find("'lable'") != std::string::npos);
  CHECK(csv->take_column("lable") == 1U);
  CHECK(csv->take_series("ch") == std::vector<std::size_t>{3, 0});
  CHECK(csv->check_rest({}));
  CHECK(csv->take_rest().empty());
  auto series = CsvTable::from_text("a.csv", "Ch1\n");
  CHECK(series->take_series("ch").error().hint.find("'ch1'") != std::string::npos);
}

TEST_CASE("other files than tables are named by their kind, labels that look like them are read") {
  using namespace std::string_literals;
  for (const auto& [text, kind] : {std::pair{"\x89HDF\r\n\x1a\n\0"s, "HDF5"},
                                   {"RIFF\x24\0\0\0WAVEfmt "s, "WAV"},
                                   {"PK\x03\x04\x14\0"s, "spreadsheet"},
                                   {"\xFF\xFEx\0"s, "UTF-16"},
                                   {"\x93NUMPY\x01\0"s, "NumPy"},
                                   {"SQLite format 3\0"s, "SQLite"},
                                   {"weft-fabric-model 6\n"s, "model"},
                                   {"\x1f\x8b\x08"s, "gzip"},
                                   {"MATLAB 7.3 MAT-file\0"s, "MATLAB"},
                                   {"PAR1\x15\0"s, "Parquet"},
                                   {"{\"t_s\": [0, 1]}\n"s, "JSON"},
                                   {"<!DOCTYPE html>\n<html>"s, "web page"},
                                   {"version https://git-lfs.github.com/spec/v1\n"s, "LFS"},
                                   {"\x80\x04\x95\0"s, "pickle"},
                                   {"BZh91AY&SY\0"s, "bzip2"}}) {
    const auto error = CsvTable::from_text("a.csv", text).error();
    CHECK(error.code == Errc::parse);
    CHECK(error.got.find(kind) != std::string::npos);
    CHECK_FALSE(error.hint.empty());
  }
  for (const char* text :
       {"FORMICA,o1\n", "RIFF,o1\n", "weft-knit,1\n", "ID3,2\n", "PAR1,2\n", "BZh,2\n"})
    CHECK(complaint(text).empty());
}

TEST_CASE("names that differ in invisible characters are reported, others are not") {
  const auto count = [](std::set<std::string> names) {
    return find_similar_names(names, "labels").size();
  };
  CHECK(count({"denim", "denim\u00A0"}) == 1);
  CHECK(count({"denim", " denim"}) == 1);
  CHECK(count({"raw  silk", "raw silk", "raw\u2003silk"}) == 3);
  CHECK(count({"denim", "denim\u200B", "silk"}) == 1);
  CHECK(count({"\uFEFFfelt", "felt"}) == 1);
  CHECK(count({"velour cr\u00E8me", "velour cre\u0300me"}) == 1);
  CHECK(count({"\u0439\u043E\u0434", "\u0438\u0306\u043E\u0434"}) == 1);
  CHECK(count({"\uAC00", "\u1100\u1161"}) == 1);
  CHECK(count({"a-b", "a\u2011b"}) == 1);
  CHECK(count({"denim", "d\u0435nim"}) == 1);         // Cyrillic
  CHECK(count({"\u00B5-felt", "\u03BC-felt"}) == 1);  // micro sign, Greek
  CHECK(count({"de\u00ADnim", "\u202Edenim", "denim"}) == 3);
  CHECK(count({"cr\u00E8me", "creme", "cr\u00EAme"}) == 0);
  CHECK(count({"\u68C9", "\u9EBB", "a", "b", ""}) == 0);
  const auto one = find_similar_names({"denim", "denim\u00A0"}, "labels");
  CHECK(one.front().code == "similar_names");
  CHECK(one.front().text.ends_with("'denim' and 'denim<U+00A0>'"));
  CHECK(find_similar_names({"denim", "d\u0435nim"}, "labels")
            .front()
            .text.ends_with("'denim' and 'd<U+0435>nim'"));
  const auto capital = find_similar_names({"Denim", "denim ", "silk"}, "labels");
  REQUIRE(capital.size() == 1);
  CHECK(capital.front().code == "capital_letters");
}

}  // namespace
}  // namespace weft::daemon::csv_table_test
