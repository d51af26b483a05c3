#include "sim/plant/fabric.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "protocols/base/json_text.hpp"
#include "protocols/base/time.hpp"
#include "sim/plant/bounds.hpp"
#include "sim/plant/calibrations.hpp"
#include "sim/plant/field_reader.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {
namespace {

constexpr double steepest_surface = 6;  // larger std(h)/lambda has no meaning in e^{h/lambda}
constexpr double furthest_draw = 3;     // draws are limited to three standard deviations
constexpr double usual_roughness_m = 5e-6;

/// 1 + spread * N(0, 1), limited, at least 0.1.
double ratio(Random& random, double spread) {
  const double draw = std::clamp(random.gaussian(), -furthest_draw, furthest_draw);
  return std::max(0.1, 1 + spread * draw);
}

Relaxation relaxation_of(const MaterialParams& params, double eta) {
  Relaxation relaxation;
  for (std::size_t i = 0; i < Relaxation::terms; ++i) {
    relaxation.share[i] = params.relaxation_base[i] + params.relaxation_slope[i] * eta;
    relaxation.time_s[i] = params.relaxation_time_s[i];
  }
  return relaxation;
}

WavinessSpec waviness_of(const Fabric& fabric, const MaterialParams& params) {
  WavinessSpec out = params.waviness;
  if (fabric.waviness_rms_m > 0) out.rms_m = fabric.waviness_rms_m;
  return out;
}

double height_rms_m(const Fabric& fabric, const MaterialParams& params) {
  if (fabric.height_rms_m > 0) return fabric.height_rms_m;
  if (params.roughness_exponent == 1) return params.height_per_roughness * fabric.roughness_m;
  return params.height_per_roughness * usual_roughness_m *
         std::pow(fabric.roughness_m / usual_roughness_m, params.roughness_exponent);
}

SurfaceSpec surface_of(const Fabric& fabric, const MaterialParams& params) {
  return {.warp_pitch_m = fabric.warp_per_m > 0 ? 1 / fabric.warp_per_m : 0,
          .weft_pitch_m = fabric.weft_per_m > 0 ? 1 / fabric.weft_per_m : 0,
          .height_rms_m = height_rms_m(fabric, params),
          .structure = fabric.structure};
}

/// One random stream per member, so that members do not affect each other.
double drawn_ratio(std::uint64_t seed, const char* member, double spread) {
  Random random(mix(seed, member));
  return ratio(random, spread);
}

double drawn(std::uint64_t seed, const char* member, double deviation) {
  return deviation * Random(mix(seed, member)).gaussian();
}

void draw_piece(ContactMaterial& material, SurfaceSpec& surface, const PieceSpread& spread,
                std::uint64_t seed) {
  material.law.lambda_m *= drawn_ratio(seed, "lambda", spread.lambda);
  material.law.pressure_pa *= drawn_ratio(seed, "pressure", spread.pressure);
  material.friction.coefficient *= drawn_ratio(seed, "friction", spread.friction);
  material.thickness_m *= drawn_ratio(seed, "thickness", spread.thickness);
  surface.height_rms_m *= drawn_ratio(seed, "roughness", spread.roughness);
  surface.warp_pitch_m *= drawn_ratio(seed, "warp pitch", spread.pitch);
  surface.weft_pitch_m *= drawn_ratio(seed, "weft pitch", spread.pitch);
}

void draw_mounting(Patch& patch, const MountingSpread& spread, std::uint64_t seed) {
  patch.offset_x_m = drawn(seed, "position x", spread.position_m);
  patch.offset_y_m = drawn(seed, "position y", spread.position_m);
  patch.skew_rad = drawn(seed, "skew", spread.skew_rad);
  patch.tilt_x = drawn(seed, "tilt x", spread.tilt);
  patch.tilt_y = drawn(seed, "tilt y", spread.tilt);
  patch.material.law.lambda_m *= drawn_ratio(seed, "tension", spread.tension);
  Random random(mix(seed, "pad height"));
  for (double& height_m : patch.pad_height_m) height_m = spread.pad_height_m * random.gaussian();
}

void draw_touch(Patch& patch, const TouchSpread& spread, std::uint64_t seed) {
  patch.offset_x_m += drawn(seed, "path x", spread.path_m);
  patch.offset_y_m += drawn(seed, "path y", spread.path_m);
  patch.gain_scale = drawn_ratio(seed, "gain", spread.gain);
  Random random(mix(seed, "pad ratio"));
  for (double& pad : patch.pad_ratio) pad = ratio(random, spread.pad_ratio);
}

using nlohmann::json;
using Structures = std::map<std::string, Structure, std::less<>>;

constexpr std::size_t most_fabrics = 10'000;
constexpr std::size_t most_lines = 16;
constexpr double per_m_per_cm = 100;
constexpr double per_m_per_mm = 1000;

Result<Structure::Line> parse_line(const json& object, const std::string& where) {
  Structure::Line line;
  FieldReader reader(object, where);
  reader.required("warp", line.warp, -8, 8).required("weft", line.weft, -8, 8);
  reader.required("share", line.share, 0, 1).number("phase_rad", line.phase_rad, -10, 10);
  if (const Status status = reader.finish(); !status) return pass(status.error());
  return line;
}

Status parse_lines(const json& list, const std::string& where, Structure& structure) {
  if (!list.is_array() || list.size() > most_lines)
    return parse_error(where, {.what = "list of lines invalid", .expected = "at most 16 lines"});
  for (std::size_t i = 0; i < list.size(); ++i) {
    auto line = parse_line(list[i], where + "/" + std::to_string(i));
    if (!line) return pass(line.error());
    structure.lines.push_back(*line);
  }
  return {};
}

Result<Structure> parse_structure(const json& object, const std::string& where) {
  Structure structure;
  std::string source;
  FieldReader reader(object, where);
  reader.text("standing", source).ignore("note");
  reader.required("isotropic_share", structure.isotropic_share, 0, 1);
  reader.required("streak_share", structure.streak_share, 0, 1);
  reader.interval("band_per_mm", structure.low_per_m, structure.high_per_m, 0.05, 5, per_m_per_mm);
  reader.number("jitter_rad", structure.jitter_rad, 0, 20);
  const json* lines = reader.child("lines");
  if (const Status status = reader.finish(); !status) return pass(status.error());
  if (source != "estimated")
    return parse_error(where + "/standing",
                       {.what = "numbers without a valid standing", .expected = "estimated"});
  if (lines != nullptr)
    if (const Status status = parse_lines(*lines, where + "/lines", structure); !status)
      return pass(status.error());
  double total = structure.isotropic_share + structure.streak_share;
  for (const Structure::Line& line : structure.lines) total += line.share;
  if (std::abs(total - 1) > 1e-6)
    return fail({.code = Errc::range,
                 .where = where,
                 .what = "sum of the variance shares wrong",
                 .expected = "1",
                 .got = std::to_string(total)});
  return structure;
}

Result<Structures> parse_structures(const json& object) {
  Structures structures;
  if (!object.is_object())
    return parse_error("/structures",
                       {.what = "value has the wrong type", .expected = "an object of structures"});
  for (const auto& [name, value] : object.items()) {
    auto structure = parse_structure(value, "/structures/" + name);
    if (!structure) return pass(structure.error());
    structures.emplace(name, std::move(*structure));
  }
  return structures;
}

Result<Fabric> parse_fabric(const json& object, const std::string& where,
                            const Structures& structures, const json& sources) {
  Fabric fabric;
  std::string structure;
  FieldReader reader(object, where);
  reader.source_required(sources).text("name", fabric.name).text("structure", structure);
  reader.ignore("construction");
  reader.required("thickness_mm", fabric.thickness_m, 0.01, 50, m_per_mm);
  reader.required("LC", fabric.kes.linearity, 0.05, 0.95);
  reader.required("WC_gfcm_cm2", fabric.kes.work_j_m2, 1e-3, 100, kes_work_j_m2);
  reader.required("RC_percent", fabric.kes.resilience, 1, 100, 0.01);
  reader.required("MIU", fabric.friction_mean, 0, 5);
  reader.required("MMD", fabric.friction_deviation, 0, 1);
  reader.required("SMD_um", fabric.roughness_m, 0, 500, m_per_um);
  reader.number("warp_per_cm", fabric.warp_per_m, 0.5, 200, per_m_per_cm);
  reader.number("weft_per_cm", fabric.weft_per_m, 0.5, 200, per_m_per_cm);
  reader.number("grain_um", fabric.grain_m, 5, 5000, m_per_um);
  reader.number("height_um", fabric.height_rms_m, 0.01, 1000, m_per_um);
  reader.number("waviness_um", fabric.waviness_rms_m, 0.01, 100, m_per_um);
  if (const Status status = reader.finish(); !status) return pass(status.error());
  if (fabric.name.empty()) return parse_error(where + "/name", {.what = "fabric without a name"});
  const auto found = structures.find(structure);
  if (found == structures.end())
    return fail({.code = Errc::not_found,
                 .where = where + "/structure",
                 .what = "structure not found",
                 .expected = "a key of /structures",
                 .got = structure});
  fabric.structure = found->second;
  if (!fabric.structure.lines.empty() && !(fabric.warp_per_m > 0 && fabric.weft_per_m > 0))
    return parse_error(where, {.what = "yarn counts missing for a structure with lines",
                               .expected = "warp_per_cm and weft_per_cm"});
  if (auto law = law_from_kes(fabric.kes); !law) return pass(law.error(), where);
  return fabric;
}

Status parse_params(const json& object, const json& sources, MaterialParams& params) {
  FieldReader reader(object, "/parameters");
  reader.source_required(sources);
  reader.pair("relaxation_base", params.relaxation_base[0], params.relaxation_base[1], 0, 0.4);
  reader.pair("relaxation_slope", params.relaxation_slope[0], params.relaxation_slope[1], 0, 0.4);
  reader.pair("relaxation_time_s", params.relaxation_time_s[0], params.relaxation_time_s[1], 1e-3,
              1e4);
  reader.number("hysteresis_length", params.hysteresis_length, 0.01, 10);
  reader.number("friction_exponent", params.friction_exponent, 0.3, 1.5);
  reader.number("friction_reference_N", params.friction_reference_n, 0.1, 100);
  reader.number("bristle_length_um", params.bristle_length_m, 1, 5000, m_per_um);
  reader.number("height_per_roughness", params.height_per_roughness, 0.1, 10);
  reader.number("roughness_exponent", params.roughness_exponent, 0, 2);
  reader.number("wear_most", params.wear.most, 0, 1);
  reader.number("wear_scale_Pa_m", params.wear.scale_pa_m, 1, 1e9);
  reader.number("cover_um", params.cover.lambda_m, 0, 1000, m_per_um);
  reader.number("cover_pressure_Pa", params.cover.pressure_pa, 1, 1e6);
  reader.number("waviness_um", params.waviness.rms_m, 0, 100, m_per_um);
  reader.interval("waviness_wave_mm", params.waviness.shortest_wave_m,
                  params.waviness.longest_wave_m, 16, 1000, m_per_mm);
  return reader.finish();
}

using Key = std::pair<const char*, double*>;

Status parse_level(const json& object, const std::string& where, const json& sources,
                   std::initializer_list<Key> ratios, std::initializer_list<Key> lengths_mm,
                   std::initializer_list<Key> angles_mrad,
                   std::initializer_list<Key> heights_um = {}) {
  FieldReader reader(object, where);
  reader.source_required(sources);
  for (const auto& [key, value] : ratios) reader.number(key, *value, 0, 0.5);
  for (const auto& [key, value] : lengths_mm) reader.number(key, *value, 0, 50, m_per_mm);
  for (const auto& [key, value] : angles_mrad) reader.number(key, *value, 0, 500, 1e-3);
  for (const auto& [key, value] : heights_um) reader.number(key, *value, 0, 100, m_per_um);
  return reader.finish();
}

Status parse_spread(const json& object, const json& sources, Spread& spread) {
  FieldReader reader(object, "/spread");
  const json none = json::object();
  const auto level = [&](std::string_view key) -> const json& {
    const json* found = reader.child(key);
    return found == nullptr ? none : *found;
  };
  const json &piece = level("piece"), &mounting = level("mounting"), &touch = level("touch");
  if (const Status status = reader.finish(); !status) return status;
  PieceSpread& p = spread.piece;
  MountingSpread& m = spread.mounting;
  TouchSpread& t = spread.touch;
  Status status = parse_level(piece, "/spread/piece", sources,
                              {{"lambda", &p.lambda},
                               {"pressure", &p.pressure},
                               {"friction", &p.friction},
                               {"thickness", &p.thickness},
                               {"roughness", &p.roughness},
                               {"pitch", &p.pitch}},
                              {}, {});
  if (status)
    status = parse_level(mounting, "/spread/mounting", sources, {{"tension", &m.tension}},
                         {{"position_mm", &m.position_m}},
                         {{"skew_mrad", &m.skew_rad}, {"tilt_mrad", &m.tilt}},
                         {{"pad_height_um", &m.pad_height_m}});
  if (!status) return status;
  return parse_level(touch, "/spread/touch", sources,
                     {{"gain", &t.gain}, {"pad_ratio", &t.pad_ratio}}, {{"path_mm", &t.path_m}},
                     {});
}

/// A table from before the levels of spread existed: each of its values belongs to one level.
Status parse_trial_spread(const json& object, const json& sources, Spread& spread) {
  PieceSpread& p = spread.piece;
  return parse_level(
      object, "/trial_spread", sources,
      {{"lambda", &p.lambda},
       {"pressure", &p.pressure},
       {"friction", &p.friction},
       {"thickness", &p.thickness},
       {"gain", &spread.touch.gain}},
      {}, {{"tilt_mrad", &spread.mounting.tilt}, {"skew_mrad", &spread.mounting.skew_rad}});
}

Status parse_table(const json& table, const Structures& structures, const json& sources,
                   FabricLibrary& library) {
  if (!table.is_array() || table.empty() || table.size() > most_fabrics)
    return parse_error("/fabrics",
                       {.what = "list of fabrics invalid", .expected = "1 to 10000 fabrics"});
  for (std::size_t i = 0; i < table.size(); ++i) {
    const std::string where = "/fabrics/" + std::to_string(i);
    auto fabric = parse_fabric(table[i], where, structures, sources);
    if (!fabric) return pass(fabric.error());
    if (library.find(fabric->name) != nullptr)
      return parse_error(where + "/name", {.what = "fabric listed twice", .got = fabric->name});
    library.fabrics.push_back(std::move(*fabric));
  }
  return {};
}

/// Keys that a standing may refer to: sources and calibrations.
json joined(const json& sources, const json& calibrations) {
  json out = sources.is_object() ? sources : json::object();
  for (const auto& [key, value] : calibrations.items()) out[key] = value;
  return out;
}

Result<FabricLibrary> parse_document(const json& document) {
  FieldReader reader(document, "");
  std::string format;
  reader.text("format", format).ignore("note");
  const json none = json::object();
  const auto child_or_none = [&](std::string_view key) -> const json& {
    const json* found = reader.child(key);
    return found == nullptr ? none : *found;
  };
  const json& calibrations = child_or_none("calibrations");
  if (const Status s = check_calibrations(calibrations); !s) return pass(s.error());
  const json sources = joined(child_or_none("sources"), calibrations);
  const json* sensor = reader.child("sensor");
  const json& structures_json = child_or_none("structures");
  const json& parameters = child_or_none("parameters");
  const json& spread = child_or_none("spread");
  const json& trial_spread = child_or_none("trial_spread");
  const json& table = child_or_none("fabrics");
  if (const Status status = reader.finish(); !status) return pass(status.error());
  if (format != "weft-fabrics-1" && format != "weft-fabrics-2")
    return parse_error("/format", {.what = "format of the fabric table unknown",
                                   .expected = "weft-fabrics-1 or weft-fabrics-2",
                                   .got = format});
  FabricLibrary library;
  const auto structures = parse_structures(structures_json);
  if (!structures) return pass(structures.error());
  if (const Status s = parse_params(parameters, sources, library.params); !s)
    return pass(s.error());
  if (const Status s = parse_spread(spread, sources, library.spread); !s) return pass(s.error());
  if (const Status s = parse_trial_spread(trial_spread, sources, library.spread); !s)
    return pass(s.error());
  if (const Status s = parse_table(table, *structures, sources, library); !s)
    return pass(s.error());
  if (sensor == nullptr) return library;
  FieldReader sensor_reader(*sensor, "/sensor");
  sensor_reader.source_required(sources);
  if (const Status s = read_pads(sensor_reader, library.pads.emplace()); !s) return pass(s.error());
  return library;
}

}  // namespace

