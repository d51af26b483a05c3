#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/confusion.hpp"

namespace weft::daemon {
namespace {

namespace ci = classifier::imprint;

constexpr std::string_view ellis_citation =
    "Ellis: A Multiple-Scale Measure of Static Tactile Texture, 1986";
using nlohmann::ordered_json;

// Names the experiments that do not test all imprints.
std::string format_requested(const ImprintTables& tables) {
  std::string out;
  for (std::size_t e = 0; e < tables.requested.size(); ++e)
    if (tables.requested[e] < tables.imprints)
      out += " " + std::string(ci::to_string(tables.options.experiments[e])) + " tests only " +
             std::to_string(tables.requested[e]) + " of them.";
  return out;
}

ordered_json experiment_json(const ci::ExperimentOutcome& outcome) {
  return {{"converged", outcome.converged},
          {"correct", outcome.converged ? ordered_json(outcome.correct) : ordered_json(nullptr)},
          {"total", outcome.converged ? ordered_json(outcome.total) : ordered_json(nullptr)},
          {"rounds", outcome.most_rounds},
          {"wrong", outcome.wrong},
          {"taken_for", outcome.taken_for}};
}

ordered_json convergence_json(const ci::ExperimentOutcome& outcome) {
  return {{"converged", outcome.converged},
          {"trainings", outcome.trainings},
          {"failed", outcome.failed},
          {"rounds", outcome.most_rounds}};
}

ordered_json printed_json(ci::Experiment experiment, const FeatureSet& set) {
  using enum PaperEntry::Convergence;
  const auto entry = paper_entry(experiment, set);
  if (!entry) return nullptr;
  if (entry->convergence == never) return {{"converged", false}};
  if (entry->convergence == erratic) return {{"converged", "erratic"}};
  return {{"converged", true}, {"correct", entry->correct}, {"total", ellis_imprints}};
}

ordered_json convergence_json(const ImprintTables& tables) {
  ordered_json out = ordered_json::array();
  for (const auto* sets : {&tables.sets, &tables.partial_sets})
    for (const FeatureSet& set : *sets) {
      if (set.convergence.empty()) continue;
      ordered_json row{{"features", set.sigmas.empty() ? set.name() : std::string(set.kind())},
                       {"scales", set.sigmas},
                       {"linearly_separable", to_string(set.separability.verdict)},
                       {"paper", printed_json(ci::Experiment::one_of_all, set)}};
      for (std::size_t r = 0; r < convergence_rules.size(); ++r)
        row[std::string(to_string(convergence_rules.at(r)))] = convergence_json(set.convergence[r]);
      out.push_back(std::move(row));
    }
  return out;
}

ordered_json misclassified_json(const ImprintTables& tables) {
  ordered_json out = ordered_json::array();
  for (const Misclassified& one : list_misclassified(tables)) {
    ordered_json row{
        {"file", tables.files[one.row]}, {"label", tables.labels[one.row]}, {"wrong", one.wrong}};
    for (std::size_t e = 0; e < one.taken_for.size(); ++e)
      if (!one.taken_for[e].empty())
        row["experiments"][std::string(to_string(tables.options.experiments[e]))] = {
            {"taken_for", one.taken_for[e]}, {"of", count_answers(tables, e)}};
    out.push_back(std::move(row));
  }
  return out;
}

constexpr std::string_view no_convergence_note =
    "\u221E: no convergence. The perceptron still made training errors after 1000 rounds and gives "
    "no "
    "prediction.";

std::string_view meaning_of(ci::Experiment experiment) {
  switch (experiment) {
    case ci::Experiment::one_of_all:
      return "cross-validation; each test part is one imprint";
    case ci::Experiment::object_of_all:
      return "cross-validation; each test part has all imprints of one object";
    case ci::Experiment::one_of_class:
      return "cross-validation; each test part has one imprint of every class";
    case ci::Experiment::object_of_class:
      return "cross-validation; each test part has all imprints of one object of every class";
  }
  return {};
}

std::vector<std::string> rules_head(const ImprintTables& tables, std::string first) {
  std::vector<std::string> out{std::move(first), "<span class=\"paper\">paper</span>"};
  for (const classifier::Learner rule : tables.options.rules)
    out.push_back(escape(to_string(rule)));
  return out;
}

// Both forms of the features, and Laws' energies.
Blocks experiment_table(const ImprintTables& tables, std::size_t experiment) {
  std::vector<std::string> head = rules_head(tables, "scales [taxels]");
  head.insert(head.begin() + 1, "features per scale");
  HtmlTable table(head, 2);
  const ci::Experiment name = tables.options.experiments[experiment];
  for (const FeatureSet& set : tables.sets) {
    std::vector<std::string> cells{escape(set.name()), escape(set.kind()),
                                   escape(paper_text(name, set))};
    for (std::size_t r = 0; r < tables.options.rules.size(); ++r)
      cells.push_back(escape(cell_text(tables.outcome(set, experiment, r))));
    table.row(cells);
  }
  return figure(table.finish(),
                "<b>Experiment " + escape(to_string(name)) + "</b>: " + escape(meaning_of(name)) +
                    ". " + escape(no_convergence_note),
                bench_badge(tables.bench));
}

// Section 3.4.6: features and scales with which a perceptron converges in 1/N.
Blocks convergence_table(const ImprintTables& tables) {
  std::vector<std::string> head{"features", "scales [taxels]",
                                "<span class=\"paper\">paper</span>"};
  for (const classifier::Learner rule : convergence_rules) head.push_back(escape(to_string(rule)));
  head.emplace_back("all imprints linearly separable");
  HtmlTable table(head, 2);
  for (const auto* sets : {&tables.sets, &tables.partial_sets})
    for (const FeatureSet& set : *sets) {
      std::vector<std::string> cells{escape(set.kind()), escape(set.name()),
                                     escape(paper_text(ci::Experiment::one_of_all, set))};
      for (std::size_t r = 0; r < convergence_rules.size(); ++r)
        cells.push_back(set.convergence.empty() ? std::string(no_value)
                                                : escape(convergence_text(set.convergence[r])));
      cells.push_back(escape(to_string(set.separability.verdict)));
      table.row(cells);
    }
  return figure(
      table.finish(),
      "Converged trainings of 1/N, with the number of rounds of the longest. Separable: a test "
      "without a perceptron proves whether weights without errors exist. Separable imprints may "
      "need more than 1000 rounds.",
      bench_badge(tables.bench));
}

// Section 3.4.5: misclassified imprints and their predicted classes.
Blocks misclassified_table(const ImprintTables& tables) {
  constexpr std::size_t most_rows = 50;
  const std::vector<Misclassified> all = list_misclassified(tables);
  std::vector<std::string> head{"imprint", "class"};
  for (std::size_t e = 0; e < tables.options.experiments.size(); ++e)
    head.push_back(escape(to_string(tables.options.experiments[e])) + ", of " +
                   std::to_string(count_answers(tables, e)));
  HtmlTable table(head, head.size());
  for (const Misclassified& one : std::span(all).first(std::min(most_rows, all.size()))) {
    std::vector<std::string> cells{escape(tables.files[one.row]), escape(tables.labels[one.row])};
    for (const auto& answers : one.taken_for) {
      std::vector<std::string> words;
      for (const auto& [label, times] : answers)
        words.push_back(label + " " + std::to_string(times));
      cells.push_back(words.empty() ? std::string(no_value) : escape(joined(words)));
    }
    table.row(cells);
  }
  return figure(
      table.finish(),
      std::to_string(all.size()) + " imprints were misclassified by at least one converged rule; " +
          (all.size() > most_rows ? "the first " + std::to_string(most_rows) + ", " : "") +
          "most frequent first. Ellis 1986 found three of 24: SCREEN3-SOFT predicted as a knit, "
          "KNIT2-HARD and RASP3-SOFT as a screen.",
      bench_badge(tables.bench));
}

std::string thumbnails_caption(const ImprintTables& tables) {
  const std::size_t drawn = tables.pictures.tiles.size();
  return "The first imprint of each object" +
         (drawn < tables.objects
              ? ", " + std::to_string(drawn) + " of " + std::to_string(tables.objects) + " objects"
              : std::string()) +
         ", with its class below. All share one scale; darker means more pressure.";
}

/// Predictions in 1/N by class, over all features and rules that converged.
Blocks confusion_section(const ImprintTables& tables) {
  const auto& experiments = tables.options.experiments;
  const auto at = std::ranges::find(experiments, ci::Experiment::one_of_all);
  if (at == experiments.end()) return {};
  const auto e = static_cast<std::size_t>(at - experiments.begin());
  const std::set<std::string> names(tables.labels.begin(), tables.labels.end());
  classifier::Confusion all({names.begin(), names.end()});
  const auto place = [&](const std::string& label) {
    return static_cast<std::size_t>(std::ranges::find(all.labels, label) - all.labels.begin());
  };
  const std::size_t answers = count_answers(tables, e);
  for (const std::string& label : tables.labels) all.at(place(label), place(label)) += answers;
  for (const Misclassified& one : list_misclassified(tables))
    for (const auto& [label, times] : one.taken_for[e]) {
      const std::size_t truth = place(tables.labels[one.row]);
      all.at(truth, truth) -= times;
      all.at(truth, place(label)) += times;
    }
  if (answers == 0) return {};
  const std::string title = "Predictions in 1/N by class";
  return section(
      "Confusion matrix",
      figure(confusion_pictures(all, title),
             "<b>" + title + "</b>: cross-validated by imprint, over the " +
                 std::to_string(answers) + " sets of features and rules that converged. " +
                 escape(worst_confusions(all, 3)),
             bench_badge(tables.bench)));
}

}  // namespace

std::string cell_text(const ci::ExperimentOutcome& outcome) {
  if (!outcome.converged) return "\u221E";
  const double share = outcome.total == 0 ? 0.0
                                          : static_cast<double>(outcome.correct) /
                                                static_cast<double>(outcome.total);
  return std::to_string(outcome.correct) + " / " + std::to_string(outcome.total) + " (" +
         percent(share, 0) + " %)";
}

std::string convergence_text(const ci::ExperimentOutcome& outcome) {
  if (outcome.failed == outcome.trainings) return "\u221E";
  return std::to_string(outcome.trainings - outcome.failed) + " of " +
         std::to_string(outcome.trainings) +
         (outcome.converged ? ", " + std::to_string(outcome.most_rounds) + " rounds" : "");
}

std::string paper_text(ci::Experiment experiment, const FeatureSet& set) {
  using enum PaperEntry::Convergence;
  const auto entry = paper_entry(experiment, set);
  if (!entry) return std::string(no_value);
  if (entry->convergence == erratic) return "erratic";
  ci::ExperimentOutcome printed;
  printed.converged = entry->convergence == always;
  printed.correct = entry->correct;
  printed.total = ellis_imprints;
  return cell_text(printed);
}

std::string tables_note(const ImprintTables& tables) {
  return "Column \"paper\": Ellis 1986, 24 real imprints of 12 objects in 4 classes. All other "
         "columns: " +
         std::to_string(tables.imprints) + " imprints of " + std::to_string(tables.objects) +
         " objects in " + std::to_string(tables.classes) + " classes" +
         (tables.bench == BenchKind::simulated ? ", SIMULATED" : "") +
         "; \u221E: no convergence of the perceptron in 1000 rounds." + format_requested(tables) +
         (tables.left_out.empty() ? "" : " Skipped: " + format_left_out(tables) + ".");
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
  return {{"command", "imprint tables"},
          {"bench", to_string(tables.bench)},
          {"dataset", tables.dataset},
          {"dataset_sha256", tables.sha256},
          {"imprints", tables.imprints},
          {"classes", tables.classes},
          {"objects", tables.objects},
          {"asked", std::move(requested)},
          {"left_out", std::move(left_out)},
          {"sets", std::move(sets)},
          {"noise", ci::noise_names.at(static_cast<std::size_t>(tables.options.edges.noise))},
          {"orientation",
           ci::orientation_names.at(static_cast<std::size_t>(tables.options.edges.orientation))},
          {"convergence", convergence_json(tables)},
          {"misclassified", misclassified_json(tables)}};
}

Document tables_document(const ImprintTables& tables) {
  Document out{"imprints", "Static imprints: " + tables.dataset,
               std::string(bench_text(tables.bench))};
  out.lead_html = std::to_string(tables.imprints) + " imprints of " +
                  std::to_string(tables.objects) + " objects in " + std::to_string(tables.classes) +
                  " classes";
  out.result = confusion_section(tables);
  out.pictures = section("Imprints", figure(picture(tables.pictures), thumbnails_caption(tables),
                                            bench_badge(tables.bench)));
  Blocks experiments = paragraph(escape(tables_note(tables)));
  for (std::size_t e = 0; e < tables.options.experiments.size(); ++e)
    experiments += experiment_table(tables, e);
  out.tables = section("Tables of Ellis 1986", std::move(experiments)) +
               section("Convergence", details("Convergence of the perceptron by features",
                                              convergence_table(tables))) +
               section("Misclassified imprints",
                       details("Misclassified imprints and their predicted classes",
                               misclassified_table(tables)));
  std::vector<std::pair<std::string, std::string>> facts;
  for (const ci::Experiment one : tables.options.experiments)
    facts.emplace_back(to_string(one), meaning_of(one));
  facts.emplace_back("\u221E", no_convergence_note);
  facts.emplace_back("paper", ellis_citation);
  out.method = definitions(facts);
  out.provenance = definitions({{"data set", tables.dataset}, {"data set SHA-256", tables.sha256}});
  return out;
}

}  // namespace weft::daemon
