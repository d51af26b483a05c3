#include "daemon/analysis/calibration/cloth_model.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "daemon/analysis/calibration/press.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double m_per_um = 1e-6, m_per_mm = 1e-3, per_m_per_mm = 1e3, n_m_per_n_mm = 1e3;
constexpr double start_cover_m = 60e-6;  // the table's own value has priority
constexpr double start_tilt_rad = 1e-3, start_pad_height_m = 1e-6, start_common_mode = 2e-3;
constexpr double reference_smd_m = 5e-6;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

double lambda_of(const sim::Fabric& fabric) {
  const auto law = sim::law_from_kes(fabric.kes);
  return law ? law->lambda_m : 0;
}

const sim::Fabric* longest_named(const std::string& label, const sim::FabricLibrary& library) {
  const sim::Fabric* best = nullptr;
  for (const sim::Fabric& fabric : library.fabrics)
    if (lower(label).find(lower(fabric.name)) != std::string::npos &&
        (best == nullptr || fabric.name.size() > best->name.size()))
      best = &fabric;
  return best;
}

const sim::Fabric& median_cloth(const sim::FabricLibrary& library) {
  std::vector<const sim::Fabric*> cloths;
  for (const sim::Fabric& fabric : library.fabrics) cloths.push_back(&fabric);
  std::ranges::stable_sort(cloths, {}, [](const sim::Fabric* f) { return lambda_of(*f); });
  return *cloths[cloths.size() / 2];
}

double height_of(const sim::Fabric& fabric, const sim::MaterialParams& params) {
  if (fabric.height_rms_m > 0) return fabric.height_rms_m;
  return params.height_per_roughness * reference_smd_m *
         std::pow(fabric.roughness_m / reference_smd_m, params.roughness_exponent);
}

/// A length that determines ln(height/Lambda): its bounds follow the fabric's own Lambda.
Parameter height(const BaseCloth& cloth, double lambda_m, double start_m) {
  const double low = 0.003, high = 0.5;
  return {.name = "height_um",
          .cloth = cloth.label,
          .block = Block::cloth,
          .low = low * lambda_m / m_per_um,
          .high = high * lambda_m / m_per_um,
          .logarithmic = true,
          .is_off_at_low = true,
          .reason =
              "0.003 to 0.5 of lambda with the cover: 0.3 % modulation is below all available "
              "recordings; above 0.5, e^(h/lambda) is no texture",
          .start = std::clamp(start_m, low * lambda_m, high * lambda_m) / m_per_um};
}

}  // namespace

double Parameter::to_unit(double value) const {
  const double held = std::clamp(value, low, high);
  return logarithmic ? std::log(held / low) / std::log(high / low) : (held - low) / (high - low);
}

double Parameter::from_unit(double unit) const {
  const double held = std::clamp(unit, 0.0, 1.0);
  return logarithmic ? low * std::pow(high / low, held) : low + held * (high - low);
}

double line_share(const sim::Structure& structure) {
  double sum = 0;
  for (const sim::Structure::Line& line : structure.lines) sum += line.share;
  return sum;
}

sim::Structure reshaped(sim::Structure structure, double share, double low_per_m) {
  const double lines = line_share(structure),
               random = structure.isotropic_share + structure.streak_share;
  structure.low_per_m = std::min(low_per_m, structure.high_per_m);
  if (!(lines > 0)) return structure;
  for (sim::Structure::Line& line : structure.lines) line.share *= share / lines;
  const double isotropic = random > 0 ? structure.isotropic_share / random : 1;
  structure.isotropic_share = (1 - share) * isotropic;
  structure.streak_share = (1 - share) * (1 - isotropic);
  return structure;
}

