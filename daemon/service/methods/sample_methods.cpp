#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

json of_axes(const recipes::Joints& joints, bool linear, double per_unit) {
  json out = json::object();
  for (const recipes::Axis axis : recipes::all_axes)
    if (recipes::is_linear(axis) == linear) out[to_string(axis)] = joints[axis] * per_unit;
  return out;
}

json phase_json(const LiveFrame& frame) {
  return frame.phase == Phase::none ? json() : json(std::string(1, to_char(frame.phase)));
}

json set_point_json(const LiveFrame& frame, double value_n) {
  return frame.force_n > 0 ? json(value_n) : json();
}

json force_json(const LiveFrame& frame) {
  const WrenchSample& now = *frame.wrench;
  return {{"fx_n", now.force_n[0]},
          {"fy_n", now.force_n[1]},
          {"fz_n", now.force_n[2]},
          {"tx_nm", now.torque_nm[0]},
          {"ty_nm", now.torque_nm[1]},
          {"tz_nm", now.torque_nm[2]},
          {"fz_min_n", frame.least_fz_n},
          {"fz_max_n", frame.most_fz_n},
          {"phase", phase_json(frame)},
          {"force_n", set_point_json(frame, frame.force_n)},
          {"force_band_n", set_point_json(frame, frame.force_band_n)}};
}

/// Rounds to 1 / `parts`, for short JSON.
json rounded(double value, double parts) {
  return std::round(value * parts) / parts;
}

json rest_json(const LiveFrame& frame) {
  if (frame.rest_counts.empty()) return nullptr;
  json out = json::array();
  for (const double count : frame.rest_counts) out.push_back(rounded(count, 10));
  return out;
}

void publish(server::Hub& hub, const LiveFrame& frame, std::string_view run, std::int64_t t_us) {
  constexpr double mm_per_m = 1e3;
  constexpr double deg_per_rad = 57.29577951308232;
  const auto notify = [&](std::string_view topic, json delta) {
    delta["run"] = run;
    delta["by"] = "auto:run";
    delta["bench_s"] = frame.bench_s;
    hub.pass_on(topic, delta, t_us);
  };
  if (frame.wrench) notify("stream:force", force_json(frame));
  if (frame.joints)
    notify("stream:stages", {{"position_mm", of_axes(*frame.joints, true, mm_per_m)},
                             {"angle_deg", of_axes(*frame.joints, false, deg_per_rad)},
                             {"phase", phase_json(frame)}});
  if (!frame.taxels.empty())
    notify("stream:taxels", {{"counts", frame.taxels}, {"rest_counts", rest_json(frame)}});
}

constexpr std::array history_columns{"bench_s", "fx_n",  "fy_n",     "fz_n",     "tx_nm",
                                     "ty_nm",   "tz_nm", "fz_min_n", "fz_max_n", "x_mm",
                                     "y_mm",    "z_mm",  "phase",    "force_n",  "force_band_n"};

/// Values in the order of history_columns.
json row_json(const LiveFrame& row) {
  constexpr double fine = 1e4;
  json out = json::array({rounded(row.bench_s, 1e3)});
  const auto add = [&out](bool known, double value) {
    out.push_back(known ? rounded(value, fine) : json());
  };
  const bool wrench = row.wrench.has_value();
  const WrenchSample sample = row.wrench.value_or(WrenchSample{});
  for (const double force_n : sample.force_n) add(wrench, force_n);
  for (const double torque_nm : sample.torque_nm) add(wrench, torque_nm);
  add(wrench, row.least_fz_n);
  add(wrench, row.most_fz_n);
  for (const recipes::Axis axis : {recipes::Axis::x, recipes::Axis::y, recipes::Axis::z})
    add(row.joints.has_value(), row.joints ? (*row.joints)[axis] * 1e3 : 0);
  out.push_back(phase_json(row));
  out.push_back(set_point_json(row, row.force_n));
  out.push_back(set_point_json(row, row.force_band_n));
  return out;
}

/// Merges rows into one: the last row, with the extremes of Fz of all.
LiveFrame joined_rows(std::span<const LiveFrame> rows) {
  LiveFrame out = rows.back();
  for (const LiveFrame& row : rows) {
    if (!row.wrench) continue;
    out.least_fz_n = out.wrench ? std::min(out.least_fz_n, row.least_fz_n) : row.least_fz_n;
    out.most_fz_n = out.wrench ? std::max(out.most_fz_n, row.most_fz_n) : row.most_fz_n;
    if (!out.wrench) out.wrench = row.wrench;
  }
  return out;
}

Outcome recent_samples(const Services& services, const Call& call) {
  constexpr std::int64_t most_rows = 3000;
  const auto most =
      read_whole_number(call, {"most", 1500, 1, most_rows, "number of rows out of range"});
  if (!most) return refused(most.error());
  const LiveHistory found = services.frame_sampler->history(call.params.value("after_s", -1.0));
  const std::span<const LiveFrame> rows(found.rows);
  const std::size_t stride = (rows.size() + *most - 1) / *most;
  json out = json::array();
  for (std::size_t at = 0; at < rows.size(); at += stride)
    out.push_back(row_json(joined_rows(rows.subspan(at, std::min(stride, rows.size() - at)))));
  const bool felt = !rows.empty() && !rows.back().taxels.empty();
  return format_text({{"run", found.run.empty() ? json() : json(found.run)},
                      {"columns", history_columns},
                      {"rows", std::move(out)},
                      {"counts", felt ? json(rows.back().taxels) : json()},
                      {"rest_counts", felt ? rest_json(rows.back()) : json()}});
}

}  // namespace

void publish_samples(server::Hub& hub, LiveFrameSampler& sampler, const runs::RunManager& manager,
                     std::int64_t t_us) {
  const bool wanted =
      hub.wanted("stream:force") || hub.wanted("stream:stages") || hub.wanted("stream:taxels");
  const auto frame = sampler.take();  // even unwatched: viewers get new frames only
  if (!wanted || !frame) return;
  if (const auto run = manager.active()) publish(hub, *frame, *run, t_us);
}

void add_sample_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read(
      "run.samples",
      "get sensor values of the last 40 minutes (bench time) of the newest run, for display. They "
      "are not a record",
      {{"after_s", ParamType::number, false, "only rows after this bench time [s]"},
       {"most", ParamType::integer, false,
        "largest number of rows, up to 3000 (default: 1500). Neighbouring rows are merged: the "
        "last values with the extremes of all"}},
      "run (null: none yet), columns, rows (values in the order of columns, null: not "
      "known), newest counts and rest_counts as in stream:taxels",
      recent_samples);
}

}  // namespace weft::daemon::api
