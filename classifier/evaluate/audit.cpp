#include "classifier/evaluate/audit.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "classifier/base/parallel.hpp"
#include "classifier/evaluate/evaluate.hpp"

namespace weft::classifier {
namespace {

TrainOptions train_options(const AuditOptions& options, std::size_t threads) {
  TrainOptions out;
  out.seed = options.seed;
  out.threads = threads;
  return out;
}

// Accuracy of one split. Permuted labels may leave a test label untrained: its rows count as
// errors.
Result<double> split_accuracy(const FeatureMatrix& matrix, const Split& split, Learner learner,
                              const TrainOptions& options) {
  const std::set<std::string> labels = labels_in(matrix, split.train);
  std::optional<TrainedLearner> trained;
  if (labels.size() > 1) {
    auto made = train_recipe(select_rows(matrix, split.train), {.learner = learner}, options);
    if (!made) return pass(made.error());
    trained.emplace(std::move(*made));
  }
  std::size_t correct = 0;
  for (const std::size_t r : split.test) {
    std::string answer = *labels.begin();
    if (trained) {
      const auto winner = trained->classify(matrix.values.row(r));
      if (!winner) return pass(winner.error(), matrix.files[r]);
      answer = trained->labels()[*winner];
    }
    correct += answer == matrix.labels[r] ? 1U : 0U;
  }
  return static_cast<double>(correct) / static_cast<double>(split.test.size());
}

Result<double> mean_accuracy(const FeatureMatrix& matrix, std::span<const Split> splits,
                             Learner learner, const TrainOptions& options) {
  double sum = 0.0;
  for (const Split& split : splits) {
    const auto one = split_accuracy(matrix, split, learner, options);
    if (!one) return pass(one.error());
    sum += *one;
  }
  return sum / static_cast<double>(splits.size());
}

std::vector<std::vector<std::string>> draw_labels(const PermutationUnits& units, std::size_t count,
                                                  std::uint64_t seed) {
  RandomEngine engine(seed);
  std::vector<std::vector<std::string>> out;
  for (std::size_t b = 0; b < count; ++b) out.push_back(permute_labels(units, engine));
  return out;
}

// Accuracies [permutation][probe]: all probes get the same labels.
Result<std::vector<std::vector<double>>> permuted_accuracies(
    std::span<const Probe> probes, std::span<const Split> splits,
    std::span<const std::vector<std::string>> labels, Learner learner,
    const AuditOptions& options) {
  std::vector<std::vector<double>> out(labels.size(), std::vector<double>(probes.size()));
  std::vector<std::optional<Error>> failed(labels.size());
  const TrainOptions training = train_options(options, 1);
  parallel_for(labels.size(), options.threads, [&](std::size_t b) {
    for (std::size_t k = 0; k < probes.size(); ++k) {
      FeatureMatrix matrix = probes[k].features;
      matrix.labels = labels[b];
      const auto reached = mean_accuracy(matrix, splits, learner, training);
      if (reached)
        out[b][k] = *reached;
      else
        failed[b] = reached.error();
    }
  });
  for (const auto& error : failed)
    if (error) return pass(*error, "permuted labels");
  return out;
}

// Tolerance for equal accuracies: means over splits of equal counts differ by rounding.
constexpr double same_accuracy = 1e-9;

std::size_t count_reaching(const std::vector<std::vector<double>>& permuted, double accuracy) {
  const auto reaches = [accuracy](const std::vector<double>& probes) {
    return std::ranges::any_of(probes,
                               [accuracy](double one) { return one >= accuracy - same_accuracy; });
  };
  return static_cast<std::size_t>(std::ranges::count_if(permuted, reaches));
}

// Share of permutations with a best probe that reaches `accuracy`; the observed labels count as one
// permutation.
double max_p(const std::vector<std::vector<double>>& permuted, double accuracy) {
  return static_cast<double>(1 + count_reaching(permuted, accuracy)) /
         static_cast<double>(1 + permuted.size());
}

Status check_probes(const FeatureMatrix& full, std::span<const Probe> probes) {
  for (const Probe& probe : probes)
    if (probe.features.labels != full.labels)
      return fail({.code = Errc::invalid_argument,
                   .where = "probe " + probe.name,
                   .what = "number of rows differs from the full features",
                   .expected = std::to_string(full.size()) + " rows",
                   .got = std::to_string(probe.features.size())});
  return {};
}

struct BothLearners {
  Evaluation lda, trees;
  [[nodiscard]] Reached better() const {
    const bool is_trees = trees.accuracy > lda.accuracy;
    const Evaluation& one = is_trees ? trees : lda;
    return {is_trees ? Learner::trees : Learner::lda, one.accuracy, one.ci95};
  }
};

Result<BothLearners> evaluate_both(const FeatureMatrix& matrix, std::span<const Split> splits,
                                   const AuditOptions& options) {
  const TrainOptions training = train_options(options, options.threads);
  auto lda = evaluate(matrix, splits, Learner::lda, training);
  if (!lda) return pass(lda.error());
  auto trees = evaluate(matrix, splits, Learner::trees, training);
  if (!trees) return pass(trees.error());
  return BothLearners{std::move(*lda), std::move(*trees)};
}

CannotTell find_obstacle(const AuditFigures& figures, const PermutationUnits& units,
                         const std::vector<std::vector<double>>& permuted, double level) {
  if (figures.probes.empty()) return CannotTell::no_probe;
  // Below this number most permutations repeat each other, and p cannot be small.
  if (units.log_arrangements() < std::log(static_cast<double>(1 + permuted.size())))
    return CannotTell::too_few_units;
  return max_p(permuted, figures.full.accuracy) > level ? CannotTell::full_at_chance
                                                        : CannotTell::none;
}

// Appends the figures of every probe to `out`, with the p of LDA alone. Returns the accuracies of
// trees.
Result<std::vector<double>> measure_probes(std::span<const Probe> probes,
                                           std::span<const Split> splits,
                                           const std::vector<std::vector<double>>& permuted,
                                           const AuditOptions& options, AuditFigures& out) {
  std::vector<double> tree_accuracy;
  for (std::size_t k = 0; k < probes.size(); ++k) {
    const auto both = evaluate_both(probes[k].features, splits, options);
    if (!both) return pass(both.error(), "probe " + probes[k].name);
    ProbeFigure one{probes[k].name, probes[k].features.names.size(), both->better()};
    for (const auto& accuracy : permuted)
      one.chance += accuracy[k] / static_cast<double>(permuted.size());
    const double above = out.full.accuracy - one.chance;
    one.share = above > 0.0 ? (one.reached.accuracy - one.chance) / above : 0.0;
    one.p = std::min(1.0, 2.0 * max_p(permuted, both->lda.accuracy));
    tree_accuracy.push_back(both->trees.accuracy);
    out.chance += one.chance / static_cast<double>(probes.size());
    out.probes.push_back(std::move(one));
  }
  return tree_accuracy;
}

std::string_view recording_key(const FeatureMatrix& matrix, std::size_t row) {
  return recording_of(std::string_view(matrix.files[row]));
}

bool is_open(const ProbeFigure& one, const AuditOptions& options) {
  return one.share >= options.least_share && one.p > options.level + same_accuracy;
}

constexpr std::size_t tree_batch = 10;

// Permutes with trees while they could still make a probe significant. A probe that is dropped
// early has the p of the permutations so far, which is above the level too.
Status add_trees(std::span<const Probe> probes, std::span<const Split> splits,
                 const PermutationUnits& units, std::span<const double> tree_accuracy,
                 const AuditOptions& options, AuditFigures& out) {
  const auto labels = draw_labels(units, options.tree_permutations, options.seed);
  std::vector<std::vector<double>> permuted;
  const auto can_decide = [&](std::size_t k) {
    const double best_p = 2.0 *
                          static_cast<double>(1 + count_reaching(permuted, tree_accuracy[k])) /
                          static_cast<double>(1 + labels.size());
    return is_open(out.probes[k], options) && best_p <= options.level + same_accuracy;
  };
  const std::vector<std::size_t> all = numbers_below(probes.size());
  while (permuted.size() < labels.size() && std::ranges::any_of(all, can_decide)) {
    const std::size_t count = std::min(tree_batch, labels.size() - permuted.size());
    auto batch = permuted_accuracies(
        probes, splits, std::span(labels).subspan(permuted.size(), count), Learner::trees, options);
    if (!batch) return pass(batch.error());
    std::ranges::move(*batch, std::back_inserter(permuted));
  }
  out.tree_permutations = permuted.size();
  for (const std::size_t k : all)
    if (!permuted.empty())
      out.probes[k].p = std::min(out.probes[k].p, 2.0 * max_p(permuted, tree_accuracy[k]));
  return {};
}

}  // namespace

double PermutationUnits::log_arrangements() const {
  double out = 0.0;
  for (const auto& block : blocks) {
    std::map<std::string, std::size_t> count;
    for (const std::size_t unit : block) ++count[label[unit]];
    out += std::lgamma(static_cast<double>(block.size()) + 1.0);
    for (const auto& [name, units] : count) out -= std::lgamma(static_cast<double>(units) + 1.0);
  }
  return out;
}

Result<PermutationUnits> make_permutation_units(const FeatureMatrix& matrix,
                                                std::span<const Split> splits) {
  PermutationUnits out;
  out.of_groups = std::ranges::none_of(matrix.groups, &std::string::empty) &&
                  groups_on_both_sides(splits, matrix.groups).empty();
  std::map<std::pair<std::string, std::string>, std::size_t> place;
  std::map<std::string, std::vector<std::size_t>> blocks;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    const std::string& label = matrix.labels[r];
    const auto key = out.of_groups ? std::pair(matrix.groups[r], label)
                                   : std::pair(recording_of(matrix.files[r], r), std::string());
    const auto [at, is_new] = place.emplace(key, place.size());
    out.of_row.push_back(at->second);
    if (is_new) {
      out.label.push_back(label);
      blocks[out.of_groups ? matrix.groups[r] : std::string()].push_back(at->second);
    } else if (out.label[at->second] != label) {
      return fail({.code = Errc::invalid_argument,
                   .where = matrix.files[r],
                   .what = "recording has two labels",
                   .got = out.label[at->second] + " and " + label});
    }
  }
  const bool within =
      std::ranges::all_of(blocks, [](const auto& block) { return block.second.size() > 1; });
  if (!within) blocks = {{"", numbers_below(out.label.size())}};
  for (auto& [name, units] : blocks) out.blocks.push_back(std::move(units));
  return out;
}

