#pragma once
// Corrects the method text that split_interval() writes for random splits, where the classifier
// cannot know the kind of split. Wilson intervals stay unchanged, including those of splits that
// all agree.

#include <cstddef>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/evaluate/evaluate.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/extract.hpp"
#include "classifier/vibro/protocol.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {

/// "2 recordings are skipped, shorter than a window: a.wav (felt), b.wav (foil)".
std::string format_too_short(const std::vector<classifier::vibro::TooShort>& recordings,
                             std::size_t parts = 1);

/// For a leak with a largest share above zero.
inline std::string leak_sentence(const classifier::vibro::Leak& leak) {
  return percent(leak.windows, 0) +
         " % of the test windows share samples with a training window (median share " +
         percent(leak.median, 0) + " %, largest " + percent(leak.largest, 0) + " %)";
}

/// For splits that leave one group out in turn.
void name_groups_left_out(classifier::Interval& interval);

/// The same for every interval of the evaluation.
void name_groups_left_out(classifier::Evaluation& evaluation);

/// The same for every interval of the assessment, for splits by groups or contiguous parts. Random
/// splits of windows already have the right name.
void name_left_out(classifier::vibro::CrossValidation& assessment,
                   classifier::vibro::Protocol protocol);

}  // namespace weft::daemon
