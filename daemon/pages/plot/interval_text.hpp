#pragma once
// What an interval is of, where the classifier cannot know: corrects what split_interval() says of
// random splits. Wilson's intervals stay as they are, those of splits that all agree among them.

#include "classifier/base/interval.hpp"
#include "classifier/evaluate/evaluate.hpp"
#include "classifier/vibro/cross_validation.hpp"

namespace weft::daemon {

/// The splits leave one group out in turn.
void name_groups_left_out(classifier::Interval& interval);

/// The same of every interval of the evaluation.
void name_groups_left_out(classifier::LearnerEvaluation& evaluation);

/// Of every interval of the assessment: groups or contiguous parts are left out in turn; random
/// splits of windows are named already.
void name_left_out(classifier::vibro::CrossValidation& assessment,
                   classifier::vibro::Protocol protocol);

}  // namespace weft::daemon
