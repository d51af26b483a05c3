#include "daemon/analysis/design/design_page.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

ordered_json interval_json(const classifier::Interval& interval) {
  return {interval.low, interval.high};
}

ordered_json value_json(const char* name, const CellValue& value) {
  return {{name, value.value}, {"ci95", interval_json(value.ci95)}};
}

ordered_json factors_json(const SweepAnalysis& a, const std::vector<double>& factors) {
  ordered_json out;
  for (std::size_t f = 0; f < a.factors.size(); ++f) out[a.factors[f]] = factors[f];
  return out;
}

ordered_json factors_json(const SweepAnalysis& a, std::size_t cell) {
  return factors_json(a, a.cells[cell].factors);
}

ordered_json cell_json(const SweepAnalysis& a, std::size_t i) {
  const SweepCell& cell = a.cells[i];
  const auto& summary = a.choice.cells[i];
  return {{"factors", factors_json(a, i)},
          {"trials", cell.trials},
          {"separability",
           {{"accuracy", summary.figures.accuracy}, {"ci95", interval_json(summary.ci95)}}},
          {"snr_db", value_json("mean", cell.snr_db)},
          {"saturated_share", value_json("mean", cell.saturated_share)},
          {"seconds", value_json("median", cell.seconds)},
          {"on_front", std::ranges::find(a.choice.front, i) != a.choice.front.end()},
          {"chosen_share", summary.chosen_share}};
}

template <class Value>
ordered_json or_null(const std::optional<Value>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

}  // namespace

ordered_json design_json(const SweepAnalysis& a) {
  ordered_json cells = ordered_json::array(), front = ordered_json::array(),
               surest = ordered_json::array(), left_out = ordered_json::array();
  for (const LeftOutCell& one : a.left_out)
    left_out.push_back({{"factors", factors_json(a, one.factors)}, {"why", one.why}});
  for (std::size_t i = 0; i < a.cells.size(); ++i) cells.push_back(cell_json(a, i));
  for (const std::size_t i : a.choice.front) front.push_back(factors_json(a, i));
  for (const FactorShare& one : a.surest)
    surest.push_back(
        {{"factor", a.factors[one.factor]}, {"value", one.value}, {"share", one.share}});
  return {{"bench", to_string(a.bench)},
          {"exploration", a.exploration},
          {"dataset_sha256", a.datasets},
          {"factors", a.factors},
          {"fabrics", a.fabrics},
          {"replicates", a.replicates},
          {"learner", a.learner},
          {"band_m", {a.band.shortest_m, a.band.longest_m}},
          {"cells", std::move(cells)},
          {"front", std::move(front)},
          {"left_out", std::move(left_out)},
          {"explorations_left_out", a.without},
          {"design_effect", a.choice.design_effect},
          {"recommendation",
           {{"supported", a.choice.supported},
            {"factors", factors_json(a, a.choice.chosen)},
            {"share", a.choice.share},
            {"resamples", a.choice.resamples},
            {"surest", std::move(surest)},
            {"overlapping", a.choice.overlapping},
            {"quicker_overlapping", a.choice.quicker_overlapping},
            {"words", recommendation(a)}}}};
}

ordered_json design_json(const RepetitionStudy& study) {
  ordered_json points = ordered_json::array();
  for (const auto& p : study.curve.points)
    points.push_back({{"repetitions", p.repetitions},
                      {"accuracy", p.accuracy},
                      {"ci95", interval_json(p.ci95)}});
  const auto& f = study.forecast;
  return {{"bench", to_string(study.bench)},
          {"exploration", study.exploration},
          {"dataset_sha256", study.dataset},
          {"learner", study.learner},
          {"fabrics", study.curve.fabrics},
          {"repetitions", study.curve.repetitions},
          {"trials", study.curve.trials},
          {"draws", study.curve.draws},
          {"curve", std::move(points)},
          {"law", {{"floor", f.law.floor}, {"scale", f.law.scale}, {"exponent", f.law.exponent}}},
          {"predicted",
           {{"repetitions", f.predict},
            {"accuracy", f.accuracy},
            {"interval95", interval_json(f.ci95)}}},
          {"wanted",
           {{"accuracy", f.wanted},
            {"most", f.most},
            {"repetitions", or_null(f.enough)},
            {"low", or_null(f.enough_low)},
            {"high", or_null(f.enough_high)},
            {"reached_share", f.reached_share}}},
          {"words", format_repetition_study(study)}};
}

}  // namespace weft::daemon
