#include <algorithm>
#include <array>
#include <map>

#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/analysis/tradeoff/vibro_paper.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/confusion.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;

constexpr std::size_t max_listed_mistakes = 5;

Blocks shares(const VibroEvaluation& evaluation) {
  HtmlTable out({"learner", "accuracy of windows [%]", "95 % interval", "macro F-score",
                 "accuracy of recordings [%]", "95 % interval", "recordings"},
                1);
  for (const WindowLearner& method : evaluation.learners) {
    const vibro::CrossValidation& r = method.result;
    out.row({escape(method.name), percent(r.accuracy, 2),
             percent(r.accuracy_ci95.low) + " to " + percent(r.accuracy_ci95.high),
             fixed(r.f_score, 3), percent(r.voted_accuracy, 2),
             percent(r.voted_ci95.low) + " to " + percent(r.voted_ci95.high),
             std::to_string(r.voted)});
  }
  const vibro::CrossValidation& first = evaluation.learners.front().result;
  return figure(out.finish(),
                "Windows: " + escape(first.accuracy_ci95.method) +
                    ". Recordings (with blocks, parts of one) are predicted by majority vote of "
                    "their windows: " +
                    escape(first.voted_ci95.method) + ".",
                bench_badge(evaluation.bench));
}

Blocks confusions(const VibroEvaluation& evaluation) {
  Blocks out;
  for (const WindowLearner& method : evaluation.learners)
    out += figure(confusion_pictures(method.result.confusion, "Windows, " + method.name),
                  escape(method.name) + ". " +
                      escape(worst_confusions(method.result.confusion, max_listed_mistakes)),
                  bench_badge(evaluation.bench));
  return section("Confusion matrix by material", side_by_side(std::move(out)));
}

using classifier::Learner;
using vibro::Family;
using vibro::Protocol;

// Table 2 of the paper: accuracy [%], SMMRPFFT, 2 s, over all learners.
struct PaperMaterial {
  const char* name;
  double right;
};
constexpr std::array paper_table_2 = {
    PaperMaterial{"fabric-1", 100},       PaperMaterial{"aluminium_film", 100},
    PaperMaterial{"fabric-2", 90},        PaperMaterial{"fabric-3", 100},
    PaperMaterial{"moquette-1", 77},      PaperMaterial{"moquette-2", 100},
    PaperMaterial{"fabric-4", 100},       PaperMaterial{"sticky fabric-5", 100},
    PaperMaterial{"sticky-fabric", 100},  PaperMaterial{"sparkle-paper-1", 95},
    PaperMaterial{"sparkle-paper-2", 92}, PaperMaterial{"toy-tire-rubber", 55}};

const VibroPoint* find(const VibroTradeoff& tradeoff, Learner learner, Family family,
                       double window_s, const std::string& source, Protocol protocol) {
  for (const VibroPoint& p : tradeoff.points)
    if (p.learner == learner && p.family == family && p.window_s == window_s &&
        p.source == source && p.protocol == protocol)
      return &p;
  return nullptr;
}

bool measured(const VibroTradeoff& tradeoff, const PapersRow& row) {
  return std::ranges::any_of(tradeoff.points, [&](const VibroPoint& p) {
    return p.family == row.family && p.window_s == row.window_s;
  });
}

std::string score(const VibroPoint* p) {
  return p == nullptr ? std::string(no_value) : fixed(p->result.f_score, 2);
}

// A line with our results: F-scores of the learners and their mean; a dash if one was not measured.
std::vector<std::string> scores_of(const VibroTradeoff& tradeoff, const PapersRow& row,
                                   const std::string& source, Protocol protocol) {
  std::vector<std::string> out;
  double sum = 0.0;
  bool whole = true;
  for (const Learner learner : papers_table_learners()) {
    const VibroPoint* p = find(tradeoff, learner, row.family, row.window_s, source, protocol);
    out.push_back(score(p));
    sum += p == nullptr ? 0.0 : p->result.f_score;
    whole = whole && p != nullptr;
  }
  const auto count = static_cast<double>(papers_table_learners().size());
  out.push_back(whole ? fixed(sum / count, 3) : std::string(no_value));
  return out;
}

