// Imprints from files and from the scene, and back from a data set.

#include <catch2/catch.hpp>
#include <set>

#include "daemon/analysis/imprint/imprint_scene.hpp"
#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::test::imprint_files_test {
namespace {

using classifier::imprint::Image;

TableOptions least_squares_only() {
  TableOptions out;
  out.scales = {{0}};
  out.rules = {classifier::Learner::least_squares};
  out.laws = false;
  return out;
}

std::string bytes(std::initializer_list<int> values) {
  std::string out;
  for (const int value : values) out += static_cast<char>(value);
  return out;
}

std::string npy(const std::string& dictionary, const std::string& body) {
  const std::size_t length = dictionary.size();
  return "\x93NUMPY" +
         bytes({1, 0, static_cast<int>(length % 256), static_cast<int>(length / 256)}) +
         dictionary + body;
}

std::vector<double> values_of(const Result<Image>& image) {
  REQUIRE(image);
  const auto& values = std::as_const(*image).data();
  return {values.begin(), values.end()};
}

TEST_CASE("a matrix of text: commas or blanks, comments, complaints with a line") {
  const auto image = parse_image_csv("a.csv", "# rows\n1, 2.5,3\r\n\n4,5,-6\n");
  CHECK(values_of(image) == std::vector<double>{1, 2.5, 3, 4, 5, -6});
  CHECK(image->rows() == 2);
  CHECK(values_of(parse_image_csv("a.txt", "1 2\n  3\t4\n")) == std::vector<double>{1, 2, 3, 4});
  for (const auto& [text, where] : {std::pair{"1,2\n3\n", "a.csv:2"},
                                    {"1,x\n", "a.csv:1"},
                                    {"1,nan\n", "a.csv:1"},
                                    {"1,2,\n", "a.csv:1"},
                                    {"1,2\n3,4", "a.csv:2"},  // possibly a part of 3,45
                                    {"1,2\n\n3,4 ", "a.csv:3"},
                                    {"", "a.csv"}})
    CHECK(parse_image_csv("a.csv", text).error().where.starts_with(where));
}

TEST_CASE("grey maps: plain and binary, 8 and 16 bits, comments, truncated") {
  CHECK(values_of(parse_image_pgm("p", "P2 # comment\n3 2\n127\n1 2 3\n4 5 127\n")) ==
        std::vector<double>{1, 2, 3, 4, 5, 127});
  CHECK(values_of(parse_image_pgm("p", "P2 2 1 9 1 2\n# that was all")) ==
        std::vector<double>{1, 2});
  CHECK(values_of(parse_image_pgm("p", "P5\n2 2\n255\n" + bytes({0, 10, 200, 255}))) ==
        std::vector<double>{0, 10, 200, 255});
  CHECK(values_of(parse_image_pgm("p", "P5\n2 1\n1000\n" + bytes({1, 2, 3, 0}))) ==
        std::vector<double>{258, 768});
  for (const std::string& text :
       {std::string("P6\n1 1\n255\nabc"), std::string("P5\n2 2\n255\nabc"),
        std::string("P5\n2 2\n255\nabcde"), std::string("P2\n2 2\n9\n1 2 3\n"),
        std::string("P2\n2 1\n9\n1 10\n"), std::string("P2\n2 1\n9\n1 1"),
        std::string("P2\n2 1\n9\n1 1 1\n"), std::string("P2\n2 1\n9\n1 1\n# more\nx"),
        std::string("P5\n0 2\n255\n"), std::string("P2"),
        std::string("P2\n99999999999999999999 1\n9\n1"),
        std::string("P2\n4294967296 4294967296 9\n1"), std::string("P5\n1 1\n0\na"),
        std::string("P2\n1 1\n70000\n1\n")})
    CHECK(!parse_image_pgm("p", text));
}

TEST_CASE("NumPy arrays: types, byte orders, both orders of memory") {
  const std::string shape = "'fortran_order': False, 'shape': (2, 3), }\n";
  CHECK(values_of(
            parse_image_npy("n", npy("{'descr': '|u1', " + shape, bytes({1, 2, 3, 4, 5, 255})))) ==
        std::vector<double>{1, 2, 3, 4, 5, 255});
  CHECK(values_of(
            parse_image_npy("n", npy("{'descr': '>i2', 'fortran_order': False, 'shape': (1, 2), }",
                                     bytes({255, 254, 1, 0})))) == std::vector<double>{-2, 256});
  CHECK(values_of(
            parse_image_npy("n", npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1), }",
                                     bytes({0, 0, 0x20, 0x40})))) == std::vector<double>{2.5});
  CHECK(values_of(parse_image_npy(
            "n", npy("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3), }",
                     bytes({1, 2, 3, 4, 5, 6})))) == std::vector<double>{1, 3, 5, 2, 4, 6});
  const std::string six = bytes({1, 2, 3, 4, 5, 6});
  for (const std::string& dictionary :
       {std::string("{'descr': '|u1', 'fortran_order': False, 'shape': (6,), }"),
        std::string("{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2, 3), }"),
        std::string("{'descr': '|u1', 'fortran_order': False, 'shape': (2, 4), }"),
        std::string("{'descr': '|u1', 'fortran_order': False, 'shape': (0, 3), }"),
        std::string("{'descr': '|u1', 'shape': (2, 3), }"), std::string("{'descr': '|u1"),
        std::string("{'descr': '|S1', 'fortran_order': False, 'shape': (2, 3), }"),
        std::string("{'descr': '', 'fortran_order': False, 'shape': (2, 3), }")})
    CHECK(!parse_image_npy("n", npy(dictionary, six)));
  CHECK(!parse_image_npy("n", "\x93NUMPY"));
  CHECK(!parse_image_npy("n", "\x93NUMPY" + bytes({1, 0, 200, 0}) + "{}"));
}

