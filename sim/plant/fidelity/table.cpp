#include "sim/plant/fidelity/table.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>

#include "protocols/base/json_text.hpp"
#include "sim/plant/bounds.hpp"
#include "sim/plant/field_reader.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;

constexpr std::size_t most_rows = 10'000;
constexpr std::array<std::string_view, 5> known_scenes{"press", "slide", "stick_slip", "retouch",
                                                       "fabrics17"};

Result<FidelityRow> read_row(const json& object, const std::string& where) {
  if (!object.is_object())
    return parse_error(where, {.what = "not a row", .expected = "an object"});
  FidelityRow row;
  std::string level, integrator = "none";
  double step_us = 0;
  FieldReader reader(object, where);
  reader.text("scene", row.scene).text("level", level).text("integrator", integrator);
  reader.required("step_us", step_us, 0, 1e6);
  reader.required("error_max_n", row.error_max_n, 0, 1e9);
  reader.required("error_rms_n", row.error_rms_n, 0, 1e9);
  reader.required("times_real_time", row.times_real_time, 1e-9, 1e12);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (std::find(known_scenes.begin(), known_scenes.end(), row.scene) == known_scenes.end())
    return parse_error(where + "/scene",
                       {.what = "no such scene",
                        .expected = "press, slide, stick_slip, retouch or fabrics17",
                        .got = row.scene});
  const auto known = level_from(level);
  if (!known || !moves(*known))
    return parse_error(where + "/level",
                       {.what = "no such level of motion", .expected = "L0 to L3", .got = level});
  row.setting = {.level = *known, .step_s = step_us * 1e-6};
  if (*known < Level::dynamic) return row;
  const auto method = integrator_from(integrator);
  if (!method) return pass(method.error(), where + "/integrator");
  row.setting.integrator = *method;
  return row;
}

Result<FidelityTable> read_table(const json& root) {
  FidelityTable table;
  double version = 0;
  std::string bench;
  FieldReader reader(root, "");
  reader.required("schema_version", version, 1, 1).text("bench", bench);
  reader.text("made_by", table.made_by).text("machine", table.machine);
  reader.text("commit", table.commit);
  const json* rows = reader.child("rows");
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (bench != "simulated")
    return parse_error(
        "/bench", {.what = "not a table of simulations", .expected = "simulated", .got = bench});
  if (rows == nullptr || !rows->is_array() || rows->size() > most_rows)
    return parse_error("/rows", {.what = "not a list of rows", .expected = "at most 10000 rows"});
  for (std::size_t i = 0; i < rows->size(); ++i) {
    auto row = read_row((*rows)[i], "/rows/" + std::to_string(i));
    if (!row) return pass(row.error());
    table.rows.push_back(std::move(*row));
  }
  return table;
}

constexpr double paper_load_n = 5;  // a percentage is one of this: Khan et al. 2016, phases P and M

/// The table's scenes that stand for a bench's: press, slide and fabrics17; retouch for overshoot,
/// stick_slip for stick-slip.
std::vector<std::string> involved(const Scene& scene) {
  std::vector<std::string> kinds{"press", "slide", "fabrics17"};
  if (is_needed(scene, Trait::overshoot)) kinds.emplace_back("retouch");
  if (is_needed(scene, Trait::stick_slip)) kinds.emplace_back("stick_slip");
  return kinds;
}

/// Fastest first; what is as fast stands in an order of its own, so that a choice does not depend
/// on the table's.
bool faster(const FidelityOffer& a, const FidelityOffer& b) {
  return std::tuple(-a.times_real_time, a.error_max_n, a.setting.level, -a.setting.step_s) <
         std::tuple(-b.times_real_time, b.error_max_n, b.setting.level, -b.setting.step_s);
}

bool more_accurate(const FidelityOffer& a, const FidelityOffer& b) {
  return std::tuple(a.error_max_n, -a.times_real_time, a.setting.level, -a.setting.step_s) <
         std::tuple(b.error_max_n, -b.times_real_time, b.setting.level, -b.setting.step_s);
}

void widen(FidelityOffer& offer, const FidelityRow& row) {
  offer.error_max_n = std::max(offer.error_max_n, row.error_max_n);
  offer.error_rms_n = std::max(offer.error_rms_n, row.error_rms_n);
  offer.times_real_time = std::min(offer.times_real_time, row.times_real_time);
}

