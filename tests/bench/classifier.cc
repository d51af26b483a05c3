// Compares the classifier with common tools: training, features, one vote, growth with the number
// of fabrics. All data are simulated or made up.

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "classifier/evaluate/splits.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/bench/classifier_libsvm.hpp"
#include "tests/bench/classifier_set.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;
using bench::compute_median;
using bench::Figure;
using bench::seconds_of;

constexpr std::size_t runs = 5;
const std::filesystem::path scratch = "out/bench";

std::string load_average() {
  std::ifstream in("/proc/loadavg");
  std::string one;
  in >> one;
  return "load average " + one;
}

std::string text(double v, const char* format = "%.4g") {
  char out[32];
  std::snprintf(out, sizeof out, format, v);
  return out;
}

// Output of classifier_peers.py; nothing without python or scikit-learn.
nlohmann::json run_peer(const std::string& arguments) {
  return bench::json_of("/usr/bin/python3 tests/bench/classifier_peers.py " + arguments +
                        " 2>/dev/null");
}

// Training part (8 of 20 trials of each fabric) and test part.
struct Set {
  std::string name;
  FeatureMatrix train, test;
};

Set split_set(std::string name, const FeatureMatrix& all) {
  const Split split = stratified_splits(all.labels, 0.4, 1, 1).value().front();
  return {std::move(name), select_rows(all, split.train), select_rows(all, split.test)};
}

// Empty without a campaign.
std::vector<Trial> campaign_trials() {
  const auto dataset = daemon::read_hdf5("out/demo/dataset.h5");
  return dataset ? daemon::complete_trials(*dataset, "M1") : std::vector<Trial>();
}

std::optional<Set> campaign_set(const std::vector<Trial>& trials) {
  const auto matrix = build_feature_matrix(trials);
  if (!matrix) return std::nullopt;
  return split_set("simulated campaign M1", *matrix);
}

std::vector<bench::PairRows> pairs_of(const FeatureMatrix& train, const TrainOptions& options) {
  std::vector<std::string> labels = train.labels;
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  std::vector<bench::PairRows> out;
  for (const Pair& pair : all_pairs(labels.size())) {
    std::vector<std::size_t> rows, unit;
    std::vector<int> sign;
    for (const bool positive : {true, false}) {
      for (std::size_t r = 0; r < train.size(); ++r) {
        if (train.labels[r] != labels[positive ? pair.a : pair.b]) continue;
        unit.push_back(rows.size());
        rows.push_back(r);
        sign.push_back(positive ? 1 : -1);
      }
    }
    auto folds = stratified_folds(sign, unit, options.folds, options.seed);
    out.push_back({train.values.take(rows), std::move(sign), std::move(folds)});
  }
  return out;
}

// Number of cores with other parameters than the plain search.
std::size_t differing(const FabricModel& model, const std::vector<bench::PlainChoice>& plain) {
  std::size_t out = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const CoreInfo& info = model.cores()[i].info();
    const auto& [c, gamma, delta, fits] = plain[i];
    if (info.c != c || info.gamma != gamma || info.threshold != delta) ++out;
  }
  return out;
}

// Seconds of the whole job with scikit-learn, extrapolated from a few pairs; nothing if it is
// absent.
std::optional<double> scikit_seconds(const Set& set, std::size_t pairs) {
  if (pairs == 0) return std::nullopt;
  const auto path = scratch / "classifier_train.csv";
  std::ofstream out(path);
  out.precision(17);
  for (std::size_t r = 0; r < set.train.size(); ++r) {
    out << set.train.labels[r];
    for (const double v : set.train.values.row(r)) out << ',' << v;
    out << '\n';
  }
  out.close();
  const nlohmann::json reply = run_peer("grid " + path.string() + " " + std::to_string(pairs));
  if (!reply.is_object()) return std::nullopt;
  auto seconds = reply["seconds"].get<std::vector<double>>();
  return bench::median(seconds) * reply["pairs"].get<double>();
}