void add_row(const PapersRow& row, const std::string& whose, std::vector<std::string> scores,
             HtmlTable& out) {
  scores.insert(scores.begin(),
                {fixed(row.window_s, 0) + " s", std::string(vibro::to_string(row.family)), whose});
  out.row(scores);
}

Blocks table_1(const VibroTradeoff& tradeoff, const std::string& source, const std::string& badge) {
  std::vector<std::string> head = {"window", "features", "whose"};
  for (const Learner m : papers_table_learners()) head.emplace_back(classifier::paper_name(m));
  head.emplace_back("average");
  HtmlTable out(head, 3);
  std::size_t rows = 0;
  for (const PapersRow& row : papers_table_1()) {
    if (!measured(tradeoff, row)) continue;
    ++rows;
    for (const Protocol protocol : {Protocol::random, tradeoff.honest})
      add_row(row, "Weft, " + protocol_name(protocol), scores_of(tradeoff, row, source, protocol),
              out);
    if (!tradeoff.papers_recipe) continue;
    std::vector<std::string> papers;
    for (const double f : row.f_score) papers.push_back(fixed(f, 2));
    papers.push_back(fixed(row.average, 3));
    add_row(row, "the paper", std::move(papers), out);
  }
  if (rows == 0) return {};
  return figure(out.finish(),
                "Table 1: macro F-score, three components, source " + escape(source) +
                    (tradeoff.papers_recipe
                         ? ". The paper had 20 s of twelve textures, S, X, Y and Z. Its random "
                           "windows share samples between training and test, as here."
                         : "."),
                badge);
}

// Figure 4 a to d: F-score and prediction time by learner, features (2 s) and source.
Blocks figure_4(const VibroTradeoff& tradeoff, const std::string& badge) {
  HtmlTable out(
      {"learner", "features", "source", "F, " + protocol_name(Protocol::random),
       "F, " + protocol_name(tradeoff.honest), "feature time of a window", "prediction time"},
      3);
  std::size_t rows = 0;
  for (const VibroPoint& p : tradeoff.points) {
    if (p.window_s != 2.0 || p.protocol != Protocol::random) continue;
    ++rows;
    const VibroPoint* honest =
        find(tradeoff, p.learner, p.family, p.window_s, p.source, tradeoff.honest);
    out.row({std::string(classifier::to_string(p.learner)), std::string(vibro::to_string(p.family)),
             escape(p.source), score(&p), score(honest), duration(p.features_s),
             duration(p.result.answer_s)});
  }
  if (rows == 0) return {};
  return figure(
      out.finish(),
      std::string("Figure 4: windows of 2 s.") +
          (tradeoff.papers_recipe
               ? " The paper gives an average F-score of 0.91 for XGBRF with 4.69 ms, 0.35 ms for "
                 "LG and Tree, and kNN 1 % better than XGBRF with 2.13 ms more."
               : ""),
      badge);
}

struct Material {
  std::size_t right = 0, total = 0;
  std::map<std::string, std::size_t> predicted_as;
};

std::map<std::string, Material> materials(const VibroTradeoff& tradeoff, const std::string& source,
                                          Protocol protocol) {
  std::map<std::string, Material> out;
  for (const VibroPoint& p : tradeoff.points) {
    if (p.protocol != protocol || p.source != source || p.window_s != 2.0 ||
        p.family != Family::smmrpfft)
      continue;
    const classifier::Confusion& c = p.result.confusion;
    for (std::size_t t = 0; t < c.classes(); ++t) {
      Material& own = out[c.labels[t]];
      for (std::size_t k = 0; k < c.classes(); ++k) {
        own.total += c.at(t, k);
        (k == t ? own.right : own.predicted_as[c.labels[k]]) += c.at(t, k);
      }
    }
  }
  return out;
}