TEST_CASE("a manifest of imprints becomes a data set that survives its file") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label,group\na.csv,knit,K1\nb.pgm,knit,K1\nc.npy,rasp,R1\n");
  write_file(folder / "a.csv", "1,2,3\n4,5,6\n");
  write_file(folder / "b.pgm", "P2 3 2 9 1 2 3 4 5 9\n");
  write_file(folder / "c.npy", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }",
                                   std::string(48, '\0')));
  const auto made = import_imprints(folder / "m.csv");
  REQUIRE(made);
  REQUIRE(write_hdf5(*made, folder / "d.h5"));
  const auto dataset = read_hdf5(folder / "d.h5");
  REQUIRE(dataset);
  CHECK(dataset_sha256(*made) == dataset_sha256(*dataset));
  CHECK(dataset->info.kind == BenchKind::unknown);
  const auto imprints = extract_imprints(*dataset);
  REQUIRE(imprints);
  REQUIRE(imprints->size() == 3);
  CHECK((*imprints)[1].object == "K1");
  CHECK((*imprints)[1].image(1, 2) == 9.0);
  CHECK((*imprints)[2].image.rows() == 2);
  write_file(folder / "a.csv", "1,2\n4,5\n");
  CHECK(import_imprints(folder / "m.csv").error().where.find("m.csv:3") != std::string::npos);
  write_file(folder / "a.csv", "1,nan,3\n");
  CHECK(!import_imprints(folder / "m.csv"));
}

