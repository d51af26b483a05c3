// Results of our classifier on trials in the Python reference's own CSV form, for
// oracle_agreement.py and for tests with real recordings.
//
//   oracle_agreement features INDEX.csv            feature CSV, 17 digits: label, then Table I
//   oracle_agreement pairs INDEX.csv               per pair and feature t and p, per delta the
//                                              subset
//   oracle_agreement cores INDEX.csv TRAIN TEST REDUCTION      per core its folds, parameters and
//                                              decisions on the test rows; the votes' winners
//   oracle_agreement evaluate INDEX.csv TRAIN TEST LEARNER [WINDOW_S PERIOD_S]
//
// REDUCTION: pvalue, pca or all; LEARNER: these and lda, svc, trees, cores-best, best. Each with
// -groups for folds by group, or with -paper to select once outside the folds.
//
// INDEX.csv: header file,label,group; trial CSV: header phase,c1..cn. TRAIN and TEST are lists of
// groups: 0,1.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "classifier/base/student_t.hpp"
#include "classifier/evaluate/evaluate.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/selection/selection.hpp"
#include "tests/unit/classifier/support.hpp"

namespace {

using namespace weft;
using namespace weft::classifier;

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::stringstream in(line.ends_with('\r') ? line.substr(0, line.size() - 1) : line);
  for (std::string cell; std::getline(in, cell, ',');) out.push_back(cell);
  return out;
}

Trial read_trial(const std::filesystem::path& file) {
  Trial out;
  out.file = file.filename();
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  out.taxels = cells(line).size() - 1;
  while (std::getline(in, line)) {
    const auto row = cells(line);
    out.phase.push_back(phase_from_char(row[0][0]).value_or(Phase::none));
    for (std::size_t k = 1; k < row.size(); ++k) out.counts.push_back(std::stod(row[k]));
  }
  return out;
}

std::vector<Trial> read_index(const std::filesystem::path& index) {
  std::vector<Trial> out;
  std::ifstream in(index);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    const auto row = cells(line);
    out.push_back(read_trial(index.parent_path() / row[0]));
    out.back().label = row[1];
    out.back().group = row.size() > 2 ? row[2] : "";
  }
  return out;
}

template <class T>
T or_exit(Result<T>&& result) {
  if (!result) {
    std::cerr << to_string(result.error()) << "\n";
    std::exit(1);
  }
  return std::move(*result);
}

void print_features(const FeatureMatrix& matrix) {
  std::printf("label");
  for (const auto& name : matrix.names) std::printf(",%s", name.c_str());
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    std::printf("\n%s", matrix.labels[r].c_str());
    for (const double v : matrix.values.row(r)) std::printf(",%.17g", v);
  }
  std::printf("\n");
}

std::vector<std::size_t> rows_of(const FeatureMatrix& matrix, const std::string& label) {
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    if (matrix.labels[r] == label) out.push_back(r);
  }
  return out;
}

// One line a pair and value: a,b,t,... then a,b,p,... and a,b,DELTA,subset
void print_pair(const FeatureMatrix& matrix, const std::string& a, const std::string& b) {
  auto rows = rows_of(matrix, a);
  std::vector<int> sign(rows.size(), 1);
  for (const std::size_t r : rows_of(matrix, b)) rows.push_back(r);
  sign.resize(rows.size(), -1);
  const auto t = classifier::testing::t_of_all(matrix.values.take(rows), sign);
  const double df = static_cast<double>(rows.size()) - 2.0;
  std::printf("%s,%s,t", a.c_str(), b.c_str());
  for (const double v : t) std::printf(",%.17g", v);
  std::printf("\n%s,%s,p", a.c_str(), b.c_str());
  for (const double v : t) std::printf(",%.17g", two_sided_p(v, df));
  const auto ranked = rank_by_t(t);
  for (const double delta : Grid{}.delta) {
    std::printf("\n%s,%s,%g", a.c_str(), b.c_str(), delta);
    const auto size = subset_size(t, ranked, df, delta, TrainOptions{}.cap);
    for (std::size_t k = 0; k < size; ++k) std::printf(",%zu", ranked[k]);
  }
  std::printf("\n");
}

void print_pairs(const FeatureMatrix& matrix) {
  std::vector<std::string> labels = matrix.labels;
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  for (const auto [a, b] : all_pairs(labels.size())) print_pair(matrix, labels[a], labels[b]);
}

std::vector<Trial> windows_of(const std::vector<Trial>& trials, double window_s, double period_s) {
  std::vector<Trial> out;
  for (const Trial& trial : trials) {
    for (Trial& w : or_exit(cut_windows(trial, {window_s, 0.0, period_s}))) {
      out.push_back(std::move(w));
    }
  }
  return out;
}

