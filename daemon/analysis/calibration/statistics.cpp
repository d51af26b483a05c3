#include "daemon/analysis/calibration/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "daemon/analysis/calibration/stroke_summary.hpp"
#include "daemon/analysis/calibration/variance_components.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double least_shown = 1e-5;  // least value distinguished from 0, on scales without 0
constexpr std::array band_names{"band_0.01", "band_0.03", "band_0.1", "band_0.3", "band_1"};
static_assert(band_names.size() == bands);

using Maybe = std::optional<double>;

/// Collects statistics, and the reasons for absent ones.
class Collector {
 public:
  void add(std::string name, const std::string& cloth, Scale scale, Maybe natural,
           const std::string& why_absent) {
    if (!natural) {
      absent_[{std::move(name), why_absent}].push_back(cloth);
      return;
    }
    const double value = to_scale(*natural, scale);
    out_.statistics.push_back({std::move(name), cloth, scale, value, *natural});
  }
  StatisticSet finish(const std::vector<std::string>& remarks) && {
    out_.remarks = remarks;
    for (const auto& [what, cloths] : absent_)
      out_.remarks.push_back(what.first + " is not known" +
                             (cloths.front().empty() ? "" : " of " + joined(cloths)) + ": " +
                             what.second + ".");
    return std::move(out_);
  }

 private:
  StatisticSet out_;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> absent_;
};

/// A drawn sample, with queries over its strokes.
class Sample {
 public:
  Sample(const Summaries& summaries, const std::vector<DrawnCell>& cells)
      : summaries_(summaries), cells_(cells) {}

  /// Strokes of one fabric (by index), or of all, in the order of the cells.
  [[nodiscard]] std::vector<std::size_t> strokes(std::optional<std::size_t> cloth = {}) const {
    std::vector<std::size_t> out;
    for (const DrawnCell& drawn : cells_)
      if (!cloth || summaries_.cells[drawn.cell].cloth == *cloth)
        out.insert(out.end(), drawn.strokes.begin(), drawn.strokes.end());
    return out;
  }
  /// Median of `get(stroke)` over the strokes with a value.
  template <class Get>
  [[nodiscard]] Maybe typical(std::optional<std::size_t> cloth, Get&& get) const {
    std::vector<double> out;
    for (const std::size_t s : strokes(cloth))
      if (const Maybe value = get(summaries_.strokes[s])) out.push_back(*value);
    return median(std::move(out));
  }
  /// The same over windows.
  template <class Get>
  [[nodiscard]] Maybe typical_window(std::optional<std::size_t> cloth, Get&& get) const {
    std::vector<double> out;
    for (const std::size_t s : strokes(cloth))
      for (const WindowSummary& window : summaries_.strokes[s].windows) out.push_back(get(window));
    return median(std::move(out));
  }
  /// True if a stroke of the view has the finest pitch.
  [[nodiscard]] bool is_finest(std::size_t stroke) const {
    return summaries_.view->strokes[stroke].pitch_mm() <= same_pitch * summaries_.finest_mm;
  }
  [[nodiscard]] const Summaries& summaries() const { return summaries_; }
  [[nodiscard]] const std::vector<DrawnCell>& cells() const { return cells_; }

 private:
  const Summaries& summaries_;
  const std::vector<DrawnCell>& cells_;
};

void each_cloth(const Sample& sample,
                const std::function<void(std::size_t, const std::string&)>& visit) {
  const std::vector<std::string>& cloths = sample.summaries().cloths;
  for (std::size_t c = 0; c < cloths.size(); ++c) visit(c, cloths[c]);
}

constexpr const char* no_windows = "no part with 8 samples, or no channel with a level";

// 1

double log_modulation(const WindowSummary& window) {
  return to_scale(window.modulation, Scale::log);
}

Maybe pooled_within_cells(const Sample& sample) {
  double square = 0, freedom = 0;
  for (const DrawnCell& drawn : sample.cells()) {
    std::vector<double> values;
    for (const std::size_t s : drawn.strokes)
      for (const WindowSummary& window : sample.summaries().strokes[s].windows)
        values.push_back(log_modulation(window));
    if (values.size() < 2) continue;
    square += variance(values) * static_cast<double>(values.size());
    freedom += static_cast<double>(values.size() - 1);
  }
  return freedom > 0 ? Maybe(std::sqrt(square / freedom)) : std::nullopt;
}

void add_modulation(const Sample& sample, Collector& out) {
  std::vector<double> cloths, logs;
  each_cloth(sample, [&](std::size_t c, const std::string& name) {
    const Maybe log_median = sample.typical_window(c, log_modulation);
    if (log_median) logs.push_back(*log_median);
    if (log_median) cloths.push_back(std::exp(*log_median));
    out.add("modulation", name, Scale::log,
            log_median ? Maybe(std::exp(*log_median)) : std::nullopt, no_windows);
  });
  out.add("modulation_median", {}, Scale::log, median(cloths), no_windows);
  out.add("modulation_between", {}, Scale::log, sample_sd(logs), "only one fabric");
  out.add("modulation_within", {}, Scale::log, pooled_within_cells(sample),
          "no patch with two windows under the same conditions");
}