Status check(const MaterialParams& params) {
  const auto& base = params.relaxation_base;
  const auto& slope = params.relaxation_slope;
  const WavinessSpec& waves = params.waviness;
  return check_bounds("cloths",
                      {{"first relaxation share", base[0], 0, 0.999},
                       {"second relaxation share", base[1], 0, 0.999},
                       {"first share per hysteresis", slope[0], 0, 0.999},
                       {"second share per hysteresis", slope[1], 0, 0.999},
                       {"first relaxation time [s]", params.relaxation_time_s[0], 1e-6, 1e9},
                       {"second relaxation time [s]", params.relaxation_time_s[1], 1e-6, 1e9},
                       {"hysteresis length", params.hysteresis_length, 1e-3, 100},
                       {"friction exponent", params.friction_exponent, 0, 2},
                       {"friction reference load [N]", params.friction_reference_n, 1e-6, 1e6},
                       {"bristle length [m]", params.bristle_length_m, 1e-9, 1},
                       {"height per roughness", params.height_per_roughness, 0, 100},
                       {"roughness exponent", params.roughness_exponent, 0, 10},
                       {"wear", params.wear.most, 0, 1},
                       {"wear scale [Pa m]", params.wear.scale_pa_m, 1e-6, 1e15},
                       {"cover [m]", params.cover.lambda_m, 0, 1},
                       {"cover pressure [Pa]", params.cover.pressure_pa, 1e-3, 1e9},
                       {"waviness [m]", waves.rms_m, 0, 1e-2},
                       {"shortest wave [m]", waves.shortest_wave_m, 1e-6, 10},
                       {"longest wave [m]", waves.longest_wave_m, waves.shortest_wave_m, 10}});
}

