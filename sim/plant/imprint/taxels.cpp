#include "sim/plant/imprint/taxels.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "sim/plant/bounds.hpp"
#include "sim/plant/random.hpp"

namespace weft::sim {

namespace {

constexpr double largest_pressure_pa = 1e30;

Status check_pressures(const Imprint& imprint, const CoverState& cover) {
  const std::size_t n = imprint.pressure_pa.size();
  if (n != imprint.rows * imprint.cols || (!cover.felt_pa.empty() && cover.felt_pa.size() != n))
    return fail({.code = Errc::range,
                 .where = "pressure_pa",
                 .what = "imprint and cover are not of one size",
                 .expected = std::to_string(cover.felt_pa.empty() ? imprint.rows * imprint.cols
                                                                  : cover.felt_pa.size()),
                 .got = std::to_string(n)});
  for (const auto& [values, name] :
       {std::pair{&imprint.pressure_pa, "pressure_pa["}, std::pair{&cover.felt_pa, "felt_pa["}})
    for (std::size_t i = 0; i < values->size(); ++i)
      if (!inside((*values)[i], 0, largest_pressure_pa))
        return fail({.code = Errc::range,
                     .where = name + std::to_string(i) + "]",
                     .what = "a pressure is not a pressure",
                     .expected = "0 to 1e30 Pa",
                     .got = std::to_string((*values)[i])});
  return {};
}

}  // namespace

Status check(const TaxelParams& params) {
  if (!inside(params.full_scale_pa, 1, 1e9))
    return fail({.code = Errc::range,
                 .where = "full_scale_pa",
                 .what = "no array has this full scale",
                 .expected = "1 to 1e9 Pa",
                 .got = std::to_string(params.full_scale_pa)});
  if (params.bits < 1 || params.bits > 12)
    return fail({.code = Errc::range,
                 .where = "bits",
                 .what = "no array has this many bits",
                 .expected = "1 to 12",
                 .got = std::to_string(params.bits)});
  if (!inside(params.hysteresis, 0, 4))
    return fail({.code = Errc::range,
                 .where = "hysteresis",
                 .what = "no cover lingers like this",
                 .expected = "0 to 4",
                 .got = std::to_string(params.hysteresis)});
  if (!inside(params.noise_counts, 0, 100))
    return fail({.code = Errc::range,
                 .where = "noise_counts",
                 .what = "noise is not a number of counts",
                 .expected = "0 to 100",
                 .got = std::to_string(params.noise_counts)});
  return {};
}

Result<TaxelFrame> read_taxels(const TaxelParams& params, const Imprint& imprint, CoverState& cover,
                               std::uint64_t noise_seed) {
  if (auto ok = check(params); !ok) return pass(ok.error());
  if (auto ok = check_pressures(imprint, cover); !ok) return pass(ok.error());
  const std::size_t n = imprint.pressure_pa.size();
  cover.felt_pa.resize(n, 0.0);
  TaxelFrame frame{imprint.rows, imprint.cols, std::vector<std::uint16_t>(n), 0};
  const double highest = std::exp2(params.bits) - 1;
  Random noise(noise_seed);
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double pressure = imprint.pressure_pa[i];
    double& felt = cover.felt_pa[i];
    felt = std::clamp(felt, pressure, (1 + params.hysteresis) * pressure);
    const double jitter = params.noise_counts > 0 ? params.noise_counts * noise.gaussian() : 0;
    const double counts = std::round(highest * felt / params.full_scale_pa + jitter);
    frame.counts[i] = static_cast<std::uint16_t>(std::clamp(counts, 0.0, highest));
    saturated += counts >= highest ? 1 : 0;
  }
  frame.saturated_fraction = static_cast<double>(saturated) / static_cast<double>(n);
  return frame;
}

}  // namespace weft::sim