std::string material_cells(const Material& m) {
  const auto whole = static_cast<double>(std::max<std::size_t>(m.total, 1));
  std::string out = percent(static_cast<double>(m.right) / whole, 0);
  for (const auto& [name, count] : m.predicted_as) {
    constexpr double worth_naming = 0.03;
    const double share = static_cast<double>(count) / whole;
    if (share >= worth_naming) out += "; " + escape(name) + " " + percent(share, 0);
  }
  return out;
}

Blocks table_2(const VibroTradeoff& tradeoff, const std::string& source, const std::string& badge) {
  auto random = materials(tradeoff, source, Protocol::random);
  auto honest = materials(tradeoff, source, tradeoff.honest);
  if (random.empty()) return {};
  HtmlTable out({"material", "accuracy and wrong predictions [%], random windows",
                 protocol_name(tradeoff.honest)},
                1);
  for (auto& [name, material] : random)
    out.row({escape(name), material_cells(material), material_cells(honest[name])});
  std::string papers;
  for (const PaperMaterial& m : paper_table_2)
    papers += (papers.empty() ? "" : ", ") + std::string(m.name) + " " + fixed(m.right, 0);
  return figure(out.finish(),
                std::string("Table 2: SMMRPFFT, 2 s, over all learners.") +
                    (tradeoff.papers_recipe ? " The paper's materials; their order in the "
                                              "recordings is not published: " +
                                                  escape(papers) + "."
                                            : ""),
                badge);
}

}  // namespace

Result<Document> vibro_document(const VibroEvaluation& evaluation) {
  if (evaluation.learners.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = evaluation.dataset,
                 .what = "no learners for the page"});
  TradeoffSet set{evaluation.dataset, evaluation.sha256, evaluation.bench, {}, {}, {}};
  for (const auto& [name, value] : evaluation.facts) set.facts.emplace_back(name, value);
  Blocks lines;
  for (const WindowLearner& method : evaluation.learners) {
    set.points.push_back(
        vibro_tradeoff_point(evaluation.bench, method.name, method.result, evaluation.features_s));
    set.points.back().contact_s = evaluation.window_s;
    const vibro::CrossValidation& r = method.result;
    lines += paragraph("<b>" + escape(method.name) + ": accuracy " + percent(r.voted_accuracy) +
                       " %</b> of recordings (95 %: " + percent(r.voted_ci95.low) + " to " +
                       percent(r.voted_ci95.high) + "), " + percent(r.accuracy) +
                       " % of windows. " + bench_badge(evaluation.bench));
  }
  TradeoffReport report;
  report.measure = "macro F-score";
  report.costs = {classifier_costs().front()};
  report.sets = {std::move(set)};
  auto sections = tradeoff_sections(report);
  if (!sections) return pass(sections.error());
  Document out{"vibration evaluation", "Sound and vibration: evaluation of " + evaluation.dataset,
               std::string(bench_text(evaluation.bench))};
  out.result = section("Accuracy", std::move(lines)) + confusions(evaluation);
  out.pictures = std::move(*sections);
  out.tables = section("Accuracy of windows and recordings", shares(evaluation));
  if (!evaluation.importance.empty())
    out.tables += section("Importance of features",
                          figure(code_block(evaluation.importance),
                                 "Loss of accuracy when the values of a feature are shuffled.",
                                 bench_badge(evaluation.bench)));
  out.alerts = warnings_of(evaluation.facts);
  out.method = definitions(evaluation.facts);
  out.provenance =
      definitions({{"data set", evaluation.dataset}, {"data set SHA-256", evaluation.sha256}});
  return out;
}

Blocks vibro_tables(const VibroTradeoff& tradeoff, const std::string& badge_html) {
  if (tradeoff.points.empty()) return {};
  const std::string source =
      tradeoff.points.back().source;  // the source with most channels is last
  return table_1(tradeoff, source, badge_html) + average_tables(tradeoff, badge_html) +
         figure_4(tradeoff, badge_html) + table_2(tradeoff, source, badge_html);
}

}  // namespace weft::daemon
