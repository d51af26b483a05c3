#include "classifier/imprint/experiments.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "classifier/base/parallel.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier::imprint {
namespace {

using Rounds = std::vector<std::vector<std::size_t>>;

// Joins the k-th entry of each list, for all k that every list has.
Rounds side_by_side(const std::vector<Rounds>& lists) {
  std::size_t least = lists.empty() ? 0 : lists.front().size();
  for (const Rounds& list : lists) least = std::min(least, list.size());
  Rounds out(least);
  for (std::size_t k = 0; k < least; ++k)
    for (const Rounds& list : lists) out[k].insert(out[k].end(), list[k].begin(), list[k].end());
  return out;
}

std::vector<std::size_t> others(std::size_t rows, const std::vector<std::size_t>& aside) {
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < rows; ++r)
    if (std::find(aside.begin(), aside.end(), r) == aside.end()) out.push_back(r);
  return out;
}

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

/// True for more right predictions, or equally many with fewer scales. A rule that did not converge
/// has none right.
bool is_better(const ScaleScore& a, const ScaleScore& b) {
  const auto right = [](const ScaleScore& s) {
    return s.outcome.converged ? s.outcome.correct : 0;
  };
  if (right(a) != right(b)) return right(a) > right(b);
  return a.sigmas.size() < b.sigmas.size();
}

}  // namespace

std::string_view to_string(Experiment experiment) {
  constexpr std::array<std::string_view, 4> names{"1/N", "2/N", "1/CLASS", "2/CLASS"};
  return names.at(static_cast<std::size_t>(experiment));
}

Result<Rounds> test_rounds(Experiment experiment, std::span<const std::string> labels,
                           std::span<const std::string> objects) {
  if (labels.size() != objects.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "imprints",
                 .what = "numbers of classes and objects differ",
                 .expected = std::to_string(labels.size()),
                 .got = std::to_string(objects.size())});
  const Rounds of_class = rows_by_class(find_classes(labels).of_row),
               of_object = rows_by_class(find_classes(objects).of_row);
  for (const auto& rows : of_object)
    for (const std::size_t r : rows)
      if (labels[r] != labels[rows.front()])
        return fail({.code = Errc::invalid_argument,
                     .where = objects[r],
                     .what = "object in two classes",
                     .expected = labels[rows.front()],
                     .got = labels[r]});
  const auto singly = [](const std::vector<std::size_t>& rows) {
    Rounds out;
    for (const std::size_t r : rows) out.push_back({r});
    return out;
  };
  std::vector<Rounds> lists;
  switch (experiment) {
    case Experiment::one_of_all:
      return singly(numbers_below(labels.size()));
    case Experiment::object_of_all:
      return of_object;
    case Experiment::one_of_class:
      for (const auto& rows : of_class) lists.push_back(singly(rows));
      break;
    case Experiment::object_of_class:
      for (const auto& rows : of_class) {
        lists.emplace_back();
        for (const auto& object : of_object)
          if (labels[object.front()] == labels[rows.front()]) lists.back().push_back(object);
      }
      break;
  }
  return side_by_side(lists);
}

Status check_rounds(const Rounds& rounds, std::span<const std::string> labels) {
  const Rounds of_class = rows_by_class(find_classes(labels).of_row);
  for (const auto& aside : rounds)
    for (const auto& rows : of_class) {
      const auto left = std::ranges::count_if(
          rows, [&](std::size_t r) { return std::ranges::find(aside, r) == aside.end(); });
      if (left == 0)
        return fail({.code = Errc::invalid_argument,
                     .where = labels[rows.front()],
                     .what = "class without training imprints in a round",
                     .expected = "at least one",
                     .hint = "Remove the class, or record more of its objects"});
    }
  return {};
}

Result<ExperimentOutcome> run_experiment(const FeatureMatrix& matrix, Experiment experiment,
                                         Learner rule, OnFailure on_failure) {
  const auto rounds = test_rounds(experiment, matrix.labels, matrix.groups);
  if (!rounds) return pass(rounds.error());
  if (auto ok = check_rounds(*rounds, matrix.labels); !ok)
    return pass(ok.error(), to_string(experiment));
  ExperimentOutcome out;
  for (const auto& aside : *rounds) {
    const auto trained =
        train_recipe(select_rows(matrix, others(matrix.size(), aside)), {.learner = rule}, {});
    if (!trained) return pass(trained.error(), to_string(experiment));
    const FitReport report = trained->predictor().report();
    out.most_rounds = std::max(out.most_rounds, report.rounds);
    ++out.trainings;
    if (!report.converged) {
      out.converged = false;
      ++out.failed;
      if (on_failure == OnFailure::stop) break;
      continue;
    }
    for (const std::size_t r : aside) {
      const auto predicted = trained->classify(matrix.values.row(r));
      if (!predicted) return pass(predicted.error(), matrix.files[r]);
      ++out.total;
      const std::string& answer = trained->labels()[*predicted];
      if (answer == matrix.labels[r]) {
        ++out.correct;
        continue;
      }
      out.wrong.push_back(r);
      out.taken_for.push_back(answer);
    }
  }
  return out;
}

Result<std::vector<ScaleScore>> search_scales(std::span<const Imprint> imprints,
                                              const ScaleSearchOptions& options) {
  constexpr std::size_t most_sets = 2000;
  const std::size_t count = options.sigmas.size(), most = std::min(options.most_scales, count);
  const std::size_t sets = subsets_up_to(count, most);
  if (sets == 0 || sets > most_sets)
    return fail({.code = Errc::range,
                 .where = "sigmas",
                 .what = "number of scale sets out of range",
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
