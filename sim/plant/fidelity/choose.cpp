#include "sim/plant/fidelity/choose.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "sim/plant/bounds.hpp"

namespace weft::sim {
namespace {

constexpr double paper_load_n = 5;  // base of percentages: Khan et al. 2016, phases P and M
constexpr const char* table_place = "/simulation/fidelity";

auto rank(const FidelityOffer& offer) {
  return std::tuple(offer.setting.level, -offer.setting.step_s, offer.setting.integrator);
}

/// Strict orders, so that a choice does not depend on the order of the table.
bool is_faster(const FidelityOffer& a, const FidelityOffer& b) {
  return std::tuple(a.forecast.plant_s, a.promise_n, rank(a)) <
         std::tuple(b.forecast.plant_s, b.promise_n, rank(b));
}

bool is_more_accurate(const FidelityOffer& a, const FidelityOffer& b) {
  return std::tuple(a.promise_n, a.forecast.plant_s, rank(a)) <
         std::tuple(b.promise_n, b.forecast.plant_s, rank(b));
}

struct RangeCheck {
  const char* what;
  const char* unit;
  double per_unit;  ///< factor from SI
  MeasuredRange found, measured;
};

std::string format_range(const RangeCheck& check, const MeasuredRange& range) {
  const std::string format = std::string("%.4g ") + check.unit;
  const std::string most = printed(format.c_str(), range.most * check.per_unit);
  if (range.least == range.most) return most;
  return printed("%.4g to ", range.least * check.per_unit) + most;
}

Status check_ranges(const TableConditions& conditions, const ForceScene& forces) {
  const RangeCheck checks[]{
      {"force", "N", 1, forces.force_n, conditions.force_n},
      {"slide speed", "mm/s", 1e3, forces.speed_mps, conditions.speed_mps},
      {"press duration", "s", 1, forces.press_s, conditions.press_s},
      {"seat speed",
       "mm/s",
       1e3,
       {forces.seat_speed_mps, forces.seat_speed_mps},
       conditions.seat_speed_mps},
      {"slack", "mm", 1e3, {forces.mount.slack_m, forces.mount.slack_m}, conditions.slack_m},
      {"mount stiffness",
       "N/m",
       1,
       {forces.mount.stiffness_n_m, forces.mount.stiffness_n_m},
       conditions.mount_stiffness_n_m}};
  for (const RangeCheck& check : checks) {
    const bool is_used = check.found.most > 0;
    if (!is_used ||
        (check.measured.contains(check.found.least) && check.measured.contains(check.found.most)))
      continue;
    return fail({.code = Errc::unsupported,
                 .where = table_place,
                 .what = std::string(check.what) + " outside the range of the fidelity table",
                 .expected = format_range(check, check.measured),
                 .got = format_range(check, check.found),
                 .hint = "Omit --accuracy and --budget, or set simulation.level in the rig file"});
  }
  return {};
}

Result<double> scale_of(const std::string& fabric, const ForceScene& forces) {
  const Fabric* found = forces.library == nullptr ? nullptr : forces.library->find(fabric);
  if (found == nullptr)
    return fail({.code = Errc::not_found,
                 .where = table_place,
                 .what = "fabric without a measured error and without a row in the fabric table",
                 .got = fabric});
  const auto law = law_from_kes(found->kes);
  if (!law) return pass(law.error(), fabric);
  return impact_scale_n(*law, forces.mount, forces.seat_speed_mps, forces.force_n.most,
                        forces.face_area_m2);
}

Result<double> promise_for(const MeasuredSetting& measured, const std::string& fabric,
                           const ForceScene& forces) {
  for (const ClothError& cloth : measured.cloths)
    if (forces.has_rows && cloth.fabric == fabric) return measured.margin.factor * cloth.max_n;
  const auto scale_n = scale_of(fabric, forces);
  if (!scale_n) return scale_n;
  return measured.any_margin.factor * measured.any_max * *scale_n;
}

Result<FidelityOffer> make_offer(const FidelityTable& table, const MeasuredSetting& measured,
                                 const ForceScene& forces, const FidelityRequest& request) {
  FidelityOffer out{.setting = measured.setting, .promise_n = 0, .limiting_fabric = {}};
  for (const std::string& fabric : forces.fabrics) {
    const auto promise_n = promise_for(measured, fabric, forces);
    if (!promise_n) return pass(promise_n.error());
    if (!out.limiting_fabric.empty() && *promise_n <= out.promise_n) continue;
    out.promise_n = *promise_n;
    out.limiting_fabric = fabric;
  }
  out.forecast = forecast(table.host_cost, measured, request.run, request.probe_us);
  return out;
}

double speed_of(const FidelityOffer& offer) {
  return offer.forecast.times_real_time();
}

bool keeps(const FidelityOffer& offer, const FidelityRequest& request) {
  return offer.promise_n <= request.accuracy_n.value_or(HUGE_VAL) &&
         offer.promise_n < request.promise_below_n.value_or(HUGE_VAL) &&
         speed_of(offer) >= forecast_reserve * request.times_real_time.value_or(0);
}

std::string format_request(const FidelityRequest& request) {
  std::string text;
  if (request.accuracy_n)
    text = "an error of at most " + printed("%.4g mN", *request.accuracy_n * 1e3);
  if (request.times_real_time)
    text += (text.empty() ? "" : " and ") +
            printed("at least %.4g times real time", *request.times_real_time);
  if (request.level) text += " at level " + std::string(to_string(*request.level));
  return text;
}

std::string format_nearest(const std::vector<FidelityOffer>& all, const FidelityRequest& request) {
  if (all.empty()) return "none";
  const FidelityOffer& fastest = all.front();
  const std::string accurate =
      to_string(*std::min_element(all.begin(), all.end(), is_more_accurate));
  if (!request.times_real_time) return "nearest " + accurate;
  const std::string fast = "fastest about " + format_times(speed_of(fastest)) + " (" +
                           to_string(fastest.setting) + "); " + format_parts(fastest.forecast);
  return request.accuracy_n ? "nearest " + accurate + "; " + fast : fast;
}

struct Amount {
  double value;
  std::string_view unit;
};

std::optional<Amount> amount(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
  return Amount{value, unit};
}

}  // namespace

double impact_scale_n(const FabricLaw& law, const Mount& mount, double seat_speed_mps,
                      double force_n, double face_area_m2) {
  const double stiffness_n_m = (force_n + face_area_m2 * law.pressure_pa) / law.lambda_m;
  return seat_speed_mps * std::sqrt(stiffness_n_m * mount.mass_kg);
}

std::string to_string(const FidelityOffer& offer) {
  return to_string(offer.setting) + " (promises " + printed("%.3g mN", offer.promise_n * 1e3) +
         ", about " + format_times(speed_of(offer)) + ")";
}

Result<std::vector<FidelityOffer>> offers(const FidelityTable& table, const Scene& scene,
                                          const ForceScene& forces,
                                          const FidelityRequest& request) {
  if (Status s = check_ranges(table.conditions, forces); !s) return pass(s.error());
  std::vector<FidelityOffer> out;
  for (const MeasuredSetting& measured : table.settings) {
    const FidelitySetting& setting = measured.setting;
    if (!fits_bench(setting) || !check(scene, setting.level)) continue;
    if (request.level && setting.level != *request.level) continue;
    auto offer = make_offer(table, measured, forces, request);
    if (!offer) return pass(offer.error());
    out.push_back(std::move(*offer));
  }
  std::sort(out.begin(), out.end(), is_faster);
  return out;
}

Result<FidelityOffer> choose(const FidelityTable& table, const Scene& scene,
                             const ForceScene& forces, const FidelityRequest& request) {
  const auto all = offers(table, scene, forces, request);
  if (!all) return pass(all.error());
  std::vector<FidelityOffer> good;
  std::ranges::copy_if(*all, std::back_inserter(good),
                       [&](const FidelityOffer& offer) { return keeps(offer, request); });
  if (good.empty())
    return fail({.code = Errc::unsupported,
                 .where = "scene " + std::string(scene.name),
                 .what = "no measured setting meets the request",
                 .expected = format_request(request),
                 .got = format_nearest(*all, request),
                 .hint = "Request a larger error or a lower speed"});
  return request.accuracy_n ? good.front()
                            : *std::min_element(good.begin(), good.end(), is_more_accurate);
}

Result<double> parse_accuracy_n(std::string_view text) {
  const auto refuse = [&] {
    return fail(
        {.code = Errc::invalid_argument,
         .where = "--accuracy",
         .what = "accuracy invalid",
         .expected = "an error of the force above 0, at most 1000 N, such as 10mN, 0.01N or 0.5%",
         .got = std::string(text)});
  };
  const auto read = amount(text);
  if (!read) return refuse();
  const double per_n = read->unit == "N"    ? 1
                       : read->unit == "mN" ? 1e-3
                       : read->unit == "%"  ? 0.01 * paper_load_n
                                            : 0;
  const double error_n = per_n * read->value;
  if (!(error_n > 0 && error_n <= 1000)) return refuse();
  return error_n;
}

Result<double> parse_times_real_time(std::string_view text) {
  const auto read = amount(text);
  if (!read || read->unit != "x" || !(read->value > 0 && read->value <= 1e12))
    return fail({.code = Errc::invalid_argument,
                 .where = "--budget",
                 .what = "speed invalid",
                 .expected = "a multiple of real time above 0, such as 1000x",
                 .got = std::string(text)});
  return read->value;
}

}  // namespace weft::sim
