#include "daemon/analysis/imprint/tables.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "classifier/base/parallel.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
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
  const auto hull =
      classifier::separability(one.matrix.values, classes.of_row, classes.names.size(), 3000);
  if (!hull) return pass(hull.error());
  one.set.separability = *hull;
  for (const ci::Experiment experiment : options.experiments)
    for (const classifier::Learner rule : options.rules) {
      if (options.stop && options.stop())
        return fail({.code = Errc::wrong_state, .what = "stopped"});
      auto outcome = ci::run_experiment(one.matrix, experiment, rule);
      if (!outcome) return pass(outcome.error(), one.set.name());
      one.set.outcomes.push_back(std::move(*outcome));
    }
  return {};
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

using nlohmann::ordered_json;

struct EllisEntry {
  bool converged;
  std::size_t correct;
};

/// Nothing where the paper has no such entry.
std::optional<EllisEntry> ellis_entry(ci::Experiment experiment, std::span<const double> sigmas,
                                      ci::Form form) {
  const auto all = ellis_scales();
  const auto at =
      std::ranges::find_if(all, [&](const auto& set) { return std::ranges::equal(set, sigmas); });
  if (at == all.end()) return std::nullopt;
  const EllisRow& row = ellis_rows.at(static_cast<std::size_t>(experiment));
  const bool full = form == ci::Form::full;
  if (std::ranges::equal(sigmas, all[5]))
    return EllisEntry{true, full ? row.full_13 : row.brief_13};
  if (std::ranges::equal(sigmas, all[6]))
    return EllisEntry{true, full ? row.full_124 : row.brief_124};
  // Single scales and 1 & 2 were not printed again for 1/CLASS and 2/CLASS.
  if (experiment == ci::Experiment::one_of_all || experiment == ci::Experiment::object_of_all)
    return EllisEntry{false, 0};
  return std::nullopt;
}

ordered_json experiment_json(const ci::ExperimentOutcome& outcome) {
  return {{"converged", outcome.converged},
          {"correct", outcome.converged ? ordered_json(outcome.correct) : ordered_json(nullptr)},
          {"total", outcome.converged ? ordered_json(outcome.total) : ordered_json(nullptr)},
          {"rounds", outcome.most_rounds},
          {"wrong", outcome.wrong}};
}

ordered_json printed_json(ci::Experiment experiment, const FeatureSet& set) {
  const auto entry =
      set.sigmas.empty() ? std::nullopt : ellis_entry(experiment, set.sigmas, set.form);
  if (!entry) return nullptr;
  if (!entry->converged) return {{"converged", false}};
  return {{"converged", true}, {"correct", entry->correct}, {"total", ellis_imprints}};
}

std::vector<std::string> rules_head(const ImprintTables& tables, std::string first) {
  std::vector<std::string> out{std::move(first), "<span class=\"paper\">paper</span>"};
  for (const classifier::Learner rule : tables.options.rules)
    out.push_back(escape(to_string(rule)));
  return out;
}

std::string experiment_table(const ImprintTables& tables, std::size_t experiment, ci::Form form) {
  HtmlTable table(rules_head(tables, "scales [taxels]"));
  const ci::Experiment name = tables.options.experiments[experiment];
  for (const FeatureSet& set : tables.sets) {
    if (set.sigmas.empty() ? form != ci::Form::full : set.form != form) continue;
    std::vector<std::string> cells{escape(set.name()), escape(paper_text(name, set))};
    for (std::size_t r = 0; r < tables.options.rules.size(); ++r)
      cells.push_back(escape(cell_text(tables.outcome(set, experiment, r))));
    table.row(cells);
  }
  return figure(table.finish(),
                std::string(to_string(form)) + " features a scale. " + escape(tables_note(tables)),
                bench_badge(tables.bench));
}

std::string separability_table(const ImprintTables& tables) {
  HtmlTable table({"features", "scales [taxels]", "all imprints linearly separable"}, 2);
  for (const FeatureSet& set : tables.sets)
    table.row({escape(set.sigmas.empty() ? "Laws" : to_string(set.form)), escape(set.name()),
               escape(to_string(set.separability.verdict))});
  return figure(table.finish(),
                "Whether any weights would do, proved without a perceptron: what does not converge "
                "in 1000 rounds may still be separable.",
                bench_badge(tables.bench));
}

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

ordered_json tables_json(const ImprintTables& tables) {
  ordered_json sets = ordered_json::array();
  for (const FeatureSet& set : tables.sets) {
    ordered_json one{
        {"scales", set.sigmas},
        {"features", set.sigmas.empty() ? set.name() : std::string(to_string(set.form))},
        {"linearly_separable", to_string(set.separability.verdict)}};
    for (std::size_t e = 0; e < tables.options.experiments.size(); ++e) {
      const ci::Experiment experiment = tables.options.experiments[e];
      ordered_json& row = one["experiments"][std::string(to_string(experiment))];
      row["paper"] = printed_json(experiment, set);
      for (std::size_t r = 0; r < tables.options.rules.size(); ++r)
        row[std::string(to_string(tables.options.rules[r]))] =
            experiment_json(tables.outcome(set, e, r));
    }
    sets.push_back(std::move(one));
  }
  ordered_json requested = ordered_json::object(), left_out = ordered_json::object();
  for (std::size_t e = 0; e < tables.requested.size(); ++e)
    requested[std::string(to_string(tables.options.experiments[e]))] = tables.requested[e];
  for (const auto& [experiment, why] : tables.left_out) left_out[experiment] = why;
  return {{"command", "imprint tables"},     {"bench", to_string(tables.bench)},
          {"dataset", tables.dataset},       {"dataset_sha256", tables.sha256},
          {"imprints", tables.imprints},     {"classes", tables.classes},
          {"objects", tables.objects},       {"asked", std::move(requested)},
          {"left_out", std::move(left_out)}, {"sets", std::move(sets)}};
}

std::string tables_html(const ImprintTables& tables) {
  std::string out = "<header>" + bench_badge(tables.bench) +
                    "<h1>Static imprints: " + escape(tables.dataset) + "</h1></header>\n<dl>" +
                    definition("data set", tables.sha256) +
                    definition("imprints", std::to_string(tables.imprints)) +
                    definition("objects", std::to_string(tables.objects)) +
                    definition("classes", std::to_string(tables.classes)) + "</dl>\n";
  for (std::size_t e = 0; e < tables.options.experiments.size(); ++e) {
    out +=
        "<section><h2>Experiment " + escape(to_string(tables.options.experiments[e])) + "</h2>\n";
    for (const ci::Form form : {ci::Form::full, ci::Form::brief})
      out += experiment_table(tables, e, form);
    out += "</section>\n";
  }
  out += "<section><h2>Linear separability</h2>\n" + separability_table(tables) + "</section>\n";
  return page_around("Static imprints: " + tables.dataset, out);
}

}  // namespace weft::daemon
