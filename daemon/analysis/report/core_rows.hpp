#pragma once
// Table III of the paper for our cores.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "daemon/analysis/report/paper.hpp"

namespace weft::daemon {

struct CoreFeature {
  std::string name;  ///< "range.M.4"
  double p_value = 1;
  double log_p = 0;  ///< natural logarithm, where p underflows
};

/// One core of a model, its selected features best first. a < b in the model's order.
struct CoreLine {
  std::string a;
  std::string b;
  std::vector<CoreFeature> features;
  const classifier::CoreInfo* info = nullptr;
  std::size_t support_vectors = 0;
};

/// All cores, in the model's order; they refer to `model`.
std::vector<CoreLine> core_lines(const classifier::FabricModel& model);

/// The core of two fabrics, in whichever order they are named.
std::optional<CoreLine> find_core(const std::vector<CoreLine>& lines, std::string_view a,
                                  std::string_view b);

/// The paper's three pairs that the model has, then those with the most cross-validation errors
/// (then the greatest loss), at most `count` in all.
std::vector<CoreLine> shown_cores(const std::vector<CoreLine>& lines, std::size_t count);

/// The first four that it looks at, as the paper writes them.
std::string first_features_html(const CoreLine& line);

/// What the paper printed for this pair; nullptr when nothing.
const paper::Core* paper_core(const CoreLine& line);

}  // namespace weft::daemon
