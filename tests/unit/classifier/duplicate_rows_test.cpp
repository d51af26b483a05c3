#include "classifier/evaluate/splits.hpp"

#include <catch2/catch.hpp>

namespace weft::classifier::duplicate_rows_test {
namespace {

FeatureMatrix rows(const std::vector<std::vector<double>>& values) {
  FeatureMatrix out;
  out.names = {"a", "b"};
  out.values = Matrix(values.size(), 2);
  for (std::size_t r = 0; r < values.size(); ++r) {
    std::ranges::copy(values[r], out.values.row(r).begin());
    out.labels.push_back(r % 2 == 0 ? "x" : "y");
    out.groups.emplace_back();
    out.files.push_back("file" + std::to_string(r));
  }
  return out;
}

TEST_CASE("test rows that are a training row to the last bit are counted, and one pair named") {
  const FeatureMatrix matrix = rows({{1, 2}, {1, 3}, {2, 2}, {1, 2}, {1, 2 + 1e-15}, {2, 2}});
  const DuplicateRows none =
      find_duplicates(matrix, std::vector<Split>{{{0, 1, 2}, {4}}, {{0, 3}, {1}}});
  CHECK(none.tested == 2);
  CHECK(none.found == 0);
  CHECK(none.test.empty());
  const DuplicateRows some =
      find_duplicates(matrix, std::vector<Split>{{{1, 2}, {0, 3}}, {{0, 2}, {3, 4, 5}}});
  CHECK(some.tested == 5);
  CHECK(some.found == 2);
  CHECK(some.test == "file3");
  CHECK(some.train == "file0");
}

TEST_CASE("a twin of another label contradicts, and is the one that is named") {
  FeatureMatrix matrix = rows({{1, 2}, {3, 4}, {1, 2}, {3, 4}, {5, 6}});
  const std::vector<Split> splits{{{0, 1, 4}, {2, 3}}};
  CHECK(find_duplicates(matrix, splits).contradicting == 0);
  matrix.labels[3] = "x";
  const DuplicateRows some = find_duplicates(matrix, splits);
  CHECK(some.found == 2);
  CHECK(some.contradicting == 1);
  CHECK(some.test == "file3");
  CHECK(some.train == "file1");
}

TEST_CASE("windows of silence that two recordings have in common make no copies of them") {
  FeatureMatrix matrix = rows({{0, 0}, {0, 0}, {0, 0}, {1, 2}, {0, 0}, {0, 0}, {3, 4}, {5, 6}});
  matrix.files = {"a#w0", "a#w1", "a#w2", "a#w3", "b#w0", "b#w1", "b#w2", "b#w3"};
  const std::vector<Split> splits{{{0, 1, 2, 3}, {4, 5, 6, 7}}};
  CHECK(find_duplicates(matrix, splits).found == 0);
  matrix.values.row(6)[0] = 1;
  matrix.values.row(6)[1] = 2;  // now row 6 has all values of a, which is the beginning of b
  CHECK(find_duplicates(matrix, splits).found == 3);
  CHECK(find_duplicates(matrix, std::vector<Split>{{{0, 1}, {2, 3}}}).found == 0);  // one recording
}

TEST_CASE("copies are found among many that have a window of silence in common") {
  constexpr std::size_t others = 60, copies = 12;
  std::vector<std::vector<double>> values;
  std::vector<std::string> files;
  std::vector<Split> splits(1);
  for (std::size_t k = 0; k < others + copies; ++k)
    for (std::size_t w = 0; w < 4; ++w) {
      (k % 2 == 0 ? splits[0].train : splits[0].test).push_back(files.size());
      const double own = static_cast<double>(k < others ? k : others);
      values.push_back(w == 0 ? std::vector{0.0, 0.0} : std::vector{own + 1, double(w)});
      files.push_back(std::to_string(k) + "#w" + std::to_string(w));
    }
  FeatureMatrix matrix = rows(values);
  matrix.files = files;
  CHECK(find_duplicates(matrix, splits).found == 4 * copies / 2);
  CHECK(find_duplicates(matrix, splits).test == std::to_string(others + 1) + "#w0");
}

}  // namespace
}  // namespace weft::classifier::duplicate_rows_test