std::vector<std::string> permute_labels(const PermutationUnits& units, RandomEngine& engine) {
  std::vector<std::string> of_unit = units.label;
  for (const auto& block : units.blocks) {
    std::vector<std::string> labels;
    for (const std::size_t unit : block) labels.push_back(units.label[unit]);
    shuffle(labels, engine);
    for (std::size_t i = 0; i < block.size(); ++i) of_unit[block[i]] = labels[i];
  }
  std::vector<std::string> out;
  for (const std::size_t unit : units.of_row) out.push_back(of_unit[unit]);
  return out;
}

std::vector<Split> split_in_parts(const FeatureMatrix& matrix, bool by_group, std::size_t parts) {
  // Units (groups, or recordings of each label) go to the parts in turn, in order of appearance.
  std::map<std::string, std::map<std::string, std::size_t>> number;
  std::vector<std::size_t> part;
  for (std::size_t r = 0; r < matrix.size(); ++r) {
    auto& units = number[by_group ? std::string() : matrix.labels[r]];
    const std::string unit = by_group ? matrix.groups[r] : std::string(recording_key(matrix, r));
    part.push_back(units.emplace(unit, units.size()).first->second % parts);
  }
  std::vector<Split> out;
  for (std::size_t p = 0; p < parts; ++p) {
    Split split;
    for (std::size_t r = 0; r < part.size(); ++r)
      if (part[r] != p) split.train.push_back(r);
    const std::set<std::string> trained = labels_in(matrix, split.train);
    for (std::size_t r = 0; r < part.size(); ++r)
      if (part[r] == p && trained.contains(matrix.labels[r])) split.test.push_back(r);
    split.whole_group = by_group;
    if (!split.test.empty() && trained.size() > 1) out.push_back(std::move(split));
  }
  return out;
}

