// Merges the plate tilt that weft align measured into a rig file; declared in rig_file.hpp.

#include <nlohmann/json.hpp>

#include "daemon/hardware/rig/rig_file.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* make_one = "Create the file with `weft align --rig RIG --json`";

struct FoundLevel {
  std::string rig, bench, outcome;
  double rx_rad = 0, ry_rad = 0, lean_left_rad = 0, tolerance_rad = 0;
  std::int64_t measured_unix_s = 0;
};

Result<FoundLevel> parse_level(std::string_view text) {
  const Result<json> document = parse_json(text);
  if (!document) return pass(document.error());
  const json& parsed = *document;
  if (!parsed.is_object() || parsed.value("command", json()) != "align")
    return fail({.code = Errc::parse,
                 .what = "not an output of weft align",
                 .expected = "output of weft align --json",
                 .hint = make_one});
  try {
    const json& after = parsed.at("after");
    if (after.is_null())
      return fail({.code = Errc::wrong_state,
                   .where = "/after",
                   .what = "no plate tilt measured",
                   .hint = make_one});
    return FoundLevel{parsed.at("rig"),           parsed.at("bench"),          parsed.at("outcome"),
                      after.at("rx_rad"),         after.at("ry_rad"),          after.at("lean_rad"),
                      parsed.at("tolerance_rad"), parsed.at("measured_unix_s")};
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .what = "not an output of weft align",
                 .expected = "output of weft align --json",
                 .got = e.what(),
                 .hint = make_one});
  }
}

Status of_this_rig(const FoundLevel& found, const RigFile& rig) {
  if (found.outcome != "complete" || !(found.lean_left_rad <= found.tolerance_rad))
    return fail({.code = Errc::wrong_state,
                 .where = "/outcome",
                 .what = "plate not levelled",
                 .expected = "complete",
                 .got = found.outcome,
                 .hint = "Run `weft align` again"});
  if (found.rig != rig.name)
    return fail({.code = Errc::wrong_state,
                 .where = "/rig",
                 .what = "plate tilt measured on another rig",
                 .expected = rig.name,
                 .got = found.rig,
                 .hint = "Run `weft align` with this rig file"});
  if (found.bench != to_string(rig.bench))
    return fail({.code = Errc::wrong_state,
                 .where = "/bench",
                 .what = "plate tilt measured on another kind of bench",
                 .expected = std::string(to_string(rig.bench)),
                 .got = found.bench,
                 .hint = "Run `weft align` with this rig file"});
  return {};
}

Status of_these_days(const FoundLevel& found, std::chrono::nanoseconds now_utc,
                     std::chrono::seconds oldest) {
  constexpr std::int64_t clocks_differ_s = 60;
  const std::int64_t now_s = std::chrono::duration_cast<std::chrono::seconds>(now_utc).count();
  const auto seconds = [](std::int64_t s) { return std::to_string(s) + " s"; };
  if (oldest.count() <= 0) return {};
  // compared without a difference, which could overflow: a file may contain any number
  if (found.measured_unix_s > now_s + clocks_differ_s)
    return fail({.code = Errc::wrong_state,
                 .where = "/measured_unix_s",
                 .what = "plate tilt measured in the future",
                 .expected = "at most " + seconds(now_s),
                 .got = seconds(found.measured_unix_s),
                 .hint = "Set the clock of this computer, or use --level-max-age-h 0"});
  if (found.measured_unix_s < now_s - oldest.count())
    return fail({.code = Errc::wrong_state,
                 .where = "/measured_unix_s",
                 .what = "plate tilt measured too long ago",
                 .expected = "at least " + seconds(now_s - oldest.count()),
                 .got = seconds(found.measured_unix_s),
                 .hint = "Run `weft align` again, or increase --level-max-age-h"});
  return {};
}

}  // namespace

Result<std::string> with_level(std::string_view rig_json, std::string_view align_json,
                               std::chrono::nanoseconds now_utc, std::chrono::seconds oldest) {
  const Result<FoundLevel> found = parse_level(align_json);
  if (!found) return pass(found.error());
  const Result<RigFile> rig = parse_rig_file(rig_json);
  if (!rig) return pass(rig.error());
  if (Status same = of_this_rig(*found, *rig); !same) return pass(same.error());
  if (Status fresh = of_these_days(*found, now_utc, oldest); !fresh) return pass(fresh.error());
  auto merged = ordered_json::parse(rig_json);
  ordered_json& plate = merged["plate"];
  if (plate.contains("level"))
    return fail({.code = Errc::invalid_argument,
                 .where = "/plate/level",
                 .what = "rig file already has a plate tilt",
                 .hint = "Remove it from the rig file, or omit --level"});
  plate["level"] = {{"rx_rad", found->rx_rad},
                    {"ry_rad", found->ry_rad},
                    {"lean_left_rad", found->lean_left_rad},
                    {"measured_unix_s", found->measured_unix_s}};
  return merged.dump(2);
}

}  // namespace weft::daemon
