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

#include "classifier/vibro/cross_validation.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;

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
  const Recipe recipe = vibro::window_recipe(or_exit(learner_from(argv[1])), std::stoul(argv[4]));
  TrainOptions options;
  options.trees = std::stoul(argv[2]);
  const auto size = read<std::uint64_t>(3);
  FeatureMatrix all;
  all.values = Matrix(size[0], size[1]);
  const auto values = read<double>(size[0] * size[1]);
  std::copy(values.begin(), values.end(), all.values.data().begin());
  for (std::size_t f = 0; f < size[1]; ++f) all.names.push_back(std::to_string(f));
  for (const std::uint64_t c : read<std::uint64_t>(size[0]))
    all.labels.push_back(std::to_string(1'000'000 + c));  // in the order of the classes
  all.groups.resize(size[0]);
  all.files.resize(size[0]);
  for (std::uint64_t seed = 0; seed < std::stoul(argv[3]); ++seed) {
    std::vector<std::size_t> train, test;
    const auto trains = read<std::uint8_t>(size[0]);
    for (std::size_t r = 0; r < trains.size(); ++r) (trains[r] != 0 ? train : test).push_back(r);
    options.seed = seed;
    const TrainedLearner trained = or_exit(train_recipe(select_rows(all, train), recipe, options));
    std::size_t right = 0;
    for (const std::size_t r : test) {
      const std::size_t answer = or_exit(trained.classify(all.values.row(r)));
      right += trained.labels()[answer] == all.labels[r] ? 1 : 0;
    }
    std::printf("%.17g\n", static_cast<double>(right) / static_cast<double>(test.size()));
  }
  return 0;
}
