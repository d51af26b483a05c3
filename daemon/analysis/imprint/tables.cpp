#include "daemon/analysis/imprint/tables.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "classifier/base/parallel.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"

namespace weft::daemon {
namespace {

namespace ci = classifier::imprint;
using classifier::FeatureMatrix;

std::string format_left_out(const ImprintTables& tables) {
  std::vector<std::string> out;
  for (const auto& [experiment, why] : tables.left_out)
    out.push_back(experiment + " (" + why + ")");
  return joined(out);
}

// Of experiments that never ask about some imprints.
std::string format_requested(const ImprintTables& tables) {
  std::string out;
  for (std::size_t e = 0; e < tables.requested.size(); ++e)
    if (tables.requested[e] < tables.imprints)
      out += " " + std::string(ci::to_string(tables.options.experiments[e])) + " asks about " +
             std::to_string(tables.requested[e]) + " of them.";
  return out;
}

struct PreparedSet {
  FeatureSet set;
  FeatureMatrix matrix;
};

Result<std::vector<PreparedSet>> prepare_sets(std::span<const ci::Imprint> imprints,
                                              const TableOptions& options) {
  std::vector<PreparedSet> out;
  for (const ci::Form form : {ci::Form::full, ci::Form::brief})
    for (const auto& sigmas : options.scales) {
      ci::ScaleOptions scales;
      scales.sigmas = sigmas;
      scales.form = form;
      auto matrix = ci::build_matrix(imprints, scales, options.threads);
      if (!matrix) return pass(matrix.error());
      out.push_back({{sigmas, form, {}, {}, {}}, std::move(*matrix)});
    }
  if (!options.laws) return out;
  for (const ci::LawsSize size : {ci::LawsSize::three, ci::LawsSize::five}) {
    auto matrix =
        ci::build_matrix(imprints, ci::FeaturePlan{std::nullopt, {size}}, options.threads);
    if (!matrix) return pass(matrix.error());
    out.push_back({{{}, {}, size, {}, {}}, std::move(*matrix)});
  }
  return out;
}

// Why `experiment` has no meaning on these imprints, or nothing; how many it asks about.
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
  // Setting such objects aside is setting imprints aside.
  if (of_objects && !pressed_twice) return "no object was pressed twice";
  if (const auto ok = ci::check_rounds(*rounds, labels); !ok)
    return ok.error().where + ": " + ok.error().what;
  return std::nullopt;
}

// Notes classes, objects and the experiments that have a meaning, of which there must be one.
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
               .what = "no experiment can be made of these imprints",
               .expected = "two objects of each class, pressed twice, for all four",
               .got = format_left_out(out),
               .hint = "Name the objects in the manifest's column group"});
}

Status measure_set(const TableOptions& options, PreparedSet& one) {
  const ci::Classes classes = ci::find_classes(one.matrix.labels);
  // A hull of thousands of corners is walked for seconds; beyond that the answer stays open.
  const auto hull = ci::separability(one.matrix.values, classes.of_row, classes.names.size(), 3000);
  if (!hull) return pass(hull.error());
  one.set.separability = *hull;
  for (const ci::Experiment experiment : options.experiments)
    for (const ci::Rule rule : options.rules) {
      if (options.stop && options.stop())
        return fail({.code = Errc::wrong_state, .what = "stopped"});
      auto outcome = ci::run_experiment(one.matrix, experiment, rule);
      if (!outcome) return pass(outcome.error(), one.set.name());
      one.set.outcomes.push_back(std::move(*outcome));
    }
  return {};
}

using classifier::imprint::Experiment;
using classifier::imprint::Form;

struct EllisRow {
  Experiment experiment;
  std::size_t full_13, brief_13;    // scales 1 & 3
  std::size_t full_124, brief_124;  // scales 1, 2, & 4
};
constexpr std::array<EllisRow, 4> ellis_rows{{{Experiment::one_of_all, 18, 19, 22, 20},
                                              {Experiment::object_of_all, 17, 16, 18, 18},
                                              {Experiment::one_of_class, 19, 20, 20, 21},
                                              {Experiment::object_of_class, 17, 18, 21, 22}}};

}  // namespace

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
                 .what = "nothing to measure",
                 .expected = "scales, experiments and rules"});
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
  for (PreparedSet& one : *prepared) out.sets.push_back(std::move(one.set));
  return out;
}

std::string cell_text(const ci::ExperimentOutcome& outcome) {
  if (!outcome.converged) return "\u221E";
  const double share = outcome.total == 0 ? 0.0
                                          : static_cast<double>(outcome.correct) /
                                                static_cast<double>(outcome.total);
  return std::to_string(outcome.correct) + " / " + std::to_string(outcome.total) + " (" +
         percent(share, 0) + " %)";
}

std::string paper_text(ci::Experiment experiment, const FeatureSet& set) {
  if (set.sigmas.empty()) return std::string(no_value);
  const auto entry = ellis_entry(experiment, set.sigmas, set.form);
  if (!entry) return std::string(no_value);
  ci::ExperimentOutcome printed;
  printed.converged = entry->converged;
  printed.correct = entry->correct;
  printed.total = ellis_imprints;
  return cell_text(printed);
}

std::string tables_note(const ImprintTables& tables) {
  return "Column \"paper\": Ellis 1986, real imprints of its own, 24 of 12 objects in 4 classes. "
         "All "
         "other columns: " +
         std::to_string(tables.imprints) + " imprints of " + std::to_string(tables.objects) +
         " objects in " + std::to_string(tables.classes) + " classes" +
         (tables.bench == BenchKind::simulated ? ", SIMULATED" : "") +
         "; \u221E: the perceptron did not converge in 1000 rounds." + format_requested(tables) +
         (tables.left_out.empty() ? "" : " Left out: " + format_left_out(tables) + ".");
}

std::vector<std::vector<double>> ellis_scales() {
  return {{0}, {1}, {2}, {3}, {1, 2}, {1, 3}, {1, 2, 4}};
}

std::optional<EllisEntry> ellis_entry(Experiment experiment, std::span<const double> sigmas,
                                      Form form) {
  const auto all = ellis_scales();
  const auto at =
      std::ranges::find_if(all, [&](const auto& set) { return std::ranges::equal(set, sigmas); });
  if (at == all.end()) return std::nullopt;
  const EllisRow& row = ellis_rows.at(static_cast<std::size_t>(experiment));
  const bool full = form == Form::full;
  if (std::ranges::equal(sigmas, all[5]))
    return EllisEntry{true, full ? row.full_13 : row.brief_13};
  if (std::ranges::equal(sigmas, all[6]))
    return EllisEntry{true, full ? row.full_124 : row.brief_124};
  // Single scales and 1 & 2 were not printed again for 1/CLASS and 2/CLASS.
  if (experiment == Experiment::one_of_all || experiment == Experiment::object_of_all)
    return EllisEntry{false, 0};
  return std::nullopt;
}

}  // namespace weft::daemon
