#pragma once
// The headline accuracy of a campaign, equal on the terminal, in the report, on the page and over
// the API. It follows the handover's protocol. Results of other protocols are shown below it, with
// the reason for the difference.

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/splits.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

struct Headline {
  std::string exploration;
  std::string learner;     ///< "lda, ranks"
  std::string protocol;    ///< "cross-validated by group of repetitions"
  std::size_t tested = 0;  ///< predictions, each by a model trained without the trial
  std::string unit;        ///< what is counted: "trials", "slides", "imprints"
  HandoverShare accuracy;  ///< mean over the groups left out
  std::size_t labels = 0;
  std::vector<std::string> not_tested = {};  ///< labels that occur in one group only
  double base_rate = 0;  ///< share of the most frequent label: the accuracy of always predicting it
  /// Confusion matrix of the same predictions, or of the windows they are made of; none: not known.
  std::optional<classifier::Confusion> confusion = {};
  std::string confusion_unit = {};  ///< "trials", "windows"
};

/// Each split tests the rows of one group of repetitions and trains on all others; a group without
/// rows gives no split. `group_of`: group of each repetition, starting with repetition 1. A row
/// with a label that no other group has is not tested.
std::vector<classifier::Split> splits_by_repetition(const std::vector<std::uint32_t>& repetition,
                                                    const std::vector<std::size_t>& group_of);

/// One headline per exploration in the handover.
std::vector<Headline> handover_headlines(const HandoverResult& handover, const Dataset& dataset);

/// Adds the confusion matrices in `evaluation_json`, the text of the handover's evaluation.json.
void add_confusions(std::string_view evaluation_json, std::vector<Headline>& headlines);

/// The same protocol for a campaign without handover: Learner::best, cross-validated over five
/// groups of repetitions. An exploration without two groups that share labels has no headline.
/// Errors: the classifier's.
Result<std::vector<Headline>> measure_headlines(const Dataset& dataset, std::size_t threads = 0);

/// "M1: 98.2 % (95 %: 96.0 to 99.2) of 340 trials, lda; each of ...; ..."
std::string headline_text(const Headline& headline);
/// {exploration, learner, protocol, accuracy, ci95, tested, unit, labels, base_rate, chance}.
nlohmann::ordered_json headline_json(const Headline& headline);

/// A result of the report that differs from the headline, with the reason.
struct OtherProtocol {
  std::string_view name;  ///< key of its results in report.json
  std::string_view text;  ///< one sentence
};
/// The ones that a report contains.
std::vector<OtherProtocol> other_protocols(bool random_splits, bool learning_curve);

}  // namespace weft::daemon
