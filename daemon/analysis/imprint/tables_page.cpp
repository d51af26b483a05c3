#include "daemon/analysis/imprint/tables.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"

namespace weft::daemon {
namespace {

namespace ci = classifier::imprint;

std::vector<std::string> rules_head(const ImprintTables& tables, std::string first) {
  std::vector<std::string> out{std::move(first), "<span class=\"paper\">paper</span>"};
  for (const ci::Rule rule : tables.options.rules) out.push_back(escape(to_string(rule)));
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
