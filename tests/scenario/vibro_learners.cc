// Accuracy of a learner on rows given as bytes, for vibro_learners.py.
//
//   vibro_learners METHOD TREES SEEDS COMPONENTS [timed] < ROWS
//
// ROWS: uint64 rows, features, classes; the values as doubles, row by row; the classes as uint64;
// then for every seed a byte per row: 1 trains, 0 tests (native byte order). Prints a line for
// every seed: the accuracy. With `timed` it uses one thread and then prints the processor seconds
// of the training and of one answer (the median over the test rows), and the class of every test
// row.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;

constexpr unsigned long first_class = 1'000'000;  // keeps labels in the order of the classes

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

// Answers for the rows, each with its own time.
struct Answers {
  std::vector<std::string> labels;
  std::vector<double> seconds;
};

Answers classify(const TrainedLearner& trained, const FeatureMatrix& all,
                 const std::vector<std::size_t>& rows) {
  Answers out;
  for (const std::size_t r : rows) {
    const double begun_s = bench::processor_seconds();
    const std::size_t answer = or_exit(trained.classify(all.values.row(r)));
    out.seconds.push_back(bench::processor_seconds() - begun_s);
    out.labels.push_back(trained.labels()[answer]);
  }
  return out;
}

void print_timed(Answers answers, double train_s) {
  const auto middle =
      answers.seconds.begin() + static_cast<std::ptrdiff_t>(answers.seconds.size() / 2);
  std::nth_element(answers.seconds.begin(), middle, answers.seconds.end());
  std::printf(" %.9g %.9g", train_s, *middle);
  for (const std::string& label : answers.labels)
    std::printf(" %lu", std::stoul(label) - first_class);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5 && argc != 6) return 2;
  const bool is_timed = argc == 6;
  const Recipe recipe = vibro::window_recipe(or_exit(learner_from(argv[1])), std::stoul(argv[4]));
  TrainOptions options;
  options.trees = std::stoul(argv[2]);
  if (is_timed) options.threads = 1;
  const auto size = read<std::uint64_t>(3);
  FeatureMatrix all;
  all.values = Matrix(size[0], size[1]);
  const auto values = read<double>(size[0] * size[1]);
  std::copy(values.begin(), values.end(), all.values.data().begin());
  for (std::size_t f = 0; f < size[1]; ++f) all.names.push_back(std::to_string(f));
  for (const std::uint64_t c : read<std::uint64_t>(size[0]))
    all.labels.push_back(std::to_string(first_class + c));
  all.groups.resize(size[0]);
  all.files.resize(size[0]);
  for (std::uint64_t seed = 0; seed < std::stoul(argv[3]); ++seed) {
    std::vector<std::size_t> train, test;
    const auto trains = read<std::uint8_t>(size[0]);
    for (std::size_t r = 0; r < trains.size(); ++r) (trains[r] != 0 ? train : test).push_back(r);
    options.seed = seed;
    const double begun_s = bench::processor_seconds();
    const TrainedLearner trained = or_exit(train_recipe(select_rows(all, train), recipe, options));
    const double train_s = bench::processor_seconds() - begun_s;
    const Answers answers = classify(trained, all, test);
    std::size_t right = 0;
    for (std::size_t i = 0; i < test.size(); ++i)
      right += answers.labels[i] == all.labels[test[i]] ? 1 : 0;
    std::printf("%.17g", static_cast<double>(right) / static_cast<double>(test.size()));
    if (is_timed) print_timed(answers, train_s);
    std::printf("\n");
  }
  return 0;
}
