#include "daemon/analysis/imprint/tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "classifier/base/parallel.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon {
namespace {

namespace ci = classifier::imprint;
using classifier::FeatureMatrix;

struct PreparedSet {
  FeatureSet set;
  FeatureMatrix matrix;
};

bool is_partial(ci::Form form) {
  return form == ci::Form::steps || form == ci::Form::extrema;
}

bool measures_convergence(const TableOptions& options) {
  return std::ranges::find(options.experiments, ci::Experiment::one_of_all) !=
         options.experiments.end();
}

Result<std::vector<PreparedSet>> prepare_sets(std::span<const ci::Imprint> imprints,
                                              const TableOptions& options) {
  std::vector<PreparedSet> out;
  for (const ci::Form form : {ci::Form::full, ci::Form::brief, ci::Form::steps, ci::Form::extrema})
    for (const auto& sigmas : options.scales) {
      if (is_partial(form) && !measures_convergence(options)) continue;
      ci::ScaleOptions scales = options.edges;
      scales.sigmas = sigmas;
      scales.form = form;
      auto matrix = ci::build_matrix(imprints, scales, options.threads);
      if (!matrix) return pass(matrix.error());
      out.push_back({{sigmas, form, {}, {}, {}, {}}, std::move(*matrix)});
    }
  if (!options.laws) return out;
  for (const ci::LawsSize size : {ci::LawsSize::three, ci::LawsSize::five}) {
    auto matrix =
        ci::build_matrix(imprints, ci::FeaturePlan{std::nullopt, {size}, false}, options.threads);
    if (!matrix) return pass(matrix.error());
    out.push_back({{{}, {}, size, {}, {}, {}}, std::move(*matrix)});
  }
  return out;
}

// Returns the reason why `experiment` cannot be run on these imprints, or nothing; `requested`:
// number of imprints that it tests.
Result<std::optional<std::string>> why_not_runnable(ci::Experiment experiment,
                                                    const std::vector<std::string>& labels,
                                                    const std::vector<std::string>& objects,
                                                    bool pressed_twice, std::size_t& requested) {
  const auto rounds = ci::test_rounds(experiment, labels, objects);
  if (!rounds) return pass(rounds.error());
  requested = 0;
  for (const auto& aside : *rounds) requested += aside.size();
  const bool of_objects =
      experiment == ci::Experiment::object_of_all || experiment == ci::Experiment::object_of_class;
  // Otherwise leaving out an object equals leaving out an imprint.
  if (of_objects && !pressed_twice) return "no object pressed twice";
  if (const auto ok = ci::check_rounds(*rounds, labels); !ok)
    return ok.error().where + ": " + ok.error().what;
  return std::nullopt;
}

// Records classes, objects and the experiments that can be run; there must be at least one.
Status choose_experiments(std::span<const ci::Imprint> imprints,
                          std::vector<ci::Experiment>& experiments, ImprintTables& out) {
  std::vector<std::string> labels, objects;
  for (const ci::Imprint& one : imprints) {
    labels.push_back(one.label);
    objects.push_back(one.object);
  }
  out.classes = ci::find_classes(labels).names.size();
  out.objects = ci::find_classes(objects).names.size();
  std::vector<ci::Experiment> runnable;
  for (const ci::Experiment experiment : experiments) {
    std::size_t requested = 0;
    const auto why =
        why_not_runnable(experiment, labels, objects, out.objects < imprints.size(), requested);
    if (!why) return pass(why.error());
    if (*why) {
      out.left_out.emplace_back(ci::to_string(experiment), **why);
      continue;
    }
    runnable.push_back(experiment);
    out.requested.push_back(requested);
  }
  experiments = std::move(runnable);
  if (!experiments.empty()) return {};
  return fail({.code = Errc::invalid_argument,
               .what = "no experiment possible with these imprints",
               .expected = "two objects per class, each pressed twice, for all four experiments",
               .got = format_left_out(out),
               .hint = "Enter the objects in the group column of the manifest"});
}

Status unless_stopped(const TableOptions& options) {
  if (!options.stop || !options.stop()) return {};
  return fail({.code = Errc::wrong_state, .what = "imprint tables stopped on request"});
}

Status measure_convergence(const TableOptions& options, PreparedSet& one) {
  constexpr std::size_t most_counted = 100;  // a training without convergence makes 1000 passes
                                             // over the data
  const auto on_failure =
      one.matrix.size() <= most_counted ? ci::OnFailure::count : ci::OnFailure::stop;
  for (const classifier::Learner rule : convergence_rules) {
    if (auto ok = unless_stopped(options); !ok) return ok;
    auto outcome = ci::run_experiment(one.matrix, ci::Experiment::one_of_all, rule, on_failure);
    if (!outcome) return pass(outcome.error(), one.set.name());
    one.set.convergence.push_back(std::move(*outcome));
  }
  return {};
}

Status measure_set(const TableOptions& options, PreparedSet& one) {
  const ci::Classes classes = ci::find_classes(one.matrix.labels);
  // A hull with thousands of corners takes seconds; above this limit separability stays undecided.
  const auto hull =
      classifier::separability(one.matrix.values, classes.of_row, classes.names.size(), 3000);
  if (!hull) return pass(hull.error());
  one.set.separability = *hull;
  if (measures_convergence(options))
    if (auto ok = measure_convergence(options, one); !ok) return ok;
  if (is_partial(one.set.form)) return {};
  for (const ci::Experiment experiment : options.experiments)
    for (const classifier::Learner rule : options.rules) {
      if (auto ok = unless_stopped(options); !ok) return ok;
      auto outcome = ci::run_experiment(one.matrix, experiment, rule);
      if (!outcome) return pass(outcome.error(), one.set.name());
      one.set.outcomes.push_back(std::move(*outcome));
    }
  return {};
}

/// One scale for all pictures, from the least to the largest value.
chart::Maps draw_imprints(std::span<const ci::Imprint> imprints) {
  constexpr std::size_t most = 42;
  std::map<std::string, const ci::Imprint*> first_of;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const ci::Imprint& one : imprints) {
    if (first_of.size() < most) first_of.try_emplace(one.object, &one);
    const auto [least, largest] = std::ranges::minmax(one.image.data());
    low = std::min(low, least);
    high = std::max(high, largest);
  }
  chart::Maps out{"The first imprint of each object; darker means more pressure"};
  for (const auto& [object, one] : first_of) {
    chart::Tile tile{object, one->label == object ? std::string() : one->label, one->image.cols()};
    for (const double value : one->image.data()) {
      const double level = high > low ? std::round(15 * (value - low) / (high - low)) : 0;
      tile.levels += "0123456789abcdef"[static_cast<std::size_t>(level)];
    }
    out.tiles.push_back(std::move(tile));
  }
  return out;
}

