#include "daemon/analysis/tradeoff/vibro_paper.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;
using classifier::Learner;
using nlohmann::ordered_json;
using vibro::Family;
using vibro::Protocol;

// The nine learners of the paper's Table 1, then MLP2.
constexpr std::array learners_of_paper = {
    Learner::nb,       Learner::knn, Learner::tree, Learner::forest, Learner::svm,
    Learner::logistic, Learner::nn,  Learner::xgb,  Learner::xgbrf,  Learner::mlp2};
constexpr std::size_t in_table = 9;
constexpr std::array families_of_paper = {Family::smmrp, Family::fft, Family::smmrpfft};

constexpr std::array<std::array<double, in_table>, 4> f_scores_of_paper = {
    {{0.95, 0.94, 0.94, 0.95, 0.94, 0.91, 0.96, 0.97, 0.95},
     {0.95, 0.95, 0.94, 0.95, 0.93, 0.94, 0.95, 0.95, 0.94},
     {0.98, 0.99, 0.97, 1.0, 0.98, 0.97, 1.0, 0.98, 0.99},
     {0.99, 0.96, 0.98, 0.99, 0.96, 0.96, 1.0, 0.99, 0.99}}};

// Sums over averages, used for the gains.
struct Totals {
  std::set<Family> families;
  std::size_t learners = 0;
  double f_score = 0.0, accuracy = 0.0, answer_s = 0.0, classify_s = 0.0;
};

Totals totals_of(std::span<const VibroAverage> averages, const std::string& source,
                 Protocol protocol, double window_s) {
  Totals out;
  for (const VibroAverage& a : averages) {
    if (a.source != source || a.protocol != protocol || a.window_s != window_s) continue;
    const auto weight = static_cast<double>(a.learners);
    out.families.insert(a.family);
    out.learners += a.learners;
    out.f_score += weight * a.f_score;
    out.accuracy += weight * a.accuracy;
    out.answer_s += weight * a.answer_s;
    out.classify_s += weight * a.classify_s;
  }
  return out;
}

double gain(double from, double to) {
  return from > 0.0 ? to / from - 1.0 : 0.0;
}

bool has_papers_channels(std::span<const vibro::Channel> channels) {
  return channels.size() == 4 && std::ranges::count(channels, "S", &vibro::Channel::name) == 1;
}

ordered_json gain_json(const VibroGain& g) {
  ordered_json papers;
  if (g.is_papers) papers = {{"f_score", papers_f_score_gain}, {"time", papers_time_gain}};
  return {{"source", g.source},         {"protocol", vibro::to_string(g.protocol)},
          {"f_score", g.f_score},       {"f_score_points", g.f_score_points},
          {"accuracy", g.accuracy},     {"answer_s", g.answer_s},
          {"classify_s", g.classify_s}, {"paper", papers}};
}

// The paper's values apply to random windows and all channels.
bool is_papers(const VibroTradeoff& tradeoff, const std::string& source, Protocol protocol) {
  return tradeoff.papers_recipe && protocol == Protocol::random &&
         source == tradeoff.points.back().source;  // the source with most channels is last
}

std::optional<double> papers_average(Family family, double window_s) {
  for (const PapersRow& row : papers_table_1())
    if (row.family == family && row.window_s == window_s) return row.average;
  return std::nullopt;
}

ordered_json or_null(std::optional<double> value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json average_json(const VibroAverage& a) {
  ordered_json papers;
  if (a.papers_f_score || a.papers_explained)
    papers = {{"f_score", or_null(a.papers_f_score)}, {"explained", or_null(a.papers_explained)}};
  return {{"source", a.source},
          {"window_s", a.window_s},
          {"features", vibro::to_string(a.family)},
          {"protocol", vibro::to_string(a.protocol)},
          {"learners", a.learners},
          {"f_score", a.f_score},
          {"accuracy", a.accuracy},
          {"explained", a.explained},
          {"answer_s", a.answer_s},
          {"classify_s", a.classify_s},
          {"paper", papers}};
}

Blocks table_of_averages(std::span<const VibroAverage> averages, const std::string& badge) {
  HtmlTable out({"source", "window", "features", "split", "learners", "F-score", "paper",
                 "accuracy of windows [%]", "variance explained [%]", "paper"},
                4);
  for (const VibroAverage& a : averages)
    out.row({escape(a.source), general(a.window_s) + " s", std::string(vibro::to_string(a.family)),
             protocol_name(a.protocol), std::to_string(a.learners), fixed(a.f_score, 3),
             a.papers_f_score ? fixed(*a.papers_f_score, 3) : std::string(no_value),
             percent(a.accuracy, 2), percent(a.explained, 2),
             a.papers_explained ? percent(*a.papers_explained, 0) : std::string(no_value)});
  return figure(out.finish(),
                "Averages over the measured ones of the paper's ten classifiers, and the variance "
                "of the training windows explained by the components. The paper averages the nine "
                "classifiers of its Table 1.",
                badge);
}

Blocks table_of_gains(std::span<const VibroGain> gains, const std::string& badge) {
  if (gains.empty()) return {};
  HtmlTable out({"source", "split", "F-score", "accuracy of windows", "prediction time",
                 "learner time", "paper: F-score, time"},
                2);
  for (const VibroGain& g : gains)
    out.row({escape(g.source), protocol_name(g.protocol), signed_percent(g.f_score),
             signed_percent(g.accuracy), signed_percent(g.answer_s), signed_percent(g.classify_s),
             g.is_papers
                 ? signed_percent(papers_f_score_gain) + ", " + signed_percent(papers_time_gain)
                 : std::string(no_value)});
  return figure(out.finish(),
                "Gain of windows of 2 s over windows of 1 s, in percent of the value at 1 s. Means "
                "over the paper's learners and all feature sets.",
                badge);
}

}  // namespace

