#include "classifier/imprint/scale_search.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include "classifier/base/parallel.hpp"
#include "classifier/imprint/imprint_set.hpp"

namespace weft::classifier::imprint {
namespace {

using Subset = std::vector<std::size_t>;

// Subsets of {0 .. count - 1} with `size` members, in lexical order.
void add_subsets(std::size_t count, std::size_t size, Subset& begun, std::vector<Subset>& out) {
  if (begun.size() == size) {
    out.push_back(begun);
    return;
  }
  for (std::size_t i = begun.empty() ? 0 : begun.back() + 1; i < count; ++i) {
    begun.push_back(i);
    add_subsets(count, size, begun, out);
    begun.pop_back();
  }
}

std::size_t subsets_up_to(std::size_t count, std::size_t most) {
  std::size_t sum = 0, of_size = 1;
  for (std::size_t k = 1; k <= most && sum <= 1000000; ++k) {
    of_size = of_size * (count - k + 1) / k;
    sum += of_size;
  }
  return sum;
}

std::vector<std::size_t> columns_of(const Subset& scales, std::size_t width) {
  std::vector<std::size_t> out;
  for (const std::size_t s : scales)
    for (std::size_t k = 0; k < width; ++k) out.push_back(s * width + k);
  return out;
}

/// More right, or as many by fewer scales. A rule that did not converge has none right.
bool is_better(const ScaleScore& a, const ScaleScore& b) {
  const auto right = [](const ScaleScore& s) {
    return s.outcome.converged ? s.outcome.correct : 0;
  };
  if (right(a) != right(b)) return right(a) > right(b);
  return a.sigmas.size() < b.sigmas.size();
}

}  // namespace

Result<std::vector<ScaleScore>> search_scales(std::span<const Imprint> imprints,
                                              const ScaleSearchOptions& options) {
  constexpr std::size_t most_sets = 2000;
  const std::size_t count = options.sigmas.size(), most = std::min(options.most_scales, count);
  const std::size_t sets = subsets_up_to(count, most);
  if (sets == 0 || sets > most_sets)
    return fail({.code = Errc::range,
                 .where = "sigmas",
                 .what = "so many sets of scales are not searched",
                 .expected = "1 to " + std::to_string(most_sets) + " sets",
                 .got = std::to_string(sets)});
  ScaleOptions scales;
  scales.sigmas = options.sigmas;
  scales.form = options.form;
  const auto matrix = build_matrix(imprints, scales, options.threads);
  if (!matrix) return pass(matrix.error());
  std::vector<Subset> subsets;
  for (std::size_t size = 1; size <= most; ++size) {
    Subset begun;
    add_subsets(count, size, begun, subsets);
  }
  std::vector<std::optional<Result<ExperimentOutcome>>> outcomes(subsets.size());
  const std::size_t width = matrix->names.size() / count;
  parallel_for(subsets.size(), options.threads, [&](std::size_t i) {
    outcomes[i] = run_experiment(select_columns(*matrix, columns_of(subsets[i], width)),
                                 options.evaluated_by, options.rule);
  });
  std::vector<ScaleScore> out;
  for (std::size_t i = 0; i < subsets.size(); ++i) {
    const auto& outcome = *outcomes[i];
    if (!outcome) return pass(outcome.error());
    ScaleScore score{{}, *outcome};
    for (const std::size_t s : subsets[i]) score.sigmas.push_back(options.sigmas[s]);
    out.push_back(std::move(score));
  }
  std::stable_sort(out.begin(), out.end(), is_better);
  return out;
}

}  // namespace weft::classifier::imprint