// 2

Maybe peak(const std::array<Maybe, bands>& rms) {
  const auto largest =
      std::ranges::max_element(rms, {}, [](const Maybe& value) { return value.value_or(-1); });
  if (!*largest) return std::nullopt;
  const auto band = static_cast<std::size_t>(largest - rms.begin());
  return std::sqrt(band_edges_per_mm[band] * band_edges_per_mm[band + 1]);
}

void add_spectrum(const Sample& sample, Collector& out) {
  const bool any = !sample.summaries().channels.empty();
  std::vector<std::array<Maybe, bands>> spectra;
  each_cloth(sample, [&](std::size_t c, const std::string& name) {
    out.add(
        "modulation_stroke", name, Scale::log,
        sample.typical(
            c, [&](const StrokeSummary& s) { return any ? Maybe(s.modulation) : std::nullopt; }),
        "no channel with a level");
    std::array<Maybe, bands>& rms = spectra.emplace_back();
    for (std::size_t band = 0; band < bands; ++band)
      rms[band] = sample.typical(c, [&](const StrokeSummary& s) { return s.band[band]; });
  });
  const auto each_spectrum = [&](const std::string& name, auto&& get) {
    each_cloth(sample, [&](std::size_t c, const std::string& cloth) {
      out.add(name, cloth, Scale::log, get(spectra[c]),
              "strokes too short for its waves, or sample spacing too large");
    });
  };
  for (std::size_t band = 0; band < bands; ++band)
    each_spectrum(band_names[band], [&](const auto& rms) { return rms[band]; });
  each_spectrum("peak", peak);
}

// 3

void add_noise(const Sample& sample, Collector& out) {
  std::vector<double> level, noise;
  for (const std::size_t s : sample.strokes()) {
    if (!sample.is_finest(s)) continue;
    const StrokeSummary& own = sample.summaries().strokes[s];
    level.insert(level.end(), own.level.begin(), own.level.end());
    noise.insert(noise.end(), own.noise.begin(), own.noise.end());
  }
  const auto law = fit_noise_law(level, noise);
  const auto part = [&](double NoiseLaw::*which) {
    return law ? Maybe((*law).*which) : std::nullopt;
  };
  const std::string why = "levels do not differ";
  out.add("noise", {}, Scale::log, median(noise), "no channel with a level");
  out.add("noise_s0", {}, Scale::natural, part(&NoiseLaw::s0), why);
  out.add("noise_k1", {}, Scale::natural, part(&NoiseLaw::k1), why);
  out.add("noise_k2", {}, Scale::natural, part(&NoiseLaw::k2), why);
  out.add("noise_exponent", {}, Scale::natural, fit_exponent(level, noise), why);
}

// 4 and 5

