// Prints one digest per learner: the features of made-up trials, and every bit of the trained model
// and its predictions. script/same-bytes builds it with several compilers and compares the lines.
// No function of the C library makes the trials.

#include <string>

#include "classifier/base/random.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/learners/learner_text.hpp"
#include "tests/scenario/bytes_digest.hpp"

using namespace weft;
using testing::Digest;
using testing::expected;
using namespace weft::classifier;

namespace {

constexpr std::size_t fabrics = 5, repetitions = 8, taxels = 6;

/// Counts of a random walk; each fabric has its own step size.
Trial made_trial(std::size_t fabric, std::size_t repetition, RandomEngine& engine) {
  Trial out;
  out.label = std::string("fabric ") + std::to_string(fabric);
  out.group = std::to_string(repetition);
  out.file = out.label + " " + out.group;
  out.taxels = taxels;
  std::vector<double> count(taxels, 9000.0);
  for (const auto& [phase, samples] :
       {std::pair{Phase::rest, 20}, {Phase::press, 41}, {Phase::motion, 313}, {Phase::end, 17}}) {
    for (int i = 0; i < samples; ++i) {
      out.phase.push_back(phase);
      for (std::size_t t = 0; t < taxels; ++t) {
        const auto step = static_cast<double>(random_below(engine, 21 + 2 * fabric));
        count[t] += step - 10.0 - static_cast<double>(fabric) * (t % 2 == 0 ? 0.9 : 1.0);
        out.counts.push_back(count[t]);
      }
    }
  }
  return out;
}

FeatureMatrix made_matrix() {
  RandomEngine engine(17);
  std::vector<Trial> trials;
  for (std::size_t f = 0; f < fabrics; ++f)
    for (std::size_t r = 0; r < repetitions; ++r) trials.push_back(made_trial(f, r, engine));
  return expected(build_feature_matrix(trials));
}

void print_model(const std::string& name, const FeatureMatrix& matrix,
                 const TrainedLearner& trained) {
  LineWriter out;
  write_learner(out, trained);
  Digest digest;
  digest.add(out.str());
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const auto row = matrix.values.row(r);
    digest.add(trained.labels()[expected(trained.classify(row))]);
    if (const FabricModel* cores = trained.cores()) {
      const auto vote = expected(cores->classify(expected(trained.prepared(row))));
      for (const double decision : vote.decision) digest.add(decision);
    }
  }
  digest.print(name);
}

}  // namespace

int main() {
  const FeatureMatrix matrix = made_matrix();
  Digest features;
  for (const double v : matrix.values.data()) features.add(v);
  features.print("features");
  for (const Learner learner :
       {Learner::pvalue, Learner::pca, Learner::all, Learner::lda, Learner::svc, Learner::trees})
    for (const View view : tried_views())
      print_model(std::string(to_string(learner)) + ", " + std::string(to_string(view)), matrix,
                  expected(train_recipe(matrix, {learner, 20, view}, {})));
  print_model("best", matrix, expected(train_learner(matrix, Learner::best, {})).trained);
  return 0;
}