Status ClothModel::add_cloth(const std::string& label, const sim::FabricLibrary& library) {
  const sim::Fabric* named = longest_named(label, library);
  BaseCloth cloth{label, named != nullptr ? *named : median_cloth(library), {}, named != nullptr};
  cloth.taken = cloth.fabric.name;
  cloth.fabric.name = label;
  const auto law = sim::law_from_kes(cloth.fabric.kes);
  if (!law) return pass(law.error(), cloth.taken);
  const sim::FabricLaw whole = sim::compose(*law, params_.cover);
  parameters_.push_back(height(cloth, whole.lambda_m, height_of(cloth.fabric, params_)));
  const double waves_m =
      cloth.fabric.waviness_rms_m > 0 ? cloth.fabric.waviness_rms_m : params_.waviness.rms_m;
  parameters_.push_back(
      {.name = "waviness_um",
       .cloth = label,
       .block = Block::cloth,
       .low = 0.1,
       .high = 30,
       .logarithmic = true,
       .is_off_at_low = true,
       .reason = "0.1 um modulates by 0.1 %, 30 um by more than all available recordings",
       .start = std::clamp(waves_m / m_per_um, 0.1, 30.0)});
  const sim::Structure& structure = cloth.fabric.structure;
  parameters_.push_back({.name = "band_low_per_mm",
                         .cloth = label,
                         .block = Block::cloth,
                         .low = 0.05,
                         .high = 0.5,
                         .logarithmic = true,
                         .is_off_at_low = false,
                         .reason = "the fabric table allows at least 0.05 /mm; above 0.5 /mm no "
                                   "wave is long compared with the 16 mm face",
                         .start = std::clamp(structure.low_per_m / per_m_per_mm, 0.05, 0.5)});
  if (line_share(structure) > 0)
    parameters_.push_back({.name = "line_share",
                           .cloth = label,
                           .block = Block::cloth,
                           .low = 0,
                           .high = 0.9,
                           .logarithmic = false,
                           .is_off_at_low = true,
                           .reason = "share of the variance; every fabric has a random part",
                           .start = std::min(line_share(structure), 0.9)});
  cloths_.push_back(std::move(cloth));
  return {};
}

void ClothModel::add_common(const sim::FabricLibrary& library) {
  const auto add = [this](const char* name, Block block, double low, double high, double start,
                          const char* reason) {
    parameters_.push_back({.name = name,
                           .cloth = {},
                           .block = block,
                           .low = low,
                           .high = high,
                           .logarithmic = low > 0,
                           .is_off_at_low = block != Block::fixed,
                           .reason = reason,
                           .start = std::clamp(start, low, high)});
  };
  const sim::Spread& spread = library.spread;
  const sim::MountingSpread& mounting = spread.mounting;
  const bool was_calibrated = library.pads.has_value();
  add("path_mm", Block::common, 0.01, 5, spread.touch.path_m / m_per_mm,
      "10 um: resolution of stages; 5 mm: stroke repositioned by eye");
  add("pad_ratio", Block::common, 1e-4, 0.05, spread.touch.pad_ratio,
      "below 1e-4 noise hides it; above 0.05 a path has no pattern");
  add("tilt_mrad", Block::common, 0.01, 10, 1e3 * (was_calibrated ? mounting.tilt : start_tilt_rad),
      "10 mrad lift one edge of the face by 0.16 mm");
  add("pad_height_um", Block::common, 0.01, 20,
      (was_calibrated ? mounting.pad_height_m : start_pad_height_m) / m_per_um,
      "20 um: thickness of a thin fabric");
  add("common_mode", Block::common, 1e-5, 0.05,
      was_calibrated ? pads_.common_mode : start_common_mode,
      "share of the signal; above 0.05 it exceeds the modulation of fabrics");
  add("common_mode_time_s", Block::common, 0.1, 30, pads_.common_mode_time_s,
      "from a few samples to a whole stroke");
  add("drift_counts", Block::common, 0.01 * scale_, 500 * scale_, pads_.drift_counts * scale_,
      "with fixed drift_time_s: a stroke shows only drift over the root of the time");
  add("grip_N_mm", Block::common, 0.1, 100, 0.2,
      "from constant force to a grip as stiff as the guide of the probe");
  add("gain_spread", Block::estimator, 0, 2, pads_.gain_spread, "estimator: level_spread");
  add("noise_counts", Block::estimator, 0, 1e3 * scale_, pads_.noise_counts * scale_,
      "estimator: noise_s0");
  add("noise_per_count", Block::estimator, 0, 1e3 * scale_, pads_.noise_per_count * scale_,
      "estimator: noise_k1");
  add("noise_per_square", Block::estimator, 0, 1, pads_.noise_per_square, "estimator: noise_k2");
  add("cover_um", Block::fixed, 10, 200, params_.cover.lambda_m / m_per_um,
      "30 to 100 um give recorded modulations with the table's heights");
}

