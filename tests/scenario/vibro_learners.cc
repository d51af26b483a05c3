// Accuracy of a learner on rows given as bytes, for vibro_learners.py.
//
//   vibro_learners METHOD TREES SEEDS COMPONENTS < ROWS
//
// ROWS: uint64 rows, features, classes; the values as doubles, row by row; the classes as uint64;
// then for every seed a byte per row: 1 trains, 0 tests (native byte order). Prints the accuracy of
// every seed, a line each.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <vector>

#include "classifier/vibro/learn/pipeline.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;
using namespace weft::classifier::vibro;

template <class T>
std::vector<T> read(std::size_t count) {
  std::vector<T> out(count);
  std::cin.read(reinterpret_cast<char*>(out.data()),
                static_cast<std::streamsize>(count * sizeof(T)));
  if (!std::cin) std::exit(2);
  return out;
}

template <class T>
T or_exit(Result<T>&& result) {
  if (!result) {
    std::cerr << to_string(result.error()) << "\n";
    std::exit(result.error().code == Errc::unsupported ? 77 : 1);
  }
  return std::move(*result);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  PipelineOptions options;
  options.method = or_exit(method_from(argv[1]));
  options.learner.trees = std::stoul(argv[2]);
  options.components = std::stoul(argv[4]);
  const auto size = read<std::uint64_t>(3);
  Matrix rows(size[0], size[1]);
  const auto values = read<double>(size[0] * size[1]);
  std::copy(values.begin(), values.end(), rows.data().begin());
  const auto of_row = read<std::uint64_t>(size[0]);
  for (std::uint64_t seed = 0; seed < std::stoul(argv[3]); ++seed) {
    std::vector<std::size_t> train, test, train_class;
    const auto trains = read<std::uint8_t>(size[0]);
    for (std::size_t r = 0; r < trains.size(); ++r) (trains[r] != 0 ? train : test).push_back(r);
    for (const std::size_t r : train) train_class.push_back(of_row[r]);
    options.learner.seed = seed;
    const Matrix own = rows.take(train);
    const Pipeline trained = or_exit(Pipeline::train({&own, train_class, size[2]}, options));
    std::size_t right = 0;
    for (const std::size_t r : test)
      right += or_exit(trained.classify(rows.row(r))) == of_row[r] ? 1 : 0;
    std::printf("%.17g\n", static_cast<double>(right) / static_cast<double>(test.size()));
  }
  return 0;
}