struct EllisRow {
  ci::Experiment experiment;
  std::size_t full_13, brief_13;    // scales 1 & 3
  std::size_t full_124, brief_124;  // scales 1, 2, & 4
};
constexpr std::array<EllisRow, 4> ellis_rows{{{ci::Experiment::one_of_all, 18, 19, 22, 20},
                                              {ci::Experiment::object_of_all, 17, 16, 18, 18},
                                              {ci::Experiment::one_of_class, 19, 20, 20, 21},
                                              {ci::Experiment::object_of_class, 17, 18, 21, 22}}};

// The paper's statements on convergence in 1/N (section 3.4.6); nothing if it always converged.
std::optional<PaperEntry> entry_of_convergence(const FeatureSet& set) {
  using enum PaperEntry::Convergence;
  if (set.sigmas.empty()) return PaperEntry{set.laws == ci::LawsSize::three ? never : erratic, 0};
  if (set.form == ci::Form::steps || set.form == ci::Form::extrema) return PaperEntry{never, 0};
  return std::nullopt;
}

}  // namespace

std::optional<PaperEntry> paper_entry(ci::Experiment experiment, const FeatureSet& set) {
  using enum PaperEntry::Convergence;
  if (const auto entry = entry_of_convergence(set))
    return experiment == ci::Experiment::one_of_all ? entry : std::nullopt;
  const auto all = ellis_scales();
  const auto at = std::ranges::find(all, set.sigmas);
  if (at == all.end()) return std::nullopt;
  const EllisRow& row = ellis_rows.at(static_cast<std::size_t>(experiment));
  const bool full = set.form == ci::Form::full;
  if (*at == all[5]) return PaperEntry{always, full ? row.full_13 : row.brief_13};
  if (*at == all[6]) return PaperEntry{always, full ? row.full_124 : row.brief_124};
  // Single scales and 1 & 2 were not printed for 1/CLASS and 2/CLASS.
  if (experiment == ci::Experiment::one_of_all || experiment == ci::Experiment::object_of_all)
    return PaperEntry{never, 0};
  return std::nullopt;
}