Status check(const Spread& spread) {
  const auto& [piece, mounting, touch] = spread;
  return check_bounds("spread", {{"spread of lambda", piece.lambda, 0, 1},
                                 {"spread of the pressure", piece.pressure, 0, 1},
                                 {"spread of the friction", piece.friction, 0, 1},
                                 {"spread of the thickness", piece.thickness, 0, 1},
                                 {"spread of the roughness", piece.roughness, 0, 1},
                                 {"spread of the pitch", piece.pitch, 0, 1},
                                 {"spread of the position [m]", mounting.position_m, 0, 1},
                                 {"spread of the skew [rad]", mounting.skew_rad, 0, 1},
                                 {"spread of the tension", mounting.tension, 0, 1},
                                 {"spread of the tilt", mounting.tilt, 0, 1},
                                 {"spread of the pad height [m]", mounting.pad_height_m, 0, 1},
                                 {"spread of the path [m]", touch.path_m, 0, 1},
                                 {"spread of the gain", touch.gain, 0, 1},
                                 {"spread of the pad ratio", touch.pad_ratio, 0, 1}});
}

namespace {

Result<ContactMaterial> material_of(const Fabric& fabric, const MaterialParams& params,
                                    const MaterialSwitches& switches) {
  const auto law = law_from_kes(fabric.kes);
  if (!law) return pass(law.error());
  ContactMaterial material;
  material.law = *law;
  material.thickness_m = fabric.thickness_m;
  if (switches.relaxation) material.relaxation = relaxation_of(params, law->hysteresis);
  material.hysteresis = {switches.hysteresis ? law->hysteresis : 0, params.hysteresis_length};
  material.friction = {switches.friction ? fabric.friction_mean : 0, params.friction_reference_n,
                       params.friction_exponent, params.bristle_length_m};
  return material;
}

}  // namespace

