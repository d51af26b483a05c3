#pragma once
// One attempt at a trial as a client draws it: phases, target, curves reduced to so many points.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/analysis/report/trace.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::api {

/// Samples [first, last] that are one point; a point without samples (`is_gap`) stands where some
/// are missing.
struct SampleRange {
  std::size_t first = 0, last = 0;
  bool is_gap = false;
  friend bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// At most `points` ranges of equally many samples (the last of a run may have fewer). A gap: more
/// than 0.15 s and five usual intervals; where there are more gaps than points they are not shown.
std::vector<SampleRange> reduce_samples(const std::vector<std::int64_t>& t_ns, std::size_t points);

struct NamedCurve {
  std::string name;  ///< with its unit, "fz_N"
  std::function<double(std::size_t sample)> value;
};

/// {t_s: [...], NAME: {min: [...], max: [...]}, ...} of each point, null in a gap. t_s: of a
/// point's first sample, from `zero_ns` on.
nlohmann::json curves_json(const std::vector<std::int64_t>& t_ns, std::size_t points,
                           std::int64_t zero_ns, const std::vector<NamedCurve>& curves);

/// What `data.trial` answers of an attempt, but for the run: docs/api.md.
nlohmann::json trial_curves_json(const Dataset& dataset, std::size_t trial, std::size_t points,
                                 const std::vector<ForceTarget>& targets);

}  // namespace weft::daemon::api