std::string_view FeatureSet::kind() const {
  return sigmas.empty() ? "Laws" : to_string(form);
}

std::string FeatureSet::name() const {
  if (sigmas.empty()) return laws == ci::LawsSize::three ? "Laws 3 x 3" : "Laws 5 x 5";
  std::vector<std::string> words;
  for (const double sigma : sigmas) words.push_back(general(sigma));
  return joined(words);
}

Result<ImprintTables> measure_tables(const Dataset& dataset, TableOptions options) {
  if (options.scales.empty() || options.experiments.empty() || options.rules.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "tables",
                 .what = "no scales, experiments or rules selected",
                 .expected = "at least one of each"});
  const auto imprints = extract_imprints(dataset);
  if (!imprints) return pass(imprints.error());
  ImprintTables out;
  if (auto ok = choose_experiments(*imprints, options.experiments, out); !ok)
    return pass(ok.error(), dataset.info.name);
  auto prepared = prepare_sets(*imprints, options);
  if (!prepared) return pass(prepared.error());
  std::vector<std::optional<Error>> problems(prepared->size());
  classifier::parallel_for(prepared->size(), options.threads, [&](std::size_t i) {
    if (auto done = measure_set(options, (*prepared)[i]); !done) problems[i] = done.error();
  });
  for (const auto& problem : problems)
    if (problem) return pass(*problem);
  out.bench = dataset.info.kind;
  out.dataset = dataset.info.name;
  out.sha256 = dataset_sha256(dataset);
  out.imprints = imprints->size();
  out.options = std::move(options);
  for (PreparedSet& one : *prepared)
    (is_partial(one.set.form) ? out.partial_sets : out.sets).push_back(std::move(one.set));
  for (const ci::Imprint& one : *imprints) {
    out.files.push_back(one.file);
    out.labels.push_back(one.label);
  }
  out.pictures = draw_imprints(*imprints);
  return out;
}

std::string format_left_out(const ImprintTables& tables) {
  std::vector<std::string> out;
  for (const auto& [experiment, why] : tables.left_out)
    out.push_back(experiment + " (" + why + ")");
  return joined(out);
}

std::vector<Misclassified> list_misclassified(const ImprintTables& tables) {
  const std::size_t experiments = tables.options.experiments.size();
  std::vector<Misclassified> all(tables.imprints);
  for (std::size_t r = 0; r < all.size(); ++r) {
    all[r].row = r;
    all[r].taken_for.resize(experiments);
  }
  for (const FeatureSet& set : tables.sets)
    for (std::size_t e = 0; e < experiments; ++e)
      for (std::size_t rule = 0; rule < tables.options.rules.size(); ++rule) {
        const ci::ExperimentOutcome& outcome = tables.outcome(set, e, rule);
        if (!outcome.converged) continue;
        for (std::size_t i = 0; i < outcome.wrong.size(); ++i) {
          Misclassified& one = all[outcome.wrong[i]];
          ++one.taken_for[e][outcome.taken_for[i]];
          ++one.wrong;
        }
      }
  std::erase_if(all, [](const Misclassified& one) { return one.wrong == 0; });
  std::ranges::stable_sort(all, std::ranges::greater{}, &Misclassified::wrong);
  return all;
}

std::size_t count_answers(const ImprintTables& tables, std::size_t experiment) {
  std::size_t out = 0;
  for (const FeatureSet& set : tables.sets)
    for (std::size_t rule = 0; rule < tables.options.rules.size(); ++rule)
      out += tables.outcome(set, experiment, rule).converged ? 1 : 0;
  return out;
}

std::vector<std::vector<double>> ellis_scales() {
  return {{0}, {1}, {2}, {3}, {1, 2}, {1, 3}, {1, 2, 4}};
}

}  // namespace weft::daemon