TEST_CASE("imprints of different sizes are no set, whoever opens it") {
  const TemporaryFolder folder;
  write_file(folder / "m.csv", "file,label,group\na.csv,knit,K1\nb.csv,rasp,R1\n");
  write_file(folder / "a.csv", "1,2,3\n4,5,6\n");
  write_file(folder / "b.csv", "1,2,3\n4,5,6\n7,8,9\n");
  const auto refused = import_imprints(folder / "m.csv");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where.find("m.csv:3: b.csv") != std::string::npos);
  CHECK(refused.error().expected == "2 x 3 taxels as in a.csv");
  CHECK(refused.error().got == "3 x 3 taxels");
  // A set written by another program.
  write_file(folder / "b.csv", "1,2,3\n4,5,6\n");
  auto mixed = import_imprints(folder / "m.csv").value();
  mixed.trials[1].counts.resize(3);
  mixed.trials[1].phase.resize(1);
  mixed.records[1].t_ns.resize(1);
  CHECK(extract_imprints(mixed).error().where == "b.csv");
  TableOptions options;
  options.scales = {{0}};
  CHECK(measure_tables(mixed, options).error().where == "b.csv");
}

TEST_CASE("objects that are numbered within their class are as many as they are") {
  const TemporaryFolder folder;
  std::string lines = "file,label,group\n";
  for (const char* label : {"knit", "rasp"})
    for (const char* object : {"1", "2"})
      for (const char* press : {"a", "b"}) {
        const std::string file = std::string(label) + object + press + ".csv";
        write_file(folder / file, "1,2,3\n4,5,6\n7,8,9\n");
        lines += file + "," + label + "," + object + "\n";
      }
  write_file(folder / "m.csv", lines);
  const auto dataset = import_imprints(folder / "m.csv");
  REQUIRE(dataset);
  const auto imprints = extract_imprints(*dataset);
  REQUIRE(imprints);
  std::map<std::string, int> presses;
  for (const auto& one : *imprints) ++presses[one.object];
  CHECK(presses ==
        std::map<std::string, int>{{"knit/1", 2}, {"knit/2", 2}, {"rasp/1", 2}, {"rasp/2", 2}});
}

TEST_CASE("without an object that was pressed twice no object is set aside") {
  const TemporaryFolder folder;
  write_file(folder / "t.csv",
             "label,index,then\n0,1,1,2,3,4\n0,2,5,6,7,8\n1,1,9,1,9,9\n1,2,9,8,3,1\n");
  const auto dataset = import_imprint_table(folder / "t.csv", 2, 2);
  REQUIRE(dataset);
  TableOptions options = least_squares_only();
  const auto tables = measure_tables(*dataset, options);
  REQUIRE(tables);
  CHECK(tables->objects == 4);
  REQUIRE(tables->left_out.size() == 2);
  CHECK(tables->left_out[0].first == "2/N");
  CHECK(tables->left_out[0].second.find("twice") != std::string::npos);
  CHECK(tables->left_out[1].first == "2/CLASS");
  CHECK(tables->options.experiments.size() == 2);
  CHECK(tables_note(*tables).find("2/CLASS (" + tables->left_out[1].second + ")") !=
        std::string::npos);
  options.experiments = {classifier::imprint::Experiment::object_of_all};
  CHECK_FALSE(measure_tables(*dataset, options));
}

TEST_CASE("an experiment that would train a class with nothing is left out, with the reason") {
  const TemporaryFolder folder;
  std::string lines = "label,object,then\n";
  for (const char* object : {"a,1", "a,2", "b,3", "b,4", "b,5", "c,6"})  // c has one object
    for (const char* values : {"1,2,3,4", "5,6,8,7"})
      lines += std::string(object) + "," + values + "\n";
  write_file(folder / "t.csv", lines);
  const auto dataset = import_imprint_table(folder / "t.csv", 2, 2);
  REQUIRE(dataset);
  TableOptions options = least_squares_only();
  const auto tables = measure_tables(*dataset, options);
  REQUIRE(tables);
  CHECK(tables->options.experiments == std::vector{classifier::imprint::Experiment::one_of_all,
                                                   classifier::imprint::Experiment::one_of_class});
  REQUIRE(tables->left_out.size() == 2);
  CHECK(tables->left_out[0].first == "2/N");
  CHECK(tables->left_out[0].second.find("c: ") == 0);
  CHECK(tables->requested == std::vector<std::size_t>{12, 6});
  CHECK_THAT(tables_note(*tables), Catch::Contains("1/CLASS") && Catch::Contains(" 6 of them"));
  for (const auto experiment : {classifier::imprint::Experiment::object_of_all,
                                classifier::imprint::Experiment::object_of_class}) {
    options.experiments = {experiment};
    CHECK_FALSE(measure_tables(*dataset, options));
  }
}