std::string signed_percent(double share) {
  return (share < 0.0 ? "" : "+") + fixed(100.0 * share, 2) + " %";
}

bool is_papers_recipe(std::span<const vibro::Recording> recordings,
                      const vibro::ProtocolOptions& protocol, vibro::Combine combine,
                      std::size_t components) {
  constexpr std::size_t of_a_texture = 100;
  constexpr double tests = 0.2;
  std::map<std::string, std::size_t> windows;
  for (const vibro::Recording& recording : recordings) {
    if (!has_papers_channels(recording.channels)) return false;
    windows[recording.label] += protocol.per_recording;
  }
  return protocol.protocol == Protocol::random && protocol.test_share == tests &&
         combine == vibro::Combine::mean && components == vibro::papers_components &&
         !windows.empty() && std::ranges::all_of(windows, [](const auto& label) {
           return label.second == of_a_texture;
         });
}

std::optional<double> papers_explained(Family family, double window_s) {
  if (window_s != 2.0) return std::nullopt;
  if (family == Family::smmrp) return 0.95;
  if (family == Family::fft) return 0.97;
  return family == Family::smmrpfft ? std::optional(1.0) : std::nullopt;
}

std::span<const Learner> papers_table_learners() {
  return papers_learners().first(in_table);
}

std::span<const Learner> papers_learners() {
  return learners_of_paper;
}

std::vector<PapersRow> papers_table_1() {
  return {{1.0, Family::smmrp, f_scores_of_paper[0], 0.95},
          {1.0, Family::fft, f_scores_of_paper[1], 0.94},
          {2.0, Family::smmrp, f_scores_of_paper[2], 0.984},
          {2.0, Family::fft, f_scores_of_paper[3], 0.980}};
}

std::vector<VibroAverage> compute_averages(const VibroTradeoff& tradeoff) {
  std::vector<VibroAverage> out;
  for (const VibroPoint& p : tradeoff.points) {
    if (std::ranges::find(papers_learners(), p.learner) == papers_learners().end() ||
        (p.window_s != 1.0 && p.window_s != 2.0))
      continue;
    auto at = std::ranges::find_if(out, [&](const VibroAverage& a) {
      return a.source == p.source && a.window_s == p.window_s && a.family == p.family &&
             a.protocol == p.protocol;
    });
    if (at == out.end())
      at = out.insert(at, {p.source, p.window_s, p.family, p.protocol, 0, 0.0, 0.0, 0.0});
    if (at->learners == 0 && is_papers(tradeoff, p.source, p.protocol)) {
      at->papers_f_score = papers_average(p.family, p.window_s);
      at->papers_explained = papers_explained(p.family, p.window_s);
    }
    const auto n = static_cast<double>(++at->learners);
    at->f_score += (p.result.f_score - at->f_score) / n;
    at->accuracy += (p.result.accuracy - at->accuracy) / n;
    at->explained += (p.result.explained - at->explained) / n;
    at->answer_s += (p.features_s + p.result.answer_s - at->answer_s) / n;
    at->classify_s += (p.result.answer_s - at->classify_s) / n;
  }
  return out;
}

std::vector<VibroGain> compute_gains(const VibroTradeoff& tradeoff,
                                     std::span<const VibroAverage> averages) {
  std::vector<VibroGain> out;
  for (const VibroAverage& a : averages) {
    if (std::ranges::any_of(out, [&](const VibroGain& g) {
          return g.source == a.source && g.protocol == a.protocol;
        }))
      continue;
    const Totals one = totals_of(averages, a.source, a.protocol, 1.0);
    const Totals two = totals_of(averages, a.source, a.protocol, 2.0);
    if (one.learners == 0 || one.learners != two.learners || one.families != two.families) continue;
    const bool whole = one.learners == learners_of_paper.size() * families_of_paper.size() &&
                       std::ranges::all_of(families_of_paper, [&](Family family) {
                         return one.families.contains(family);
                       });
    out.push_back({a.source, a.protocol, whole && is_papers(tradeoff, a.source, a.protocol),
                   gain(one.f_score, two.f_score), gain(one.accuracy, two.accuracy),
                   gain(one.answer_s, two.answer_s), gain(one.classify_s, two.classify_s),
                   (two.f_score - one.f_score) / static_cast<double>(one.learners)});
  }
  return out;
}

ordered_json averages_json(const VibroTradeoff& tradeoff, Protocol protocol) {
  auto averages = compute_averages(tradeoff);
  std::erase_if(averages, [&](const VibroAverage& a) { return a.protocol != protocol; });
  ordered_json out = {{"papers_recipe", tradeoff.papers_recipe && protocol == Protocol::random},
                      {"averages", ordered_json::array()},
                      {"gains", ordered_json::array()}};
  for (const VibroAverage& a : averages) out["averages"].push_back(average_json(a));
  for (const VibroGain& g : compute_gains(tradeoff, averages)) out["gains"].push_back(gain_json(g));
  return out;
}

Blocks average_tables(const VibroTradeoff& tradeoff, const std::string& badge_html) {
  const auto averages = compute_averages(tradeoff);
  if (averages.empty()) return {};
  return table_of_averages(averages, badge_html) +
         table_of_gains(compute_gains(tradeoff, averages), badge_html);
}

}  // namespace weft::daemon
