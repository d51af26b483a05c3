#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

/// A setting with the largest errors of its fabrics.
struct MeasuredRow {
  sim::FidelitySetting setting;
  double max_n = 0, q99_n = 0;
  double times_real_time = 0;  ///< of the contact computation only
};

std::vector<MeasuredRow> measured_rows(const sim::FidelityTable& table) {
  std::vector<MeasuredRow> out;
  for (const sim::MeasuredSetting& measured : table.settings) {
    MeasuredRow row{.setting = measured.setting,
                    .times_real_time = 1e6 / measured.contact_us_per_s};
    for (const sim::ClothError& cloth : measured.cloths) {
      row.max_n = std::max(row.max_n, cloth.max_n);
      row.q99_n = std::max(row.q99_n, cloth.q99_n);
    }
    if (row.max_n > 0) out.push_back(row);
  }
  return out;
}

/// "L2 midpoint" of "L2 midpoint 0.384 ms".
std::string family_of(const sim::FidelitySetting& setting) {
  const std::string name = to_string(setting);
  return setting.step_s > 0 ? name.substr(0, name.rfind(' ', name.rfind(' ') - 1)) : name;
}

chart::Plot plot_of(const std::vector<MeasuredRow>& rows, const std::vector<std::size_t>& front) {
  std::vector<std::string> families;
  std::vector<chart::FamilySample> points;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string family = family_of(rows[i].setting);
    auto known = std::ranges::find(families, family);
    if (known == families.end()) known = families.insert(families.end(), family);
    chart::Sample sample{1 / rows[i].times_real_time, rows[i].max_n};
    sample.front = std::ranges::find(front, i) != front.end();
    if (sample.front) sample.label = to_string(rows[i].setting);
    points.push_back({static_cast<std::size_t>(known - families.begin()), std::move(sample)});
  }
  chart::Plot out{"Error of the simulated force against processor time, SIMULATED", "SIMULATED"};
  out.panel_height = 300;
  out.front_name = "Pareto front";
  out.panels = {{"plant fidelity, all fabrics",
                 {.title = "processor seconds per simulated second", .logarithmic = true},
                 {.title = "largest error of the force [N]", .logarithmic = true}}};
  out.panels.front().series = chart::series_of(families, points);
  return out;
}

Blocks front_table(const std::vector<MeasuredRow>& rows, const std::vector<std::size_t>& front,
                   std::string_view setting) {
  HtmlTable table({"setting", "largest error [mN]", "99 % of trials [mN]", "times real time"});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = to_string(rows[i].setting);
    const bool used = name == setting;
    if (!used && std::ranges::find(front, i) == front.end()) continue;
    table.row({used ? "<b>" + escape(name) + ", this campaign</b>" : escape(name),
               significant(rows[i].max_n * 1e3), significant(rows[i].q99_n * 1e3),
               thousands(static_cast<std::size_t>(std::lround(rows[i].times_real_time)))});
  }
  return table.finish();
}

using nlohmann::ordered_json;

std::string share_cell(const SeedMean& m) {
  return percent(m.mean) + "<span class=\"interval-text\">" + percent(m.ci95.low) + " to " +
         percent(m.ci95.high) + "</span>";
}

std::string number_cell(const SeedMean& m, int decimals) {
  if (!std::isfinite(m.mean)) return "unbounded";
  return fixed(m.mean, decimals) + "<span class=\"interval-text\">" + fixed(m.ci95.low, decimals) +
         " to " + fixed(m.ci95.high, decimals) + "</span>";
}

std::vector<std::string> different(const std::vector<Transfer>& all, std::string Transfer::*field) {
  std::vector<std::string> out;
  for (const Transfer& t : all)
    if (std::ranges::find(out, t.*field) == out.end()) out.push_back(t.*field);
  return out;
}

/// Rows: learner and channels; columns: training level; tested at one level.
Blocks transfer_table(const DownstreamResult& result, const std::string& tested,
                      bool across_swatches) {
  std::vector<std::string> head{"channels", "learner"};
  for (const std::string& level : result.levels) head.push_back("trained at " + escape(level));
  HtmlTable out(head, 2);
  for (const std::string& channels : different(result.transfers, &Transfer::channels))
    for (const std::string& learner : different(result.transfers, &Transfer::learner)) {
      std::vector<std::string> row{escape(channels), escape(learner)};
      for (const std::string& level : result.levels)
        for (const Transfer& t : result.transfers)
          if (t.channels == channels && t.learner == learner && t.trained == level &&
              t.tested == tested && t.across_swatches == across_swatches)
            row.push_back(share_cell(t.accuracy));
      out.row(row);
    }
  return out.finish();
}

