#pragma once
// One attempt at a trial for plotting: phases, target, and curves reduced to a number of points.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/analysis/report/trace.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::api {

/// Samples [first, last] that form one point. A point without samples (`is_gap`) marks missing
/// ones.
struct SampleRange {
  std::size_t first = 0, last = 0;
  bool is_gap = false;
  friend bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// At most `points` ranges with equal numbers of samples; the last of a section may have fewer. A
/// gap is longer than 0.15 s and than five times the median interval. If there are too many gaps
/// for `points`, none is marked.
std::vector<SampleRange> reduce_samples(const std::vector<std::int64_t>& t_ns, std::size_t points);

struct NamedCurve {
  std::string name;  ///< includes the unit, "fz_N"
  std::function<double(std::size_t sample)> value;
};

/// {t_s: [...], NAME: {min: [...], max: [...]}, ...} with one value per point, null in a gap. t_s
/// is the time of a point's first sample, relative to `zero_ns` [s].
nlohmann::json curves_json(const std::vector<std::int64_t>& t_ns, std::size_t points,
                           std::int64_t zero_ns, const std::vector<NamedCurve>& curves);

/// Answer of `data.trial` for an attempt, without the run: docs/reference/api.md.
nlohmann::json trial_curves_json(const Dataset& dataset, std::size_t trial, std::size_t points,
                                 const std::vector<ForceTarget>& targets);

}  // namespace weft::daemon::api
