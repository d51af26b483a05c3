#include "classifier/evaluate/twins.hpp"

#include <catch2/catch.hpp>

namespace weft::classifier::twins_test {
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
  const Twins none = twins_of(matrix, std::vector<Split>{{{0, 1, 2}, {4}}, {{0, 3}, {1}}});
  CHECK(none.tested == 2);
  CHECK(none.found == 0);
  CHECK(none.test.empty());
  const Twins some = twins_of(matrix, std::vector<Split>{{{1, 2}, {0, 3}}, {{0, 2}, {3, 4, 5}}});
  CHECK(some.tested == 5);
  CHECK(some.found == 2);
  CHECK(some.test == "file3");
  CHECK(some.train == "file0");
}

}  // namespace
}  // namespace weft::classifier::twins_test
