#include "classifier/imprint/imprint_model.hpp"

#include <algorithm>
#include <array>

#include "classifier/base/content_digest.hpp"

namespace weft::classifier::imprint {
namespace {

constexpr std::size_t most_bits = 52;  // with more bits a double cannot represent every count
constexpr std::size_t most_scales = 1000;

// In the order of the enumerators.
constexpr std::array<std::string_view, 2> laws_size_names{"3", "5"};
// Features of the unsmoothed imprint. The maps were added after Laws' sizes, so that older files
// are still read.
constexpr std::array<std::string_view, 3> unsmoothed_names{"3", "5", "maps"};
constexpr std::size_t maps_name = 2;

void write_grid(LineWriter& out, const TaxelGrid& grid) {
  out.count("rows", grid.rows);
  out.count("cols", grid.cols);
  out.number("pitch_m", grid.pitch_m);
  out.count("count_bits", grid.count_bits);
}

TaxelGrid read_grid(LineReader& in) {
  TaxelGrid out;
  out.rows = in.count("rows", 1, most_taxels);
  out.cols = in.count("cols", 1, most_taxels / std::max<std::size_t>(out.rows, 1));
  out.pitch_m = in.not_negative("pitch_m");
  out.count_bits = in.count("count_bits", 0, most_bits);
  return out;
}

void write_plan(LineWriter& out, const FeaturePlan& plan) {
  out.count("scales", plan.scales ? plan.scales->sigmas.size() : 0);
  if (plan.scales) {
    out.numbers("sigmas", plan.scales->sigmas);
    out.text("form", word_in(form_names, plan.scales->form));
    out.text("noise", word_in(noise_names, plan.scales->noise));
    out.text("orientation", word_in(orientation_names, plan.scales->orientation));
    out.number("edges_low", plan.scales->thresholds.low);
    out.number("edges_high", plan.scales->thresholds.high);
  }
  out.count("laws", plan.laws.size() + (plan.maps ? 1 : 0));
  for (const LawsSize size : plan.laws) out.text("laws_size", word_in(laws_size_names, size));
  if (plan.maps) out.text("laws_size", unsmoothed_names[maps_name]);
}

FeaturePlan read_plan(LineReader& in) {
  FeaturePlan out{std::nullopt, {}, false};
  if (const std::size_t scales = in.count("scales", 0, most_scales); scales > 0) {
    ScaleOptions& own = out.scales.emplace();
    own.sigmas = in.numbers("sigmas", scales);
    own.form = static_cast<Form>(word(in, "form", form_names));
    own.noise = static_cast<NoiseForm>(word(in, "noise", noise_names));
    own.orientation = static_cast<OrientationSpread>(word(in, "orientation", orientation_names));
    own.thresholds.low = in.not_negative("edges_low");
    own.thresholds.high = in.not_negative("edges_high");
  }
  for (std::size_t left = in.count("laws", 0, unsmoothed_names.size()); in.ok() && left > 0;
       --left) {
    const std::size_t which = word(in, "laws_size", unsmoothed_names);
    if (which == maps_name && left != 1)
      in.refuse("maps not last in the list", "maps once, as the last entry");
    if (which == maps_name)
      out.maps = true;
    else
      out.laws.push_back(static_cast<LawsSize>(which));
  }
  return out;
}

}  // namespace

std::vector<std::uint64_t> content_digests(std::span<const Imprint> imprints) {
  std::vector<std::uint64_t> out;
  for (const Imprint& imprint : imprints) {
    ContentDigest digest;
    digest.add(imprint.image.rows());
    for (std::size_t r = 0; r < imprint.image.rows(); ++r) digest.add(imprint.image.row(r));
    out.push_back(digest.value());
  }
  return out;
}

Result<std::vector<Prediction>> classify_imprints(const ImprintModel& model, const TaxelGrid& grid,
                                                  std::span<const Imprint> imprints,
                                                  const VoteOptions& options) {
  if (!is_same_grid(model.setup.grid, grid))
    return fail({.code = Errc::invalid_argument,
                 .what = "model trained for another array",
                 .expected = format_grid(model.setup.grid),
                 .got = format_grid(grid)});
  for (const Imprint& imprint : imprints)
    if (auto ok = check_imprint(model.setup.grid, imprint); !ok) return pass(ok.error());
  const auto matrix = build_matrix(imprints, model.setup.features);
  if (!matrix) return pass(matrix.error());
  std::vector<Prediction> out;
  for (std::size_t r = 0; r < matrix->size(); ++r) {
    auto one = predict(model.learner, model.postprocessing, matrix->values.row(r), options);
    if (!one) return pass(one.error(), matrix->files[r]);
    out.push_back(std::move(*one));
  }
  return out;
}

}  // namespace weft::classifier::imprint

namespace weft::classifier {

using imprint::ImprintSetup;

void SetupText<ImprintSetup>::write(LineWriter& out, const ImprintSetup& setup) {
  imprint::write_grid(out, setup.grid);
  imprint::write_plan(out, setup.features);
}

ImprintSetup SetupText<ImprintSetup>::read(LineReader& in) {
  imprint::TaxelGrid grid = imprint::read_grid(in);
  return {grid, imprint::read_plan(in)};
}

Result<std::vector<std::string>> SetupText<ImprintSetup>::feature_names(const ImprintSetup& setup,
                                                                        std::size_t /*most*/) {
  const auto features =
      imprint::PlannedFeatures::make(setup.features, setup.grid.rows, setup.grid.cols);
  if (!features) return pass(features.error());
  return features->names();
}

}  // namespace weft::classifier
