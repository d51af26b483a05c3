#pragma once
// What an interval is of, where the classifier cannot know: corrects what split_interval() says of
// random splits. Wilson's intervals stay as they are, those of splits that all agree among them.

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

/// "2 recordings are left out, as no window fits into them: a.wav (felt), b.wav (foil)".
std::string format_too_short(const std::vector<classifier::vibro::TooShort>& recordings,
                             std::size_t parts = 1);

/// Of a leak whose largest share is above zero.
inline std::string leak_sentence(const classifier::vibro::Leak& leak) {
  return percent(leak.windows, 0) +
         " % of the test windows share samples with a training window, half of all at least " +
         percent(leak.median, 0) + " % of theirs, one " + percent(leak.largest, 0) + " %";
}

/// The splits leave one group out in turn.
void name_groups_left_out(classifier::Interval& interval);

/// The same of every interval of the evaluation.
void name_groups_left_out(classifier::Evaluation& evaluation);

/// Of every interval of the assessment: groups or contiguous parts are left out in turn; random
/// splits of windows are named already.
void name_left_out(classifier::vibro::CrossValidation& assessment,
                   classifier::vibro::Protocol protocol);

}  // namespace weft::daemon
