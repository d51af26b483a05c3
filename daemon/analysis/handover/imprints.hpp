#pragma once
// The hand-over of a campaign of presses: the experiments of Ellis 1986 on its imprints, and a
// model of them all.

#include <functional>
#include <string>
#include <vector>

#include "daemon/analysis/handover/handover.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

struct HandoverImprints {
  std::string evaluation_json;      ///< what evaluation.json says
  std::vector<HandoverText> texts;  ///< imprints.html, imprints.json, imprints.model
};

/// The tables of daemon/storage/imprints on the complete trials of `data`, with all scales, forms
/// and rules; a model with `weft train`'s defaults, and its accuracy by leaving each object out in
/// turn. Errors: a data set without imprints, what the rules and the learners refuse, wrong_state
/// where it is stopped.
Result<HandoverImprints> run_imprint_handover(const Dataset& data,
                                              const std::string& dataset_sha256,
                                              const recipes::Handover& wanted,
                                              const HandoverHooks& hooks,
                                              std::function<bool()> stop);

}  // namespace weft::daemon