void training(const Set& set, std::size_t scikit_pairs, std::vector<Figure>& out) {
  const TrainOptions options{.threads = 1};
  const auto pairs = pairs_of(set.train, options);
  std::vector<bench::PlainChoice> plain(pairs.size());
  std::vector<double> one, two, libsvm;
  std::optional<FabricModel> model;
  for (std::size_t run = 0; run < runs; ++run) {  // alternating, so that other load affects all
                                                  // equally
    libsvm.push_back(seconds_of([&] {
      for (std::size_t i = 0; i < pairs.size(); ++i)
        plain[i] = bench::plain_search(pairs[i], options);
    }));
    for (int again = 0; again < 3; ++again) {
      one.push_back(seconds_of([&] { model.emplace(train(set.train, options).value()); }));
      two.push_back(seconds_of([&] { model.emplace(train(set.train, {.threads = 2}).value()); }));
    }
  }
  std::size_t fits = 0, own_fits = 0;
  for (const auto& choice : plain) fits += choice.fits;
  for (const FabricCore& core : model->cores()) own_fits += core.info().fits;
  const double own = bench::median(one), peer = bench::median(libsvm);
  const std::string note =
      std::to_string(own_fits) + " fits instead of " + std::to_string(fits) +
      "; cores with other parameters: " + std::to_string(differing(*model, plain)) +
      "; peer over ours " + text(peer / own) + "; " + load_average();
  out.push_back({"train, 1 thread: " + set.name, own, "s", "libsvm precomputed, every fit", peer,
                 note, bench::faster_by(20)});
  out.push_back({"train, 2 threads: " + set.name, bench::median(two), "s", "same, 1 thread", own,
                 load_average()});
  if (const auto scikit = scikit_seconds(set, scikit_pairs))
    out.push_back(
        {"train, 1 thread: " + set.name, own, "s", "scikit-learn Pipeline, grid search", *scikit,
         "median of " + std::to_string(scikit_pairs) + " pairs x " + std::to_string(pairs.size()) +
             " pairs; peer over ours " + text(*scikit / own),
         bench::faster_by(5000)});
}

void voting(const Set& set, std::vector<Figure>& out) {
  const FabricModel model = train(set.train).value();
  constexpr std::size_t votes = 20;  // short enough to fit between two time slices of another
                                     // process
  const auto vote = [&](std::size_t r) {
    const auto made = model.classify(set.test.values.row(r));
    return model.labels()[made->winner] == set.test.labels[r] ? 1U : 0U;
  };
  std::size_t right = 0, row = 0;
  for (std::size_t r = 0; r < set.test.size(); ++r) right += vote(r);
  const double each = compute_median(101,
                                     [&] {
                                       for (std::size_t i = 0; i < votes; ++i)
                                         if (vote(row++ % set.test.size()) > 1) std::abort();
                                     }) /
                      votes;
  // Each distance needs a load and two operations per input: four a cycle with eight lanes at 2.5
  // GHz. Each support vector needs an exponential, about 3 ns.
  double limit = 0.0;
  for (const FabricCore& core : model.cores()) {
    const auto vectors = static_cast<double>(core.support().rows());
    limit += vectors * (static_cast<double>(core.support().cols()) / 8.0 * 0.4e-9 + 3e-9);
  }
  out.push_back({"one trial voted: " + set.name, each * 1e6, "us", "required limit", 20.0,
                 std::to_string(right) + " of " + std::to_string(set.test.size()) +
                     " right; arithmetic alone " + text(limit * 1e6) + " us; " + load_average(),
                 bench::at_most(20)});
}

// Time of an answer from samples to winner, alternating between all features and those that the
// model uses.
void predict_once(const TrainedLearner& learner, const std::vector<Trial>& trials, std::size_t at,
                  FeatureExtractor& extractor) {
  const auto features = extractor.extract(trials[at % trials.size()]);
  if (!features || !learner.classify(*features)) std::abort();
}

std::string names_of(BlockSet blocks) {
  std::string out;
  const FeatureLayout layout(1, {});
  for (const FeatureInfo& column : layout.columns())
    if (!blocks.has(column.block))
      out += (out.empty() ? "" : " ") + column.name.substr(0, column.name.find('.'));
  return out.empty() ? "no block left out" : "left out: " + out;
}

void predictions(const std::string& name, const std::vector<Trial>& trials,
                 std::vector<Figure>& out) {
  const FeatureMatrix matrix = build_feature_matrix(trials).value();
  const FeatureLayout layout(trials.front().taxels, phases_of(trials.front()));
  for (const std::size_t cap : {std::size_t{5}, std::size_t{10}, std::size_t{20}}) {
    const TrainedLearner learner = train_recipe(matrix, {Learner::pvalue, cap}, {}).value();
    const std::vector<std::size_t> columns = learner.used_columns();
    const BlockSet wanted = layout.blocks_of(columns);
    FeatureExtractor all, some({}, wanted);
    std::vector<double> before, after, answer;
    for (std::size_t i = 0; i < 101 + trials.size(); ++i) {  // the first round fills the tables
      predict_once(learner, trials, i, all);  // the first reader of the trial waits for memory
      const double slow = seconds_of([&] { predict_once(learner, trials, i, all); });
      const double fast = seconds_of([&] { predict_once(learner, trials, i, some); });
      const auto row = matrix.values.row(i % matrix.size());
      const double vote = seconds_of([&] {
        if (!learner.classify(row)) std::abort();
      });
      if (i < trials.size()) continue;
      before.push_back(slow), after.push_back(fast), answer.push_back(vote);
    }
    out.push_back({"one prediction, N " + std::to_string(cap) + ": " + name,
                   bench::median(after) * 1e6, "us", "all features computed",
                   bench::median(before) * 1e6,
                   std::to_string(columns.size()) + " of " + std::to_string(layout.size()) +
                       " columns used; " + names_of(wanted) + "; the vote alone " +
                       text(bench::median(answer) * 1e6) + " us; " + load_average()});
  }
}