struct Setting {
  std::string name;  // a reduction or a learner
  TrainOptions options;
};

Setting setting_of(std::string name) {
  TrainOptions options;
  const auto take_suffix = [&](const std::string& suffix) {
    if (!name.ends_with(suffix)) return false;
    name.resize(name.size() - suffix.size());
    return true;
  };
  options.nested = !take_suffix("-paper");
  if (take_suffix("-groups")) options.fold_unit = FoldUnit::group;
  return {std::move(name), options};
}

// For every row of the core the fold in which it validates, rows of class a first.
void print_folds(const PairProblem& problem) {
  std::vector<std::size_t> fold_of(problem.rows.size());
  for (std::size_t f = 0; f < problem.folds.size(); ++f)
    for (const std::size_t row : problem.folds[f].validate) fold_of[row] = f;
  for (const std::size_t f : fold_of) std::printf(",%zu", f);
}

// core,a,b,C,gamma,threshold,errors,loss,inputs; folds,a,b,...; decisions,a,b,...; and the winners.
void print_cores(const FeatureMatrix& matrix, char** argument) {
  auto [reduction, options] = setting_of(argument[2]);
  options.reduction = classifier::testing::reduction_named(reduction);
  const Split split = or_exit(grouped_split(matrix.groups, cells(argument[0]), cells(argument[1])));
  const FeatureMatrix rows = select_rows(matrix, split.train);
  const FabricModel model = or_exit(train(rows, options));
  const std::vector<Vote> votes =
      classifier::testing::votes_on(model, select_rows(matrix, split.test));
  const RowsOfLabel of_label = rows_by_label(rows);
  for (std::size_t i = 0; i < model.pairs().size(); ++i) {
    const std::string &a = model.labels()[model.pairs()[i].a],
                      &b = model.labels()[model.pairs()[i].b];
    const CoreInfo& info = model.cores()[i].info();
    std::printf("core,%s,%s,%.17g,%.17g,%.17g,%zu,%.17g,%zu\nfolds,%s,%s", a.c_str(), b.c_str(),
                info.c, info.gamma, info.threshold, info.cv_errors, info.cv_loss, info.inputs,
                a.c_str(), b.c_str());
    print_folds(PairMaker(rows, options).make(of_label.at(a), of_label.at(b)));
    std::printf("\ndecisions,%s,%s", a.c_str(), b.c_str());
    for (const Vote& vote : votes) std::printf(",%.17g", vote.decision[i]);
    std::printf("\n");
  }
  std::printf("winners,,");
  for (const Vote& vote : votes) std::printf(",%s", model.labels()[vote.winner].c_str());
  std::printf("\n");
}

void print_evaluation(const FeatureMatrix& matrix, char** argument) {
  const auto [name, options] = setting_of(argument[2]);
  const Split split = or_exit(grouped_split(matrix.groups, cells(argument[0]), cells(argument[1])));
  const Evaluation e =
      or_exit(evaluate(matrix, std::vector{split}, or_exit(learner_from(name)), options));

  std::printf("%s: accuracy %.4f (%zu of %zu), 95 %% %.4f-%.4f, trained %s\n", argument[2],
              e.accuracy, e.confusion.correct(), e.confusion.total(), e.ci95.low, e.ci95.high,
              to_string(e.recipes.front()).c_str());
  for (std::size_t t = 0; t < e.confusion.classes(); ++t) {
    std::printf("  %-14s", e.confusion.labels[t].c_str());
    for (std::size_t p = 0; p < e.confusion.classes(); ++p)
      std::printf(" %4zu", e.confusion.at(t, p));
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string command = argc > 2 ? argv[1] : "";
  const bool windows = command == "evaluate" && argc == 8;
  const bool splits = (command == "evaluate" || command == "cores") && argc >= 6;
  if (command != "features" && command != "pairs" && !splits) {
    std::fprintf(stderr,
                 "usage: features INDEX | pairs INDEX | cores INDEX TRAIN TEST REDUCTION | "
                 "evaluate INDEX TRAIN TEST LEARNER [WINDOW_S PERIOD_S]\n");
    return 2;
  }
  std::vector<Trial> trials = read_index(argv[2]);
  if (windows) trials = windows_of(trials, std::stod(argv[6]), std::stod(argv[7]));
  const FeatureMatrix matrix = or_exit(build_feature_matrix(trials));
  if (command == "features") print_features(matrix);
  if (command == "pairs") print_pairs(matrix);
  if (command == "cores") print_cores(matrix, argv + 3);
  if (command == "evaluate") print_evaluation(matrix, argv + 3);
  return 0;
}