Result<ClothModel> ClothModel::make(const RecordingView& view, const sim::FabricLibrary& library,
                                    std::optional<double> scale) {
  if (library.fabrics.empty())
    return fail({.code = Errc::not_found,
                 .where = "fabrics",
                 .what = "fabric table empty",
                 .expected = "at least one fabric"});
  ClothModel out;
  out.params_ = library.params;
  if (!(out.params_.cover.lambda_m > 0)) out.params_.cover.lambda_m = start_cover_m;
  out.spread_ = library.spread;
  out.spread_.piece = {0, 0, 0, 0, 0, 0};
  if (library.pads) out.pads_ = *library.pads;
  out.pads_.temperature_k = 0;
  out.scale_ = scale.value_or(count_scale(view, out.pads_));
  std::set<std::string> seen;
  for (const Stroke& stroke : view.strokes)
    if (seen.insert(stroke.cloth).second)
      if (Status s = out.add_cloth(stroke.cloth, library); !s) return pass(s.error());
  out.add_common(library);
  return out;
}

std::vector<double> ClothModel::start() const {
  std::vector<double> out;
  for (const Parameter& parameter : parameters_) out.push_back(parameter.start);
  return out;
}

std::size_t ClothModel::find(std::string_view name, std::string_view cloth) const {
  const auto at = std::ranges::find_if(
      parameters_, [&](const Parameter& p) { return p.name == name && p.cloth == cloth; });
  return static_cast<std::size_t>(at - parameters_.begin());
}

std::vector<std::size_t> ClothModel::block(Block block, std::string_view cloth) const {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    if (parameters_[i].block == block && (cloth.empty() || parameters_[i].cloth == cloth))
      out.push_back(i);
  return out;
}

ClothModel::Inputs ClothModel::inputs(std::string_view cloth,
                                      std::span<const double> values) const {
  const auto at = [&](std::string_view name, std::string_view of = {}) {
    return values[find(name, of)];
  };
  const auto base = std::ranges::find(cloths_, cloth, &BaseCloth::label);
  Inputs out{base->fabric, params_, spread_, pads_, at("grip_N_mm") * n_m_per_n_mm};
  out.fabric.height_rms_m = at("height_um", cloth) * m_per_um;
  out.fabric.waviness_rms_m = at("waviness_um", cloth) * m_per_um;
  const std::size_t lines = find("line_share", cloth);
  out.fabric.structure = reshaped(out.fabric.structure, lines < values.size() ? values[lines] : 0,
                                  at("band_low_per_mm", cloth) * per_m_per_mm);
  out.params.cover.lambda_m = at("cover_um") * m_per_um;
  out.spread.touch.path_m = at("path_mm") * m_per_mm;
  out.spread.touch.pad_ratio = at("pad_ratio");
  out.spread.mounting.tilt = at("tilt_mrad") * 1e-3;
  out.spread.mounting.pad_height_m = at("pad_height_um") * m_per_um;
  out.pads.common_mode = at("common_mode");
  out.pads.common_mode_time_s = at("common_mode_time_s");
  out.pads.drift_counts = at("drift_counts") / scale_;
  out.pads.gain_spread = at("gain_spread");
  out.pads.noise_counts = at("noise_counts") / scale_;
  out.pads.noise_per_count = at("noise_per_count") / scale_;
  out.pads.noise_per_square = at("noise_per_square");
  return out;
}

}  // namespace weft::daemon::calibration
