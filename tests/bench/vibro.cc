// Sound and vibration: features of a window and answers of the learners, compared with numpy,
// scipy, scikit-learn and XGBoost's Python on the same data in the same run (vibro_peers.py). Data
// are made up: noise of twelve classes. Times are processor times of one thread, so that other work
// of the machine counts for neither side.

#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "classifier/base/random.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/extract.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;
using namespace weft::classifier::vibro;
using bench::Figure;

const std::filesystem::path scratch = "out/bench";
constexpr std::size_t classes = 12, per_class = 100, components = 3;

// Median of one call's time [s] over `count` batches of `calls`; reading the clock costs as much as
// the quickest answers.
double compute_median(std::size_t count, std::size_t calls, const std::function<void()>& work) {
  work();  // warms caches and tables
  std::vector<double> s;
  for (std::size_t i = 0; i < count; ++i) {
    const double begun = bench::processor_seconds();
    for (std::size_t k = 0; k < calls; ++k) work();
    s.push_back((bench::processor_seconds() - begun) / static_cast<double>(calls));
  }
  return bench::median(s);
}

// Output of vibro_peers.py; nothing without scikit-learn.
nlohmann::json run_peer(const std::string& arguments) {
  return bench::json_of(
      "OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 /usr/bin/python3 tests/bench/vibro_peers.py " +
      arguments + " 2>/dev/null");
}

// Roughly normal: the sum of four uniform numbers.
std::vector<double> noise(std::size_t n, RandomEngine& engine) {
  std::vector<double> out;
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0.0;
    for (int k = 0; k < 4; ++k) sum += static_cast<double>(engine() >> 11U) * 0x1p-53 - 0.5;
    out.push_back(sum);
  }
  return out;
}

std::vector<Channel> channels_of(const std::string& source) {
  std::vector<Channel> out;
  for (const char c : source) out.push_back({std::string(1, c), c == 'S' ? 8000.0 : 200.0, "1"});
  return out;
}

void add(std::vector<Figure>& figures, const std::string& name, double ours,
         const nlohmann::json& peers, const std::string& key, const std::string& peer) {
  const double theirs = peers.is_object() ? peers.value(key, 0.0) : 0.0;
  figures.push_back({name, 1e6 * ours, "us", peer, 1e6 * theirs,
                     theirs > 0 ? "peer takes " + std::to_string(theirs / ours) + " times as long"
                                : "no peer here"});
}

void measure_features(std::vector<Figure>& figures, const nlohmann::json& peers) {
  RandomEngine engine(1);
  for (const std::string source : {"S", "XYZ", "SXYZ"}) {
    for (const double window_s : {1.0, 2.0}) {
      const auto channels = channels_of(source);
      std::vector<std::vector<double>> samples;
      WindowView window;
      for (const Channel& c : channels)
        samples.push_back(noise(samples_in(window_s, c.rate_hz), engine));
      for (const auto& s : samples) window.emplace_back(s);
      auto extractor = WindowExtractor::make(channels, {Family::all, Combine::concat}).value();
      const double own = compute_median(101, 3, [&] { (void)extractor.features(window); });
      const std::string key = source + (window_s == 1.0 ? " 1 s" : " 2 s");
      add(figures, "features of a window, " + key, own, peers, "features " + key,
          "numpy, the reference");
    }
  }
}

struct Set {
  Matrix train, test;
  std::vector<std::size_t> of_train;
};

// Nine features with a spread as large as the distance of the classes.
Set made_up_set() {
  RandomEngine engine(2);
  constexpr std::size_t features = 9, rows = classes * per_class, trains = rows * 4 / 5;
  Set out{Matrix(trains, features), Matrix(rows - trains, features), {}};
  const std::vector<double> centre = noise(classes * features, engine);
  for (std::size_t r = 0; r < rows; ++r) {
    const std::size_t c = r % classes;
    const auto spread = noise(features, engine);
    auto to = r < trains ? out.train.row(r) : out.test.row(r - trains);
    for (std::size_t f = 0; f < features; ++f) to[f] = centre[c * features + f] + 0.5 * spread[f];
    if (r < trains) out.of_train.push_back(c);
  }
  return out;
}

void write_set(const Set& set, const std::filesystem::path& path) {
  std::ofstream out(path);
  out.precision(17);
  for (std::size_t r = 0; r < set.train.rows() + set.test.rows(); ++r) {
    const bool trains = r < set.train.rows();
    out << (trains ? 1 : 0) << ',' << r % classes;
    for (const double v : trains ? set.train.row(r) : set.test.row(r - set.train.rows()))
      out << ',' << v;
    out << '\n';
  }
}

FeatureMatrix matrix_of(const Set& set) {
  FeatureMatrix out;
  out.values = set.train;
  for (std::size_t f = 0; f < set.train.cols(); ++f) out.names.push_back(std::to_string(f));
  for (const std::size_t c : set.of_train) out.labels.push_back(std::to_string(1000 + c));
  out.groups.resize(set.of_train.size());
  out.files.resize(set.of_train.size());
  return out;
}

void measure_learners(std::vector<Figure>& figures, const Set& set, const nlohmann::json& peers) {
  const FeatureMatrix matrix = matrix_of(set);
  for (const Learner learner : window_learners()) {
    const std::string name(learner == Learner::all ? "Cores" : paper_name(learner));
    if (!is_available(learner)) {
      std::printf("%s: left out, no library for it in this build\n", name.c_str());
      continue;
    }
    const TrainOptions options{.threads = 1};
    std::optional<TrainedLearner> trained;
    const double fit = compute_median(3, 1, [&] {
      trained.emplace(train_recipe(matrix, window_recipe(learner, components), options).value());
    });
    std::size_t row = 0;
    const double answer = compute_median(
        101, 20, [&] { (void)trained->classify(set.test.row(row++ % set.test.rows())); });
    add(figures, name + ": training, 960 rows", fit, peers, name + " fit",
        "scikit-learn or XGBoost");
    if (peers.is_object() && peers.contains(name + " fit, hist"))
      add(figures, name + ": training, 960 rows", fit, peers, name + " fit, hist",
          "XGBoost with histograms, as in ours");
    add(figures, name + ": one answer", answer, peers, name + " answer", "scikit-learn or XGBoost");
  }
}

}  // namespace

int main() {
  std::filesystem::create_directories(scratch);
  std::vector<bench::Figure> figures;
  const Set set = made_up_set();
  const auto path = scratch / "vibro_set.csv";
  write_set(set, path);
  const auto peers = run_peer(path.string() + " ../shared/oracle");
  measure_features(figures, peers);
  measure_learners(figures, set, peers);
  return bench::report("vibro", figures);
}