double extraction_seconds(const Trial& trial) {
  FeatureExtractor extractor;
  return compute_median(41, [&] {
    if (!extractor.extract(trial)) std::abort();
  });
}

Trial trial_of_length(std::size_t motion_samples) {
  bench::Dice dice(5);
  const bench::MadeSensor sensor(dice);
  const bench::MadeFabric fabric = bench::make_fabric(dice);
  return bench::make_trial(fabric, sensor, dice, motion_samples);
}

std::optional<double> oracle_seconds(const Trial& trial) {
  const auto path = scratch / "classifier_trial.csv";
  std::ofstream out(path);
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    out << to_char(trial.phase[i]);
    for (const double v : trial.row(i)) out << ',' << v;
    out << '\n';
  }
  out.close();
  const auto reply = run_peer("extract " + path.string() + " ../shared/oracle/fabric000.py");
  if (!reply.is_object()) return std::nullopt;
  auto seconds = reply["seconds"].get<std::vector<double>>();
  return bench::median(seconds);
}

void features(std::vector<Figure>& out) {
  constexpr std::size_t usual = 925;
  const Trial trial = trial_of_length(usual);
  const double own = extraction_seconds(trial);
  // Two transforms of 2048 for eight lanes: 10 n log2 n operations, 16 a cycle at 2.5 GHz. The
  // samples are read three times from the cache.
  const double flops = 8.0 * 10.0 * 2048.0 * 11.0;
  out.push_back({"features of 16 x 925 samples", own * 1e6, "us", "required limit", 150.0,
                 "arithmetic of the transforms alone " + text(flops / 16.0 / 2.5e9 * 1e6) +
                     " us; " + load_average(),
                 bench::at_most(150)});
  if (const auto peer = oracle_seconds(trial))
    out.push_back({"features of 16 x 925 samples", own * 1e6, "us", "numpy (oracle's extract)",
                   *peer * 1e6, "peer over ours " + text(*peer / own)});
}

// Phase M only, with plain noise as counts: the time does not depend on the values.
Trial motion_of(std::size_t samples, std::size_t taxels) {
  bench::Dice dice(5);
  Trial out;
  out.taxels = taxels;
  out.phase.assign(samples, Phase::motion);
  out.counts.resize(samples * taxels);
  for (double& v : out.counts) v = std::nearbyint(dice.normal(9000.0, 300.0));
  return out;
}

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Processor time of one extraction; short ones are measured in batches.
double measure_cost(FeatureExtractor& extractor, const Trial& trial) {
  const std::size_t times = 100'000 / (trial.samples() + 30) + 1;
  const double start = processor_seconds();
  for (std::size_t i = 0; i < times; ++i)
    if (!extractor.extract(trial)) std::abort();
  return (processor_seconds() - start) / static_cast<double>(times);
}