Blocks shift_table(const DownstreamResult& result) {
  HtmlTable out({"channels", "level", "most shifted feature", "shift [deviations within a fabric]",
                 "Spearman's rank correlation of F"},
                3);
  for (const FeatureShift& s : result.shifts)
    out.row({escape(s.channels), escape(s.level), feature_html(s.shifted),
             number_cell(s.max_shift, 2), number_cell(s.spearman, 3)});
  return out.finish();
}

/// Values that are not finite become null in the JSON text.
ordered_json mean_json(const SeedMean& m) {
  return {{"mean", m.mean},
          {"ci95", {m.ci95.low, m.ci95.high}},
          {"ci95_method", m.ci95.method},
          {"seeds", m.values}};
}

}  // namespace

Result<Blocks> fidelity_section(const sim::FidelityTable& table, std::string_view setting) {
  const std::vector<MeasuredRow> rows = measured_rows(table);
  if (rows.empty()) return Blocks();
  std::vector<TradeoffChoice> bargains;
  for (const MeasuredRow& row : rows) bargains.push_back({-row.max_n, 1 / row.times_real_time});
  const auto front = pareto_front(bargains);
  if (!front) return pass(front.error());
  const sim::TableConditions& conditions = table.conditions;
  return section(
      "Cost of the plant\u2019s fidelity",
      figure(picture(plot_of(rows, *front)) + front_table(rows, *front, setting),
             "Recorded samples of " + std::to_string(conditions.scenes) + " random recipes on " +
                 std::to_string(conditions.seeds) + " benches each, against " +
                 escape(conditions.reference) +
                 ". Times are those of the contact only. The Pareto front has the least error for "
                 "the time. Measured by " +
                 escape(table.made_by) + " on " + escape(table.machine) +
                 ", not by this campaign. The error of this campaign is given above.",
             bench_badge(BenchKind::simulated)),
      "fidelity");
}

Blocks downstream_section(const DownstreamResult& result) {
  const std::string& yardstick = result.levels.back();
  Blocks out = paragraph(
      std::to_string(result.fabrics) + " fabrics, " + std::to_string(result.campaign.swatches) +
      " pieces of each, " + std::to_string(result.campaign.trials) + " trials per piece, " +
      fixed(result.campaign.slide_s, 1) + " s of sliding, " + std::to_string(result.seeds) +
      " seeds. Fabrics, places and noise are the same at every level. Training and test are "
      "both simulated: the values compare levels and do not predict the accuracy on real fabrics.");
  for (const bool across : {true, false})
    out += figure(
        transfer_table(result, yardstick, across),
        std::string(across ? "Across pieces: training and test use different pieces of the "
                             "fabrics. "
                           : "On the same pieces: every second trial is used for training. ") +
            "Tested at " + escape(yardstick) +
            ". Accuracy in percent, 95 % intervals over seeds (Student's t; "
            "Wilson's of one seed if all agree).",
        simulated_badge());
  out += figure(transfer_table(result, "L1", true),
                "Across pieces, tested at L1: accuracy of a classifier that was trained on a "
                "finer model.",
                simulated_badge());
  out += figure(
      shift_table(result),
      "Features of a level compared with those at " + escape(yardstick) +
          ". The shift of a feature is the mean over fabrics of |difference of its means|, "
          "divided by its pooled deviation within a fabric. F is from an analysis of variance "
          "between fabrics.",
      simulated_badge());
  return section("Downstream: effect on a classifier", std::move(out));
}

ordered_json downstream_json(const DownstreamResult& result) {
  ordered_json out = {{"bench", "simulated"},
                      {"fabrics", result.fabrics},
                      {"swatches", result.campaign.swatches},
                      {"trials", result.campaign.trials},
                      {"slide_s", result.campaign.slide_s},
                      {"seeds", result.seeds},
                      {"levels", result.levels},
                      {"transfers", ordered_json::array()},
                      {"shifts", ordered_json::array()}};
  for (const Transfer& t : result.transfers)
    out["transfers"].push_back({{"channels", t.channels},
                                {"learner", t.learner},
                                {"trained", t.trained},
                                {"tested", t.tested},
                                {"across_swatches", t.across_swatches},
                                {"accuracy", mean_json(t.accuracy)}});
  for (const FeatureShift& s : result.shifts)
    out["shifts"].push_back({{"channels", s.channels},
                             {"level", s.level},
                             {"yardstick", result.levels.back()},
                             {"spearman", mean_json(s.spearman)},
                             {"max_shift", mean_json(s.max_shift)},
                             {"shifted", s.shifted}});
  return out;
}

}  // namespace weft::daemon