/// The setting's rows on every one of `scenes`, or nothing.
std::optional<FidelityOffer> find_offer(const FidelityTable& table, const FidelitySetting& setting,
                                        const std::vector<std::string>& scenes) {
  std::optional<FidelityOffer> offer;
  for (const std::string& scene : scenes) {
    bool measured = false;
    for (const FidelityRow& row : table.rows) {
      if (row.scene != scene || row.setting != setting) continue;
      measured = true;
      if (!offer) offer = {setting, 0, 0, row.times_real_time};
      widen(*offer, row);
    }
    if (!measured) return std::nullopt;
  }
  return offer;
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

/// What comes closest: the most accurate, of those that are fast enough if there is one, and the
/// fastest, of those that are accurate enough; each only where it was asked for.
std::string nearest(const std::vector<FidelityOffer>& all, const FidelityRequest& request) {
  if (all.empty()) return "none";
  FidelityOffer accurate = *std::min_element(all.begin(), all.end(), more_accurate);
  FidelityOffer fast = all.front();
  for (const FidelityOffer& offer : all) {
    if (request.times_real_time && offer.times_real_time >= *request.times_real_time &&
        (accurate.times_real_time < *request.times_real_time || more_accurate(offer, accurate)))
      accurate = offer;
    if (request.accuracy_n && offer.error_max_n <= *request.accuracy_n &&
        (fast.error_max_n > *request.accuracy_n || faster(offer, fast)))
      fast = offer;
  }
  if (!request.times_real_time || accurate.setting == fast.setting) return to_string(accurate);
  if (!request.accuracy_n) return to_string(fast);
  return to_string(accurate) + " or " + to_string(fast);
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

Result<FidelityTable> parse_fidelity(std::string_view text) {
  const Result<json> root = parse_json(text);
  if (!root) return pass(root.error(), "fidelity table");
  if (!root->is_object())
    return parse_error("fidelity table", {.what = "not a JSON object", .expected = "an object"});
  return read_table(*root);
}

std::string to_string(const FidelityOffer& offer) {
  return to_string(offer.setting) + " (" + printed("%.3g mN", offer.error_max_n * 1e3) +
         printed(", %.3g times real time)", offer.times_real_time);
}

std::vector<FidelityOffer> offers(const FidelityTable& table, const Scene& scene) {
  const std::vector<std::string> kinds = involved(scene);
  std::vector<FidelityOffer> out;
  for (const FidelityRow& row : table.rows) {
    if (row.scene != kinds.front() || !fits_bench(row.setting)) continue;
    if (!check(scene, row.setting.level)) continue;
    if (std::any_of(out.begin(), out.end(),
                    [&](const FidelityOffer& o) { return o.setting == row.setting; }))
      continue;
    if (const auto offer = find_offer(table, row.setting, kinds)) out.push_back(*offer);
  }
  std::sort(out.begin(), out.end(), faster);
  return out;
}

Result<FidelityOffer> choose(const FidelityTable& table, const Scene& scene,
                             const FidelityRequest& request) {
  std::vector<FidelityOffer> all = offers(table, scene), good;
  if (request.level)
    std::erase_if(all, [&](const FidelityOffer& o) { return o.setting.level != *request.level; });
  for (const FidelityOffer& offer : all)
    if (offer.error_max_n <= request.accuracy_n.value_or(HUGE_VAL) &&
        offer.times_real_time >= request.times_real_time.value_or(0))
      good.push_back(offer);
  if (good.empty())
    return fail({.code = Errc::unsupported,
                 .where = "scene " + std::string(scene.name),
                 .what = "no measured setting does what is asked",
                 .expected = format_request(request),
                 .got = "the nearest: " + nearest(all, request),
                 .hint = "Ask for less of the one or of the other"});
  return request.accuracy_n ? good.front()
                            : *std::min_element(good.begin(), good.end(), more_accurate);
}

Result<double> parse_accuracy_n(std::string_view text) {
  const auto refuse = [&] {
    return fail(
        {.code = Errc::invalid_argument,
         .where = "--accuracy",
         .what = "not an accuracy",
         .expected = "an error of the force over 0 and up to 1000 N, such as 10mN, 0.01N or 0.5%",
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
                 .what = "not a speed",
                 .expected = "a multiple of real time over 0, such as 1000x",
                 .got = std::string(text)});
  return read->value;
}

}  // namespace weft::sim
