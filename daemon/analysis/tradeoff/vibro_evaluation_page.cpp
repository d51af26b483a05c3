#include "daemon/analysis/tradeoff/vibro_evaluation_page.hpp"

#include <algorithm>

#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/tradeoff_page.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;

constexpr std::size_t max_listed_mistakes = 5;
constexpr double least_answer_s = 1e-9;  // the clock's step: a time must be positive to be drawn

TradeoffPoint point_of(const VibroEvaluation& evaluation, const EvaluatedMethod& method) {
  const vibro::CrossValidation& r = method.result;
  TradeoffPoint out;
  out.name = out.family = method.name;
  out.bench = evaluation.bench;
  out.accuracy = r.f_score;
  out.ci95 = r.f_score_ci95;
  out.tested = r.confusion.total();
  out.features_s = evaluation.features_s;
  out.vote_s = r.answer_s;
  out.answer_s = std::max(evaluation.features_s + r.answer_s, least_answer_s);
  out.timings_s = {out.answer_s};
  out.contact_s = evaluation.window_s;
  out.train_s = r.train_s;
  return out;
}

std::string shares(const VibroEvaluation& evaluation) {
  HtmlTable out({"learner", "windows right [%]", "95 % interval", "macro F-score",
                 "recordings right [%]", "95 % interval", "of so many"},
                1);
  for (const EvaluatedMethod& method : evaluation.methods) {
    const vibro::CrossValidation& r = method.result;
    out.row({escape(method.name), percent(r.accuracy, 2),
             percent(r.accuracy_ci95.low) + " to " + percent(r.accuracy_ci95.high),
             fixed(r.f_score, 3), percent(r.voted_accuracy, 2),
             percent(r.voted_ci95.low) + " to " + percent(r.voted_ci95.high),
             std::to_string(r.voted)});
  }
  const vibro::CrossValidation& first = evaluation.methods.front().result;
  return figure(out.finish(),
                "Windows: " + escape(first.accuracy_ci95.method) +
                    ". A recording (with blocks, a part of one) is answered by the most frequent "
                    "answer of its windows: " +
                    escape(first.voted_ci95.method) + ".",
                bench_badge(evaluation.bench));
}

std::string confusions(const VibroEvaluation& evaluation) {
  std::string out = "<section>\n<h2>Confusion by material</h2>\n";
  for (const EvaluatedMethod& method : evaluation.methods)
    out += figure("<div class=\"scroll\">" +
                      confusion_map(method.result.confusion, "Windows, " + method.name) + "</div>",
                  escape(method.name) + ". " +
                      escape(worst_confusions(method.result.confusion, max_listed_mistakes)),
                  bench_badge(evaluation.bench));
  return out + "</section>\n";
}

}  // namespace

Result<std::string> vibro_evaluation_html(const VibroEvaluation& evaluation) {
  if (evaluation.methods.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = evaluation.dataset,
                 .what = "a page without a learner"});
  TradeoffSet set{evaluation.dataset, evaluation.sha256, evaluation.bench, {}, {}, {}};
  for (const auto& [name, value] : evaluation.facts) set.facts.emplace_back(name, value);
  for (const EvaluatedMethod& method : evaluation.methods)
    set.points.push_back(point_of(evaluation, method));
  TradeoffReport report;
  report.costs = {classifier_costs().front()};
  report.sets = {std::move(set)};
  report.tables_html =
      "<section>\n<h2>Shares of right answers</h2>\n" + shares(evaluation) + "</section>\n" +
      confusions(evaluation) +
      (evaluation.importance.empty()
           ? std::string()
           : "<section>\n<h2>Importance of features</h2>\n" +
                 figure("<pre>" + escape(evaluation.importance) + "</pre>",
                        "Accuracy that goes when a feature's values are dealt out at random.",
                        bench_badge(evaluation.bench)) +
                 "</section>\n");
  const auto sections = tradeoff_sections_html(report);
  if (!sections) return pass(sections.error());
  return page_around("Evaluation of " + evaluation.dataset,
                     "<header>" + bench_badge(evaluation.bench) +
                         "\n<h1>Sound and vibration: evaluation of " + escape(evaluation.dataset) +
                         "</h1>\n<p>Accuracy in the picture and its table is the macro F-score."
                         "</p>\n</header>\n" +
                         *sections);
}

}  // namespace weft::daemon