Result<Patch> cut_patch(const Fabric& fabric, const MaterialParams& params, const Spread& spread,
                        const MaterialSwitches& switches, const PatchSeeds& seeds) {
  if (const Status s = check(params); !s) return pass(s.error(), fabric.name);
  if (const Status s = check(spread); !s) return pass(s.error(), fabric.name);
  auto material = material_of(fabric, params, switches);
  if (!material) return pass(material.error(), fabric.name);
  SurfaceSpec surface = surface_of(fabric, params);
  const double lambda_m = compose(material->law, params.cover).lambda_m;
  if (!(surface.height_rms_m < steepest_surface * lambda_m))
    return fail({.code = Errc::range,
                 .where = fabric.name,
                 .what = "surface too rough for the stiffness of fabric and cover",
                 .expected = "std(h) below 6 lambda of both together"});
  const auto seed = [&](std::uint64_t level) { return mix(mix(0, fabric.name), level); };
  const std::uint64_t piece = seed(seeds.piece), mounting = seed(seeds.mounting);
  Patch patch;
  patch.fabric = fabric.name;
  patch.material = std::move(*material);
  patch.grain_m = fabric.grain_m;
  patch.wear = params.wear;
  patch.seed = seed(seeds.touch);
  patch.mounted = mix(piece, mounting);
  if (switches.trial_spread) {
    draw_piece(patch.material, surface, spread.piece, piece);
    draw_mounting(patch, spread.mounting, mounting);
    draw_touch(patch, spread.touch, patch.seed);
  }
  patch.material.law = compose(patch.material.law, params.cover);
  if (switches.texture) patch.field = HeightField(surface, mix(piece, "surface"));
  if (switches.waviness)
    patch.material.waviness = Waviness(waviness_of(fabric, params), mix(piece, "waviness"))
                                  .shifted(patch.offset_x_m, patch.offset_y_m);
  return patch;
}

Result<Patch> cut_patch(const Fabric& fabric, const MaterialParams& params, const Spread& spread,
                        const MaterialSwitches& switches, std::uint64_t seed) {
  auto patch = cut_patch(fabric, params, spread, switches, PatchSeeds{seed, seed, seed});
  if (patch) patch->mounted = 0;
  return patch;
}

Patch bare_plate(const Cover& cover) {
  Patch patch;
  patch.material.law = compose(patch.material.law, cover);
  patch.material.friction.coefficient = 0.15;  // acetate on metal [E]
  return patch;
}

const Fabric* FabricLibrary::find(std::string_view name) const {
  const auto found = std::find_if(fabrics.begin(), fabrics.end(),
                                  [&](const Fabric& fabric) { return fabric.name == name; });
  return found == fabrics.end() ? nullptr : &*found;
}

std::vector<std::string> FabricLibrary::names() const {
  std::vector<std::string> names;
  for (const Fabric& fabric : fabrics) names.push_back(fabric.name);
  return names;
}

Result<FabricLibrary> parse_fabrics(std::string_view text) {
  const Result<json> document = parse_json(text);
  if (!document) return pass(document.error(), "fabrics");
  return parse_document(*document);
}

}  // namespace weft::sim