std::vector<NestedValue> pattern_observations(const Sample& sample) {
  std::map<std::pair<std::size_t, std::string>, std::size_t> fixed;  // fabric and conditions
  std::vector<NestedValue> out;
  for (std::size_t k = 0; k < sample.cells().size(); ++k) {
    const DrawnCell& drawn = sample.cells()[k];
    const Stroke& first = sample.summaries().view->strokes[drawn.strokes.front()];
    const std::size_t group =
        fixed
            .try_emplace({sample.summaries().cells[drawn.cell].cloth, first.conditions},
                         fixed.size())
            .first->second;
    for (const std::size_t s : drawn.strokes) {
      const auto& windows = sample.summaries().strokes[s].windows;
      for (std::size_t w = 0; w < windows.size(); ++w)
        if (!windows[w].log_pattern.empty())
          // patches of one mounting count as places, like the windows of a stroke
          out.push_back({{group, first.mounting, k * 10'000 + w}, windows[w].log_pattern});
    }
  }
  return out;
}

void add_patterns(const Sample& sample, Collector& out) {
  const bool several = sample.summaries().channels.size() > 1;
  const std::string one_channel = "only one channel";
  out.add("level_spread", {}, Scale::log,
          sample.typical({}, [](const StrokeSummary& s) { return s.level_spread; }), one_channel);
  const NestedSpread spread =
      several ? nested_spread(pattern_observations(sample)) : NestedSpread{};
  const auto why = [&](const char* reason) { return several ? reason : one_channel; };
  out.add("pattern_path", {}, Scale::log, spread.within,
          why("no place with two repetitions under the same conditions"));
  out.add("pattern_patch", {}, Scale::log, spread.inner, why("no mounting with two places"));
  out.add("pattern_mounting", {}, Scale::log, spread.outer,
          why("no fabric with two mountings under the same conditions"));
}

// 6

void add_correlations(const Sample& sample, Collector& out) {
  const bool several = sample.summaries().channels.size() > 1;
  const auto add = [&](const char* name, Scale scale, double WindowSummary::*which, bool known,
                       const char* why) {
    out.add(name, {}, scale,
            known ? sample.typical_window({}, [&](const WindowSummary& w) { return w.*which; })
                  : std::nullopt,
            several ? why : "only one channel");
  };
  const bool square = several && sample.summaries().square;
  const char* const not_square = "array not square: neighbours not known";
  add("neighbours", Scale::fisher_z, &WindowSummary::neighbours, square, not_square);
  add("far", Scale::fisher_z, &WindowSummary::far, square, not_square);
  add("common_share", Scale::logit, &WindowSummary::common_share, several, no_windows);
}

// 7

void add_drift(const Sample& sample, Collector& out) {
  const bool any = !sample.summaries().channels.empty();
  const auto add = [&](const char* name, Scale scale, double StrokeSummary::*which) {
    each_cloth(sample, [&](std::size_t c, const std::string& cloth) {
      out.add(name, cloth, scale,
              sample.typical(
                  c, [&](const StrokeSummary& s) { return any ? Maybe(s.*which) : std::nullopt; }),
              "no channel with a level");
    });
  };
  add("drift", Scale::log, &StrokeSummary::drift);
  add("jumps", Scale::logit, &StrokeSummary::jumps);
}

// 8

/// Pairs of different drawn strokes, each repeated as often as its two strokes were drawn together.
std::vector<PairSummary> drawn_pairs(const Sample& sample) {
  std::vector<PairSummary> out;
  for (const DrawnCell& drawn : sample.cells())
    for (const PairSummary& pair : sample.summaries().repetitions[drawn.cell]) {
      const auto times = std::ranges::count(drawn.strokes, pair.first) *
                         std::ranges::count(drawn.strokes, pair.second);
      out.insert(out.end(), static_cast<std::size_t>(times), pair);
    }
  return out;
}

std::vector<PairSummary> drawn_controls(const Sample& sample) {
  std::vector<PairSummary> out;
  for (const std::size_t s : sample.strokes()) {
    const auto& all = sample.summaries().controls;
    const auto at = std::ranges::lower_bound(all, s, {}, &PairSummary::first);
    if (at != all.end() && at->first == s) out.push_back(*at);
  }
  return out;
}

Maybe median_correlation(const std::vector<PairSummary>& pairs) {
  std::vector<double> out;
  for (const PairSummary& pair : pairs) out.push_back(pair.correlation);
  return median(std::move(out));
}

void add_repetition(const Sample& sample, Collector& out) {
  const bool any = !sample.summaries().channels.empty();
  const auto pairs = any ? drawn_pairs(sample) : std::vector<PairSummary>{};
  const auto controls = any ? drawn_controls(sample) : std::vector<PairSummary>{};
  std::vector<double> lags_mm;
  for (const PairSummary& pair : pairs)
    if (sample.is_finest(pair.first)) lags_mm.push_back(pair.lag_mm);
  out.add("repetition", {}, Scale::fisher_z, median_correlation(pairs),
          "no patch with two repetitions under the same conditions");
  out.add("repetition_lag", {}, Scale::natural, sample_sd(lags_mm),
          "fewer than two pairs of repetitions");
  out.add("control", {}, Scale::fisher_z, median_correlation(controls),
          "no two fabrics stroked under the same conditions");
}

}  // namespace

double to_scale(double natural, Scale scale) {
  switch (scale) {
    case Scale::natural:
      return natural;
    case Scale::log:
      return std::log(std::max(natural, least_shown));
    case Scale::fisher_z:
      return std::atanh(std::clamp(natural, least_shown - 1, 1 - least_shown));
    case Scale::logit: {
      const double share = std::clamp(natural, least_shown, 1 - least_shown);
      return std::log(share / (1 - share));
    }
  }
  return natural;
}

double from_scale(double value, Scale scale) {
  switch (scale) {
    case Scale::natural:
      return value;
    case Scale::log:
      return std::exp(value);
    case Scale::fisher_z:
      return std::tanh(value);
    case Scale::logit:
      return 1 / (1 + std::exp(-value));
  }
  return value;
}

const Statistic* find(std::span<const Statistic> statistics, std::string_view name,
                      std::string_view cloth) {
  const auto at = std::ranges::find_if(
      statistics, [&](const Statistic& s) { return s.name == name && s.cloth == cloth; });
  return at == statistics.end() ? nullptr : &*at;
}

StatisticSet combine(const Summaries& summaries, const std::vector<DrawnCell>& sample) {
  Collector out;
  const Sample drawn(summaries, sample);
  add_modulation(drawn, out);
  add_spectrum(drawn, out);
  add_noise(drawn, out);
  add_patterns(drawn, out);
  add_correlations(drawn, out);
  add_drift(drawn, out);
  add_repetition(drawn, out);
  return std::move(out).finish(summaries.remarks);
}

StatisticSet compute_statistics(const RecordingView& view) {
  const Summaries summaries = summarise(view);
  return combine(summaries, all_cells(summaries));
}

}  // namespace weft::daemon::calibration