Result<Reached> reach(const FeatureMatrix& matrix, std::span<const Split> splits,
                      const AuditOptions& options) {
  const auto both = evaluate_both(matrix, splits, options);
  if (!both) return pass(both.error());
  return both->better();
}

Result<AuditFigures> audit(const FeatureMatrix& full, std::span<const Probe> probes,
                           std::span<const Split> splits, const AuditOptions& options) {
  if (auto ok = check_probes(full, probes); !ok) return pass(ok.error());
  const auto units = make_permutation_units(full, splits);
  if (!units) return pass(units.error());
  const auto reached = reach(full, splits, options);
  if (!reached) return pass(reached.error(), "full features");
  AuditFigures out{.full = *reached,
                   .chance = 0.0,
                   .probes = {},
                   .units = units->label.size(),
                   .units_of_groups = units->of_groups};
  const auto lda =
      permuted_accuracies(probes, splits, draw_labels(*units, options.permutations, options.seed),
                          Learner::lda, options);
  if (!lda) return pass(lda.error());
  out.permutations = lda->size();
  const auto tree_accuracy = measure_probes(probes, splits, *lda, options, out);
  if (!tree_accuracy) return pass(tree_accuracy.error());
  out.why = find_obstacle(out, *units, *lda, options.level);
  if (out.why != CannotTell::none) return out;
  if (auto ok = add_trees(probes, splits, *units, *tree_accuracy, options, out); !ok)
    return pass(ok.error());
  for (ProbeFigure& one : out.probes)
    one.named = one.share >= options.least_share && one.p <= options.level + same_accuracy;
  out.verdict = std::ranges::any_of(out.probes, &ProbeFigure::named) ? AuditVerdict::confounded
                                                                     : AuditVerdict::no_sign;
  return out;
}

}  // namespace weft::classifier