// Ratio to the time per sample of an M1 trial, both sides alternating; the median.
void cost_per_sample(std::size_t length, std::size_t taxels, std::vector<Figure>& out) {
  constexpr std::size_t usual = 925;
  const Trial trial = motion_of(length, taxels), m1 = motion_of(usual, taxels);
  FeatureExtractor own, other;
  measure_cost(own, trial), measure_cost(other, m1);  // warms memory and tables
  std::vector<double> each, reference, ratio;
  for (std::size_t run = 0; run < (length < 50'000 ? 21U : 3U); ++run) {
    each.push_back(measure_cost(own, trial) / static_cast<double>(length) * 1e9);
    reference.push_back(measure_cost(other, m1) / static_cast<double>(usual) * 1e9);
    ratio.push_back(each.back() / reference.back());
  }
  out.push_back({"features per sample, " + std::to_string(taxels) + " x " + std::to_string(length),
                 bench::median(each), "ns", "per sample of as many x 925", bench::median(reference),
                 "ratio " + text(bench::median(ratio), "%.2f") + ", processor time",
                 bench::ratio_at_most(3)});
}

void any_length(bool quick, std::vector<Figure>& out) {
  for (const std::size_t length :
       {1U,     2U,      3U,      5U,      7U,       11U,        13U,
        17U,    37U,     101U,    907U,    997U,     1031U,      1847U,
        9'973U, 16'411U, 20'011U, 99'991U, 300'007U, 1'000'003U, 1'048'576U})
    if (!quick || length < 20'000) cost_per_sample(length, bench::bench_taxels, out);
  // with more taxels a motion has at most 2^20 samples
  if (!quick)
    for (const std::size_t taxels : {std::size_t{1}, std::size_t{2}})
      cost_per_sample(10'000'019, taxels, out);
}

FeatureMatrix gaussian(std::size_t classes) {
  constexpr std::size_t columns = 195, per_class = 8;
  bench::Dice dice(11);
  FeatureMatrix out;
  out.values = Matrix(classes * per_class, columns);
  for (std::size_t k = 0; k < columns; ++k)
    out.names.push_back(std::string("f") + std::to_string(k));
  for (std::size_t c = 0; c < classes; ++c) {
    std::vector<double> centre(columns);
    for (double& v : centre) v = dice.normal(0.0, 1.0);
    for (std::size_t r = 0; r < per_class; ++r) {
      const std::size_t row = c * per_class + r;
      for (std::size_t k = 0; k < columns; ++k)
        out.values(row, k) = centre[k] + dice.normal(0.0, 0.7);
      out.labels.push_back(std::to_string(10000 + c));
      out.groups.push_back(std::to_string(r));
      out.files.push_back(std::to_string(row) + ".csv");
    }
  }
  return out;
}

// Slope of log time over log classes by least squares.
double exponent(const std::vector<std::pair<double, double>>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto n = static_cast<double>(points.size());
  for (const auto& [classes, s] : points) {
    const double a = std::log(classes), b = std::log(s);
    x += a, y += b, xx += a * a, xy += a * b;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

// Seconds and note of a training on all classes with two threads.
double growth_seconds(std::size_t classes, Tie tie, std::string& note) {
  const FeatureMatrix matrix = gaussian(classes);
  const double s = compute_median(classes < 500 ? runs : 3, [&] {
    if (!train(matrix, {.tie = tie, .threads = 2})) std::abort();
  });
  const auto pairs = static_cast<double>(classes * (classes - 1) / 2);
  note = text(s / pairs * 1e6) + " us a pair; " + load_average();
  return s;
}

void growth(std::vector<Figure>& out) {
  for (const Tie tie : {Tie::automatic, Tie::loss}) {
    const std::string rule = tie == Tie::loss ? "ties by loss" : "default ties";
    std::vector<std::pair<double, double>> points;
    for (const std::size_t classes :
         {std::size_t{17}, std::size_t{50}, std::size_t{100}, std::size_t{500}}) {
      std::string note;
      const double s = growth_seconds(classes, tie, note);
      points.emplace_back(static_cast<double>(classes), s);
      out.push_back(
          {"train, 2 threads, made up, " + rule + ": " + std::to_string(classes) + " classes", s,
           "s", classes == 500 ? "required limit" : "17 classes",
           classes == 500 ? 10.0 : points.front().second, note,
           classes == 500 ? std::optional(bench::at_most(10)) : std::nullopt});
    }
    out.push_back({"exponent of time over classes, " + rule, exponent(points), "", "pairs alone",
                   2.0, "least squares on the logarithms of the four rows above"});
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::filesystem::create_directories(scratch);
  const bool quick = argc > 1 && std::string(argv[1]) == "--quick";  // skips python and growth
  std::vector<Figure> out;
  const Set made =
      split_set("made up", build_feature_matrix(bench::made_trials(17, 20, 7)).value());
  const std::optional<Set> campaign = campaign_set(campaign_trials());
  if (!campaign) std::printf("no out/demo/dataset.h5: the simulated campaign is left out\n");
  training(made, quick ? 0 : 5, out);
  if (campaign) training(*campaign, quick ? 0 : 5, out);
  voting(made, out);
  if (campaign) voting(*campaign, out);
  for (const std::size_t fabrics : {std::size_t{2}, std::size_t{5}, std::size_t{17}})
    predictions("made up, " + std::to_string(fabrics) + " fabrics",
                bench::made_trials(fabrics, 8, 7), out);
  if (campaign) predictions("simulated campaign M1", campaign_trials(), out);
  features(out);
  any_length(quick, out);
  if (!quick) growth(out);
  return bench::report("classifier", out);
}
