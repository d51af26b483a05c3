#include "classifier/evaluate/permutation.hpp"

#include "classifier/base/random.hpp"

namespace weft::classifier {
namespace {

// Matches to expect if the answers were dealt out blindly: sum over labels of (answers x trials) /
// n.
double blind_matches(const Confusion& confusion) {
  double sum = 0.0;
  for (std::size_t k = 0; k < confusion.classes(); ++k) {
    double answers = 0.0, trials = 0.0;
    for (std::size_t j = 0; j < confusion.classes(); ++j) {
      answers += static_cast<double>(confusion.at(j, k));
      trials += static_cast<double>(confusion.at(k, j));
    }
    sum += answers * trials;
  }
  return sum / static_cast<double>(confusion.total());
}

// `evaluate_on` gives the scores of a matrix over splits.
template <class EvaluateOn>
Result<PermutationResult> permuted(const FeatureMatrix& matrix, std::uint64_t seed,
                                   const PermutationOptions& options,
                                   const EvaluateOn& evaluate_on) {
  if (options.permutations == 0)
    return fail({.code = Errc::range,
                 .where = "permutations",
                 .what = "no permutation",
                 .expected = "at least 1",
                 .got = "0"});
  RandomEngine engine(seed);
  FeatureMatrix shuffled = matrix;
  PermutationResult out;
  double matches = 0.0;
  for (std::size_t p = 0; p < options.permutations; ++p) {
    shuffled.labels = permuted_labels(matrix.labels, engine());
    const auto splits =
        stratified_splits(shuffled.labels, options.train_fraction, options.splits, engine());
    if (!splits) return pass(splits.error(), "permuted labels");
    const auto evaluation = evaluate_on(shuffled, *splits);
    if (!evaluation) return pass(evaluation.error(), "permuted labels");
    out.accuracy.push_back(evaluation->accuracy);
    out.trials += evaluation->confusion.total();
    matches += blind_matches(evaluation->confusion);
  }
  out.mean = compute_mean(out.accuracy);
  out.chance = matches / static_cast<double>(out.trials);
  return out;
}

}  // namespace

Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, const TrainOptions& train,
                                            const PermutationOptions& options) {
  return permuted(matrix, train.seed, options,
                  [&](const FeatureMatrix& shuffled, const std::vector<Split>& splits) {
                    return evaluate(shuffled, splits, train);
                  });
}

Result<PermutationResult> evaluate_permuted(const FeatureMatrix& matrix, Learner learner,
                                            const TrainOptions& train,
                                            const PermutationOptions& options) {
  return permuted(matrix, train.seed, options,
                  [&](const FeatureMatrix& shuffled, const std::vector<Split>& splits) {
                    return evaluate(shuffled, splits, learner, train);
                  });
}

}  // namespace weft::classifier
