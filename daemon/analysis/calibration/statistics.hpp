#pragma once
// Statistics of strokes for comparing a simulation with recordings. They describe signals, never a
// classifier's accuracy. Pure functions of a view.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/analysis/calibration/recording_view.hpp"

namespace weft::daemon::calibration {

/// Scale on which a statistic is compared: differences have about the same size everywhere on it.
enum class Scale { natural, log, fisher_z, logit };
/// From the natural scale; for log and logit, 0 is replaced by 1e-5, the least value distinguished.
double to_scale(double natural, Scale scale);
double from_scale(double value, Scale scale);

struct Statistic {
  std::string name;
  std::string cloth;  ///< empty: over all fabrics
  Scale scale = Scale::natural;
  double value = 0;  ///< on `scale`; always finite
  double shown = 0;  ///< natural scale, in the unit listed below
};

/// Names, in this order. x: counts above the unloaded level; L: their mean over the stroke;
/// z = x/L - 1; zd: z minus its line. Windows: 50 mm, at least 8 samples, end to end. "Typical":
/// median over channels, then over windows (or strokes).
///
/// 1 modulation           cloth  log      typical sd of zd in a window
///   modulation_median    all    log      median of the cloths'
///   modulation_between   all    log      sd between cloths of ln modulation        (2 cloths)
///   modulation_within    all    log      pooled sd within cells over windows of the same
/// 2 modulation_stroke    cloth  log      typical sd of z over the stroke
///   band_0.01, _0.03,    cloth  log      typical rms of zd from this wave number [1/mm] to the
///   _0.1, _0.3, _1                       next, the last to 1.75 (Hann window); of strokes that
///                                        hold a wave of it and sample all of it
///   peak                 cloth  log      [1/mm] geometric middle of the band with the largest rms
/// 3 (strokes with the finest pitch only)
///   noise                all    log      [counts] n = sqrt(mean (third difference)^2 / 20), median
///   noise_s0, _k1, _k2   all    natural  [counts; counts; 1] n^2 = s0^2 + k1 L + k2 L^2, each >=
///   0,
///                                        of the quietest quarter: texture only adds to noise
///   noise_exponent       all    natural  slope of ln n on ln L
/// 4 level_spread         all    log      sd over channels of ln L, median of strokes
/// 5 pattern_path         all    log      sd of the pattern (ln L of a window less its mean over
///   pattern_patch        all    log      channels) between repetitions at one place, between
///   pattern_mounting     all    log      places of one mounting, between mountings of one cloth
///                                        (variance components, unbalanced; rms over channels)
/// 6 neighbours, far      all    fisher_z correlation of zd of channels side by side, and of the
///                                        four pairs of corners on one side (square arrays only;
///                                        typical over windows, of the mean over pairs)
///   common_share         all    logit    var(mean over channels of zd) / mean of var(zd)
/// 7 drift                cloth  log      |slope of x| x duration / L, typical
///   jumps                cloth  logit    share of first differences further than 5 robust sd
///                                        (IQR / 1.349) from their median
/// 8 repetition           all    fisher_z largest mean correlation (over channels) of zd of two
///                                        strokes of a cell over lags of +-4 samples, median
///   repetition_lag       all    natural  [mm] sd of that lag (strokes with the finest pitch)
///   control              all    fisher_z the same with a stroke of another cloth
/// The ninth, intraclass correlation of features, needs the classifier and is not computed here.
struct StatisticSet {
  std::vector<Statistic> statistics;
  std::vector<std::string> remarks;  ///< one sentence for each statistic that the data do not
                                     ///< determine
};

/// nullptr if there is none.
const Statistic* find(std::span<const Statistic> statistics, std::string_view name,
                      std::string_view cloth = {});

StatisticSet compute_statistics(const RecordingView& view);

}  // namespace weft::daemon::calibration