TEST_CASE("a table of imprints: an object of its own where groups mix labels") {
  const TemporaryFolder folder;
  write_file(folder / "t.csv", "# label,index, then 2x2\n0,1,1,2,3,4\n0,2,5,6,7,8\n1,1,9,9,9,9\n");
  const auto dataset = import_imprint_table(folder / "t.csv", 2, 2);
  REQUIRE(dataset);
  const auto imprints = extract_imprints(*dataset);
  REQUIRE(imprints);
  CHECK(dataset->trials[2].group == "1");
  CHECK((*imprints)[1].image(1, 0) == 7.0);
  std::set<std::string> objects;
  for (const auto& one : *imprints) objects.insert(one.object);
  CHECK(objects.size() == 3);
  CHECK(!import_imprint_table(folder / "t.csv", 2, 3));
  CHECK(!import_imprint_table(folder / "t.csv", 0, 3));
  write_file(folder / "t.csv", "label,index,a,b\nx,1,2,3\nx,2,2,?\n");
  CHECK(import_imprint_table(folder / "t.csv", 1, 2).error().where.ends_with(":3 column b"));
  write_file(folder / "t.csv", "label,index,a,b\nx,1,2,3\nx,2,2,1");
  CHECK(import_imprint_table(folder / "t.csv", 1, 2).error().where.ends_with(":3"));
}

TEST_CASE(
    "the scene: 24 imprints of twelve objects, saturated here and there, the same each time") {
  for (const sim::Level level : {sim::Level::z, sim::Level::z_plus}) {
    ImprintSceneOptions options;
    options.level = level;
    const auto dataset = simulate_imprints(options);
    REQUIRE(dataset);
    CHECK(dataset->info.kind == BenchKind::simulated);
    REQUIRE(check(*dataset));
    CHECK(dataset_sha256(*dataset) == dataset_sha256(*simulate_imprints(options)));
    const auto imprints = extract_imprints(*dataset);
    REQUIRE(imprints);
    REQUIRE(imprints->size() == 24);
    CHECK((*imprints)[0].file == "PLANE1-light");
    CHECK((*imprints)[23].object == "KNIT3");
    std::size_t full = 0, empty = 0;
    double light = 0, heavy = 0;
    for (std::size_t i = 0; i < 24; ++i)
      for (const double value : std::as_const((*imprints)[i].image).data()) {
        CHECK((value >= 0 && value <= 127 && value == std::floor(value)));
        full += value == 127 ? 1 : 0;
        empty += value == 0 ? 1 : 0;
        (i % 2 == 0 ? light : heavy) += value;
      }
    CHECK(full > 100);
    CHECK(empty > 1000);
    CHECK(heavy > 1.3 * light);
  }
  CHECK(!simulate_imprints({.level = sim::Level::quasistatic}));
  CHECK(!simulate_imprints({.side = 129}));
}

TEST_CASE("hysteresis: what a cover remembers makes imprints stronger") {
  ImprintSceneOptions with, without;
  without.taxels.hysteresis = 0;
  const auto mean = [](const ImprintSceneOptions& options) {
    double sum = 0;
    const auto dataset = simulate_imprints(options);
    REQUIRE(dataset);
    for (const auto& trial : dataset->trials)
      for (const double value : trial.counts) sum += value;
    return sum;
  };
  with.level = without.level = sim::Level::z;
  CHECK(mean(with) > 1.02 * mean(without));
}

}  // namespace
}  // namespace weft::daemon::test::imprint_files_test
